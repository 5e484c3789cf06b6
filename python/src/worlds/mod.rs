//! A world under a lock, and the device that draws it. Uses errors.

pub mod device;
#[cfg(target_os = "linux")]
pub mod lending;
mod watch;
pub mod world;
