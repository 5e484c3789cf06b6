//! Plans: settings, outputs that are asked for, a view of a frame. Plain data; uses no other floor.

pub(crate) mod output_set;
pub(crate) mod packed;
pub(crate) mod settings;
pub(crate) mod view_plan;
