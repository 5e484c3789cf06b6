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
use super::{Edges, Raster};
use glam::Vec3;
use systems::relevance::LUMINANCE;

/// Standard deviation of the unsharp mask, texels.
const SHARPEN_SIGMA: f32 = 2.0;

/// How heights are guessed. Lengths are standard deviations in texels.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct HeightOptions {
    /// Removes what is wider than this; 0: nothing.
    pub remove_shading: f32,
    /// Smooths; 0: not.
    pub blur: f32,
    /// How much of the unsharp mask is added.
    pub sharpen: f32,
    /// Times the distance from the mean.
    pub contrast: f32,
    /// Dark is high.
    pub invert: bool,
    /// What lies beyond the edges.
    pub edges: Edges,
}

impl Default for HeightOptions {
    fn default() -> Self {
        Self { remove_shading: 0.0, blur: 0.0, sharpen: 0.0, contrast: 1.0, invert: false, edges: Edges::Wrap }
    }
}

/// A height map (1 channel, mean ½) from linear colour (3 channels). `done` is told the rows finished.
pub fn height_from_color(color: &Raster, options: &HeightOptions, done: &(dyn Fn(usize) + Sync)) -> Raster {
    let size = (color.width, color.height, 1);
    let rows_of = |map: &(dyn Fn(usize) -> f32 + Sync), done: &(dyn Fn(usize) + Sync)| {
        let fill = |y: usize, row: &mut [f32]| {
            row.iter_mut().enumerate().for_each(|(x, value)| *value = map(y * color.width + x));
        };
        Raster::from_rows(size, fill, done)
    };
    let texel = |i: usize| &color.values[i * color.channels..][..3];
    let mut guess = rows_of(&|i| Vec3::from_slice(texel(i)).dot(LUMINANCE), &|_| {});
    if options.remove_shading > 0.0 {
        let wide = gaussian(&guess, options.remove_shading, options.edges);
        guess = rows_of(&|i| guess.values[i] - wide.values[i], &|_| {});
    }
    guess = gaussian(&guess, options.blur, options.edges);
    if options.sharpen > 0.0 {
        let smooth = gaussian(&guess, SHARPEN_SIGMA, options.edges);
        guess = rows_of(&|i| guess.values[i] + options.sharpen * (guess.values[i] - smooth.values[i]), &|_| {});
    }
    // In one order, so that it is the same for any number of threads.
    let mean = guess.values.iter().copied().map(f64::from).sum::<f64>() / guess.values.len().max(1) as f64;
    let contrast = if options.invert { -options.contrast } else { options.contrast };
    rows_of(&|i| (0.5 + contrast * (guess.values[i] - mean as f32)).clamp(0.0, 1.0), done)
}
