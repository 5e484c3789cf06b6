//! Materials, their textures, and the images of these. Uses `report`, `files` and `document`.

pub mod material;
pub mod textures;
