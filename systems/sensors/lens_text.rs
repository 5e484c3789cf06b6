//! Lenses as people write them: angles in degrees, coefficients by their names in OpenCV. Formats for programs have
//! [`Lens`] as it is.

use super::components::Lens;
use crate::describe::angle::degrees;
use crate::draw::intrinsics::Intrinsics;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::ser::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;

/// Projection of a camera.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum LensText {
    FieldOfView(FieldOfView),
    Pinhole(Intrinsics),
    BrownConrady(BrownConrady),
    KannalaBrandt(KannalaBrandt),
    Orthographic(Orthographic),
}

/// Perspective with square pixels and the principal point in the middle, by one of the two angles.
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(default, deny_unknown_fields)]
struct FieldOfView {
    /// Horizontal field of view; either this or the other.
    #[schemars(range(min = 0.01, max = 179.0), extend("unit" = "°"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    x_degrees: Option<f32>,
    /// Vertical field of view.
    #[schemars(range(min = 0.01, max = 179.0), extend("unit" = "°"))]
    #[serde(skip_serializing_if = "Option::is_none")]
    y_degrees: Option<f32>,
}

/// Perspective distorted by the model of Brown and Conrady, with OpenCV's coefficients.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct BrownConrady {
    /// Horizontal focal length.
    #[schemars(range(min = 1e-3, max = Intrinsics::MOST_PIXELS), extend("unit" = "px"))]
    fx: f64,
    /// Vertical focal length.
    #[schemars(range(min = 1e-3, max = Intrinsics::MOST_PIXELS), extend("unit" = "px"))]
    fy: f64,
    /// Horizontal position of the principal point, from the centre of the first pixel.
    #[schemars(range(min = -Intrinsics::MOST_PIXELS, max = Intrinsics::MOST_PIXELS), extend("unit" = "px"))]
    cx: f64,
    /// Vertical position of the principal point.
    #[schemars(range(min = -Intrinsics::MOST_PIXELS, max = Intrinsics::MOST_PIXELS), extend("unit" = "px"))]
    cy: f64,
    /// Radial coefficient, of r².
    #[serde(default)]
    #[schemars(range(min = -1e6, max = 1e6))]
    k1: f64,
    /// Radial coefficient, of r⁴.
    #[serde(default)]
    #[schemars(range(min = -1e6, max = 1e6))]
    k2: f64,
    /// Tangential coefficient.
    #[serde(default)]
    #[schemars(range(min = -1e6, max = 1e6))]
    p1: f64,
    /// Tangential coefficient.
    #[serde(default)]
    #[schemars(range(min = -1e6, max = 1e6))]
    p2: f64,
    /// Radial coefficient, of r⁶.
    #[serde(default)]
    #[schemars(range(min = -1e6, max = 1e6))]
    k3: f64,
    /// Coefficient of the denominator, of r².
    #[serde(default)]
    #[schemars(range(min = -1e6, max = 1e6))]
    k4: f64,
    /// Coefficient of the denominator, of r⁴.
    #[serde(default)]
    #[schemars(range(min = -1e6, max = 1e6))]
    k5: f64,
    /// Coefficient of the denominator, of r⁶.
    #[serde(default)]
    #[schemars(range(min = -1e6, max = 1e6))]
    k6: f64,
}

/// A fisheye of Kannala and Brandt, with OpenCV's coefficients.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct KannalaBrandt {
    /// Horizontal focal length, pixels a radian near the axis.
    #[schemars(range(min = 1e-3, max = Intrinsics::MOST_PIXELS), extend("unit" = "px"))]
    fx: f64,
    /// Vertical focal length, pixels a radian near the axis.
    #[schemars(range(min = 1e-3, max = Intrinsics::MOST_PIXELS), extend("unit" = "px"))]
    fy: f64,
    /// Horizontal position of the principal point, from the centre of the first pixel.
    #[schemars(range(min = -Intrinsics::MOST_PIXELS, max = Intrinsics::MOST_PIXELS), extend("unit" = "px"))]
    cx: f64,
    /// Vertical position of the principal point.
    #[schemars(range(min = -Intrinsics::MOST_PIXELS, max = Intrinsics::MOST_PIXELS), extend("unit" = "px"))]
    cy: f64,
    /// Coefficient of θ³.
    #[serde(default)]
    #[schemars(range(min = -1e6, max = 1e6))]
    k1: f64,
    /// Coefficient of θ⁵.
    #[serde(default)]
    #[schemars(range(min = -1e6, max = 1e6))]
    k2: f64,
    /// Coefficient of θ⁷.
    #[serde(default)]
    #[schemars(range(min = -1e6, max = 1e6))]
    k3: f64,
    /// Coefficient of θ⁹.
    #[serde(default)]
    #[schemars(range(min = -1e6, max = 1e6))]
    k4: f64,
    /// Largest angle from the axis: beyond, the lens sees nothing.
    #[serde(default = "right_angle")]
    #[schemars(range(min = 0.01, max = 180.0), extend("unit" = "°"))]
    largest_degrees: f64,
}

fn right_angle() -> f64 {
    90.0
}

/// Parallel projection.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Orthographic {
    /// Half the height of the visible box.
    #[schemars(range(min = 1e-5, max = 1e6), extend("unit" = "m"))]
    half_height: f32,
}

impl From<LensText> for Lens {
    fn from(text: LensText) -> Self {
        match text {
            LensText::FieldOfView(angles) => match (angles.x_degrees, angles.y_degrees) {
                (Some(x), None) => Self::FieldOfViewX { x: f64::from(x).to_radians() },
                (None, Some(y)) => Self::FieldOfView { y: y.to_radians() },
                // Kept, so that a check reports it beside everything else.
                _ => Self::FieldOfView { y: f32::NAN },
            },
            LensText::Pinhole(intrinsics) => Self::Pinhole(intrinsics),
            LensText::BrownConrady(BrownConrady { fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6 }) => {
                let coefficients = [k1, k2, p1, p2, k3, k4, k5, k6];
                Self::BrownConrady { intrinsics: Intrinsics { fx, fy, cx, cy }, coefficients }
            }
            LensText::KannalaBrandt(KannalaBrandt { fx, fy, cx, cy, k1, k2, k3, k4, largest_degrees }) => {
                let (intrinsics, largest_angle) = (Intrinsics { fx, fy, cx, cy }, largest_degrees.to_radians());
                Self::KannalaBrandt { intrinsics, coefficients: [k1, k2, k3, k4], largest_angle }
            }
            LensText::Orthographic(Orthographic { half_height }) => Self::Orthographic { half_height },
        }
    }
}

impl From<Lens> for LensText {
    fn from(lens: Lens) -> Self {
        match lens {
            Lens::FieldOfView { y } => Self::FieldOfView(FieldOfView { x_degrees: None, y_degrees: Some(degrees(y)) }),
            Lens::FieldOfViewX { x } => {
                Self::FieldOfView(FieldOfView { x_degrees: Some(x.to_degrees() as f32), y_degrees: None })
            }
            Lens::Pinhole(intrinsics) => Self::Pinhole(intrinsics),
            Lens::BrownConrady { intrinsics, coefficients: [k1, k2, p1, p2, k3, k4, k5, k6] } => {
                let Intrinsics { fx, fy, cx, cy } = intrinsics;
                Self::BrownConrady(BrownConrady { fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6 })
            }
            Lens::KannalaBrandt { intrinsics, coefficients: [k1, k2, k3, k4], largest_angle } => {
                let Intrinsics { fx, fy, cx, cy } = intrinsics;
                let largest_degrees = largest_angle.to_degrees();
                Self::KannalaBrandt(KannalaBrandt { fx, fy, cx, cy, k1, k2, k3, k4, largest_degrees })
            }
            Lens::Orthographic { half_height } => Self::Orthographic(Orthographic { half_height }),
        }
    }
}

impl Serialize for Lens {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if matches!(self, Self::FieldOfView { y } if y.is_nan()) && serializer.is_human_readable() {
            Err(S::Error::custom("expected one of x_degrees and y_degrees"))
        } else if serializer.is_human_readable() {
            LensText::from(*self).serialize(serializer)
        } else {
            Self::serialize(self, serializer)
        }
    }
}

impl<'de> Deserialize<'de> for Lens {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if deserializer.is_human_readable() {
            Ok(LensText::deserialize(deserializer)?.into())
        } else {
            Self::deserialize(deserializer)
        }
    }
}

impl JsonSchema for Lens {
    fn schema_name() -> Cow<'static, str> {
        "Lens".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        LensText::json_schema(generator)
    }
}
