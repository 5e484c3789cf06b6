//! Things that a scene names: images, models, rigs, and fields that a program adds. Uses `text` and `format`.

pub mod custom_fields;
pub mod files;
pub mod items;
pub mod origin;
pub mod overrides;
pub mod rigs;
