//! Jobs of comparing techniques.

use super::base_mesh::BaseMesh;
use std::path::PathBuf;
use systems::assets::Technique;

/// Pictures of at most so many pixels are compared: the truth has four samples in each.
pub const MOST_PIXELS: u32 = 1 << 22;
/// Degrees; beyond, the plane is seen from its edge.
pub const MOST_DEGREES: f32 = 85.0;

/// Settings of a comparison.
#[derive(Clone, Debug)]
pub struct CompareJob {
    /// Folder for figures and pictures; made if missing.
    pub folder: PathBuf,
    /// Mesh that is bumped.
    pub figure: BaseMesh,
    /// Height map, 0 deepest; `None`: that of the scene of all techniques, with its other maps.
    pub height: Option<PathBuf>,
    /// Normal map, green up; `None`: made from the height map.
    pub normal: Option<PathBuf>,
    /// Base colour; `None`: that of the scene of all techniques, or grey with other heights.
    pub base: Option<PathBuf>,
    /// Depth of the height map from black to white, in widths of the image, 0 to 1; `None`: 0.06.
    pub height_scale: Option<f32>,
    /// Degrees between the line of sight and the vertical, 0 to [`MOST_DEGREES`].
    pub angle: f32,
    /// Pixels; at most [`MOST_PIXELS`].
    pub size: (u32, u32),
    /// None: all.
    pub techniques: Vec<Technique>,
}

impl CompareJob {
    /// Those to draw, with none at all first.
    pub fn techniques(&self) -> Vec<Technique> {
        let all = Technique::ALL.iter().map(|(_, technique)| *technique);
        // In the order of the table, each once; off is what costs are compared with.
        let is_wanted = |technique: &Technique| self.techniques.is_empty() || self.techniques.contains(technique);
        all.filter(|technique| *technique == Technique::Off || is_wanted(technique)).collect()
    }
}
