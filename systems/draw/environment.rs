//! Ambient light, the sky, exposure and tone map.

use bevy_ecs::prelude::*;
use glam::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
    /// By day, exposure follows the sky of an atmosphere: white shows `exposure` in the mean of level ground and a wall
    /// that faces the sun, instead of more. By night it stays as it is.
    pub auto_exposure: bool,
    /// From HDR to the screen.
    pub tone_map: ToneMap,
    /// Illuminance under which a white surface shows 1, as a light of intensity 1 lights it: lux.
    pub lux: f32,
}

impl Default for Environment {
    fn default() -> Self {
        Self {
            ambient: Vec3::splat(0.05),
            zenith: Vec3::new(0.10, 0.16, 0.28),
            horizon: Vec3::new(0.32, 0.36, 0.42),
            ground: Vec3::new(0.06, 0.055, 0.05),
            exposure: 1.0,
            auto_exposure: true,
            tone_map: ToneMap::Agx,
            lux: 30.0,
        }
    }
}

/// The curve from linear HDR to 0..1, before sRGB encoding.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
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
