//! In place of `lanes.rs` and `collisions.rs` in a build without vehicles: there are no lanes, and nothing is touched.

use crate::sense::captures::label_table::LabelTable;
use crate::sense::captures::pose::Pose;
use bevy_ecs::prelude::*;
use systems::sensors::collision::Collision;
use systems::sensors::{CollisionSensor, LaneReading, LaneSensor};

pub(crate) fn lane(_: &LaneSensor, _: &World, _: Entity, _: &Pose) -> LaneReading {
    LaneReading::default()
}

pub(crate) fn collisions(_: &CollisionSensor, _: &World, _: (Entity, &Pose), _: &mut LabelTable) -> Vec<Collision> {
    Vec::new()
}
