//! Relief: a data-oriented ECS simulation renderer.
pub mod renderer;
