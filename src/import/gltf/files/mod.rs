//! The files of a model: JSON and chunks, and what URIs name. Uses `report`.

pub mod container;
pub mod uri;
