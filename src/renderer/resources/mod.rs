//! Resources of a scene on the device: meshes, textures of materials, tables of records. May use `plan` and `gpu`.

pub(crate) mod frame_tables;
pub(crate) mod meshes;
pub(crate) mod scatter;
pub(crate) mod sky;
pub(crate) mod stats;
pub(crate) mod tables;
pub(crate) mod textures;
