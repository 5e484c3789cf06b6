//! Lenses of cameras in scene files: how they are written, what is wrong with them, and what they become.

use super::check::{Check, SIZES};
use super::sensors::LARGEST_PICTURE;
use serde::Deserialize;
use systems::draw::Intrinsics;
use systems::sensors::{self, CameraSensor};

/// Of coefficients.
const LARGEST_COEFFICIENT: f64 = 1e6;

#[derive(Deserialize, Debug)]
#[serde(rename_all = "snake_case")]
pub enum Lens {
    FieldOfView(FieldOfView),
    Pinhole(Pinhole),
    BrownConrady(BrownConrady),
    KannalaBrandt(KannalaBrandt),
    Orthographic(Orthographic),
}

impl Default for Lens {
    fn default() -> Self {
        Self::FieldOfView(FieldOfView { x_degrees: None, y_degrees: Some(60.0) })
    }
}

/// One of the two.
#[derive(Deserialize, Debug, Default)]
#[serde(default, deny_unknown_fields)]
pub struct FieldOfView {
    pub x_degrees: Option<f32>,
    pub y_degrees: Option<f32>,
}

/// Pixels.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Pinhole {
    pub fx: f64,
    pub fy: f64,
    pub cx: f64,
    pub cy: f64,
}

/// Pixels, and OpenCV's coefficients.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct BrownConrady {
    pub fx: f64,
    pub fy: f64,
    pub cx: f64,
    pub cy: f64,
    #[serde(default)]
    pub k1: f64,
    #[serde(default)]
    pub k2: f64,
    #[serde(default)]
    pub p1: f64,
    #[serde(default)]
    pub p2: f64,
    #[serde(default)]
    pub k3: f64,
    #[serde(default)]
    pub k4: f64,
    #[serde(default)]
    pub k5: f64,
    #[serde(default)]
    pub k6: f64,
}

/// Pixels a radian near the axis, pixels, and OpenCV's coefficients.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct KannalaBrandt {
    pub fx: f64,
    pub fy: f64,
    pub cx: f64,
    pub cy: f64,
    #[serde(default)]
    pub k1: f64,
    #[serde(default)]
    pub k2: f64,
    #[serde(default)]
    pub k3: f64,
    #[serde(default)]
    pub k4: f64,
    #[serde(default = "right_angle")]
    pub largest_degrees: f64,
}

fn right_angle() -> f64 {
    90.0
}

#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Orthographic {
    pub half_height: f32,
}

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

/// A lens for pictures of a size, pixels.
pub fn lens(source: &Lens, size: (u32, u32)) -> sensors::Lens {
    match *source {
        Lens::FieldOfView(FieldOfView { x_degrees: Some(x), .. }) => {
            sensors::Lens::of_fov_x(f64::from(x).to_radians(), size)
        }
        Lens::FieldOfView(FieldOfView { y_degrees, .. }) => {
            sensors::Lens::FieldOfView { y: y_degrees.unwrap_or(60.0).to_radians() }
        }
        Lens::Pinhole(Pinhole { fx, fy, cx, cy }) => sensors::Lens::Pinhole(Intrinsics { fx, fy, cx, cy }),
        Lens::BrownConrady(BrownConrady { fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6 }) => {
            let intrinsics = Intrinsics { fx, fy, cx, cy };
            sensors::Lens::BrownConrady { intrinsics, coefficients: [k1, k2, p1, p2, k3, k4, k5, k6] }
        }
        Lens::KannalaBrandt(KannalaBrandt { fx, fy, cx, cy, k1, k2, k3, k4, largest_degrees }) => {
            let (intrinsics, coefficients) = (Intrinsics { fx, fy, cx, cy }, [k1, k2, k3, k4]);
            sensors::Lens::KannalaBrandt { intrinsics, coefficients, largest_angle: largest_degrees.to_radians() }
        }
        Lens::Orthographic(Orthographic { half_height }) => sensors::Lens::Orthographic { half_height },
    }
}
