//! Messages of ROS 2, as structs of what Relief knows, and their definitions as text, with which a log explains itself.
//!
//! Places and turns in messages are those of their frame: x right, y down, z forward for cameras; x forward, y left,
//! z up for bodies (REP 103). Times are nanoseconds of the simulation, which begins at 0. Turns are quaternions in the
//! order x, y, z, w.
//!
//! ```text
//! definitions   what each message consists of, as text     frames     /tf and /clock
//! camera        pictures and their cameras                 points     clouds of points
//! motion        IMU and GNSS                               foxglove   boxes in pictures and in space
//! ```

mod camera;
mod definitions;
mod foxglove;
mod frames;
mod motion;
mod points;

pub use camera::{CameraInfo, Distortion, Image, Pixels};
pub use definitions::definition;
pub use foxglove::{BoxInPicture, BoxInSpace, ImageAnnotations, SceneUpdate};
pub use frames::{Clock, TfMessage, TransformStamped};
pub use motion::{Imu, NavSatFix};
pub use points::PointCloud2;

use super::cdr::Encoder;
use std::io::Result;

/// A message that can be sent or logged.
pub trait Message {
    /// Its type, as ROS 2 names it: `sensor_msgs/msg/Image`.
    const TYPE: &'static str;

    /// Appends its fields in the order of its definition.
    ///
    /// # Errors
    /// What its type has no place for.
    fn put(&self, cdr: &mut Encoder) -> Result<()>;

    /// As it is sent and stored.
    ///
    /// # Errors
    /// As for [`Self::put`].
    fn encode(&self) -> Result<Vec<u8>> {
        let mut cdr = Encoder::default();
        self.put(&mut cdr)?;
        Ok(cdr.finish())
    }
}

/// When something was measured, and in which frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Header<'a> {
    /// Nanoseconds of simulation.
    pub nanoseconds: u64,
    /// The name of the frame.
    pub frame: &'a str,
}

impl Header<'_> {
    /// As `std_msgs/Header`.
    fn put(&self, cdr: &mut Encoder) -> Result<()> {
        put_time(cdr, self.nanoseconds);
        cdr.string(self.frame)
    }
}

/// As `builtin_interfaces/Time`, which ends after 68 years; what is later has its last second.
fn put_time(cdr: &mut Encoder, nanoseconds: u64) {
    const SECOND: u64 = 1_000_000_000;
    cdr.number(i32::try_from(nanoseconds / SECOND).unwrap_or(i32::MAX));
    cdr.number((nanoseconds % SECOND) as u32);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_seconds_and_nanoseconds_and_ends() {
        // 500,000,000 is 0x1DCD6500.
        assert_eq!(Clock(1_500_000_000).encode().unwrap(), [0, 1, 0, 0, 1, 0, 0, 0, 0, 0x65, 0xcd, 0x1d]);
        let last = Clock(u64::MAX).encode().unwrap();
        assert_eq!(last[4..8], i32::MAX.to_le_bytes());
    }

    #[test]
    fn a_header_is_its_time_and_its_frame() {
        let mut cdr = Encoder::default();
        Header { nanoseconds: 7, frame: "a" }.put(&mut cdr).unwrap();
        assert_eq!(cdr.finish()[4..], [0, 0, 0, 0, 7, 0, 0, 0, 2, 0, 0, 0, b'a', 0]);
    }
}
