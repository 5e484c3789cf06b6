//! Readings of inertial measurement units.

use super::kind::{Measuring, ReadingSensor};
use crate::export::ros::{Encoded, Header, Imu, diagonal};
use crate::sense::captures::reading::Record;
use bevy_ecs::prelude::*;
use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::io::Result;
use systems::describe::Described;
use systems::sensors::{ImuReading, ImuSensor};

/// Measurement of an inertial measurement unit, for the time that it was due before.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct ImuCapture {
    /// True if the places of the sensor at the last two times that it was due are known. If not, all is 0.
    pub valid: bool,
    /// Nanoseconds of the clock of which the reading is.
    #[schemars(extend("seconds" = "time"))]
    pub nanoseconds: u64,
    /// Acceleration against free fall, m/s²: (0, 0, 9.81) at rest on level ground.
    #[schemars(with = "[f64; 3]", extend("unit" = "m/s^2, against free fall", "shown" = "{3} m/s²"))]
    pub specific_force: DVec3,
    /// About its axes, rad/s.
    #[schemars(with = "[f64; 3]", extend("unit" = "rad/s", "shown" = "{4} rad/s"))]
    pub angular_velocity: DVec3,
    /// Standard deviations of what noise adds, on each axis: of the specific force, m/s², and of the angular velocity,
    /// rad/s. A density n becomes n/√s of readings s seconds apart (Kalibr's "IMU noise model").
    #[schemars(extend("column" = false))]
    pub sigmas: [f64; 2],
}

impl Described for ImuCapture {}

impl Record for ImuCapture {
    const TOPIC: Option<&'static str> = Some("imu");

    fn message(&self, header: Header) -> Result<Option<Encoded>> {
        let [of_force, of_rate] = self.sigmas.map(|sigma| diagonal([sigma * sigma; 3]));
        let message = Imu {
            header: Header { nanoseconds: self.nanoseconds, ..header },
            orientation: None,
            angular_velocity: self.angular_velocity.to_array(),
            linear_acceleration: self.specific_force.to_array(),
            covariances: [[0.0; 9], of_rate, of_force],
        };
        self.valid.then(|| Encoded::of(&message)).transpose()
    }
}

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
