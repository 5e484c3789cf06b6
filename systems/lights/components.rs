//! Lights as components.

use crate::assets::color::linear_from_kelvin;
use crate::space::transform::Transform;
use bevy_ecs::prelude::*;
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// The shape of a [`Light`]. Spot and directional lights shine along the entity's local −Z.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub enum LightKind {
    /// In all directions from a point.
    Point,
    /// A cone from a point.
    Spot {
        /// Half angle in radians beyond which there is no light at all. At most 85°.
        outer: f32,
        /// Half angle in radians within which the light is full; between the two a smooth step
        /// (KHR_lights_punctual). `None`: the classic model, cos(angle)^exponent within the cone.
        inner: Option<f32>,
        /// The classic model's exponent; 0 is a hard-edged, even cone. Ignored where `inner` is given.
        exponent: f32,
    },
    /// Parallel light from infinitely far away; no attenuation, no range.
    Directional,
}

impl LightKind {
    /// The name that people see.
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Spot { .. } => "spot",
            Self::Directional => "directional",
        }
    }
}

/// Marks an object that casts no shadow: lamp glass, sky domes. Counts for the entity's own mesh and its pieces, not
/// for what is below it. No step reads it and no input changes it, so it is no state.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct NoShadow;

/// A light. Its place and direction are the entity's transform, so it follows its parent.
///
/// An intensity of 1 at attenuation 1 lights a white surface that faces the light to a radiance of 1.
#[derive(Component, Clone, PartialEq, Debug, Serialize, Deserialize)]
#[require(Transform)]
#[component(summary_tick)]
pub struct Light {
    /// Point, spot or directional.
    pub kind: LightKind,
    /// Linear RGB.
    pub color: Vec3,
    /// Times the colour.
    pub intensity: f32,
    /// Linear RGB light that reaches every side of a surface, attenuated like the rest.
    pub ambient: Vec3,
    /// Metres; the light fades smoothly to exactly 0 there. Infinite: no end.
    pub range: f32,
    /// Constant, linear and quadratic attenuation: 1 / (x + y·d + z·d²); [`Light::INVERSE_SQUARE`] is that of physics.
    pub attenuation: Vec3,
    /// Off costs nothing.
    pub enabled: bool,
    /// Shadows are cast if the light is among the most important ones for the picture.
    pub shadows: bool,
    /// Metres: what is nearer to the light casts none, such as the glass of its lamp.
    pub shadow_near: f32,
    /// Metres, of a point light or a spot: the radius of the ball that shines, by which its shadows have penumbrae. 0:
    /// a point, whose shadows have hard edges. Nothing else depends on it.
    pub radius: f32,
    /// Radians, of a directional light: its angular diameter, by which its shadows have penumbrae. 0: hard edges.
    pub angle: f32,
}

impl Light {
    /// The attenuation 1 / d², times the window that ends it at the range; what glTF's lights have. The intensity is
    /// the irradiance at 1 m. Nearer than 1 cm it grows no more.
    pub const INVERSE_SQUARE: Vec3 = Vec3::Z;
    /// Metres: [`Light::shadow_near`] unless another is given.
    pub const SHADOW_NEAR: f32 = 0.05;
    /// Metres: the largest [`Light::radius`].
    pub const MOST_RADIUS: f32 = 100.0;
    /// Degrees: the sun's angular diameter as seen from Earth; [`Light::angle`] unless another is given.
    pub const SUN_DEGREES: f32 = 0.53;
    /// Degrees: the largest [`Light::angle`].
    pub const MOST_DEGREES: f32 = 90.0;

    /// A white point light with inverse-square attenuation of unit reach: 1 / (1 + d²).
    pub fn point(intensity: f32, range: f32) -> Self {
        Self {
            kind: LightKind::Point,
            color: Vec3::ONE,
            intensity,
            ambient: Vec3::ZERO,
            range,
            attenuation: Vec3::new(1.0, 0.0, 1.0),
            enabled: true,
            shadows: false,
            shadow_near: Self::SHADOW_NEAR,
            radius: 0.0,
            angle: 0.0,
        }
    }

    /// A white spot light; `outer` is the half angle of its cone in radians, full inside 0.8 of it.
    pub fn spot(intensity: f32, range: f32, outer: f32) -> Self {
        Self {
            kind: LightKind::Spot { outer, inner: Some(outer * 0.8), exponent: 0.0 },
            ..Self::point(intensity, range)
        }
    }

    /// A white directional light, as large as the sun's disc.
    pub fn directional(intensity: f32) -> Self {
        Self {
            kind: LightKind::Directional,
            range: f32::INFINITY,
            attenuation: Vec3::X,
            angle: Self::SUN_DEGREES.to_radians(),
            ..Self::point(intensity, f32::INFINITY)
        }
    }

    /// The same light in another linear RGB colour.
    pub fn with_color(mut self, color: Vec3) -> Self {
        self.color = color;
        self
    }

    /// The same light in the colour of a black body of that temperature, 1667 to 25000 K (others count as the nearest).
    pub fn with_kelvin(self, kelvin: f32) -> Self {
        let color = linear_from_kelvin(kelvin.clamp(1667.0, 25000.0)).unwrap_or(self.color);
        self.with_color(color)
    }

    /// The same light, which casts shadows.
    pub fn with_shadows(mut self) -> Self {
        self.shadows = true;
        self
    }

    /// The same light with another attenuation: constant, linear and quadratic, or [`Light::INVERSE_SQUARE`].
    pub fn with_attenuation(mut self, attenuation: Vec3) -> Self {
        self.attenuation = attenuation;
        self
    }

    /// The size that blurs a shadow's edge: the radius in metres; of a directional light the tangent of half its angle.
    pub(crate) fn size(&self) -> f32 {
        match self.kind {
            LightKind::Directional => (0.5 * self.angle).tan(),
            LightKind::Point | LightKind::Spot { .. } => self.radius,
        }
    }

    /// Tells if its numbers are finite; the range alone may be infinite. Lights of files may be beyond the ranges of
    /// descriptions.
    pub(crate) fn is_valid(&self) -> bool {
        let cone = match self.kind {
            LightKind::Spot { outer, inner, exponent } => [outer, inner.unwrap_or(outer), exponent],
            LightKind::Point | LightKind::Directional => [0.0; 3],
        };
        let vectors = [self.color, self.ambient, self.attenuation];
        let numbers = cone.iter().all(|n| n.is_finite()) && vectors.iter().all(|v| v.is_finite());
        let near = self.shadow_near.is_finite() && self.shadow_near > 0.0;
        let size = (0.0..=Self::MOST_RADIUS).contains(&self.radius)
            && (0.0..=Self::MOST_DEGREES.to_radians()).contains(&self.angle);
        numbers && near && size && self.intensity.is_finite() && !self.range.is_nan()
    }
}
