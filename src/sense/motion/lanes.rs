//! Readings of lane sensors.

use super::kind::{Measuring, ReadingSensor};
use crate::sense::captures::label_table::own_and_above;
use crate::sense::captures::reading::Record;
use bevy_ecs::prelude::*;
use glam::DVec3;
use systems::sensors::{LaneReading, LaneSensor};
use systems::vehicles::routes::Routes;
use systems::vehicles::{Motion, MotionSource, OnRoute, Vehicle};

/// The vehicle that an entity is on, or is.
pub(super) fn vehicle_of(world: &World, entity: Entity) -> Option<Entity> {
    own_and_above(world, entity).find(|&above| world.get::<Vehicle>(above).is_some())
}

impl Record for LaneReading {}

impl ReadingSensor for LaneSensor {
    const KIND: &'static str = "lane";
    type Record = LaneReading;

    /// Measures in the lane of the route that its vehicle follows, or else of the nearest.
    fn measure(&self, at: &mut Measuring<'_>) -> Vec<LaneReading> {
        let (world, pose) = (at.world, at.pose);
        let vehicle = vehicle_of(world, at.entity);
        let follows = |&vehicle: &Entity| MotionSource::of(world, vehicle) == MotionSource::Route;
        let on = vehicle.filter(follows).and_then(|vehicle| world.get::<OnRoute>(vehicle));
        let routes = world.resource::<Routes>();
        let found = routes.lane_at(on, pose.translation, pose.rotation * DVec3::Z, self.reach.into());
        let speed = vehicle.and_then(|vehicle| world.get::<Motion>(vehicle)).map_or(0.0, |motion| motion.speed);
        vec![found.map_or_else(LaneReading::default, |reading| LaneReading { speed, ..reading })]
    }
}
