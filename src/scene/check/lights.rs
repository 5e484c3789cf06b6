//! Lights.

use super::walk::{BRIGHTEST, Check};
use crate::scene::format::lights::{Light, Lights, PointLight, SpotLight};
use crate::scene::format::values::Attenuation;
use systems::lights::{self, LightPolicy};
use systems::space::FARTHEST;

impl Check<'_> {
    pub(super) fn lights(&mut self, lights: Option<&Lights>) {
        let Some((lights, tolerance)) = lights.and_then(|lights| Some((lights, lights.tolerance?))) else { return };
        self.field("lights", |c| {
            c.number("tolerance", tolerance, 0.0, 1.0);
            if !matches!(lights.policy(), LightPolicy::Enough(_)) {
                c.field("tolerance", |c| c.fault("only allowed with the policy enough"));
            }
        });
    }

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
