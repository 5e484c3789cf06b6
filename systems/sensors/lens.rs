//! Projections of lenses: from a point in camera axes to its pixel, and back.
//!
//! Camera axes are X right, Y down, Z forward, in metres. Pixel (u, v) has its centre at integers ([`Intrinsics`]).
//! Lenses that bend are those of OpenCV ("Camera Calibration and 3D Reconstruction", and its part on fisheye cameras).
//!
//! ```text
//! Brown and Conrady, x = X/Z, y = Y/Z, r² = x² + y²:
//!     q = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)
//!     x' = q x + 2 p1 x y + p2 (r² + 2 x²)      u = fx x' + cx
//!     y' = q y + p1 (r² + 2 y²) + 2 p2 x y      v = fy y' + cy
//! Kannala and Brandt, θ = atan2(√(X² + Y²), Z):
//!     r = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸)
//!     (u, v) = (fx r X/√(X² + Y²) + cx, fy r Y/√(X² + Y²) + cy)
//! ```
//!
//! Such polynomials fold where they stop to grow: what is farther out would be seen a second time. A lens sees what its
//! way out from the axis does not fold before, looked at in [`PLACES`].

use super::components::{CameraSensor, Lens};
use crate::describe::check::{Described, check};
use crate::describe::fault::{Fault, Trail};
use crate::draw::intrinsics::Intrinsics;
use glam::{DMat2, DVec2, DVec3, dvec2};

/// On the way out from the axis, where is looked for folds.
const PLACES: u32 = 16;

/// Limit of Newton's method, and of the halvings of one of its steps.
const MOST_STEPS: u32 = 64;

/// Relative to 1 and the result: a last step of Newton's method is at most so long.
const CLOSE: f64 = 1e-12;

/// Radius up to which is looked for folds, at a distance of 1.
const FARTHEST_FOLD: f64 = 1e9;

/// Image of a point under a map of the plane, with its derivatives; `None` where it has no value.
type Image = Option<(DVec2, DMat2)>;

impl Described for Lens {}

impl Lens {
    /// Tells if straight lines become curves, so that no rasterizer draws its picture as it is.
    pub fn has_distortion(&self) -> bool {
        matches!(self, Self::BrownConrady { .. } | Self::KannalaBrandt { .. })
    }
}

impl CameraSensor {
    /// The pixel (u, v) of a point in camera axes, which may lie outside of the picture; `None` where the lens does not
    /// see: behind it, beyond its largest angle, or beyond where it folds.
    pub fn project(&self, camera: DVec3) -> Option<DVec2> {
        let plane = || (camera.z > 0.0).then(|| camera.truncate() / camera.z);
        match &self.lens {
            Lens::Orthographic { half_height } => {
                let [scale, middle] = self.parallel(*half_height);
                Some(camera.truncate() * scale + middle)
            }
            Lens::FieldOfView { .. } | Lens::FieldOfViewX { .. } | Lens::Pinhole(_) => {
                pixel(&self.intrinsics()?, plane()?)
            }
            Lens::BrownConrady { intrinsics, coefficients } => {
                let map = |point| brown_conrady(coefficients, point);
                let point = plane()?;
                pixel(intrinsics, map(point).filter(|_| is_plain(map, point))?.0)
            }
            Lens::KannalaBrandt { intrinsics, coefficients, largest_angle } => {
                let aside = camera.truncate();
                let angle = aside.length().atan2(camera.z);
                let map = |point| kannala_brandt(coefficients, point);
                let point = dvec2(angle, 0.0);
                let is_seen = camera != DVec3::ZERO && angle <= *largest_angle && is_plain(map, point);
                let radius = map(point).filter(|_| is_seen)?.0.x;
                pixel(intrinsics, aside.normalize_or_zero() * radius)
            }
        }
    }

    /// The direction of a pixel in camera axes; `None` where the lens does not see. 1 along the axis for lenses that
    /// see less than a half space, of unit length for those of Kannala and Brandt; along the axis where the projection
    /// is parallel.
    pub fn direction(&self, u: f64, v: f64) -> Option<DVec3> {
        match &self.lens {
            Lens::Orthographic { .. } => Some(DVec3::Z),
            Lens::FieldOfView { .. } | Lens::FieldOfViewX { .. } | Lens::Pinhole(_) => {
                Some(self.intrinsics()?.direction(u, v))
            }
            Lens::BrownConrady { intrinsics, coefficients } => {
                let image = intrinsics.direction(u, v).truncate();
                Some(inverse(|point| brown_conrady(coefficients, point), image)?.extend(1.0))
            }
            Lens::KannalaBrandt { intrinsics, coefficients, largest_angle } => {
                let image = intrinsics.direction(u, v).truncate();
                let angle = inverse(|point| kannala_brandt(coefficients, point), dvec2(image.length(), 0.0))?.x;
                let (sin, cos) = angle.sin_cos();
                (angle <= *largest_angle).then(|| (image.normalize_or_zero() * sin).extend(cos))
            }
        }
    }

    /// The point in camera axes that a pixel shows, `range` metres from the optical centre; where the projection is
    /// parallel, as far along the axis. `None` where the lens does not see.
    pub fn unproject(&self, u: f64, v: f64, range: f64) -> Option<DVec3> {
        if let Lens::Orthographic { half_height } = &self.lens {
            let [scale, middle] = self.parallel(*half_height);
            return Some(((dvec2(u, v) - middle) / scale).extend(range));
        }
        Some(self.direction(u, v)?.normalize() * range)
    }

    /// Checks that its lens has numbers that make sense, and does not fold within the picture.
    ///
    /// # Errors
    /// The expectation that failed, or the place of the fold.
    pub fn check_lens(&self) -> Result<(), Fault> {
        check(&self.lens)?;
        let limit = match self.lens {
            Lens::KannalaBrandt { largest_angle, .. } => largest_angle,
            _ => f64::INFINITY,
        };
        if !self.lens.has_distortion() {
            return Ok(());
        }
        // What sees the border sees what is within it.
        let [right, bottom] = [self.size.0, self.size.1].map(|side| side.clamp(1, Self::LARGEST) - 1);
        let across = (0..=right).flat_map(|u| [(u, 0), (u, bottom)]);
        let down = (0..=bottom).flat_map(|v| [(0, v), (right, v)]);
        match across.chain(down).find_map(|(u, v)| self.fold_before(u.into(), v.into(), limit)) {
            Some(fold) => Err(Trail::default().fault(fold)),
            None => Ok(()),
        }
    }

    /// Reason for which a lens that bends does not see a pixel, other than its largest angle.
    fn fold_before(&self, u: f64, v: f64, limit: f64) -> Option<String> {
        if self.direction(u, v).is_some() {
            return None;
        }
        let intrinsics = self.intrinsics()?;
        let image = intrinsics.direction(u, v).truncate();
        let along = image.normalize_or(DVec2::X);
        let (fold, at) = match &self.lens {
            Lens::KannalaBrandt { coefficients, .. } => {
                let (angle, at) = fold(|point| kannala_brandt(coefficients, point), DVec2::X, limit)?;
                (format!("an angle of {:.4} degrees", angle.to_degrees()), along * at.x)
            }
            Lens::BrownConrady { coefficients, .. } => {
                let found = fold(|point| brown_conrady(coefficients, point), along, f64::INFINITY);
                let Some((radius, at)) = found else {
                    return Some(format!("sees nothing at pixel ({u}, {v}), within the picture"));
                };
                (format!("a radius of {radius:.4} times the distance"), at)
            }
            _ => return None,
        };
        let pixels = (at * dvec2(intrinsics.fx, intrinsics.fy)).length();
        Some(format!("folds at {fold}, {pixels:.1} pixels from the principal point, within the picture"))
    }

    /// Scale of a parallel projection, pixels a metre, and the pixel of its axis.
    fn parallel(&self, half_height: f32) -> [DVec2; 2] {
        let size = dvec2(self.size.0.into(), self.size.1.into());
        [DVec2::splat(size.y / (2.0 * f64::from(half_height))), (size - 1.0) / 2.0]
    }
}

fn pixel(intrinsics: &Intrinsics, image: DVec2) -> Option<DVec2> {
    Some(image * dvec2(intrinsics.fx, intrinsics.fy) + dvec2(intrinsics.cx, intrinsics.cy))
}

/// Maps a point of the plane at a distance of 1. `None` beyond where the denominator is 0.
fn brown_conrady(&[k1, k2, p1, p2, k3, k4, k5, k6]: &[f64; 8], point: DVec2) -> Image {
    let (x, y, s) = (point.x, point.y, point.length_squared());
    let above = 1.0 + s * (k1 + s * (k2 + s * k3));
    let below = 1.0 + s * (k4 + s * (k5 + s * k6));
    let q = above / below;
    // By r².
    let above_grows = k1 + s * (2.0 * k2 + s * 3.0 * k3);
    let below_grows = k4 + s * (2.0 * k5 + s * 3.0 * k6);
    let q_grows = (above_grows - q * below_grows) / below;
    let image = point * q + dvec2(2.0 * p1 * x * y + p2 * (s + 2.0 * x * x), p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y);
    let aside = 2.0 * (x * y * q_grows + p1 * x + p2 * y);
    let by_x = dvec2(q + 2.0 * x * x * q_grows + 2.0 * p1 * y + 6.0 * p2 * x, aside);
    let by_y = dvec2(aside, q + 2.0 * y * y * q_grows + 6.0 * p1 * y + 2.0 * p2 * x);
    (below > 0.0).then(|| (image, DMat2::from_cols(by_x, by_y)))
}

/// Maps an angle from the axis, which is x, to a radius; y stays.
fn kannala_brandt(&[k1, k2, k3, k4]: &[f64; 4], point: DVec2) -> Image {
    let angle = point.x;
    let s = angle * angle;
    let radius = angle * (1.0 + s * (k1 + s * (k2 + s * (k3 + s * k4))));
    let grows = 1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * (7.0 * k3 + s * 9.0 * k4)));
    Some((dvec2(radius, point.y), DMat2::from_diagonal(dvec2(grows, 1.0))))
}

/// Tells if the map grows there in every direction: its derivatives, which are symmetric, are positive definite. A map
/// that does so all over a convex region puts no two of its points into one place.
fn is_upright(image: &Image) -> bool {
    image.is_some_and(|(_, grows)| grows.determinant() > 0.0 && grows.x_axis.x + grows.y_axis.y > 0.0)
}

/// Tells if the map does not fold from the middle to a point.
fn is_plain(map: impl Fn(DVec2) -> Image, point: DVec2) -> bool {
    (1..=PLACES).all(|place| is_upright(&map(point * (f64::from(place) / f64::from(PLACES)))))
}

/// Finds the point that a map puts there, by Newton's method from the middle on. It finds points before a fold alone.
/// Steps are halved until they lead nearer, and not over a fold.
fn inverse(map: impl Fn(DVec2) -> Image, image: DVec2) -> Option<DVec2> {
    let mut point = DVec2::ZERO;
    let (mut at, mut grows) = map(point)?;
    for _ in 0..MOST_STEPS {
        let off = image - at;
        let step = grows.inverse() * off;
        if step.length() <= CLOSE * (1.0 + point.length()) {
            point += step;
            return is_plain(map, point).then_some(point);
        }
        let shorter = (0..MOST_STEPS).map(|halvings| point + step * 0.5_f64.powi(halvings as i32));
        let is_nearer = |found: &Image| found.is_some_and(|(at, _)| (image - at).length() < off.length());
        let mut tried = shorter.map(|point| (point, map(point)));
        let (next, found) = tried.find(|(_, found)| is_upright(found) && is_nearer(found))?;
        (at, grows) = found?;
        point = next;
    }
    None
}

/// Radius of a map's first fold in a direction, and the fold's image; at most a limit.
fn fold(map: impl Fn(DVec2) -> Image, along: DVec2, limit: f64) -> Option<(f64, DVec2)> {
    let is_upright_at = |radius: f64| is_upright(&map(along * radius));
    let radii = std::iter::successors(Some(1e-3), |radius| Some(radius * 1.005));
    let mut beyond =
        radii.take_while(|&radius| radius < FARTHEST_FOLD.min(1.01 * limit)).find(|&radius| !is_upright_at(radius))?;
    let mut before = beyond / 1.005;
    for _ in 0..MOST_STEPS {
        let middle = (before + beyond) / 2.0;
        *(if is_upright_at(middle) { &mut before } else { &mut beyond }) = middle;
    }
    (before < limit).then(|| Some((before, map(along * before)?.0)))?
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const INTRINSICS: Intrinsics = Intrinsics { fx: 300.0, fy: 310.0, cx: 315.0, cy: 244.5 };

    fn camera(lens: Lens) -> CameraSensor {
        CameraSensor { lens, ..CameraSensor::default() }
    }

    fn bent(coefficients: [f64; 8]) -> CameraSensor {
        camera(Lens::BrownConrady { intrinsics: INTRINSICS, coefficients })
    }

    fn fisheye(coefficients: [f64; 4], degrees: f64) -> CameraSensor {
        let intrinsics = Intrinsics { fx: 200.0, fy: 205.0, ..INTRINSICS };
        camera(Lens::KannalaBrandt { intrinsics, coefficients, largest_angle: degrees.to_radians() })
    }

    #[test]
    fn points_are_where_the_formulas_put_them() {
        let point = DVec3::new(0.5, -0.25, 1.0);
        let at = |camera: CameraSensor| camera.project(point * 3.0).expect("seen");
        let plain = INTRINSICS.matrix() * point;
        assert!(at(bent([0.0; 8])).abs_diff_eq(plain.truncate(), 1e-12));
        // r² = 0.3125: q = (1 + 0.1 · 0.3125)/(1 + 0.2 · 0.3125), and tangents by hand.
        let q = 1.03125 / 1.0625;
        let x = 0.5 * q + 2.0 * 0.01 * -0.125 + 0.02 * (0.3125 + 0.5);
        let y = -0.25 * q + 0.01 * (0.3125 + 0.125) + 2.0 * 0.02 * -0.125;
        let expected = dvec2(300.0 * x + 315.0, 310.0 * y + 244.5);
        assert!(at(bent([0.1, 0.0, 0.01, 0.02, 0.0, 0.2, 0.0, 0.0])).abs_diff_eq(expected, 1e-12));
        // Angles of a fisheye are radii: straight ahead, aside, and behind.
        let fisheye = fisheye([0.0; 4], 120.0);
        let right = |degrees: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            fisheye.project(DVec3::new(sin, 0.0, cos) * 2.0).map(|pixel| pixel.x)
        };
        for degrees in [0.0, 30.0, 90.0, 119.0] {
            assert!((right(degrees).expect("seen") - (315.0 + 200.0 * degrees.to_radians())).abs() < 1e-9);
        }
        assert_eq!(right(121.0), None);
        let parallel = camera(Lens::Orthographic { half_height: 2.4 });
        assert!(parallel.project(DVec3::new(1.0, -0.5, -7.0)).expect("seen").abs_diff_eq(dvec2(419.5, 189.5), 1e-4));
        assert_eq!(bent([0.0; 8]).project(-DVec3::Z), None);
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn a_direction_is_that_of_its_pixel(
            k in prop::array::uniform8(-0.05..0.05f64),
            own in prop::array::uniform4(-0.01..0.01f64),
            (u, v) in (0.0..640.0, 0.0..480.0),
        ) {
            for camera in [bent(k), fisheye(own, 150.0), camera(Lens::Pinhole(INTRINSICS))] {
                if camera.check_lens().is_ok()
                    && let Some(direction) = camera.direction(u, v)
                {
                    // Newton's last step, times a slope of a few and the focal length.
                    let found = camera.project(direction * 4.0).expect("what has a direction is seen");
                    prop_assert!(found.abs_diff_eq(dvec2(u, v), 1e-9), "{found} for {u} {v}");
                    let is_unit = matches!(camera.lens, Lens::KannalaBrandt { .. });
                    let length = if is_unit { direction.length() } else { direction.z };
                    prop_assert!((length - 1.0).abs() < 1e-12);
                }
            }
        }
    }

    /// 1 + 3 k1 r² = 0 where k1 alone bends; 1 + 3 k1 θ² = 0 of a fisheye; 1 + k4 r² = 0 of a denominator.
    #[test]
    fn a_lens_that_folds_within_the_picture_says_where() {
        let refusal = |camera: CameraSensor| camera.check_lens().unwrap_err().to_string();
        let k1 = |k1| bent([k1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        for (k, radius) in [(-0.3, 1.0541), (-1.0, 0.5774)] {
            let said = refusal(k1(k));
            assert!(said.starts_with(&format!("folds at a radius of {radius} times the distance")), "{said}");
        }
        // r + k1 r³ is two thirds of r where it folds, which is to be as far as the farthest corner.
        let corner = dvec2(324.0 / 300.0, 244.5 / 310.0).length();
        let enough = -(2.0 / 3.0 / corner).powi(2) / 3.0;
        assert!(k1(enough * 0.999).check_lens().is_ok() && k1(enough * 1.001).check_lens().is_err());
        let said = refusal(fisheye([-0.2, 0.0, 0.0, 0.0], 100.0));
        let angle = (1.0_f64 / 0.6).sqrt();
        assert!(said.starts_with(&format!("folds at an angle of {:.4} degrees", angle.to_degrees())), "{said}");
        // Along the diagonal to the first pixel.
        let pixels = dvec2(315.0, 244.5 / 205.0 * 200.0).normalize() * angle * 2.0 / 3.0 * dvec2(200.0, 205.0);
        assert!(said.contains(&format!(", {:.1} pixels from the principal point", pixels.length())), "{said}");
        // What it need not see may fold.
        assert!(fisheye([-0.2, 0.0, 0.0, 0.0], 70.0).check_lens().is_ok());
        let said = refusal(bent([f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
        assert!(said.contains("found NaN"), "{said}");
        assert!(refusal(fisheye([0.0; 4], 181.0)).contains("largest_degrees: expected a number from 0.01 to 180"));
    }

    #[test]
    fn what_lies_beyond_a_fold_is_not_seen_a_second_time() {
        let lens = bent([-0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert!(lens.project(DVec3::new(1.05, 0.0, 1.0)).is_some());
        assert_eq!(lens.project(DVec3::new(1.06, 0.0, 1.0)), None);
        assert_eq!([50.0, 5000.0].map(|x| lens.project(DVec3::new(x, 0.0, 1.0))), [None; 2]);
        // 1 + k5 r⁴ is 0 at 0.84: before, the whole plane is seen.
        let rational = bent([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -2.0, 0.0]);
        assert!(rational.check_lens().is_ok() && rational.project(DVec3::new(0.84, 0.0, 1.0)).is_some());
        assert_eq!(rational.project(DVec3::new(0.9, 0.0, 1.0)), None);
        let fisheye = fisheye([-0.2, 0.0, 0.0, 0.0], 180.0);
        assert_eq!(fisheye.project(DVec3::new(0.0, 1.0, -0.5)), None);
    }
}
