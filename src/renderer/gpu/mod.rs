//! The device and what every program for one needs: errors, buffers that grow, textures, read-backs, timestamps, the
//! texts of shaders. Uses no other floor.

pub(crate) mod cpu_rasterizer;
pub(crate) mod device;
pub(crate) mod error;
pub(crate) mod faults;
pub(crate) mod formats;
pub(crate) mod growing_buffer;
pub(crate) mod pace;
pub(crate) mod readback;
pub mod shaders;
pub(crate) mod shared_buffer;
pub(crate) mod texture;
pub(crate) mod timestamps;
