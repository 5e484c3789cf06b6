//! Real spherical harmonics of the first three bands, for diffuse light.

use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// Coefficients of a function of direction, linear RGB: bands 0, 1 and 2 in the order (0,0), (1,−1), (1,0), (1,1),
/// (2,−2) … (2,2), with Y as the axis of order −1, Z of 0 and X of 1 (Ramamoorthi and Hanrahan: "An Efficient
/// Representation for Irradiance Environment Maps", SIGGRAPH 2001, equation 3).
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Harmonics(pub [DVec3; 9]);

/// The basis at a unit vector.
fn basis(direction: DVec3) -> [f64; 9] {
    let DVec3 { x, y, z } = direction;
    [
        0.282_094_791_773_878_14,
        0.488_602_511_902_919_9 * y,
        0.488_602_511_902_919_9 * z,
        0.488_602_511_902_919_9 * x,
        1.092_548_430_592_079_2 * x * y,
        1.092_548_430_592_079_2 * y * z,
        0.315_391_565_252_520_05 * (3.0 * z * z - 1.0),
        1.092_548_430_592_079_2 * x * z,
        0.546_274_215_296_039_6 * (x * x - y * y),
    ]
}

/// Factors of the bands in irradiance: A_l of the clamped cosine (the same, equation 8).
const IRRADIANCE: [f64; 3] = [PI, 2.0 * PI / 3.0, PI / 4.0];

/// Band of each coefficient.
const BAND: [usize; 9] = [0, 1, 1, 1, 2, 2, 2, 2, 2];

impl Harmonics {
    /// Adds a radiance that comes from a direction over a solid angle, steradians.
    pub fn add(&mut self, direction: DVec3, radiance: DVec3, solid_angle: f64) {
        for (own, basis) in self.0.iter_mut().zip(basis(direction)) {
            *own += radiance * (basis * solid_angle);
        }
    }

    /// Irradiance of a surface with that normal.
    pub fn irradiance(&self, normal: DVec3) -> DVec3 {
        let terms = self.0.iter().zip(basis(normal)).zip(BAND);
        terms.map(|((&own, basis), band)| own * (basis * IRRADIANCE[band])).sum()
    }

    /// Coefficients of a polynomial in the normal (1, y, z, x, xy, yz, 3z² − 1, xz, x² − y²), whose value is the
    /// irradiance times a factor: what shaders evaluate.
    pub fn polynomial(&self, factor: f64) -> [Vec3; 9] {
        let constants = basis(DVec3::ONE);
        let constant = |i: usize| match i {
            6 => constants[6] / 2.0,
            8 => 0.546_274_215_296_039_6,
            _ => constants[i],
        };
        std::array::from_fn(|i| (self.0[i] * (constant(i) * IRRADIANCE[BAND[i]] * factor)).as_vec3())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions of equal solid angles, by the golden angle.
    fn sphere(count: u32) -> impl Iterator<Item = DVec3> {
        (0..count).map(move |i| {
            let y = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
            let (sin, cos) = (2.399_963_229_728_653 * f64::from(i)).sin_cos();
            DVec3::new((1.0 - y * y).sqrt() * cos, y, (1.0 - y * y).sqrt() * sin)
        })
    }

    fn project(radiance: impl Fn(DVec3) -> DVec3) -> Harmonics {
        let (mut own, count) = (Harmonics::default(), 20_000);
        sphere(count).for_each(|at| own.add(at, radiance(at), 4.0 * PI / f64::from(count)));
        own
    }

    /// Functions that the three bands hold exactly; irradiance by hand. The sum over 20,000 directions is exact to some
    /// 1 / 20,000.
    #[test]
    fn irradiance_of_known_functions() {
        let even = project(|_| DVec3::new(1.0, 2.0, 3.0));
        let linear = project(|at| DVec3::splat(1.0 + at.y));
        let square = project(|at| DVec3::splat(at.x * at.x));
        for normal in sphere(50) {
            assert!(even.irradiance(normal).abs_diff_eq(DVec3::new(1.0, 2.0, 3.0) * PI, 1e-3));
            let expected = PI + 2.0 * PI / 3.0 * normal.y;
            assert!((linear.irradiance(normal).x - expected).abs() < 1e-3, "{normal}");
            // ⅓ of band 0 and the rest of band 2.
            let expected = PI / 3.0 + PI / 4.0 * (normal.x * normal.x - 1.0 / 3.0);
            assert!((square.irradiance(normal).x - expected).abs() < 1e-3, "{normal}");
        }
    }

    #[test]
    fn the_polynomial_is_the_irradiance() {
        let own = project(|at| DVec3::new((3.0 * at.x).exp(), at.y.abs(), (at.z - at.x).powi(2)));
        let polynomial = own.polynomial(0.5);
        for normal in sphere(50) {
            let Vec3 { x, y, z } = normal.as_vec3();
            let terms = [1.0, y, z, x, x * y, y * z, 3.0 * z * z - 1.0, x * z, x * x - y * y];
            let sum: Vec3 = polynomial.iter().zip(terms).map(|(&own, term)| own * term).sum();
            let expected = (own.irradiance(normal) * 0.5).as_vec3();
            assert!(sum.abs_diff_eq(expected, 1e-5 * expected.length()), "{sum} for {expected}");
        }
    }
}
