//! Relief: a data-oriented ECS simulation renderer.

pub mod app;
pub mod check;
pub mod demo;
pub mod frames;
pub mod import;
pub mod name;
pub mod output;
pub mod prelude;
pub mod problem;
pub mod renderer;
pub mod scene;
pub mod video;
