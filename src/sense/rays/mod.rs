//! Rays through what the last frame draws, and the beams of lidars: a tree over the boxes of objects, and one for each
//! mesh, with colours and masks. Uses captures.

pub mod lidar;
mod meshes;
pub(crate) mod objects;
pub(crate) mod scene;
