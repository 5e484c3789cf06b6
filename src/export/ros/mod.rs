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
