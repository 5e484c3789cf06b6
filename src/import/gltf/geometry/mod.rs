//! Meshes: vertices, their rest pose, and triangles of them. Uses `report` and `document`.

pub mod meshes;
pub mod pose;
mod triangles;
