//! In place of `lanes.rs` and `collisions.rs` in a build without vehicles: there are no lanes, and nothing is touched.

use super::kind::{Measuring, ReadingSensor};
use crate::sense::captures::reading::Record;
use systems::sensors::collision::Collision;
use systems::sensors::{CollisionSensor, LaneReading, LaneSensor};

impl Record for LaneReading {}
impl Record for Collision {}

impl ReadingSensor for LaneSensor {
    const KIND: &'static str = "lane";
    type Record = LaneReading;

    fn measure(&self, _: &mut Measuring<'_>) -> Vec<LaneReading> {
        vec![LaneReading::default()]
    }
}

impl ReadingSensor for CollisionSensor {
    const KIND: &'static str = "collision";
    type Record = Collision;

    fn measure(&self, _: &mut Measuring<'_>) -> Vec<Collision> {
        Vec::new()
    }
}
