//! Readings of lane sensors.

use crate::sense::captures::label_table::own_and_above;
use crate::sense::captures::pose::Pose;
use bevy_ecs::prelude::*;
use glam::DVec3;
use systems::sensors::{LaneReading, LaneSensor};
use systems::vehicles::routes::Routes;
use systems::vehicles::{Motion, MotionSource, OnRoute, Vehicle};

/// The vehicle that an entity is on, or is.
pub(super) fn vehicle_of(world: &World, entity: Entity) -> Option<Entity> {
    own_and_above(world, entity).find(|&above| world.get::<Vehicle>(above).is_some())
}

/// Place of a sensor in a lane: of the route that its vehicle follows, or else of the nearest.
pub(crate) fn lane(sensor: &LaneSensor, world: &World, entity: Entity, pose: &Pose) -> LaneReading {
    let vehicle = vehicle_of(world, entity);
    let follows = |&vehicle: &Entity| MotionSource::of(world, vehicle) == MotionSource::Route;
    let on = vehicle.filter(follows).and_then(|vehicle| world.get::<OnRoute>(vehicle));
    let routes = world.resource::<Routes>();
    let forward = pose.rotation * DVec3::Z;
    let found = routes.lane_at(on, pose.translation, forward, sensor.reach.into());
    let speed = vehicle.and_then(|vehicle| world.get::<Motion>(vehicle)).map_or(0.0, |motion| motion.speed);
    found.map_or_else(LaneReading::default, |reading| LaneReading { speed, ..reading })
}
