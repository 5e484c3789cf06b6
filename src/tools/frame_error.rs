//! What the figures of a frame's error have in common: which frame, and where its pictures go.

use crate::frames::LoadOptions;
use std::path::PathBuf;
use systems::Simulation;
use systems::assets::Technique;
use systems::lights::LightRecord;

/// What `relief lights` and `relief shadows` compare.
#[derive(Clone, Debug)]
pub struct FrameErrorJob {
    /// Scene file or model.
    pub scene: PathBuf,
    /// How the scene is loaded.
    pub load: LoadOptions,
    /// Where the pictures go; made if missing.
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
    /// Where the picture of that name goes.
    pub(crate) fn picture(&self, name: &str) -> PathBuf {
        self.folder.join(name).with_extension("png")
    }
}

/// How many lights of the last frame are on.
pub(crate) fn lights_on(simulation: &Simulation) -> usize {
    simulation.draw_list().lights.records.iter().filter(|light| light.kind() != LightRecord::OFF).count()
}
