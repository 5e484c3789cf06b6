//! Transforms between frames, and the clock.

use super::message::{Header, Message, put_time};
use crate::export::cdr::Encoder;
use std::io::Result;

/// Pose of a frame in another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransformStamped<'a> {
    /// When, and in which frame.
    pub header: Header<'a>,
    /// The frame whose place this is.
    pub child: &'a str,
    /// Its origin: x, y, z in metres.
    pub translation: [f64; 3],
    /// Rotation from the child's axes to those of the other: x, y, z, w.
    pub rotation: [f64; 4],
}

/// Poses of frames, as `tf2_msgs/TFMessage`: for `/tf`, or those that never change for `/tf_static`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TfMessage<'a>(pub &'a [TransformStamped<'a>]);

impl Message for TfMessage<'_> {
    const TYPE: &'static str = "tf2_msgs/msg/TFMessage";
    const FIELDS: &'static str = "geometry_msgs/TransformStamped[] transforms\n";

    fn put(&self, cdr: &mut Encoder) -> Result<()> {
        cdr.sequence(self.0, |cdr, transform| {
            transform.header.put(cdr)?;
            cdr.string(transform.child)?;
            cdr.array(&transform.translation);
            cdr.array(&transform.rotation);
            Ok(())
        })
    }
}

/// The time of the simulation in nanoseconds, as `rosgraph_msgs/Clock`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock(pub u64);

impl Message for Clock {
    const TYPE: &'static str = "rosgraph_msgs/msg/Clock";
    const FIELDS: &'static str = "builtin_interfaces/Time clock\n";

    fn put(&self, cdr: &mut Encoder) -> Result<()> {
        put_time(cdr, self.0);
        Ok(())
    }
}
