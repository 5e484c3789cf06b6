//! A file of vehicle types as serde reads it.

use super::entities::Transform;
use super::roads::FASTEST_KMH;
use super::values::Named;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use systems::assets::color_text::{BRIGHTEST, Color};
use systems::describe::Described;
use systems::lights::LightDescription;
use systems::space::{FARTHEST, LARGEST};
use systems::vehicles::lamps::LampKind;
use systems::vehicles::types::{self as lib, Limits};

/// Shortest vehicle, metres.
const SHORTEST: f64 = 0.05;
/// Longest vehicle, metres.
const LONGEST: f64 = 100.0;
/// Metres per second squared: more than any wheel gives.
const HARDEST: f64 = 100.0;

/// A file of vehicle types.
#[derive(Serialize, Deserialize, JsonSchema, Debug, Default)]
#[serde(default, deny_unknown_fields)]
pub struct VehicleTypes {
    /// Types by name; those of a later file replace an earlier one's of the same name.
    #[schemars(extend("see" = "named [types](#vehicle-type)"))]
    pub types: Named<VehicleType>,
}

impl Described for VehicleTypes {}

/// A type of vehicles.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct VehicleType {
    /// Path of a glTF file, relative to this file.
    #[schemars(extend("see" = "path"))]
    pub model: String,
    /// Transform from the model's space to the vehicle's: forward +Z, up +Y, metres.
    #[serde(default)]
    #[schemars(extend("see" = "[transform](scenes.md#transform)"))]
    pub transform: Transform,
    /// Width, height and length; by default measured, without the trailer.
    #[serde(default)]
    #[schemars(inner(range(min = SHORTEST, max = LONGEST)), extend("unit" = "m"))]
    pub size: Option<[f32; 3]>,
    /// Distance from rear axle to front axle; by default measured between wheels that steer and those that do not.
    #[serde(default)]
    #[schemars(range(min = SHORTEST, max = LONGEST), extend("unit" = "m"))]
    pub wheelbase: Option<f32>,
    /// Distance between the wheels of the rear axle; by default measured.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = LONGEST), extend("unit" = "m"))]
    pub track: Option<f32>,
    /// Mass.
    #[serde(default = "mass")]
    #[schemars(range(min = 1.0, max = 1e6), extend("unit" = "kg"))]
    pub mass: f32,
    /// Limits of its motion.
    #[serde(default)]
    #[schemars(extend("see" = "[limits](#vehicle-limits)"))]
    pub limits: VehicleLimits,
    /// Driver on a route.
    #[serde(default)]
    #[schemars(extend("see" = "[driver](#driver)"))]
    pub driver: Driver,
    /// Wheels.
    #[serde(default)]
    #[schemars(extend("see" = "list of [wheels](#wheels)"))]
    pub wheels: Vec<Wheels>,
    /// Pedals and the like.
    #[serde(default)]
    #[schemars(extend("see" = "list of [cranks](#cranks)"))]
    pub cranks: Vec<Cranks>,
    /// Names of nodes that turn about their Y with the steering, with the wheels below them.
    #[serde(default)]
    pub forks: Vec<String>,
    /// Legs and arms.
    #[serde(default)]
    #[schemars(extend("see" = "list of [swings](#swing)"))]
    pub swings: Vec<Swing>,
    /// Trailer.
    #[serde(default)]
    #[schemars(extend("see" = "[trailer](#trailer)"))]
    pub trailer: Option<Trailer>,
    /// Lamps.
    #[serde(default)]
    #[schemars(extend("see" = "list of [lamps](#lamps)"))]
    pub lamps: Vec<Lamps>,
    /// Paints.
    #[serde(default)]
    #[schemars(extend("see" = "[paint](#paint)"))]
    pub paint: Option<Paint>,
    /// Place of the driver's eye in the vehicle's space; by default guessed from the size.
    #[serde(default)]
    #[schemars(inner(range(min = -FARTHEST, max = FARTHEST)), extend("unit" = "m"))]
    pub eye: Option<[f32; 3]>,
    /// Name of its [semantic class](sensors.md#classes) in outputs of sensors; its trailer is of the class `trailer`.
    #[serde(default)]
    pub class: String,
}

impl Described for VehicleType {}

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

/// Limits of a vehicle's motion.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct VehicleLimits {
    /// Speed ahead.
    #[schemars(range(min = 0.1, max = FASTEST_KMH), extend("unit" = "km/h"))]
    pub speed_kmh: f32,
    /// Speed in reverse.
    #[schemars(range(min = 0.0, max = FASTEST_KMH), extend("unit" = "km/h"))]
    pub reverse_speed_kmh: f32,
    /// Acceleration.
    #[schemars(range(min = 0.01, max = HARDEST), extend("unit" = "m/s²"))]
    pub acceleration: f32,
    /// Hardest braking.
    #[schemars(range(min = 0.01, max = HARDEST), extend("unit" = "m/s²"))]
    pub braking: f32,
    /// Steering angle of the wheel in the middle of the front axle.
    #[schemars(range(min = 0.1, max = 85.0), extend("unit" = "°"))]
    pub steering_degrees: f32,
    /// Speed of steering.
    #[schemars(range(min = 0.1, max = 1e4), extend("unit" = "°/s"))]
    pub steering_degrees_per_second: f32,
    /// Acceleration sideways; a driver on a route slows down to it in bends.
    #[schemars(range(min = 0.01, max = HARDEST), extend("unit" = "m/s²"))]
    pub lateral_acceleration: f32,
}

impl Described for VehicleLimits {}

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

/// Parameters of the Intelligent Driver Model.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct Driver {
    /// Wanted speed, in speed limits.
    #[schemars(range(min = 0.01, max = 10.0))]
    pub speed_factor: f32,
    /// Time to the one ahead, T.
    #[schemars(range(min = 0.0, max = 60.0), extend("unit" = "s"))]
    pub headway_seconds: f32,
    /// Distance to the one ahead at a standstill, s0.
    #[schemars(range(min = 0.01, max = 100.0), extend("unit" = "m"))]
    pub gap_metres: f32,
    /// Acceleration, a.
    #[schemars(range(min = 0.01, max = HARDEST), extend("unit" = "m/s²"))]
    pub acceleration: f32,
    /// Comfortable braking, b.
    #[schemars(range(min = 0.01, max = HARDEST), extend("unit" = "m/s²"))]
    pub braking: f32,
    /// Power by which acceleration falls off toward the wanted speed, δ.
    #[schemars(range(min = 0.1, max = 100.0))]
    pub exponent: f32,
}

impl Described for Driver {}

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

/// Wheels of a vehicle.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct Wheels {
    /// Names of nodes, whose axle is along the vehicle's X.
    pub nodes: Vec<String>,
    /// Radius; by default measured.
    #[serde(default)]
    #[schemars(range(min = 0.01, max = 10.0), extend("unit" = "m"))]
    pub radius: Option<f32>,
    /// Turns with the steering.
    #[serde(default)]
    pub steers: bool,
}

impl Described for Wheels {}

/// Nodes that turn about X as the vehicle rolls, and carry nothing.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct Cranks {
    /// Names of nodes.
    pub nodes: Vec<String>,
    /// Distance rolled per radian; a pedal's is the wheel's radius times the gear.
    #[schemars(range(min = 0.01, max = 100.0), extend("unit" = "m"))]
    pub radius: f32,
}

impl Described for Cranks {}

/// A leg or an arm.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct Swing {
    /// Name of a node that swings about X.
    pub node: String,
    /// Angle to either side.
    #[schemars(range(min = -180.0, max = 180.0), extend("unit" = "°"))]
    pub degrees: f32,
    /// Distance rolled per swing there and back.
    #[schemars(range(min = 0.01, max = LARGEST), extend("unit" = "m"))]
    pub stride_metres: f32,
    /// Part of a swing that it is ahead; 0.5 is the other leg.
    #[serde(default)]
    #[schemars(range(min = -1000.0, max = 1000.0))]
    pub phase: f32,
}

impl Described for Swing {}

/// A trailer.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct Trailer {
    /// Name of a node that turns about Y at its origin, the hitch, with everything below it.
    pub node: String,
    /// Distance from the hitch back to the middle of the trailer's axles.
    #[schemars(range(min = SHORTEST, max = LONGEST), extend("unit" = "m"))]
    pub length: f32,
}

impl Described for Trailer {}

/// Lamps of one kind.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct Lamps {
    /// Names of nodes; their meshes are the glass.
    pub nodes: Vec<String>,
    /// Kind, by which it is on, and shines some way.
    #[schemars(extend("see" = "one of the [kinds](#kinds-of-lamps)"))]
    pub kind: LampKind,
    /// Light: low beam for `head`, braking for `tail`; by default the node's own, or the glass only glows.
    #[serde(default)]
    #[schemars(extend("see" = "[light](scenes.md#lights)"))]
    pub light: Option<LightDescription>,
    /// Has the node's own light [cast shadows](scenes.md#lights), from 15 cm on; a `light` has a field of its own.
    #[serde(default)]
    pub shadows: bool,
    /// Colour of the glow; by default that of the light.
    #[serde(default)]
    pub color: Option<Color>,
    /// Direction of the light in the vehicle's space; by default by the kind and the node.
    #[serde(default)]
    #[schemars(inner(range(min = -LARGEST, max = LARGEST)))]
    pub direction: Option<[f32; 3]>,
    /// Glow of the glass while the lamp is on; times the glass's base map.
    #[serde(default = "glow")]
    #[schemars(range(min = 0.0, max = BRIGHTEST))]
    pub glow: f32,
}

impl Described for Lamps {}

fn glow() -> f32 {
    2.0
}

/// Paints of a type.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct Paint {
    /// Names of the model's materials whose base colour is multiplied.
    pub materials: Vec<String>,
    /// Colours of the paints.
    #[schemars(extend("see" = "list of colours"))]
    pub colors: Vec<Color>,
}

impl Described for Paint {}
