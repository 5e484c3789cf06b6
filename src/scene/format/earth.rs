//! Place of a scene on Earth.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use systems::describe::Described;
use systems::space;
use systems::space::FARTHEST;
use systems::space::wgs84::Geodetic;

/// Place of a scene on Earth.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug)]
#[serde(deny_unknown_fields)]
pub struct GeoOrigin {
    /// Latitude of the point, WGS 84, north positive.
    #[schemars(range(min = -90.0, max = 90.0), extend("unit" = "°"))]
    pub latitude_degrees: f64,
    /// Longitude of the point, WGS 84, east positive.
    #[schemars(range(min = -180.0, max = 180.0), extend("unit" = "°"))]
    pub longitude_degrees: f64,
    /// Height of the point above the ellipsoid.
    #[serde(default)]
    #[schemars(range(min = -100000.0, max = 1e8), extend("unit" = "m"))]
    pub altitude: f64,
    /// The point in the scene's coordinates.
    #[serde(default)]
    #[schemars(inner(range(min = -FARTHEST, max = FARTHEST)), extend("unit" = "m"))]
    pub at: [f64; 3],
}

impl Described for GeoOrigin {}

impl GeoOrigin {
    /// Converts to a resource.
    pub fn resource(self) -> space::GeoOrigin {
        let Self { latitude_degrees, longitude_degrees, altitude, at } = self;
        space::GeoOrigin { place: Geodetic { latitude_degrees, longitude_degrees, altitude }, at: at.into() }
    }
}
