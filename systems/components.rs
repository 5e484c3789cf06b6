//! What a user puts on entities, beside the ids of the [`crate::library`] and a [`Transform`].

use crate::color::linear_from_kelvin;
use crate::transform::Transform;
use bevy_ecs::prelude::*;
use glam::{Quat, Vec3};
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
}

impl Light {
    /// The attenuation 1 / d², times the window that ends it at the range; what glTF's lights have. The intensity is
    /// the irradiance at 1 m. Nearer than 1 cm it grows no more.
    pub const INVERSE_SQUARE: Vec3 = Vec3::Z;

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
        }
    }

    /// A white spot light; `outer` is the half angle of its cone in radians, full inside 0.8 of it.
    pub fn spot(intensity: f32, range: f32, outer: f32) -> Self {
        Self {
            kind: LightKind::Spot { outer, inner: Some(outer * 0.8), exponent: 0.0 },
            ..Self::point(intensity, range)
        }
    }

    /// A white directional light.
    pub fn directional(intensity: f32) -> Self {
        Self {
            kind: LightKind::Directional,
            range: f32::INFINITY,
            attenuation: Vec3::X,
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

    /// The same light with another attenuation: constant, linear and quadratic, or [`Light::INVERSE_SQUARE`].
    pub fn with_attenuation(mut self, attenuation: Vec3) -> Self {
        self.attenuation = attenuation;
        self
    }

    /// Whether its numbers are numbers; the range alone may be infinite.
    pub(crate) fn is_sound(&self) -> bool {
        let cone = match self.kind {
            LightKind::Spot { outer, inner, exponent } => [outer, inner.unwrap_or(outer), exponent],
            LightKind::Point | LightKind::Directional => [0.0; 3],
        };
        let vectors = [self.color, self.ambient, self.attenuation];
        let numbers = cone.iter().all(|n| n.is_finite()) && vectors.iter().all(|v| v.is_finite());
        numbers && self.intensity.is_finite() && !self.range.is_nan()
    }
}

/// How a [`Camera`] projects. One that asks for a shape is seen whole in a target of another: more is seen to the
/// sides, or above and below.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Projection {
    /// Vertical field of view in radians.
    Perspective {
        /// Vertical field of view in radians.
        fov_y: f32,
        /// Width over height; `None`: that of the target.
        aspect: Option<f32>,
    },
    /// Parallel projection; half the height of the visible box in metres.
    Orthographic {
        /// Half the height of the visible box in metres.
        half_height: f32,
        /// Width over height of that box; `None`: that of the target.
        aspect: Option<f32>,
    },
}

/// A camera; looks down its entity's local −Z.
#[derive(Component, Clone, PartialEq, Debug)]
#[require(Transform)]
pub struct Camera {
    /// Perspective or orthographic.
    pub projection: Projection,
    /// Distance of the near plane, metres.
    pub near: f32,
    /// Distance of the far plane, metres; perspective cameras may have none (infinite).
    pub far: f32,
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            projection: Projection::Perspective { fov_y: 45f32.to_radians(), aspect: None },
            near: 0.1,
            far: f32::INFINITY,
        }
    }
}

/// Turns about its parent's axis at an even rate; the step system writes the entity's rotation.
#[derive(Component, Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[require(Transform)]
pub struct Spin {
    /// Unit axis in the parent's space.
    pub axis: Vec3,
    /// Radians per second.
    pub rate: f32,
    /// The rotation at time 0.
    pub start: Quat,
}

impl Spin {
    /// Whether its numbers are numbers, and its axis an axis.
    pub(crate) fn is_sound(&self) -> bool {
        self.axis.is_normalized() && self.rate.is_finite() && self.start.is_normalized()
    }
}

/// An entity that can show one of several meshes in turn; the window's key F cycles it.
#[derive(Component, Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Figure {
    /// The meshes, in order; the entity starts with the first.
    pub meshes: Vec<crate::library::MeshId>,
    /// Which one is shown.
    pub shown: usize,
}

/// Light and look that belong to the whole scene.
#[derive(Resource, Clone, PartialEq, Debug)]
pub struct Environment {
    /// Scene ambient A of the reference lighting model, linear RGB; every material receives it.
    pub ambient: Vec3,
    /// Linear RGB straight up.
    pub zenith: Vec3,
    /// Linear RGB at the horizon.
    pub horizon: Vec3,
    /// Linear RGB straight down.
    pub ground: Vec3,
    /// Times every pixel before the tone map.
    pub exposure: f32,
    /// From HDR to the screen.
    pub tone_map: ToneMap,
}

impl Default for Environment {
    fn default() -> Self {
        Self {
            ambient: Vec3::splat(0.05),
            zenith: Vec3::new(0.10, 0.16, 0.28),
            horizon: Vec3::new(0.32, 0.36, 0.42),
            ground: Vec3::new(0.06, 0.055, 0.05),
            exposure: 1.0,
            tone_map: ToneMap::Agx,
        }
    }
}

/// The curve from linear HDR to 0..1, before sRGB encoding.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub enum ToneMap {
    /// Cut at 1: what programs of the fixed-function era did.
    Clamp,
    /// A filmic curve fitted to ACES.
    Aces,
    /// AgX: highlights lose saturation as film does.
    #[default]
    Agx,
}

impl ToneMap {
    /// All curves with the names that scene files and the command line use.
    pub const ALL: [(&'static str, Self); 3] = [("clamp", Self::Clamp), ("aces", Self::Aces), ("agx", Self::Agx)];
}
