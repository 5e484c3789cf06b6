//! Routes, signals and vehicles.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use systems::describe::Described;
#[cfg(feature = "physics")]
pub use systems::physics::Physical;
use systems::space::{FARTHEST, LARGEST};

/// Read over in a build without physics; the check refuses it.
#[cfg(not(feature = "physics"))]
#[derive(Serialize, JsonSchema, Clone, Copy, Debug)]
pub struct Physical {}

#[cfg(not(feature = "physics"))]
impl<'de> Deserialize<'de> for Physical {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        serde::de::IgnoredAny::deserialize(deserializer).map(|_| Self {})
    }
}

/// Metres: longer routes are refused.
pub const LONGEST: f64 = 1e5;
/// Points of a route.
pub const MOST_POINTS: usize = 100_000;
/// Most lanes of a route.
const LANES: u8 = 16;
/// The last lane that a route may have.
const LAST_LANE: u8 = LANES - 1;
/// Groups of a signal.
const MOST_GROUPS: usize = 64;
/// Routes that may follow one.
const MOST_WAYS: usize = 64;
/// Metres.
const LONGEST_VEHICLE: f64 = 1000.0;
/// Metres of a crossing.
const FARTHEST_CLEAR: f64 = 200.0;
/// Seconds.
const LONGEST_WAIT: f64 = 1e5;
/// The highest speed of anything, km/h.
pub const FASTEST_KMH: f64 = 2000.0;

/// A route; its defaults are those of `RoutePlan`.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct Route {
    /// Points of the line in the middle of all its lanes, at least two that differ; a closed one does not repeat the
    /// first.
    #[schemars(length(max = MOST_POINTS), inner(inner(range(min = -FARTHEST, max = FARTHEST))), extend("unit" = "m"))]
    pub points: Vec<[f64; 3]>,
    /// Line between the points: straight, or a curve through them (centripetal Catmull-Rom).
    #[serde(default)]
    pub shape: Shape,
    /// Ends at its beginning; it has at least three points.
    #[serde(default)]
    pub closed: bool,
    /// Lanes side by side, in one direction; lane 0 is at the edge, on the right unless traffic keeps left.
    #[serde(default = "lanes")]
    #[schemars(range(min = 1, max = LANES))]
    pub lanes: u8,
    /// Width of a lane.
    #[serde(default = "lane_width")]
    #[schemars(range(min = 0.5, max = 100.0), extend("unit" = "m"))]
    pub lane_width: f32,
    /// Speed limit.
    #[serde(default = "speed_limit_kmh")]
    #[schemars(range(min = 1.0, max = FASTEST_KMH), extend("unit" = "km/h"))]
    pub speed_limit_kmh: f32,
    /// Other speed limits along it.
    #[serde(default)]
    #[schemars(extend("see" = "list of [limits](#limit)"))]
    pub limits: Vec<Limit>,
    /// Lines before which vehicles stop.
    #[serde(default)]
    #[schemars(extend("see" = "list of [stops](#stop)"))]
    pub stops: Vec<Stop>,
    /// Names of routes, one of which follows at its end; each vehicle chooses at random.
    #[serde(default)]
    #[schemars(length(max = MOST_WAYS))]
    pub then: Vec<String>,
    /// Lanes of the route before from which vehicles choose this one, as a turn from its lane; none: all.
    #[serde(default)]
    #[schemars(inner(range(max = LAST_LANE)))]
    pub from_lanes: Vec<u8>,
    /// Length beyond which vehicles, trailers included, choose another.
    #[serde(default)]
    #[schemars(range(min = 0.1, max = LONGEST_VEHICLE), extend("unit" = "m"))]
    pub longest_vehicle: Option<f32>,
}

impl Described for Route {}

fn lanes() -> u8 {
    1
}

fn lane_width() -> f32 {
    3.2
}

fn speed_limit_kmh() -> f32 {
    50.0
}

/// Line between the points of a route.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, Default, PartialEq)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// Straight between the points.
    #[default]
    Polyline,
    /// A curve through the points.
    Spline,
}

/// A speed limit along a route.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct Limit {
    /// Distance from the route's beginning, at most its length; holds up to the next one.
    #[schemars(extend("unit" = "m"))]
    pub from: f32,
    /// Speed.
    #[schemars(range(min = 1.0, max = FASTEST_KMH), extend("unit" = "km/h"))]
    pub kmh: f32,
}

impl Described for Limit {}

/// A line across a route before which vehicles stop: at a signal, or for some seconds.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct Stop {
    /// Distance from the route's beginning, at most its length.
    #[schemars(extend("unit" = "m"))]
    pub at: f32,
    /// Name of a signal.
    #[serde(default)]
    pub signal: Option<String>,
    /// Group of the signal.
    #[serde(default)]
    pub group: usize,
    /// Time that one stands there, as at a bus stop; instead of a signal.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = LONGEST_WAIT), extend("unit" = "s"))]
    pub seconds: Option<f32>,
    /// Length of a crossing beyond the line, up to the end of the next route at most. Vehicles that would have to stand
    /// in it, or would meet one of another group there, [wait](simulation_traffic.md#stops-and-signals) at green.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = FARTHEST_CLEAR), extend("unit" = "m"))]
    pub keep_clear: f32,
}

impl Described for Stop {}

/// A traffic light, whose groups are green in turn.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct Signal {
    /// Time of green of each group.
    #[schemars(length(min = 1, max = MOST_GROUPS), inner(range(min = 0.1, max = LONGEST_WAIT)))]
    #[schemars(extend("unit" = "s", "of" = "groups"))]
    pub green_seconds: Vec<f32>,
    /// Time of amber after each green.
    #[serde(default = "amber_seconds")]
    #[schemars(range(min = 0.0, max = LONGEST_WAIT), extend("unit" = "s"))]
    pub amber_seconds: f32,
    /// Time that all are red after each amber.
    #[serde(default = "red_seconds")]
    #[schemars(range(min = 0.0, max = LONGEST_WAIT), extend("unit" = "s"))]
    pub red_seconds: f32,
    /// Time that it is ahead at the start.
    #[serde(default)]
    #[schemars(range(min = -LONGEST_WAIT, max = LONGEST_WAIT), extend("unit" = "s"))]
    pub offset_seconds: f32,
}

impl Described for Signal {}

fn amber_seconds() -> f32 {
    3.0
}

fn red_seconds() -> f32 {
    2.0
}

/// Rules of the road.
#[derive(Serialize, Deserialize, JsonSchema, Debug, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Traffic {
    /// Has traffic keep left: lane 0 is the leftmost.
    pub left_hand: bool,
}

impl Described for Traffic {}

/// A traffic light that an entity's lamps show.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct SignalHead {
    /// Name of a signal.
    pub signal: String,
    /// Group of the signal.
    #[serde(default)]
    pub group: usize,
}

impl Described for SignalHead {}

/// Places of a generator along routes.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct Along {
    /// Names of routes; none: all. In the order of the scene.
    #[serde(default)]
    pub routes: Vec<String>,
    /// Distance from one to the next.
    #[schemars(range(min = 0.1, max = LONGEST), extend("unit" = "m"))]
    pub spacing: f32,
    /// Greatest random move of each copy along the route, in both directions.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = LONGEST), extend("unit" = "m"))]
    pub jitter: f32,
    /// Place of the first.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = LONGEST), extend("unit" = "m"))]
    pub from: f32,
    /// Lane, if it is only one; none: every lane.
    #[serde(default)]
    pub lane: Option<u8>,
    /// Distance to the left of the centre line (negative: right), instead of lanes: lamp posts, trees.
    #[serde(default)]
    #[schemars(range(min = -LARGEST, max = LARGEST), extend("unit" = "m"))]
    pub beside: Option<f32>,
}

impl Described for Along {}

/// A vehicle as an entity of a scene file.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct Vehicle {
    /// Name of a type; an unknown one is a warning, and a grey box on wheels is drawn instead.
    pub r#type: String,
    /// Number of one of the type's paints, counted round; none: in turn.
    #[serde(default)]
    pub paint: Option<u32>,
    /// Head lamps; tail lamps are on with them.
    #[serde(default)]
    pub headlights: Headlights,
    /// Manual control: driven by inputs, even where it has a route.
    #[serde(default)]
    pub manual: bool,
    /// Deprecated name of `manual`.
    #[serde(default)]
    pub by_hand: bool,
    /// Body on springs and tyres: [how](simulation_physics.md).
    #[serde(default)]
    #[schemars(extend("see" = "[physical](#physical)"))]
    pub physical: Option<Physical>,
    /// Name of a [route](scenes.md#route) on which it drives by itself; the entity's transform then counts for nothing.
    #[serde(default)]
    pub route: Option<String>,
    /// Distance from the route's beginning to its rear axle, at most the route's length.
    #[serde(default)]
    #[schemars(extend("unit" = "m"))]
    pub at: f64,
    /// Lane of the route.
    #[serde(default)]
    pub lane: u8,
    /// Speed at the start.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = FASTEST_KMH), extend("unit" = "km/h"))]
    pub speed_kmh: f32,
}

impl Described for Vehicle {}

/// Head lamps that are on.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, Default)]
#[serde(rename_all = "snake_case")]
pub enum Headlights {
    /// None.
    Off,
    /// Low beam.
    #[default]
    Low,
    /// High beam.
    High,
}
