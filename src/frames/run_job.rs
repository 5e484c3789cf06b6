//! Runs to be rendered, as data.

use super::run::Frames;
use crate::recording::RunFiles;
use crate::renderer::Settings;
use crate::session::LoadOptions;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use systems::lights::LightPolicy;

/// Run of a scene that is to be rendered.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunJob {
    /// Scene file or model.
    pub scene: PathBuf,
    /// Range of the frames.
    pub frames: Frames,
    /// Render settings; of sensors, but for what one says itself.
    pub settings: Settings,
    /// Lights everything by this policy; `None`: as the scene has it.
    pub lights: Option<LightPolicy>,
    /// Options of loading the scene.
    pub load: LoadOptions,
    /// Files that the run begins from and is kept in.
    pub files: RunFiles,
    /// Takes the steps at the speed of the scene's clock rather than as fast as possible.
    pub realtime: bool,
}

impl RunJob {
    /// Frame numbers stay below this.
    pub const MOST_FRAMES: u64 = 1_000_000_000;

    /// The first frame of a scene.
    pub fn new(scene: impl Into<PathBuf>) -> Self {
        Self {
            scene: scene.into(),
            frames: Frames::First(1),
            settings: Settings::default(),
            lights: None,
            load: LoadOptions::default(),
            files: RunFiles::default(),
            realtime: false,
        }
    }
}
