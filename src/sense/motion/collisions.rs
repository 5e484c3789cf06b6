//! Readings of collision sensors: boxes and meshes that touch the thing that a sensor is mounted on.
//!
//! A vehicle is the box of its type, without its trailer, from a little above the ground on; anything else is the boxes
//! around its meshes. What it may touch are other vehicles, and obstacles: by the boxes around their meshes, or their
//! triangles.

use super::bodies::solid;
use super::kind::{Measuring, ReadingSensor};
use super::lanes::vehicle_of;
#[cfg(not(feature = "physics"))]
use super::no_physics::{obstacles, of_body, solid_or_obstacle};
#[cfg(feature = "physics")]
use super::obstacles::{obstacles, of_body, solid_or_obstacle};
use super::place;
use crate::sense::captures::axes::ENTITY_FROM_LIDAR;
use crate::sense::captures::label_table::mounted_on;
use crate::sense::captures::reading::Record;
use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3};
use systems::sensors::CollisionSensor;
use systems::sensors::collision::{Collision, Convex, Touch};
use systems::vehicles::{Motion, Vehicle, VehicleTypes};

impl Record for Collision {}

impl ReadingSensor for CollisionSensor {
    const KIND: &'static str = "collision";
    type Record = Collision;

    fn measure(&self, at: &mut Measuring<'_>) -> Vec<Collision> {
        collisions(self.margin.into(), at)
    }
}

/// Things that touch what a sensor is mounted on, by number.
fn collisions(margin: f64, at: &mut Measuring<'_>) -> Vec<Collision> {
    let Measuring { world, entity, pose, ref mut labels, .. } = *at;
    let own = carrier(world, entity);
    let bodies = solid(world, own);
    let spheres: Vec<(DVec3, f64)> = bodies.iter().map(Convex::sphere).collect();
    let is_near = |(place, radius): (DVec3, f64)| {
        spheres.iter().any(|(own, reach)| own.distance(place) <= reach + radius + 2.0 * margin)
    };
    let deepest = |others: &[Convex]| {
        let near = others.iter().filter(|other| is_near(other.sphere()));
        let touches = near.flat_map(|other| bodies.iter().filter_map(|own| own.touch(other, margin)));
        touches.max_by(|a, b| a.depth.total_cmp(&b.depth))
    };
    let mut found: Vec<Collision> = Vec::new();
    for other in vehicles_near(world, is_near).into_iter().chain(obstacles(world)).filter(|other| *other != own) {
        let Some(Touch { depth, normal }) = deepest(&solid_or_obstacle(world, other, is_near)) else { continue };
        let labels = labels.labels(world, other.index_u32().wrapping_add(1));
        let speed = (velocity(world, other) - velocity(world, own)).dot(normal);
        let normal = ENTITY_FROM_LIDAR.transpose() * (pose.rotation.inverse() * normal);
        found.push(Collision { instance: labels.instance, class: labels.class, depth, normal, speed });
    }
    found.sort_by(|a, b| a.instance.cmp(&b.instance).then(b.depth.total_cmp(&a.depth)));
    found.dedup_by_key(|collision| collision.instance);
    found
}

/// Carrier of a sensor: a vehicle, or else the nearest thing above it, or what it is below, or itself.
fn carrier(world: &World, sensor: Entity) -> Entity {
    let parent = || world.get::<ChildOf>(sensor).map(ChildOf::parent);
    vehicle_of(world, sensor).or_else(|| mounted_on(world, sensor)).or_else(parent).unwrap_or(sensor)
}

/// Vehicles whose boxes may be near.
fn vehicles_near(world: &World, is_near: impl Fn((DVec3, f64)) -> bool) -> Vec<Entity> {
    let Some(mut vehicles) = world.try_query::<(Entity, &Vehicle, &Motion)>() else { return Vec::new() };
    let types = world.resource::<VehicleTypes>();
    let reach = |vehicle: &Vehicle| f64::from(types.get(vehicle.kind).size.length());
    let all = vehicles.iter(world);
    all.filter(|(_, vehicle, motion)| is_near((motion.place, reach(vehicle)))).map(|(entity, ..)| entity).collect()
}

/// m/s in the world: of a body, or a vehicle along its forward; of anything else 0.
fn velocity(world: &World, entity: Entity) -> DVec3 {
    of_body(world, entity).unwrap_or_else(|| {
        let rotation: DQuat = place::pose(world, entity).rotation;
        world.get::<Motion>(entity).map_or(DVec3::ZERO, |motion| rotation * DVec3::Z * motion.speed)
    })
}
