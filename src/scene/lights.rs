//! Lights of scene files: how they are written, what is wrong with them, and what they become.

use super::check::{BRIGHTEST, Check};
use super::values::{Attenuation, Color};
use glam::Vec3;
use serde::Deserialize;
use systems::lights::{self, LightKind};
use systems::space::FARTHEST;

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

impl Check<'_> {
    pub fn light(&mut self, light: &Light) {
        let local = |c: &mut Self, range: Option<f32>, Attenuation(attenuation): Attenuation| {
            if let Some(range) = range {
                c.number("range", range, 1e-3, FARTHEST as f32);
            }
            c.numbers("attenuation", &attenuation, 0.0, 1e6);
            if attenuation.iter().sum::<f32>() <= 0.0 {
                c.field("attenuation", |c| c.fault("expected at least one of the three to be more than 0"));
            }
        };
        let (color, intensity, ambient) = match light {
            Light::Point(l) => (l.color, l.intensity, l.ambient),
            Light::Spot(l) => (l.color, l.intensity, l.ambient),
            Light::Directional(l) => (l.color, l.intensity, l.ambient),
        };
        self.color("color", color, BRIGHTEST);
        self.color("ambient", ambient, BRIGHTEST);
        self.number("intensity", intensity, 0.0, BRIGHTEST);
        if let Light::Point(PointLight { shadow_near, radius, .. })
        | Light::Spot(SpotLight { shadow_near, radius, .. }) = light
        {
            self.number("shadow_near", *shadow_near, 1e-3, FARTHEST as f32);
            self.number("radius", *radius, 0.0, lights::Light::MOST_RADIUS);
        }
        match light {
            Light::Point(l) => local(self, l.range, l.attenuation),
            Light::Spot(l) => {
                local(self, l.range, l.attenuation);
                let classic = l.cutoff_degrees.is_some() || l.exponent.is_some();
                let cone = l.outer_degrees.is_some() || l.inner_degrees.is_some();
                if classic == cone || (classic && l.cutoff_degrees.is_none()) || (cone && l.outer_degrees.is_none()) {
                    self.fault("expected either cutoff_degrees (and exponent) or outer_degrees (and inner_degrees)");
                }
                if let Some(cutoff) = l.cutoff_degrees {
                    self.number("cutoff_degrees", cutoff, 0.1, 85.0);
                }
                if let Some(exponent) = l.exponent {
                    self.number("exponent", exponent, 0.0, 1e4);
                }
                if let Some(outer) = l.outer_degrees {
                    self.number("outer_degrees", outer, 0.1, 85.0);
                    self.number("inner_degrees", l.inner_degrees.unwrap_or(0.0), 0.0, outer);
                }
            }
            Light::Directional(l) => {
                self.number("angle_degrees", l.angle_degrees, 0.0, lights::Light::MOST_DEGREES);
            }
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
