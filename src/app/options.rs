//! Options that a window is opened with.

use crate::frames::LoadOptions;
use crate::recording::Stepper;
use crate::renderer::Settings;
use crate::viewpoint::Viewpoint;
use bevy_ecs::prelude::*;
use std::path::PathBuf;
use systems::Simulation;

/// Contents of the window, and its settings at the start.
pub struct Options {
    /// A loaded world.
    pub simulation: Simulation,
    /// File of the scene: texels that only a lost device had are read again.
    pub scene: PathBuf,
    /// Options that it was loaded with.
    pub load: LoadOptions,
    /// Takes its steps.
    pub stepper: Stepper,
    /// The scene's name, for the title bar.
    pub title: String,
    /// Names and entities of the scene's cameras, for switching between them.
    pub cameras: Vec<(String, Entity)>,
    /// Viewpoint at first.
    pub viewpoint: Viewpoint,
    /// Pixels.
    pub size: (u32, u32),
    /// Render settings at first.
    pub settings: Settings,
    /// Starts with the clock stopped.
    pub paused: bool,
    /// Starts with the panel shown.
    pub panel: bool,
}
