//! Lenses of cameras: how they are written, and what they become.

use serde::Deserialize;
use systems::draw::Intrinsics;
use systems::sensors;

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
