//! Height map to tangent-space normal map.
//!
//! The surface z = S·h over the square of width 1 has the normal (−∂z/∂u, −∂z/∂(up), 1), normalised: Blinn, "Simulation
//! of Wrinkled Surfaces", SIGGRAPH 1978, on a plane. Red is toward image-right, green toward image-up, blue out of the
//! surface, each 0.5 + 0.5·n.
//!
//! Flat surfaces come out exactly flat: (0.5, 0.5, 1). No integer is exactly 0.5; files hold the nearest, in 8 bits
//! (128, 128, 255), in 16 bits (32768, 32768, 65535).

use super::slope::{Filter, Relief, gradient};
use super::{Advance, Raster};

/// Settings of a normal map.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct NormalOptions {
    /// Meaning of the heights.
    pub relief: Relief,
    /// Filter of the differences.
    pub filter: Filter,
    /// Times every slope; 1: as the heights say. It does what a material's `normal_scale` does.
    pub strength: f32,
    /// Green toward image-down, for programs that read it so.
    pub flip_green: bool,
}

impl Default for NormalOptions {
    fn default() -> Self {
        Self { relief: Relief::default(), filter: Filter::default(), strength: 1.0, flip_green: false }
    }
}

/// The normal map (3 channels, 0.5 + 0.5·n) of the first channel of a height map. `advance` is told the rows finished.
pub fn normal_from_height(heights: &Raster, options: &NormalOptions, advance: Advance) -> Raster {
    let slope = options.strength * options.relief.slope_per_texel(heights.width);
    let up = if options.flip_green { -1.0 } else { 1.0 };
    let fill = |y: usize, row: &mut [f32]| {
        for (x, texel) in row.chunks_exact_mut(3).enumerate() {
            let [right, above] = gradient(heights, x, y, options.filter, options.relief.edges);
            let normal = glam::Vec3::new(-slope * right, -slope * above * up, 1.0).normalize();
            texel.copy_from_slice(&(normal * 0.5 + 0.5).to_array());
        }
    };
    Raster::from_rows((heights.width, heights.height, 3), fill, &|rows| advance(rows, heights.height))
}
