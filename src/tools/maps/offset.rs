//! Height map to the offset map (du, dv) of environment-mapped bump mapping.
//!
//! (du, dv) is the xy of the normal before it is normalised: minus the slope, toward image-right and image-up, the same
//! that [`super::normal_from_height`] has over its z. Where the surface leans to the right, the look-up goes to the
//! right. Slopes of more than 1 (45°) are kept at 1; `strength` brings gentle ones up.
//!
//! A byte is 128 + 127·d: 128 is none, 1 and 255 are −1 and 1. Red is du, green is dv, blue is 0.

use super::slope::gradient;
use super::{Advance, NormalOptions, Raster};

/// The offset map (3 channels, (128 + 127·d)/255) of the first channel of a height map. `advance` is told the rows
/// finished.
pub fn offset_from_height(heights: &Raster, options: &NormalOptions, advance: Advance) -> Raster {
    let slope = options.strength * options.relief.slope_per_texel(heights.width);
    let up = if options.flip_green { -1.0 } else { 1.0 };
    let encoded = |d: f32| (128.0 + 127.0 * d.clamp(-1.0, 1.0)) / 255.0;
    let fill = |y: usize, row: &mut [f32]| {
        for (x, texel) in row.chunks_exact_mut(3).enumerate() {
            let [right, above] = gradient(heights, x, y, options.filter, options.relief.edges);
            texel[0] = encoded(-slope * right);
            texel[1] = encoded(-slope * above * up);
        }
    };
    Raster::from_rows((heights.width, heights.height, 3), fill, &|rows| advance(rows, heights.height))
}
