//! Options of both tools.

use std::num::NonZero;

/// Texels along a side of a map at the most.
pub const MAX_SIDE: usize = 8192;

/// Maps to be made.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Wanted {
    /// Tangent-space normals, green up.
    pub normal: bool,
    /// Distance along the normal.
    pub height: bool,
    /// Share of the cosine-weighted sky that is open.
    pub occlusion: bool,
}

impl Default for Wanted {
    fn default() -> Self {
        Self { normal: true, height: true, occlusion: true }
    }
}

/// Range along the normal in which the fine mesh is looked for, metres.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Reach {
    /// From so far outside to so far inside, and the first that is met counts: what an onlooker from outside would see.
    Cage(f32),
    /// At most so far either way, and the nearest counts: for parts that lie close above each other.
    MaxDistance(f32),
}

impl Reach {
    /// Length to either side.
    pub fn metres(self) -> f32 {
        let (Self::Cage(metres) | Self::MaxDistance(metres)) = self;
        metres
    }
}

/// Settings of both tools, for meshes and for tiles.
#[derive(Clone, PartialEq, Debug)]
pub struct BakeOptions {
    /// Texels, width and height.
    pub size: (usize, usize),
    /// Maps to be made.
    pub wanted: Wanted,
    /// Range in which the fine mesh is looked for; `None`: a cage of [`AUTO_CAGE`] of the diagonal of the coarse mesh's
    /// box.
    pub reach: Option<Reach>,
    /// Rays of each texel for the occlusion map.
    pub rays: usize,
    /// Distance beyond which nothing shades, metres.
    pub occlusion_distance: f32,
    /// Number of texels beyond the charts that are filled; `None`: all.
    pub dilate: Option<usize>,
    /// Threads; `None`: one per core.
    pub threads: Option<NonZero<usize>>,
}

/// The cage if none is given, as a share of the diagonal of the coarse mesh's box.
pub const AUTO_CAGE: f32 = 0.02;

impl Default for BakeOptions {
    fn default() -> Self {
        Self {
            size: (2048, 2048),
            wanted: Wanted::default(),
            reach: None,
            rays: 24,
            occlusion_distance: f32::INFINITY,
            dilate: Some(16),
            threads: None,
        }
    }
}
