//! Motion of a body, its place on Earth, and the air there.

use super::message::{Header, Message};
use crate::export::cdr::Encoder;
use std::io::Result;

/// A measurement of an inertial measurement unit, as `sensor_msgs/Imu`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imu<'a> {
    /// When, and the frame of the unit.
    pub header: Header<'a>,
    /// Rotation from the unit's axes to those of the world, where it is known: x, y, z, w.
    pub orientation: Option<[f64; 4]>,
    /// In rad/s, about x, y, z.
    pub angular_velocity: [f64; 3],
    /// In m/s²: what a unit at rest measures points up (9.81 along z).
    pub linear_acceleration: [f64; 3],
    /// Covariances of the three, rows first; 0 where unknown: rad², (rad/s)², (m/s²)².
    pub covariances: [[f64; 9]; 3],
}

impl Message for Imu<'_> {
    const TYPE: &'static str = "sensor_msgs/msg/Imu";
    const FIELDS: &'static str = "\
        std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n\
        geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n\
        geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n";

    fn put(&self, cdr: &mut Encoder) -> Result<()> {
        let [mut of_orientation, of_velocity, of_acceleration] = self.covariances;
        if self.orientation.is_none() {
            // So the definition says that there is none.
            of_orientation[0] = -1.0;
        }
        self.header.put(cdr)?;
        cdr.array(&self.orientation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
        cdr.array(&of_orientation);
        cdr.array(&self.angular_velocity);
        cdr.array(&of_velocity);
        cdr.array(&self.linear_acceleration);
        cdr.array(&of_acceleration);
        Ok(())
    }
}

/// A place on Earth (WGS 84) as a receiver of GPS finds it, as `sensor_msgs/NavSatFix`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NavSatFix<'a> {
    /// When, and the frame of the antenna.
    pub header: Header<'a>,
    /// In degrees, north positive.
    pub latitude: f64,
    /// In degrees, east positive.
    pub longitude: f64,
    /// In metres above the ellipsoid.
    pub altitude: f64,
    /// In m², rows first, axes east, north, up; where it is known.
    pub covariance: Option<[f64; 9]>,
}

impl Message for NavSatFix<'_> {
    const TYPE: &'static str = "sensor_msgs/msg/NavSatFix";
    const FIELDS: &'static str = "\
        std_msgs/Header header\nsensor_msgs/NavSatStatus status\nfloat64 latitude\nfloat64 longitude\n\
        float64 altitude\nfloat64[9] position_covariance\nuint8 position_covariance_type\n";

    fn put(&self, cdr: &mut Encoder) -> Result<()> {
        self.header.put(cdr)?;
        // STATUS_FIX, SERVICE_GPS.
        cdr.number(0_i8);
        cdr.number(1_u16);
        cdr.array(&[self.latitude, self.longitude, self.altitude]);
        cdr.array(&self.covariance.unwrap_or_default());
        // COVARIANCE_TYPE_KNOWN, or _UNKNOWN.
        cdr.number(if self.covariance.is_some() { 3_u8 } else { 0 });
        Ok(())
    }
}

/// Pressure of the air, as `sensor_msgs/FluidPressure`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FluidPressure<'a> {
    /// When, and the frame of the barometer.
    pub header: Header<'a>,
    /// In Pa.
    pub pressure: f64,
    /// In Pa²; 0 where unknown.
    pub variance: f64,
}

impl Message for FluidPressure<'_> {
    const TYPE: &'static str = "sensor_msgs/msg/FluidPressure";
    const FIELDS: &'static str = "std_msgs/Header header\nfloat64 fluid_pressure\nfloat64 variance\n";

    fn put(&self, cdr: &mut Encoder) -> Result<()> {
        self.header.put(cdr)?;
        cdr.array(&[self.pressure, self.variance]);
        Ok(())
    }
}

/// A matrix of 3 by 3 with nothing beside its diagonal, as covariances are given.
pub fn diagonal([x, y, z]: [f64; 3]) -> [f64; 9] {
    [x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, z]
}
