//! Blurred skies: what surfaces of some roughness mirror.

use super::sky_map::{LEVELS, SIDE, in_sphere, middle, sphere};
use crate::ecs::parallel::map_in_parallel;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// Directions that a texel of a blurred level is made of.
const SAMPLES: u32 = 64;

/// A square of radiances on the octahedron.
struct Level {
    side: usize,
    texels: Vec<DVec3>,
}

impl Level {
    /// Half as large: a texel of four.
    fn half(&self) -> Self {
        let side = self.side / 2;
        let at = |x: usize, y: usize| self.texels[y * self.side + x];
        let four = |i: usize| {
            let (x, y) = (2 * (i % side), 2 * (i / side));
            0.25 * (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1))
        };
        Self { side, texels: (0..side * side).map(four).collect() }
    }

    /// Linear between four texels; those at the border go on.
    fn sample(&self, place: DVec2) -> DVec3 {
        let most = (self.side - 1) as f64;
        let at = ((place + 1.0) * (0.5 * self.side as f64) - 0.5).clamp(DVec2::ZERO, DVec2::splat(most));
        let (x, y) = (at.x as usize, at.y as usize);
        let (right, down) = ((x + 1).min(self.side - 1), (y + 1).min(self.side - 1));
        let texel = |x: usize, y: usize| self.texels[y * self.side + x];
        let (dx, dy) = (at.x - x as f64, at.y - y as f64);
        let above = texel(x, y).lerp(texel(right, y), dx);
        above.lerp(texel(x, down).lerp(texel(right, down), dx), dy)
    }
}

/// Levels of the sphere: the radiance itself, then blurred by roughness ¼, ½, ¾ and 1.
pub(super) fn levels(radiance: impl Fn(DVec3) -> DVec3 + Sync) -> [Vec<DVec3>; LEVELS] {
    let rows = |side: usize, texel: &(dyn Fn(DVec3) -> DVec3 + Sync)| {
        let row = |y: usize| (0..side).map(|x| texel(sphere(middle(y * side + x, side)))).collect::<Vec<_>>();
        map_in_parallel((0..side).collect::<Vec<_>>().into_iter(), row).concat()
    };
    let mut sources = vec![Level { side: SIDE, texels: rows(SIDE, &radiance) }];
    while let Some(half) = sources.last().filter(|last| last.side > 2).map(Level::half) {
        sources.push(half);
    }
    let blurred = |level: usize| {
        let lobe = Lobe::new(level as f64 / (LEVELS - 1) as f64);
        rows(SIDE >> level, &|normal| lobe.mirrored(&sources, normal))
    };
    let mut levels: [Vec<DVec3>; LEVELS] =
        std::array::from_fn(|level| if level == 0 { Vec::new() } else { blurred(level) });
    levels[0] = std::mem::take(&mut sources[0].texels);
    levels
}

/// Directions around a normal that a surface of some roughness mirrors toward it (Karis: "Real Shading in Unreal
/// Engine 4", SIGGRAPH 2013 course; the distribution of glTF 2.0, appendix B.3.2), with normal and eye in one.
struct Lobe {
    /// Direction with the normal as Y, weight, and the source's level by solid angle (Křivánek and Colbert:
    /// "Real-time Shading with Filtered Importance Sampling", 2008, equation 12).
    samples: Vec<(DVec3, f64, usize)>,
}

impl Lobe {
    fn new(roughness: f64) -> Self {
        let alpha_squared = roughness.powi(4);
        let texel = 4.0 * PI / (SIDE * SIDE) as f64;
        let sample = |i: u32| {
            let u = (f64::from(i) + 0.5) / f64::from(SAMPLES);
            let cos_squared = (1.0 - u) / (1.0 + (alpha_squared - 1.0) * u);
            let (sin, cos) = (2.399_963_229_728_653 * f64::from(i)).sin_cos();
            let (up, flat) = (cos_squared.sqrt(), (1.0 - cos_squared).sqrt());
            let half = DVec3::new(flat * cos, up, flat * sin);
            let direction = 2.0 * up * half - DVec3::Y;
            let falloff = cos_squared * (alpha_squared - 1.0) + 1.0;
            let density = alpha_squared / (PI * falloff * falloff) / 4.0;
            let level = 0.5 * (1.0 / (f64::from(SAMPLES) * density) / texel).log2();
            (direction, direction.y, level.round().max(0.0) as usize)
        };
        Self { samples: (0..SAMPLES).map(sample).filter(|(_, weight, _)| *weight > 0.0).collect() }
    }

    fn mirrored(&self, sources: &[Level], normal: DVec3) -> DVec3 {
        let (x, z) = normal.any_orthonormal_pair();
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        for &(direction, weight, level) in &self.samples {
            let world = x * direction.x + normal * direction.y + z * direction.z;
            sum += sources[level.min(sources.len() - 1)].sample(in_sphere(world)) * weight;
            weights += weight;
        }
        sum / weights
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ecs::parallel::set_threads;

    #[test]
    fn an_even_sky_stays_even_and_a_half_one_is_half_at_the_horizon() {
        set_threads(None);
        let even = levels(|_| DVec3::new(1.0, 2.0, 3.0));
        assert!(even.iter().flatten().all(|texel| texel.abs_diff_eq(DVec3::new(1.0, 2.0, 3.0), 1e-9)));
        let half = levels(|at| DVec3::splat(f64::from(u8::from(at.y > 0.0))));
        for (level, texels) in half.iter().enumerate() {
            let side = SIDE >> level;
            for (i, texel) in texels.iter().enumerate() {
                let y = sphere(middle(i, side)).y;
                // By symmetry; and nothing of the other half where the lobe, as wide as a half sphere, does not reach.
                if level > 0 && y.abs() < 1e-6 {
                    assert!((texel.x - 0.5).abs() < 0.1, "level {level}: {texel}");
                }
                assert!(y <= 0.999 || texel.x > 0.95, "level {level} at the zenith: {texel}");
                assert!(y >= -0.999 || texel.x < 0.05, "level {level} at the nadir: {texel}");
            }
        }
    }
}
