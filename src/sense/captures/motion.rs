//! Measurements of inertial measurement units and receivers of satellite navigation.

use super::reading::Record;
use crate::export::ros::{Encoded, Header, Imu, NavSatFix};
use glam::{DMat3, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::io::Result;
use systems::describe::Described;

/// Measurement of an inertial measurement unit, for the time that it was due before.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct ImuCapture {
    /// True if the places of the sensor at the last two times that it was due are known. If not, all is 0.
    pub valid: bool,
    /// Nanoseconds of the clock of which the reading is.
    #[schemars(extend("column" = "time"))]
    pub nanoseconds: u64,
    /// Acceleration against free fall, m/s²: (0, 0, 9.81) at rest on level ground.
    #[schemars(with = "[f64; 3]", extend("unit" = "m/s^2, against free fall"))]
    pub specific_force: DVec3,
    /// About its axes, rad/s.
    #[schemars(with = "[f64; 3]", extend("unit" = "rad/s"))]
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

/// Measurement of a receiver of satellite navigation.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct GnssCapture {
    /// True if the place of the scene on Earth is known. If not, all is 0.
    pub valid: bool,
    /// Degrees, WGS 84.
    #[schemars(extend("unit" = "degrees, WGS 84"))]
    pub latitude: f64,
    /// Degrees, WGS 84.
    #[schemars(extend("unit" = "degrees, WGS 84"))]
    pub longitude: f64,
    /// Metres above the ellipsoid.
    #[schemars(extend("unit" = "metres above the ellipsoid"))]
    pub altitude: f64,
    /// True if the place of the sensor when it was due before is known. If not, the velocity is 0.
    pub has_velocity: bool,
    /// To the east, north and up, m/s; the mean since the sensor was due before.
    #[schemars(with = "[f64; 3]", extend("unit" = "m/s to the east, north, up"))]
    pub velocity: DVec3,
    /// Standard deviations of what noise adds, metres: to the east and to the north, and upward.
    #[schemars(extend("column" = false))]
    pub sigmas: [f64; 2],
}

impl Described for GnssCapture {}

impl Record for GnssCapture {
    const TOPIC: Option<&'static str> = Some("fix");

    fn message(&self, header: Header) -> Result<Option<Encoded>> {
        let [horizontal, vertical] = self.sigmas.map(|sigma| sigma * sigma);
        let Self { latitude, longitude, altitude, .. } = *self;
        let covariance = Some(diagonal([horizontal, horizontal, vertical]));
        let message = NavSatFix { header, latitude, longitude, altitude, covariance };
        self.valid.then(|| Encoded::of(&message)).transpose()
    }
}

/// A matrix of 3 by 3, rows first.
fn diagonal(values: [f64; 3]) -> [f64; 9] {
    DMat3::from_diagonal(values.into()).to_cols_array()
}
