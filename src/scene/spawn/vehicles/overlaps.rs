//! Vehicles that a scene puts into each other: neither sees the other as ahead, and none gets out of it by driving.

use crate::name;
use bevy_ecs::prelude::*;
use glam::{DVec2, DVec3};
use std::collections::{BTreeSet, HashMap};
use systems::space::origin::Origin;
use systems::vehicles::routes::Routes;
use systems::vehicles::{Motion, OnRoute, Vehicle, VehicleNumber, VehicleType, VehicleTypes};

/// Metres that a vehicle's ends may be in another, and of its width: one beside or behind another is not in it.
const TOUCH: (f64, f64) = (0.1, 0.2);
/// Metres of height between two that stand over each other, on a bridge.
const HEADROOM: f64 = 2.0;
/// Pairs that are told one by one, and that are counted.
const MOST: (usize, usize) = (5, 1000);

/// Metres along the sides of the squares that outlines are found by.
const CELL: f64 = 16.0;

/// A vehicle, with its trailer straight behind it, from above.
pub struct Outline {
    middle: DVec3,
    forward: DVec2,
    /// Half of length and width.
    half: DVec2,
}

impl Outline {
    /// The footprint of a vehicle of that type whose origin is at `place`, turned by `yaw`.
    pub fn new(place: DVec3, yaw: f64, kind: &VehicleType) -> Self {
        let (sin, cos) = yaw.sin_cos();
        let (front, rear, width) = (f64::from(kind.front()), f64::from(kind.rear()), f64::from(kind.size.x));
        let half = DVec2::new(0.5 * (front + rear) - TOUCH.0, 0.5 * width * (1.0 - TOUCH.1)).max(DVec2::ZERO);
        let middle = place + DVec3::new(sin, 0.0, cos) * (0.5 * (front - rear));
        Self { middle, forward: DVec2::new(sin, cos), half }
    }

    fn sides(&self) -> [(DVec2, f64); 2] {
        [(self.forward, self.half.x), (DVec2::new(self.forward.y, -self.forward.x), self.half.y)]
    }

    /// Metres by which one would have to be moved to be out of the other; by separating axes.
    fn depth(&self, other: &Self) -> Option<f64> {
        let off = other.middle - self.middle;
        let flat = DVec2::new(off.x, off.z);
        let reach = |outline: &Self, axis: DVec2| {
            outline.sides().into_iter().map(|(side, half)| side.dot(axis).abs() * half).sum::<f64>()
        };
        let depth = |(axis, _): (DVec2, f64)| reach(self, axis) + reach(other, axis) - flat.dot(axis).abs();
        let least = self.sides().into_iter().chain(other.sides()).map(depth).fold(f64::INFINITY, f64::min);
        (off.y.abs() < HEADROOM && least > 0.0).then_some(least)
    }

    /// The squares that it may reach into.
    fn cells(&self) -> impl Iterator<Item = [i64; 2]> + use<> {
        let (middle, reach) = (DVec2::new(self.middle.x, self.middle.z), self.half.length());
        let [from, to] = [middle - reach, middle + reach].map(|corner| (corner / CELL).floor());
        (from.x as i64..=to.x as i64).flat_map(move |x| (from.y as i64..=to.y as i64).map(move |z| [x, z]))
    }
}

/// Outlines by where they are.
#[derive(Default)]
pub struct Outlines {
    all: Vec<Outline>,
    cells: HashMap<[i64; 2], Vec<usize>>,
}

impl Outlines {
    /// Those that overlap one, by their number and by how much, ascending.
    pub fn around(&self, outline: &Outline) -> Vec<(usize, f64)> {
        let near: BTreeSet<usize> =
            outline.cells().filter_map(|cell| self.cells.get(&cell)).flatten().copied().collect();
        near.into_iter().filter_map(|other| Some((other, self.all[other].depth(outline)?))).collect()
    }

    /// Adds one; it gets the next number, from 0.
    pub fn add(&mut self, outline: Outline) {
        outline.cells().for_each(|cell| self.cells.entry(cell).or_default().push(self.all.len()));
        self.all.push(outline);
    }
}

/// A line for each pair, in the order of spawning; the rest is counted.
pub fn warnings(world: &mut World) -> Vec<String> {
    let (mut before, mut pairs) = (Outlines::default(), Vec::new());
    let vehicles = outlines(world);
    let entities: Vec<Entity> = vehicles.iter().map(|(entity, _)| *entity).collect();
    for (entity, outline) in vehicles {
        pairs.extend(before.around(&outline).into_iter().map(|(other, depth)| (entities[other], entity, depth)));
        if pairs.len() > MOST.1 {
            break;
        }
        before.add(outline);
    }
    let mut told: Vec<String> = pairs.iter().take(MOST.0).map(|pair| tell(world, *pair)).collect();
    match pairs.len().saturating_sub(MOST.0) {
        0 => {}
        _ if pairs.len() > MOST.1 => {
            told.push(format!("more than {} other pairs of vehicles overlap, too", MOST.1 - MOST.0))
        }
        1 => told.push("1 other pair of vehicles overlaps, too".into()),
        more => told.push(format!("{more} other pairs of vehicles overlap, too")),
    }
    told
}

fn outlines(world: &mut World) -> Vec<(Entity, Outline)> {
    let mut vehicles = world.query::<(Entity, &VehicleNumber, &Vehicle, &Motion)>();
    let types = world.resource::<VehicleTypes>();
    let mut all: Vec<_> = vehicles.iter(world).filter(|(.., motion)| motion.place.is_finite()).collect();
    all.sort_unstable_by_key(|(_, number, ..)| *number);
    let outline = |motion: &Motion, kind| Outline::new(motion.place, motion.yaw, types.get(kind));
    all.into_iter().map(|(entity, _, vehicle, motion)| (entity, outline(motion, vehicle.kind))).collect()
}

fn tell(world: &World, (one, other, depth): (Entity, Entity, f64)) -> String {
    let place = world.get::<Motion>(other).map(|motion| motion.place).unwrap_or_default();
    let at = place + world.resource::<Origin>().0 + DVec3::ZERO;
    let on = world.get::<OnRoute>(other);
    let road = on.and_then(|on| Some((world.resource::<Routes>().get(on.route)?, on)));
    let road = road.map_or_else(String::new, |(route, on)| {
        format!(", {:.1} m along routes[{:?}] in lane {}", on.at, route.plan.name, on.lane)
    });
    let [one, other] = [one, other].map(|vehicle| name::of_entity(world, vehicle));
    format!(
        "{one:?} and {other:?} overlap by {depth:.1} m at ({:.1}, {:.1}, {:.1}){road}: \
         neither gives way",
        at.x, at.y, at.z
    )
}
