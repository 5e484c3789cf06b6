//! Slopes of a height map: what normals, offsets and horizons are made of.
//!
//! The differences are the classic 3×3 operators, each divided by what it gives for a ramp of 1 per texel, so that a
//! ramp has its exact slope with all of them:
//!
//! ```text
//! central ½ [-1 0 1]    Sobel ⅛ [1 2 1]ᵀ [-1 0 1]    Scharr 1/32 [3 10 3]ᵀ [-1 0 1]
//! ```
//!
//! Sobel and Scharr smooth across the slope, which hides the steps of 8-bit heights; Scharr's weights are those that
//! turn best with the image (Jähne, Scharr, Körkel: "Principles of Filter Design", 1999). Central differences keep the
//! most detail.

use super::{Edges, Raster};
use crate::name::named;

named! {
    /// Filter that takes the difference of neighbouring heights.
    #[derive(Default)]
    pub enum Filter {
        /// 3×3, weights 1 2 1: the usual choice
        #[default]
        Sobel = "sobel",
        /// 3×3, weights 3 10 3: closer to rotation invariance
        Scharr = "scharr",
        /// Central difference of two neighbours: sharpest, shows the steps of 8-bit heights
        Central = "central",
    }
}

/// Meaning of heights.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Relief {
    /// From height 0 to height 1, in widths of the image.
    pub height_scale: f32,
    /// Content beyond the edges.
    pub edges: Edges,
    /// Dents for bumps: 1 − h.
    pub invert: bool,
}

impl Default for Relief {
    /// The material's default depth, a tile.
    fn default() -> Self {
        Self { height_scale: 0.02, edges: Edges::Wrap, invert: false }
    }
}

impl Relief {
    /// The slope that a height difference of 1 per texel has on a map of that width.
    pub(super) fn slope_per_texel(&self, width: usize) -> f32 {
        let sign = if self.invert { -1.0 } else { 1.0 };
        sign * self.height_scale * width as f32
    }
}

/// ∂h/∂x and ∂h/∂y of the first channel at a texel, per texel: x toward image-right, y toward image-**up**.
pub(super) fn gradient(heights: &Raster, x: usize, y: usize, filter: Filter, edges: Edges) -> [f32; 2] {
    let at = |dx: isize, dy: isize| heights.at(x as isize + dx, y as isize + dy, 0, edges);
    let (across, along) = match filter {
        Filter::Central => return [(at(1, 0) - at(-1, 0)) * 0.5, (at(0, -1) - at(0, 1)) * 0.5],
        Filter::Sobel => (1.0 / 8.0, 2.0 / 8.0),
        Filter::Scharr => (3.0 / 32.0, 10.0 / 32.0),
    };
    let [nw, n, ne] = [at(-1, -1), at(0, -1), at(1, -1)];
    let [w, e] = [at(-1, 0), at(1, 0)];
    let [sw, s, se] = [at(-1, 1), at(0, 1), at(1, 1)];
    [across * ((ne - nw) + (se - sw)) + along * (e - w), across * ((nw - sw) + (ne - se)) + along * (n - s)]
}
