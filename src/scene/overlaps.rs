//! Vehicles that a scene puts into each other: neither sees the other as ahead, and none gets out of it by driving.

use crate::name;
use bevy_ecs::prelude::*;
use glam::{DVec2, DVec3};
use std::collections::HashMap;
use systems::space::origin::Origin;
use systems::vehicles::routes::Routes;
use systems::vehicles::{Motion, OnRoute, Vehicle, VehicleNumber, VehicleType, VehicleTypes};

/// Metres that a vehicle's ends may be in another, and of its width: one beside or behind another is not in it.
const TOUCH: (f64, f64) = (0.1, 0.2);
/// Metres of height between two that stand over each other, on a bridge.
const HEADROOM: f64 = 2.0;
/// Pairs that are told one by one, and that are counted.
const MOST: (usize, usize) = (5, 1000);

/// A vehicle, with its trailer straight behind it, from above.
struct Outline {
    entity: Entity,
    middle: DVec3,
    forward: DVec2,
    /// Half of length and width.
    half: DVec2,
}

impl Outline {
    fn new(entity: Entity, motion: &Motion, kind: &VehicleType) -> Self {
        let (sin, cos) = motion.yaw.sin_cos();
        let (front, rear, width) = (f64::from(kind.front()), f64::from(kind.rear()), f64::from(kind.size.x));
        let half = DVec2::new(0.5 * (front + rear) - TOUCH.0, 0.5 * width * (1.0 - TOUCH.1)).max(DVec2::ZERO);
        let middle = motion.place + DVec3::new(sin, 0.0, cos) * (0.5 * (front - rear));
        Self { entity, middle, forward: DVec2::new(sin, cos), half }
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
}

/// A line for each pair, in the order of spawning; the rest is counted.
pub fn warnings(world: &mut World) -> Vec<String> {
    let outlines = outlines(world);
    let cell_metres = 2.0 * outlines.iter().map(|outline| outline.half.length()).fold(4.0, f64::max);
    let cell = |outline: &Outline| {
        let at = outline.middle / cell_metres;
        [at.x.floor() as i64, at.z.floor() as i64]
    };
    let mut before: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
    let mut pairs = Vec::new();
    for (index, outline) in outlines.iter().enumerate() {
        let [x, z] = cell(outline);
        let around = (-1..=1).flat_map(|i| (-1..=1).map(move |j| [x.saturating_add(i), z.saturating_add(j)]));
        for other in around.filter_map(|cell| before.get(&cell)).flatten().map(|&other| &outlines[other]) {
            pairs.extend(outline.depth(other).map(|depth| (other, outline, depth)));
        }
        if pairs.len() > MOST.1 {
            break;
        }
        before.entry([x, z]).or_default().push(index);
    }
    let mut told: Vec<String> = pairs.iter().take(MOST.0).map(|pair| tell(world, pair)).collect();
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

fn outlines(world: &mut World) -> Vec<Outline> {
    let mut vehicles = world.query::<(Entity, &VehicleNumber, &Vehicle, &Motion)>();
    let types = world.resource::<VehicleTypes>();
    let mut all: Vec<_> = vehicles.iter(world).filter(|(.., motion)| motion.place.is_finite()).collect();
    all.sort_unstable_by_key(|(_, number, ..)| *number);
    all.into_iter().map(|(entity, _, vehicle, motion)| Outline::new(entity, motion, types.get(vehicle.kind))).collect()
}

fn tell(world: &World, (one, other, depth): &(&Outline, &Outline, f64)) -> String {
    let place = world.get::<Motion>(other.entity).map(|motion| motion.place).unwrap_or_default();
    let at = place + world.resource::<Origin>().0 + DVec3::ZERO;
    let on = world.get::<OnRoute>(other.entity);
    let road = on.and_then(|on| Some((world.resource::<Routes>().get(on.route)?, on)));
    let road = road.map_or_else(String::new, |(route, on)| {
        format!(", {:.1} m along routes[{:?}] in lane {}", on.at, route.plan.name, on.lane)
    });
    let [one, other] = [one, other].map(|outline| name::of_entity(world, outline.entity));
    format!(
        "{one:?} and {other:?} overlap by {depth:.1} m at ({:.1}, {:.1}, {:.1}){road}: \
         neither gives way",
        at.x, at.y, at.z
    )
}
