//! Sky of a world at a step of its clock.

use super::bodies::Bodies;
use super::sky::{Sky, SkyLight};
use super::timeline::WeatherTimeline;
use super::weather::SkyModel;
use crate::ecs::clock::Clock;
use crate::space::geo_origin::GeoOrigin;
use bevy_ecs::prelude::*;
use std::sync::Arc;

/// Sky, and what of sun and moon comes through it.
#[derive(Clone, Debug, PartialEq)]
pub struct CurrentSky {
    /// Radiance of all but sun and moon.
    pub sky: Arc<Sky>,
    /// Light of the sun.
    pub sun: SkyLight,
    /// Light of the moon.
    pub moon: SkyLight,
}

impl CurrentSky {
    /// Sky of a world; `None` where it is a gradient of three colours.
    pub fn of(world: &World) -> Option<Self> {
        let weather = world.get_resource::<WeatherTimeline>()?.now(world.resource::<Clock>());
        if weather.sky == SkyModel::Gradient {
            return None;
        }
        let bodies = Bodies::of(&weather, world.get_resource::<GeoOrigin>());
        let [sun, moon] = [bodies.sun, bodies.moon].map(|body| SkyLight::through(&body, &weather));
        Some(Self { sky: Sky::of(&weather, &bodies), sun, moon })
    }
}
