//! Values of a program in the place of some of a scene file's own fields.

use crate::scene::format::earth::GeoOrigin;
use crate::scene::format::scene::{Environment, Scene};
use serde::Deserialize;

/// Fields in the place of a scene file's own, read and checked as these. By default there are none.
#[derive(Deserialize, Clone, Debug, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Overrides {
    /// `clock.step_seconds`.
    step_seconds: Option<f64>,
    geo_origin: Option<GeoOrigin>,
    environment: Option<Environment>,
}

impl Overrides {
    /// True if all fields are the file's own.
    pub fn is_empty(&self) -> bool {
        let Self { step_seconds, geo_origin, environment } = self;
        step_seconds.is_none() && geo_origin.is_none() && environment.is_none()
    }

    pub(crate) fn apply(&self, scene: &mut Scene) {
        let Self { step_seconds, geo_origin, environment } = self.clone();
        scene.clock.step_seconds = step_seconds.unwrap_or(scene.clock.step_seconds);
        scene.geo_origin = geo_origin.or(scene.geo_origin);
        if let Some(environment) = environment {
            scene.environment = environment;
        }
    }
}
