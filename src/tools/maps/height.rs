//! Colour to height: a guess. Colour is not height: a dark stone is not deep. It serves where light and dark come from
//! shape, as in mortar between bricks, and where nothing better is to be had.
//!
//! ```text
//! v = luminance of the linear colour (Rec. 709)
//! v ← v − Gaussian(v, σ = remove_shading)            what is wider than that is taken for light and shade
//! v ← Gaussian(v, σ = blur)                          grain is not relief
//! v ← v + sharpen · (v − Gaussian(v, σ = 2))         an unsharp mask
//! h = ½ + contrast · (v − mean v), kept in 0..1
//! ```
//!
//! so that the mean lies at mid grey, the rest level of the techniques that have one. A step whose number is 0 is left
//! out. What is kept in 0..1 may move the mean a little.

use super::blur::gaussian;
use super::{Advance, Edges, Raster};
use glam::Vec3;
use systems::lights::LUMINANCE;

/// Standard deviation of the unsharp mask, texels.
const SHARPEN_SIGMA: f32 = 2.0;

/// Settings of the guess of heights. Lengths are standard deviations in texels.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct HeightOptions {
    /// Removes what is wider than this; 0: nothing.
    pub remove_shading: f32,
    /// Smooths; 0: not.
    pub blur: f32,
    /// Weight of the unsharp mask that is added.
    pub sharpen: f32,
    /// Times the distance from the mean.
    pub contrast: f32,
    /// Dark is high.
    pub invert: bool,
    /// Content beyond the edges.
    pub edges: Edges,
}

impl Default for HeightOptions {
    fn default() -> Self {
        Self { remove_shading: 0.0, blur: 0.0, sharpen: 0.0, contrast: 1.0, invert: false, edges: Edges::Wrap }
    }
}

/// A height map (1 channel, mean ½) from linear colour (3 channels). `advance` is told the rows finished, in all
/// passes.
pub fn height_from_color(color: &Raster, options: &HeightOptions, advance: Advance) -> Raster {
    let blurs = [options.remove_shading, options.blur, options.sharpen].iter().filter(|&&x| x > 0.0).count();
    let (passes, mut passed) = (1 + 2 * blurs, 0);
    let each = |value: &(dyn Fn(usize) -> f32 + Sync), done: &(dyn Fn(usize) + Sync)| {
        let fill = |y: usize, row: &mut [f32]| {
            row.iter_mut().enumerate().for_each(|(x, to)| *to = value(y * color.width + x));
        };
        Raster::from_rows((color.width, color.height, 1), fill, done)
    };
    let mut blurred = |values: &Raster, sigma: f32| {
        let before = passed * color.height;
        passed += 2;
        gaussian(values, sigma, options.edges, &|rows| advance(before + rows, passes * color.height))
    };
    let luminance = |texel: usize| Vec3::from_slice(&color.values[texel * color.channels..]).dot(LUMINANCE);
    let mut guess = each(&luminance, &|_| {});
    if options.remove_shading > 0.0 {
        let wide = blurred(&guess, options.remove_shading);
        guess = each(&|i| guess.values[i] - wide.values[i], &|_| {});
    }
    if options.blur > 0.0 {
        guess = blurred(&guess, options.blur);
    }
    if options.sharpen > 0.0 {
        let smooth = blurred(&guess, SHARPEN_SIGMA);
        guess = each(&|i| guess.values[i] + options.sharpen * (guess.values[i] - smooth.values[i]), &|_| {});
    }
    // In one order, so that it is the same for any number of threads.
    let mean = guess.values.iter().copied().map(f64::from).sum::<f64>() / guess.values.len().max(1) as f64;
    let contrast = if options.invert { -options.contrast } else { options.contrast };
    let height = |i: usize| (0.5 + contrast * (guess.values[i] - mean as f32)).clamp(0.0, 1.0);
    each(&height, &|rows| advance(passed * color.height + rows, passes * color.height))
}
