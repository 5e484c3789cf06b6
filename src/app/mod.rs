//! placeholder until the window is here
use crate::renderer::{GpuError, RenderError, Settings};
use bevy_ecs::prelude::Entity;
/// o
pub struct Options { /// s
 pub simulation: systems::Simulation, /// s
 pub title: String, /// s
 pub cameras: Vec<(String, Entity)>, /// s
 pub camera: Entity, /// s
 pub size: (u32, u32), /// s
 pub settings: Settings, /// s
 pub paused: bool, /// s
 pub panel: bool }
/// e
pub enum AppError { /// s
 NoDisplay(String), /// s
 Gpu(GpuError), /// s
 Render(RenderError) }
/// r
pub fn run(_: Options) -> Result<(), AppError> { Err(AppError::NoDisplay("none yet".into())) }
