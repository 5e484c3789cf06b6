//! Lights: how they are written, and what they become; which of them shade an object.

use super::values::{Attenuation, Color, names, one_of};
use glam::Vec3;
use serde::{Deserialize, Deserializer};
use systems::lights::{self, LightKind, LightPolicy};

#[derive(Deserialize, Debug)]
#[serde(rename_all = "snake_case")]
pub enum Light {
    Point(PointLight),
    Spot(SpotLight),
    Directional(DirectionalLight),
}

#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct PointLight {
    pub color: Color,
    pub intensity: f32,
    pub range: Option<f32>,
    pub attenuation: Attenuation,
    pub ambient: Color,
    pub on: bool,
    pub shadows: bool,
    pub shadow_near: f32,
    pub radius: f32,
}

impl Default for PointLight {
    fn default() -> Self {
        let light = lights::Light::point(1.0, f32::INFINITY);
        Self {
            color: Color::linear(light.color),
            intensity: light.intensity,
            range: None,
            attenuation: Attenuation(light.attenuation.to_array()),
            ambient: Color::linear(light.ambient),
            on: light.enabled,
            shadows: light.shadows,
            shadow_near: light.shadow_near,
            radius: light.radius,
        }
    }
}

/// Two kinds of cone: `cutoff_degrees` with `exponent`, or `outer_degrees` with `inner_degrees`.
#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct SpotLight {
    pub color: Color,
    pub intensity: f32,
    pub range: Option<f32>,
    pub attenuation: Attenuation,
    pub ambient: Color,
    pub on: bool,
    pub shadows: bool,
    pub shadow_near: f32,
    pub radius: f32,
    pub cutoff_degrees: Option<f32>,
    pub exponent: Option<f32>,
    pub inner_degrees: Option<f32>,
    pub outer_degrees: Option<f32>,
}

impl Default for SpotLight {
    fn default() -> Self {
        let PointLight { color, intensity, range, attenuation, ambient, on, shadows, shadow_near, radius } =
            PointLight::default();
        Self {
            color,
            intensity,
            range,
            attenuation,
            ambient,
            on,
            shadows,
            shadow_near,
            radius,
            cutoff_degrees: None,
            exponent: None,
            inner_degrees: None,
            outer_degrees: None,
        }
    }
}

#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct DirectionalLight {
    pub color: Color,
    pub intensity: f32,
    pub ambient: Color,
    pub on: bool,
    pub shadows: bool,
    pub angle_degrees: f32,
}

impl Default for DirectionalLight {
    fn default() -> Self {
        let PointLight { color, intensity, ambient, on, shadows, .. } = PointLight::default();
        Self { color, intensity, ambient, on, shadows, angle_degrees: lights::Light::SUN_DEGREES }
    }
}

/// Selection of the lights in reach that shade objects.
#[derive(Deserialize, Debug, Clone, Copy)]
#[serde(default, deny_unknown_fields)]
pub struct Lights {
    #[serde(deserialize_with = "light_policy")]
    policy: LightPolicy,
    pub tolerance: Option<f32>,
}

fn light_policy<'de, D: Deserializer<'de>>(deserializer: D) -> Result<LightPolicy, D::Error> {
    const NAMES: [&str; LightPolicy::ALL.len()] = names(&LightPolicy::ALL);
    one_of(&LightPolicy::ALL, &NAMES, deserializer)
}

impl Default for Lights {
    fn default() -> Self {
        Self { policy: LightPolicy::ENOUGH, tolerance: None }
    }
}

impl Lights {
    /// Converts to the component.
    pub fn policy(&self) -> LightPolicy {
        match (self.policy, self.tolerance) {
            (LightPolicy::Enough(_), Some(tolerance)) => LightPolicy::Enough(tolerance),
            (policy, _) => policy,
        }
    }
}

/// The light of a checked scene.
pub fn light(source: &Light) -> lights::Light {
    let range = |range: Option<f32>| range.unwrap_or(f32::INFINITY);
    match source {
        Light::Point(l) => lights::Light {
            kind: LightKind::Point,
            color: l.color.rgb(),
            intensity: l.intensity,
            ambient: l.ambient.rgb(),
            range: range(l.range),
            attenuation: Vec3::from_array(l.attenuation.0),
            enabled: l.on,
            shadows: l.shadows,
            shadow_near: l.shadow_near,
            radius: l.radius,
            ..lights::Light::point(l.intensity, range(l.range))
        },
        Light::Spot(l) => lights::Light {
            kind: cone(l),
            color: l.color.rgb(),
            intensity: l.intensity,
            ambient: l.ambient.rgb(),
            range: range(l.range),
            attenuation: Vec3::from_array(l.attenuation.0),
            enabled: l.on,
            shadows: l.shadows,
            shadow_near: l.shadow_near,
            radius: l.radius,
            ..lights::Light::point(l.intensity, range(l.range))
        },
        Light::Directional(l) => lights::Light {
            ambient: l.ambient.rgb(),
            enabled: l.on,
            shadows: l.shadows,
            angle: l.angle_degrees.to_radians(),
            ..lights::Light::directional(l.intensity).with_color(l.color.rgb())
        },
    }
}

fn cone(l: &SpotLight) -> LightKind {
    match (l.cutoff_degrees, l.outer_degrees) {
        (None, Some(outer)) => LightKind::Spot {
            outer: outer.to_radians(),
            inner: Some(l.inner_degrees.unwrap_or(outer * 0.8).to_radians()),
            exponent: 0.0,
        },
        (cutoff, _) => LightKind::Spot {
            outer: cutoff.unwrap_or(45.0).to_radians(),
            inner: None,
            exponent: l.exponent.unwrap_or(0.0),
        },
    }
}
