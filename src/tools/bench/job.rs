//! Settings of measurements.

use super::grid::GridPlan;
use crate::renderer::Occlusion;
use crate::session::LoadOptions;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use systems::assets::Technique;
use systems::assets::levels::LevelOfDetail;
use systems::lights::LightPolicy;

/// One scene to measure, and how.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct BenchJob {
    /// A scene file or model, whose clock makes a step before every frame; `None`: the grid of [`Self::plan`].
    pub scene: Option<PathBuf>,
    /// The scene's camera by name, or `chase NAME`, `driver NAME` of a vehicle; `None`: its first.
    pub camera: Option<String>,
    /// The grid.
    pub plan: GridPlan,
    /// Pixels.
    pub size: (u32, u32),
    /// Frames to measure, at the most.
    pub frames: u32,
    /// Frames before those, which are not measured.
    pub warm_up: u32,
    /// Seconds after which measuring stops, once there are 5 frames; warming up ends after a quarter of that.
    pub seconds: u32,
    /// Draws every material with this technique.
    pub technique: Option<Technique>,
    /// Lights everything by this policy; `None`: a grid by [`LightPolicy::Three`], a scene as it has it.
    pub lights_policy: Option<LightPolicy>,
    /// Levels of detail of distant meshes.
    pub levels: LevelOfDetail,
    /// Occlusion culling.
    pub occlusion: Occlusion,
    /// Lights that may have a shadow map; `None`: of a grid none, of a scene as many as by default. Above 0 the lights
    /// of a grid cast shadows.
    pub shadows: Option<u32>,
    /// Options of loading the scene; never from the cache. A grid's textures are put into blocks by the same choice.
    pub load: LoadOptions,
    /// Samples per pixel, 1 or 4.
    pub samples: u32,
    /// Worker threads; `None`: one per core.
    pub threads: Option<usize>,
    /// Also draws all objects in view with the plainest shader.
    pub floor: bool,
    /// A file for the last frame.
    pub picture: Option<PathBuf>,
    /// A file for the measured frames on a time line.
    pub trace: Option<PathBuf>,
}

/// Many grids to measure, each in a process of its own.
#[derive(Clone, Debug)]
pub struct SuiteJob {
    /// Settings of each measurement; its grid is the largest.
    pub most: BenchJob,
    /// Folder for results, report and plots; made if missing.
    pub folder: PathBuf,
    /// The results of an earlier suite, to compare with.
    pub earlier: Option<PathBuf>,
    /// Few scenes, to see that it works.
    pub quick: bool,
}
