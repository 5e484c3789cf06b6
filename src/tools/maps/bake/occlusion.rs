//! Ambient occlusion: how much of the sky above a place is open, counted by rays.
//!
//! Light from a sky that is equally bright everywhere counts by the cosine to the normal. So the rays are spread with
//! that density, and the share that meets nothing is the answer (Malley's method). They lie on Vogel's spiral, each
//! turned by the golden angle and each for an equal share of the hemisphere's projected disc, which spreads any number
//! of them evenly; a hash of the texel turns the spiral and shifts it outward, so that neighbours err differently and
//! filtering the map averages their errors.

use super::Target;
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

/// Turns from one point of the spiral to the next: the golden ratio's.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// The rays of a texel.
pub struct Sky {
    /// Azimuths, unit.
    azimuths: Vec<Vec2>,
    distance: f32,
}

impl Sky {
    /// So many rays, each so far, metres.
    pub fn new(rays: usize, distance: f32) -> Self {
        let azimuth = |i: usize| Vec2::from_angle((i as f64 * GOLDEN).fract() as f32 * TAU);
        Self { azimuths: (0..rays.max(1)).map(azimuth).collect(), distance }
    }

    /// Number of rays.
    pub fn rays(&self) -> usize {
        self.azimuths.len()
    }

    /// Length of the rays, metres.
    pub fn distance(&self) -> f32 {
        self.distance
    }

    /// The open share of the sky at a place that lies just outside a surface with the unit normal.
    pub fn open_share(&self, target: &Target, at: Vec3, normal: Vec3, texel: (usize, usize)) -> f32 {
        self.open_share_by(normal, texel, |direction| !target.is_hit(at, direction, self.distance))
    }

    /// The share of directions that are open.
    pub fn open_share_by(&self, normal: Vec3, texel: (usize, usize), is_open: impl Fn(Vec3) -> bool) -> f32 {
        let (right, up) = normal.any_orthonormal_pair();
        let hash = hash(texel.0 as u32, texel.1 as u32);
        let unit = |bits: u32| (bits & 0xffff) as f32 / 65536.0;
        let (turn, shift) = (Vec2::from_angle(unit(hash) * TAU), unit(hash >> 16));
        let count = self.azimuths.len() as f32;
        let open = self.azimuths.iter().enumerate().filter(|&(i, &azimuth)| {
            let squared = (i as f32 + shift) / count;
            let on_disc = turn.rotate(azimuth) * squared.sqrt();
            is_open(right * on_disc.x + up * on_disc.y + normal * (1.0 - squared).max(0.0).sqrt())
        });
        open.count() as f32 / count
    }
}

/// Bits that look random (the mixing of MurmurHash3).
fn hash(x: u32, y: u32) -> u32 {
    let mut h = x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77).rotate_left(15);
    h = (h ^ h >> 16).wrapping_mul(0x85eb_ca6b);
    h = (h ^ h >> 13).wrapping_mul(0xc2b2_ae35);
    h ^ h >> 16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_unit_above_the_surface_and_spread_by_the_cosine() {
        let normal = Vec3::new(0.3, -0.8, 0.5).normalize();
        for rays in [1, 16, 37] {
            let sky = Sky::new(rays, 1.0);
            let sum = std::cell::Cell::new((Vec3::ZERO, 0));
            for texel in (0..64).flat_map(|y| (0..64).map(move |x| (x, y))) {
                sky.open_share_by(normal, texel, |direction| {
                    assert!(direction.is_normalized() && direction.dot(normal) >= -1e-6);
                    let (total, count) = sum.get();
                    sum.set((total + direction, count + 1));
                    true
                });
            }
            let (total, count) = sum.get();
            assert_eq!(count, rays * 64 * 64);
            // The mean of cos over a cosine-weighted hemisphere is 2/3, and nothing leans sideways. Directions by
            // chance would have a standard error of √(1 − 4/9) / √(64 · 64 · rays): 0.012 / √rays.
            let mean = total / count as f32;
            assert!(mean.distance(normal * (2.0 / 3.0)) < 0.02 / (rays as f32).sqrt(), "{rays} rays: {mean}");
        }
    }

    #[test]
    fn half_a_sky_is_half_open_and_more_rays_err_less() {
        let error = |rays: usize| {
            let sky = Sky::new(rays, 1.0);
            let shares = (0..1000).map(|x| sky.open_share_by(Vec3::Y, (x, 7), |d| d.x + 0.3 * d.z > 0.0));
            let squares: f32 = shares.map(|share| (share - 0.5).powi(2)).sum();
            (squares / 1000.0).sqrt()
        };
        // Evenly spread, only rays along the edge err: ½ · N^(−3/4), 0.063 for 16, 0.35 of that for 64 and 0.044 of it
        // for 1,024. By chance it would be ½ · N^(−1/2): 0.125, a half and an eighth.
        assert!(error(16) < 0.07 && error(64) < 0.5 * error(16) && error(1024) < 0.1 * error(16));
    }
}
