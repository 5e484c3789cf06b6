//! Place of something in its lane.

use crate::describe::check::Described;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A sensor that says where it is in the lane of a route below it, and how it is turned against it.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LaneSensor {
    /// From a route's centre line, within which one of its lanes counts.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = Self::MOST_REACH, "unit" = "m"))]
    pub reach: f32,
}

impl Default for LaneSensor {
    fn default() -> Self {
        Self { reach: 10.0 }
    }
}

impl Described for LaneSensor {}
impl Described for LaneReading {}

impl LaneSensor {
    /// Metres: routes are looked for within this.
    pub const MOST_REACH: f32 = 15.0;
}

/// Pose in a lane. All is 0 where no lane is near.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct LaneReading {
    /// True if a lane is near.
    pub valid: bool,
    /// The route's place in the scene's list.
    #[schemars(extend("unit" = "place in the scene's list"))]
    pub route: u32,
    /// The lane, counted from the edge of the road: 0 is the rightmost, or the leftmost where traffic keeps left.
    #[schemars(extend("unit" = "count from the edge of the road"))]
    pub lane: u32,
    /// Metres from the middle of the lane, left positive.
    #[schemars(extend("unit" = "metres from the middle of the lane, left positive", "shown" = "offset {3} m"))]
    pub offset: f64,
    /// Radians from the way that the lane goes to the sensor's forward, left positive, −π to π.
    #[schemars(extend("unit" = "radians from the lane's way, left positive", "shown" = "heading {4} rad"))]
    pub heading_error: f64,
    /// Curvature of the lane's centre line, 1/m, left positive.
    #[schemars(extend("unit" = "1/m, left positive", "shown" = "curvature {4} 1/m"))]
    pub curvature: f64,
    /// Width of the lane, metres.
    #[schemars(extend("unit" = "metres"))]
    pub width: f64,
    /// Metres along the route's centre line from its beginning.
    #[schemars(extend("unit" = "metres of the route"))]
    pub along: f64,
    /// Speed of the vehicle that the sensor is on, m/s along its forward; 0 on anything else.
    #[schemars(extend("unit" = "m/s", "shown" = "{2} m/s"))]
    pub speed: f64,
}
