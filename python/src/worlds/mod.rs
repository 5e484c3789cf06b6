//! A world under a lock, and the device that draws it. Uses errors.

pub mod device;
mod watch;
pub mod world;
