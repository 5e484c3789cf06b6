//! Radiance of a sky by direction, in squares: the upper half for pictures, all of it blurred for what mirrors it.

use glam::{DVec2, DVec3};

/// A texel, linear RGB and 1: bits of half floats.
pub type SkyTexel = [u16; 4];

/// Texels along a side of the first level.
pub const SIDE: usize = 256;
/// Levels, each half as large; those of the sphere are blurred by roughness 0, ¼, ½, ¾ and 1.
pub const LEVELS: usize = 5;

/// Maps of a sky for renderers, rows from the top. Colours are divided by [`SkyMap::unit`].
#[derive(Clone, PartialEq, Debug, Default)]
pub struct SkyMap {
    /// Upper half: the hemisphere on an octahedron, seen from above (`hemisphere`); the border is the horizon.
    pub hemisphere: Vec<SkyTexel>,
    /// The whole sphere on an octahedron (`sphere`), level by level.
    pub sphere: [Vec<SkyTexel>; LEVELS],
    /// Radiance of a colour of 1: cd/m².
    pub unit: f64,
}

impl SkyMap {
    /// Texels along a side of the first level.
    pub const SIDE: usize = SIDE;
    /// Levels of the sphere.
    pub const LEVELS: usize = LEVELS;
}

/// Place of a texel's middle, −1 to 1 on both axes.
pub fn middle(index: usize, side: usize) -> DVec2 {
    let at = |i: usize| (2 * i + 1) as f64 / side as f64 - 1.0;
    DVec2::new(at(index % side), at(index / side))
}

/// Direction of a place in the square of the upper half: u = x + z, v = x − z on the octahedron |x| + |y| + |z| = 1
/// (Cigolle et al.: "A Survey of Efficient Representations for Independent Unit Vectors", JCGT 3(2), 2014).
pub fn hemisphere(at: DVec2) -> DVec3 {
    let (x, z) = (0.5 * (at.x + at.y), 0.5 * (at.x - at.y));
    DVec3::new(x, 1.0 - x.abs() - z.abs(), z).normalize()
}

/// Place of a direction of the upper half in its square.
pub fn in_hemisphere(direction: DVec3) -> DVec2 {
    let on = direction / (direction.x.abs() + direction.y.abs() + direction.z.abs());
    DVec2::new(on.x + on.z, on.x - on.z)
}

/// Direction of a place in the square of the sphere: x and z on the octahedron, the lower half folded outward.
pub fn sphere(at: DVec2) -> DVec3 {
    let y = 1.0 - at.x.abs() - at.y.abs();
    let folded =
        if y < 0.0 { DVec2::new((1.0 - at.y.abs()).copysign(at.x), (1.0 - at.x.abs()).copysign(at.y)) } else { at };
    DVec3::new(folded.x, y, folded.y).normalize()
}

/// Place of a direction in the square of the sphere.
pub fn in_sphere(direction: DVec3) -> DVec2 {
    let on = direction / (direction.x.abs() + direction.y.abs() + direction.z.abs());
    if on.y < 0.0 {
        DVec2::new((1.0 - on.z.abs()).copysign(on.x), (1.0 - on.x.abs()).copysign(on.z))
    } else {
        DVec2::new(on.x, on.z)
    }
}

/// Solid angle of a texel of the upper half, steradians: du dv / (2 |p|³) at p on the octahedron.
pub fn solid_angle(at: DVec2, side: usize) -> f64 {
    let (x, z) = (0.5 * (at.x + at.y), 0.5 * (at.x - at.y));
    let on = DVec3::new(x, 1.0 - x.abs() - z.abs(), z);
    let edge = 2.0 / side as f64;
    edge * edge / (2.0 * on.length().powi(3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn texels_cover_the_upper_half_once() {
        let sum: f64 = (0..64 * 64).map(|i| solid_angle(middle(i, 64), 64)).sum();
        // The middle of a texel stands for it: the error falls with the square of its size.
        assert!((sum - 2.0 * PI).abs() < 2e-3, "{sum}");
        let up: f64 = (0..64 * 64).map(|i| solid_angle(middle(i, 64), 64) * hemisphere(middle(i, 64)).y).sum();
        assert!((up - PI).abs() < 1e-3, "{up}");
    }

    #[test]
    fn a_direction_is_where_its_place_points() {
        for i in 0..32 * 32 {
            let at = middle(i, 32);
            assert!(in_sphere(sphere(at)).abs_diff_eq(at, 1e-12), "{at}");
            assert!(hemisphere(at).y > 0.0);
        }
        assert_eq!(hemisphere(DVec2::ZERO), DVec3::Y);
        assert_eq!(sphere(DVec2::new(1.0, 1.0)), DVec3::NEG_Y);
    }
}
