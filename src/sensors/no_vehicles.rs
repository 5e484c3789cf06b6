//! In place of `lanes.rs` and `collisions.rs` in a build without vehicles: there are no lanes, and nothing is touched.

use super::label_table::LabelTable;
use super::lidar::Pose;
use bevy_ecs::prelude::*;
use systems::sensors::collision::Collision;
use systems::sensors::{CollisionSensor, LaneReading, LaneSensor};

pub(super) mod lanes {
    use super::*;

    pub fn capture(_: &LaneSensor, _: &World, _: Entity, _: &Pose) -> LaneReading {
        LaneReading::default()
    }
}

pub(super) mod collisions {
    use super::*;

    pub fn capture(_: &CollisionSensor, _: &World, _: (Entity, &Pose), _: &mut LabelTable) -> Vec<Collision> {
        Vec::new()
    }
}
