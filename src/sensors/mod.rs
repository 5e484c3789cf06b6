//! Sensors that measure what a world draws.
//!
//! ```text
//! RayScene (rays.rs)   what the last frame draws, as rays meet it: a tree over the boxes of objects, and one for each
//!                      mesh (ray_meshes.rs); with colours and masks (texels.rs)
//! lidar::scan          the beams of a LidarSensor through it, into arrays
//! ```
//!
//! What sensors are as data is in [`systems::sensors`].

pub mod lidar;
mod ray_meshes;
mod rays;
mod texels;

pub use lidar::{LidarScan, Pose};
pub use rays::{Meeting, RayScene, RayWarnings};
