//! Common parts of a frame's error figures: the choice of the frame, and the folder of its pictures.

use crate::session::LoadOptions;
use std::path::PathBuf;
use systems::Simulation;
use systems::assets::Technique;
use systems::lights::LightRecord;

/// Settings of `relief lights` and `relief shadows`.
#[derive(Clone, Debug)]
pub struct FrameErrorJob {
    /// Scene file or model.
    pub scene: PathBuf,
    /// Options of loading the scene.
    pub load: LoadOptions,
    /// Folder for the pictures; made if missing.
    pub folder: PathBuf,
    /// Steps of the clock before the picture.
    pub frame: u64,
    /// Pixels; of `relief shadows` each of four samples.
    pub size: (u32, u32),
    /// The name of the camera; `None`: the scene's first.
    pub camera: Option<String>,
    /// Draws every material with this technique.
    pub technique: Option<Technique>,
}

impl FrameErrorJob {
    /// Path of the picture of that name.
    pub(crate) fn picture(&self, name: &str) -> PathBuf {
        self.folder.join(name).with_extension("png")
    }
}

/// Number of lights that are on in the last frame.
pub(crate) fn lights_on(simulation: &Simulation) -> usize {
    simulation.draw_list().lights.records.iter().filter(|light| light.kind() != LightRecord::OFF).count()
}
