//! Messages of ROS 2, as structs of what Relief knows, and their definitions as text, with which a log explains itself.
//!
//! Places and turns in messages are those of their frame: x right, y down, z forward for cameras; x forward, y left,
//! z up for bodies (REP 103). Times are nanoseconds of the simulation, which begins at 0. Turns are quaternions in the
//! order x, y, z, w.
//!
//! ```text
//! message       what all have in common
//! definitions   what each message consists of, as text     frames     /tf and /clock
//! camera        pictures and their cameras                 points     clouds of points
//! motion        IMU and GNSS                               foxglove   boxes in pictures and in space
//! ```

mod camera;
pub(crate) mod definitions;
mod foxglove;
mod frames;
pub(crate) mod message;
mod motion;
mod points;

pub use camera::*;
pub use definitions::definition;
pub use foxglove::*;
pub use frames::*;
pub use message::{Encoded, Header, Message};
pub use motion::*;
pub use points::*;
