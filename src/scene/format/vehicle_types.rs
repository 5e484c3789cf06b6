//! A file of vehicle types as serde reads it; `docs/vehicles.md` says what every field means.

use super::entities::Transform;
use super::values::Named;
use serde::Deserialize;
use systems::assets::color_text::Color;
use systems::lights::LightDescription;
use systems::vehicles::lamps::LampKind;
use systems::vehicles::types::{self as lib, Limits};

/// A whole file.
#[derive(Deserialize, Debug, Default)]
#[serde(default, deny_unknown_fields)]
pub struct VehicleTypes {
    pub types: Named<VehicleType>,
}

#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct VehicleType {
    pub model: String,
    #[serde(default)]
    pub transform: Transform,
    #[serde(default)]
    pub size: Option<[f32; 3]>,
    #[serde(default)]
    pub wheelbase: Option<f32>,
    #[serde(default)]
    pub track: Option<f32>,
    #[serde(default = "mass")]
    pub mass: f32,
    #[serde(default)]
    pub limits: VehicleLimits,
    #[serde(default)]
    pub driver: Driver,
    #[serde(default)]
    pub wheels: Vec<Wheels>,
    #[serde(default)]
    pub cranks: Vec<Cranks>,
    #[serde(default)]
    pub forks: Vec<String>,
    #[serde(default)]
    pub swings: Vec<Swing>,
    #[serde(default)]
    pub trailer: Option<Trailer>,
    #[serde(default)]
    pub lamps: Vec<Lamps>,
    #[serde(default)]
    pub paint: Option<Paint>,
    #[serde(default)]
    pub eye: Option<[f32; 3]>,
    #[serde(default)]
    pub class: String,
}

impl VehicleType {
    /// The names of nodes that it gives a role, each once.
    pub fn nodes(&self) -> Vec<&String> {
        let listed =
            self.wheels.iter().map(|wheels| &wheels.nodes).chain(self.cranks.iter().map(|cranks| &cranks.nodes));
        let listed = listed.chain(self.lamps.iter().map(|lamps| &lamps.nodes)).chain([&self.forks]).flatten();
        let single =
            self.swings.iter().map(|swing| &swing.node).chain(self.trailer.iter().map(|trailer| &trailer.node));
        let mut nodes: Vec<&String> = listed.chain(single).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}

fn mass() -> f32 {
    lib::VehicleType::default().mass
}

#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct VehicleLimits {
    pub speed_kmh: f32,
    pub reverse_speed_kmh: f32,
    pub acceleration: f32,
    pub braking: f32,
    pub steering_degrees: f32,
    pub steering_degrees_per_second: f32,
    pub lateral_acceleration: f32,
}

impl Default for VehicleLimits {
    fn default() -> Self {
        let l = Limits::default();
        Self {
            speed_kmh: (l.speed * 3.6).round(),
            reverse_speed_kmh: (l.reverse_speed * 3.6).round(),
            acceleration: l.acceleration,
            braking: l.braking,
            steering_degrees: l.steering.to_degrees().round(),
            steering_degrees_per_second: l.steering_rate.to_degrees().round(),
            lateral_acceleration: l.lateral_acceleration,
        }
    }
}

#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Driver {
    pub speed_factor: f32,
    pub headway_seconds: f32,
    pub gap_metres: f32,
    pub acceleration: f32,
    pub braking: f32,
    pub exponent: f32,
}

impl Default for Driver {
    fn default() -> Self {
        let d = lib::Driver::default();
        Self {
            speed_factor: d.speed_factor,
            headway_seconds: d.headway,
            gap_metres: d.gap,
            acceleration: d.acceleration,
            braking: d.braking,
            exponent: d.exponent,
        }
    }
}

#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Wheels {
    pub nodes: Vec<String>,
    #[serde(default)]
    pub radius: Option<f32>,
    #[serde(default)]
    pub steers: bool,
}

#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Cranks {
    pub nodes: Vec<String>,
    pub radius: f32,
}

#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Swing {
    pub node: String,
    pub degrees: f32,
    pub stride_metres: f32,
    #[serde(default)]
    pub phase: f32,
}

#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Trailer {
    pub node: String,
    pub length: f32,
}

#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Lamps {
    pub nodes: Vec<String>,
    pub kind: LampKind,
    #[serde(default)]
    pub light: Option<LightDescription>,
    #[serde(default)]
    pub shadows: bool,
    #[serde(default)]
    pub color: Option<Color>,
    #[serde(default)]
    pub direction: Option<[f32; 3]>,
    #[serde(default = "glow")]
    pub glow: f32,
}

fn glow() -> f32 {
    2.0
}

#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Paint {
    pub materials: Vec<String>,
    pub colors: Vec<Color>,
}
