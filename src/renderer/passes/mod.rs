//! The passes over a scene: their pipelines, and what they draw into. May use `plan`, `gpu` and `resources`.

pub(crate) mod attachments;
pub(crate) mod cell_view;
pub(crate) mod custom_passes;
pub(crate) mod emboss;
pub(crate) mod output_textures;
pub(crate) mod pack;
pub(crate) mod pass;
pub(crate) mod pipelines;
pub(crate) mod targets;
