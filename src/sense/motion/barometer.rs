//! Readings of barometers.

use super::kind::{Measuring, ReadingSensor};
use crate::export::ros::{Encoded, FluidPressure, Header};
use crate::sense::captures::reading::Record;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::io::Result;
use systems::describe::Described;
use systems::sensors::BarometerSensor;
use systems::space::GeoOrigin;

/// Measurement of a barometer.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct BarometerCapture {
    /// Static pressure of the air, Pa.
    #[schemars(extend("unit" = "Pa", "shown" = "{1} Pa"))]
    pub pressure: f64,
    /// Standard deviation of what noise adds, Pa.
    #[schemars(extend("column" = false))]
    pub sigma: f64,
}

impl Described for BarometerCapture {}

impl Record for BarometerCapture {
    const TOPIC: Option<&'static str> = Some("pressure");

    fn message(&self, header: Header) -> Result<Option<Encoded>> {
        let variance = self.sigma * self.sigma;
        Encoded::of(&FluidPressure { header, pressure: self.pressure, variance }).map(Some)
    }
}

impl ReadingSensor for BarometerSensor {
    const KIND: &'static str = "barometer";
    type Record = BarometerCapture;

    /// At the altitude on Earth; where that is not known, at the height in the scene's coordinates.
    fn measure(&self, at: &mut Measuring<'_>) -> Vec<BarometerCapture> {
        let point = at.pose.translation + at.origin;
        let on_earth = at.world.get_resource::<GeoOrigin>();
        let altitude = on_earth.map_or(point.y, |origin| origin.geodetic(point).altitude);
        vec![BarometerCapture { pressure: self.measure(altitude, at.noise), sigma: self.noise.pressure_sigma.into() }]
    }
}
