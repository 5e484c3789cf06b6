//! Measurements of inertial measurement units and receivers of satellite navigation.

use systems::sensors::{GnssReading, ImuReading};

/// Measurement of an inertial measurement unit.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct ImuCapture {
    /// True if it is known where the sensor was when it was due before, and before that. If not, all is 0.
    pub valid: bool,
    /// Nanoseconds of the clock of which the reading is: of when it was due before.
    pub nanoseconds: u64,
    /// The reading.
    pub reading: ImuReading,
    /// Standard deviations of its white noise: of the specific force, m/s², and of the angular rate, rad/s.
    pub sigmas: [f64; 2],
}

/// Measurement of a receiver of satellite navigation.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct GnssCapture {
    /// True if it is known where on Earth the scene is. If not, all is 0.
    pub valid: bool,
    /// True if it is known where the sensor was when it was due before. If not, the velocity is 0.
    pub has_velocity: bool,
    /// The reading; its velocity is the mean one since the sensor was due before.
    pub reading: GnssReading,
    /// Standard deviations of its place, metres: horizontal and vertical.
    pub sigmas: [f64; 2],
}
