//! Readings of inertial measurement units.

use super::kind::{Measuring, ReadingSensor};
use crate::sense::captures::motion::ImuCapture;
use bevy_ecs::prelude::*;
use serde_json::{Value, json};
use systems::sensors::{ImuReading, ImuSensor};

impl ReadingSensor for ImuSensor {
    const KIND: &'static str = "imu";
    const POSES_BEFORE: usize = 2;
    type Record = ImuCapture;

    fn measure(&self, at: &mut Measuring<'_>) -> Vec<ImuCapture> {
        let none =
            ImuCapture { sigmas: self.sigmas(at.seconds), nanoseconds: at.nanoseconds_before, ..Default::default() };
        let [Some(last), Some(first)] = at.before else { return vec![none] };
        let moments = [first, last, at.pose].map(|pose| (pose.translation, pose.rotation));
        let ImuReading { specific_force, angular_velocity } = self.measure(&moments, at.seconds, at.noise);
        vec![ImuCapture { valid: true, specific_force, angular_velocity, ..none }]
    }

    fn describe(&self, described: &mut Value, seconds: f64, _: &World) {
        // Each is of the middle of the last two intervals.
        described["delay_seconds"] = json!(seconds);
        for (field, sigma) in ["specific_force", "angular_velocity"].into_iter().zip(self.sigmas(seconds)) {
            described["outputs"][field]["sigma"] = json!(sigma);
        }
    }
}
