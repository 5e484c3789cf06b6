//! Generators: many copies of one kind of entity on a grid, or scattered over a region.
//!
//! A seed gives the same scene to the last bit on every platform ([`Random`]).

use super::placement::{OnRoute, Placement};
use super::random::Random;
use super::spawner::Spawner;
use super::vehicles::{self, Room};
use crate::scene::format::generators::{Choose, Generator, Grid, Place, Region, Scatter};
use crate::scene::format::values::place;
use bevy_ecs::prelude::*;
use glam::{Quat, Vec3};
use std::collections::HashMap;
use systems::space::Transform;

/// One copy: where it is, and which alternatives it takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Copy {
    pub at: Transform,
    pub mesh: usize,
    pub material: usize,
    pub light: usize,
    pub vehicle: usize,
    /// Place on a route, if it was placed along one.
    pub on_route: Option<OnRoute>,
}

/// The copies of a generator in order; fewer than asked for where `min_distance` leaves no room.
pub fn copies(generator: &Generator, scene_seed: u64, world: &World) -> Vec<Copy> {
    let mut random = Random::new(generator.seed.unwrap_or(scene_seed));
    let standing = Transform::from_translation;
    let mut on_routes = Vec::new();
    let places: Vec<Transform> = match &generator.place {
        Place::Grid(grid) => on_grid(grid, &mut random).into_iter().map(standing).collect(),
        Place::Scatter(scatter) => scattered(scatter, &mut random).into_iter().map(standing).collect(),
        Place::Along(along) => {
            let places = vehicles::along(along, world, &mut random);
            on_routes.extend(places.iter().map(|place| place.1));
            places.into_iter().map(|place| place.0).collect()
        }
    };
    let [min_scale, max_scale] = generator.random_scale.0;
    let (meshes, materials, lights) = (generator.meshes.len(), generator.materials.len(), generator.lights.len());
    let vehicles = generator.vehicles.len();
    let finish = |(i, place): (usize, Transform)| {
        let rotation = if generator.random_yaw { random.yaw() } else { Quat::IDENTITY };
        let scale = Vec3::splat(random.between(min_scale, max_scale));
        let at = Transform { rotation: place.rotation * rotation, scale, ..place };
        let on_route = on_routes.get(i).copied();
        match generator.choose {
            // Materials turn when the meshes have been through, so that every pair of the two comes up.
            Choose::InTurn => Copy {
                at,
                mesh: i % meshes.max(1),
                material: i / meshes.max(1) % materials.max(1),
                light: i % lights.max(1),
                vehicle: i % vehicles.max(1),
                on_route,
            },
            Choose::Random => Copy {
                at,
                mesh: random.index(meshes),
                material: random.index(materials),
                light: random.index(lights),
                vehicle: if vehicles > 0 { random.index(vehicles) } else { 0 },
                on_route,
            },
        }
    };
    places.into_iter().enumerate().map(finish).collect()
}

/// Rows along X, then Z, then Y, around the centre.
fn on_grid(grid: &Grid, random: &mut Random) -> Vec<Vec3> {
    let [nx, ny, nz] = grid.counts;
    let (spacing, center) = (Vec3::from_array(grid.spacing), place(grid.center.unwrap_or_default()));
    let jitter = Vec3::from_array(grid.jitter);
    let middle = (Vec3::new(nx as f32, ny as f32, nz as f32) - 1.0) * 0.5;
    let mut places = Vec::with_capacity(nx as usize * ny as usize * nz as usize);
    for y in 0..ny {
        for z in 0..nz {
            for x in 0..nx {
                let cell = Vec3::new(x as f32, y as f32, z as f32) - middle;
                places.push(center + cell * spacing + random.in_box(-jitter, jitter));
            }
        }
    }
    places
}

/// Points thrown at random; one too near to an earlier one is thrown again. Gives up after this many in a row.
const MOST_THROWS: u32 = 1000;

fn scattered(scatter: &Scatter, random: &mut Random) -> Vec<Vec3> {
    let mut throw = || match &scatter.region {
        Region::Box { min, max } => random.in_box(place(*min), place(*max)),
        Region::Disc { center, radius } => place(*center) + random.in_disc() * *radius,
    };
    let distance = scatter.min_distance;
    if distance <= 0.0 {
        return (0..scatter.count).map(|_| throw()).collect();
    }
    let mut cells: HashMap<[i64; 3], Vec<Vec3>> = HashMap::new();
    let cell = |at: Vec3| (at / distance).floor().to_array().map(|c| c as i64);
    let mut places = Vec::new();
    let mut throws = 0;
    while places.len() < scatter.count as usize && throws < MOST_THROWS {
        let at = throw();
        throws += 1;
        let [x, y, z] = cell(at);
        let around = (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [x + i, y + j, z + k])));
        let mut near = around.filter_map(|key| cells.get(&key)).flatten();
        if near.all(|other| other.distance(at) >= distance) {
            cells.entry([x, y, z]).or_default().push(at);
            places.push(at);
            throws = 0;
        }
    }
    places
}

impl Spawner<'_> {
    pub fn generator(&mut self, index: usize, generator: &Generator, scene_seed: u64) {
        let copies = copies(generator, scene_seed, self.world);
        let name = generator.name.clone().unwrap_or_else(|| format!("generator {}", index + 1));
        if let Place::Scatter(scatter) = &generator.place
            && copies.len() < scatter.count as usize
        {
            let (placed, asked) = (copies.len(), scatter.count);
            self.found.warnings.push(format!("{name}: {placed} of {asked} placed: min_distance leaves no room"));
        }
        if copies.is_empty() {
            self.found.warnings.push(format!("{name}: nothing is placed: there is no route with room for it"));
        }
        let mut room = Room::default();
        for (i, copy) in copies.iter().enumerate() {
            let own = Placement::of(&generator.entity);
            let placement = Placement {
                name: Some(format!("{name} {i}")),
                parent_from_entity: copy.at.mul_transform(own.parent_from_entity),
                mesh: generator.meshes.get(copy.mesh).map(String::as_str).or(own.mesh),
                material: generator.materials.get(copy.material).map(String::as_str).or(own.material),
                light: generator.lights.get(copy.light).or(own.light),
                vehicle: generator.vehicles.get(copy.vehicle).map(String::as_str).or(own.vehicle),
                on_route: copy.on_route,
                ..own
            };
            if placement.vehicle.is_none() || room.take(&placement, self.world) {
                self.entity(&generator.entity, &placement, None);
            }
        }
        if room.full > 0 {
            let warning = format!("{name}: {} of {} left out: no room between the others", room.full, copies.len());
            self.found.warnings.push(warning);
        }
    }
}
