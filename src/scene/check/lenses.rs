//! Lenses of cameras.

use super::walk::{Check, SIZES};
use crate::scene::format::lenses::{Lens, lens};
use systems::sensors::CameraSensor;

/// Pixels along a side.
pub const LARGEST_PICTURE: u32 = CameraSensor::LARGEST;
/// Largest distortion coefficient allowed.
const LARGEST_COEFFICIENT: f64 = 1e6;

impl Check<'_> {
    /// `size`: of the pictures, pixels.
    pub fn lens(&mut self, source: &Lens, size: [u32; 2]) {
        let faults = self.faults.len();
        match source {
            Lens::FieldOfView(lens) => match (lens.x_degrees, lens.y_degrees) {
                (Some(degrees), None) => self.number("x_degrees", degrees, 0.01, 179.0),
                (None, Some(degrees)) => self.number("y_degrees", degrees, 0.01, 179.0),
                _ => self.fault("expected one of x_degrees and y_degrees"),
            },
            Lens::Pinhole(lens) => self.intrinsics([lens.fx, lens.fy, lens.cx, lens.cy]),
            Lens::BrownConrady(lens) => {
                self.intrinsics([lens.fx, lens.fy, lens.cx, lens.cy]);
                self.coefficients(&[
                    ("k1", lens.k1),
                    ("k2", lens.k2),
                    ("p1", lens.p1),
                    ("p2", lens.p2),
                    ("k3", lens.k3),
                    ("k4", lens.k4),
                    ("k5", lens.k5),
                    ("k6", lens.k6),
                ]);
            }
            Lens::KannalaBrandt(lens) => {
                self.intrinsics([lens.fx, lens.fy, lens.cx, lens.cy]);
                self.coefficients(&[("k1", lens.k1), ("k2", lens.k2), ("k3", lens.k3), ("k4", lens.k4)]);
                self.number("largest_degrees", lens.largest_degrees as f32, 0.01, 180.0);
            }
            Lens::Orthographic(lens) => self.number("half_height", lens.half_height, SIZES.0, SIZES.1),
        }
        let is_drawn = size.iter().all(|side| (1..=LARGEST_PICTURE).contains(side));
        if self.faults.len() == faults && is_drawn {
            let camera = CameraSensor { lens: lens(source, size.into()), size: size.into(), ..CameraSensor::default() };
            if let Err(message) = camera.check_lens() {
                self.fault(message);
            }
        }
    }

    fn intrinsics(&mut self, [fx, fy, cx, cy]: [f64; 4]) {
        let far = 100.0 * f64::from(LARGEST_PICTURE);
        for (name, value, least) in [("fx", fx, 1e-3), ("fy", fy, 1e-3), ("cx", cx, -far), ("cy", cy, -far)] {
            if !(least..=far).contains(&value) {
                let message = format!("expected pixels from {least} to {far}, found {value}");
                self.field(name, |c| c.fault(message));
            }
        }
    }

    fn coefficients(&mut self, coefficients: &[(&'static str, f64)]) {
        for &(name, value) in coefficients {
            if !(-LARGEST_COEFFICIENT..=LARGEST_COEFFICIENT).contains(&value) {
                let message =
                    format!("expected a number from -{LARGEST_COEFFICIENT} to {LARGEST_COEFFICIENT}, found {value}");
                self.field(name, |c| c.fault(message));
            }
        }
    }
}
