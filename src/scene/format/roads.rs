//! Routes, signals and vehicles.

use serde::Deserialize;
#[cfg(feature = "physics")]
pub use systems::physics::Physical;

/// Read over in a build without physics; the check refuses it.
#[cfg(not(feature = "physics"))]
pub type Physical = serde::de::IgnoredAny;

/// A route; its defaults are those of `RoutePlan`.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Route {
    pub points: Vec<[f64; 3]>,
    #[serde(default)]
    pub shape: Shape,
    #[serde(default)]
    pub closed: bool,
    #[serde(default = "lanes")]
    pub lanes: u8,
    #[serde(default = "lane_width")]
    pub lane_width: f32,
    #[serde(default = "speed_limit_kmh")]
    pub speed_limit_kmh: f32,
    #[serde(default)]
    pub limits: Vec<Limit>,
    #[serde(default)]
    pub stops: Vec<Stop>,
    #[serde(default)]
    pub then: Vec<String>,
    #[serde(default)]
    pub from_lanes: Vec<u8>,
    #[serde(default)]
    pub longest_vehicle: Option<f32>,
}

fn lanes() -> u8 {
    1
}

fn lane_width() -> f32 {
    3.2
}

fn speed_limit_kmh() -> f32 {
    50.0
}

#[derive(Deserialize, Clone, Copy, Debug, Default, PartialEq)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    #[default]
    Polyline,
    Spline,
}

#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Limit {
    pub from: f32,
    pub kmh: f32,
}

/// At a signal, or for some seconds.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Stop {
    pub at: f32,
    #[serde(default)]
    pub signal: Option<String>,
    #[serde(default)]
    pub group: usize,
    #[serde(default)]
    pub seconds: Option<f32>,
    #[serde(default)]
    pub keep_clear: f32,
}

#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Signal {
    pub green_seconds: Vec<f32>,
    #[serde(default = "amber_seconds")]
    pub amber_seconds: f32,
    #[serde(default = "red_seconds")]
    pub red_seconds: f32,
    #[serde(default)]
    pub offset_seconds: f32,
}

fn amber_seconds() -> f32 {
    3.0
}

fn red_seconds() -> f32 {
    2.0
}

#[derive(Deserialize, Debug, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Traffic {
    pub left_hand: bool,
}

#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct SignalHead {
    pub signal: String,
    #[serde(default)]
    pub group: usize,
}

/// Places of a generator along routes.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Along {
    #[serde(default)]
    pub routes: Vec<String>,
    pub spacing: f32,
    #[serde(default)]
    pub jitter: f32,
    #[serde(default)]
    pub from: f32,
    #[serde(default)]
    pub lane: Option<u8>,
    #[serde(default)]
    pub beside: Option<f32>,
}

/// A vehicle as an entity of a scene file.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Vehicle {
    pub r#type: String,
    #[serde(default)]
    pub paint: Option<u32>,
    #[serde(default)]
    pub headlights: Headlights,
    #[serde(default)]
    pub manual: bool,
    /// Deprecated name of `manual`.
    #[serde(default)]
    pub by_hand: bool,
    #[serde(default)]
    pub physical: Option<Physical>,
    #[serde(default)]
    pub route: Option<String>,
    #[serde(default)]
    pub at: f64,
    #[serde(default)]
    pub lane: u8,
    #[serde(default)]
    pub speed_kmh: f32,
}

#[derive(Deserialize, Clone, Copy, Debug, Default)]
#[serde(rename_all = "snake_case")]
pub enum Headlights {
    Off,
    #[default]
    Low,
    High,
}
