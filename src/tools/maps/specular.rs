//! Gloss or roughness map to the specular map of Phong, Blinn and specular-glossiness materials.
//!
//! With α = roughness² a rough surface spreads its highlight like Blinn's model with the exponent n = 2/α² − 2 (Karis,
//! "Specular BRDF Reference", 2013). The normalised form of that model, F0·(n + 2)/8·(n·h)ⁿ with light in units of π,
//! has its peak at
//!
//! ```text
//! F0 · (n + 2)/8 = F0 / (4·α²)
//! ```
//!
//! which is also GGX's at normal incidence. A classic material has one exponent for all its texels; the map then holds
//! each texel's own peak, at most 1: what is polished flashes, what is dull hardly shines, as with an exponent of its
//! own. A specular-glossiness material spreads the highlight itself; its map holds F0 alone.
//!
//! F0, the reflectance at normal incidence, is that of a dielectric, 0.04, or a metal's base colour:
//! F0 = 0.04·(1 − metallic) + base·metallic, as in glTF. Alpha is the glossiness, 1 − roughness.

use super::{Advance, Raster};
use crate::name::named;
use glam::Vec3;

named! {
    /// Meaning of the map that is given.
    pub enum Polish {
        /// 1 is smooth
        Gloss = "gloss",
        /// 1 is rough
        Roughness = "roughness",
    }
}

named! {
    /// For which lighting model the map is.
    #[derive(Default)]
    pub enum SpecularModel {
        /// Phong and Blinn: rgb is the highlight's peak
        #[default]
        Phong = "phong",
        /// Specular-glossiness: rgb is F0
        SpecularGlossiness = "specular_glossiness",
    }
}

/// Settings of a specular map.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SpecularOptions<'a> {
    /// Meaning of the first map.
    pub from: Polish,
    /// For which lighting model.
    pub model: SpecularModel,
    /// F0 of what is no metal.
    pub dielectric: f32,
    /// Linear base colour (3 channels) and metallic (1 channel), of the same size as the first map.
    pub metal: Option<(&'a Raster, &'a Raster)>,
}

/// The specular map (4 channels) of a gloss or roughness map (1 channel). `advance` is told the rows finished.
pub fn specular_from(polish: &Raster, options: &SpecularOptions, advance: Advance) -> Raster {
    let texel_at = |i: usize| {
        let gloss = match options.from {
            Polish::Gloss => polish.values[i],
            Polish::Roughness => 1.0 - polish.values[i],
        };
        let gloss = gloss.clamp(0.0, 1.0);
        let dielectric = Vec3::splat(options.dielectric);
        let f0 = options.metal.map_or(dielectric, |(base, metallic)| {
            dielectric.lerp(Vec3::from_slice(&base.values[3 * i..]), metallic.values[i].clamp(0.0, 1.0))
        });
        let rgb = match options.model {
            SpecularModel::Phong => f0 * peak_of_reflectance(1.0 - gloss),
            SpecularModel::SpecularGlossiness => f0,
        };
        rgb.clamp(Vec3::ZERO, Vec3::ONE).extend(gloss)
    };
    let fill = |y: usize, row: &mut [f32]| {
        for (x, texel) in row.chunks_exact_mut(4).enumerate() {
            texel.copy_from_slice(&texel_at(y * polish.width + x).to_array());
        }
    };
    Raster::from_rows((polish.width, polish.height, 4), fill, &|rows| advance(rows, polish.height))
}

/// The highlight's peak over F0: 1/(4·α²), finite for a mirror too.
fn peak_of_reflectance(roughness: f32) -> f32 {
    1.0 / (4.0 * roughness.powi(4)).max(1e-6)
}
