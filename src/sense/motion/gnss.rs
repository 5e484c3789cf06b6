//! Readings of receivers of satellite navigation.

use super::kind::{Measuring, ReadingSensor};
use crate::export::ros::{Encoded, Header, NavSatFix, diagonal};
use crate::sense::captures::reading::Record;
use bevy_ecs::prelude::*;
use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::io::Result;
use systems::describe::Described;
use systems::sensors::{GnssReading, GnssSensor};
use systems::space::GeoOrigin;

/// Measurement of a receiver of satellite navigation.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct GnssCapture {
    /// True if the place of the scene on Earth is known. If not, all is 0.
    pub valid: bool,
    /// Degrees, WGS 84.
    #[schemars(extend("unit" = "degrees, WGS 84", "shown" = "{7}°"))]
    pub latitude: f64,
    /// Degrees, WGS 84.
    #[schemars(extend("unit" = "degrees, WGS 84", "shown" = "{7}°"))]
    pub longitude: f64,
    /// Metres above the ellipsoid.
    #[schemars(extend("unit" = "metres above the ellipsoid", "shown" = "{2} m"))]
    pub altitude: f64,
    /// True if the place of the sensor when it was due before is known. If not, the velocity is 0.
    pub has_velocity: bool,
    /// To the east, north and up, m/s; the mean since the sensor was due before.
    #[schemars(with = "[f64; 3]", extend("unit" = "m/s to the east, north, up", "shown" = "{2} m/s"))]
    pub velocity: DVec3,
    /// Standard deviations of what noise adds, metres: to the east and to the north, and upward.
    #[schemars(extend("column" = false))]
    pub sigmas: [f64; 2],
}

impl Described for GnssCapture {}

impl Record for GnssCapture {
    const TOPIC: Option<&'static str> = Some("fix");

    fn message(&self, header: Header) -> Result<Option<Encoded>> {
        let [horizontal, vertical] = self.sigmas.map(|sigma| sigma * sigma);
        let Self { latitude, longitude, altitude, .. } = *self;
        let covariance = Some(diagonal([horizontal, horizontal, vertical]));
        let message = NavSatFix { header, latitude, longitude, altitude, covariance };
        self.valid.then(|| Encoded::of(&message)).transpose()
    }
}

impl ReadingSensor for GnssSensor {
    const KIND: &'static str = "gnss";
    const POSES_BEFORE: usize = 1;
    type Record = GnssCapture;

    fn measure(&self, at: &mut Measuring<'_>) -> Vec<GnssCapture> {
        let sigmas = [self.noise.horizontal_sigma, self.noise.vertical_sigma].map(f64::from);
        let none = GnssCapture { sigmas, ..GnssCapture::default() };
        let Some(on_earth) = at.world.get_resource::<GeoOrigin>() else { return vec![none] };
        let velocity = at.before[0].map(|before| (at.pose.translation - before.translation) / at.seconds);
        let point = at.pose.translation + at.origin;
        let GnssReading { place, velocity: with_noise } =
            self.measure(on_earth, point, velocity.unwrap_or_default(), at.noise);
        vec![GnssCapture {
            valid: true,
            latitude: place.latitude_degrees,
            longitude: place.longitude_degrees,
            altitude: place.altitude,
            has_velocity: velocity.is_some(),
            velocity: if velocity.is_some() { with_noise } else { DVec3::ZERO },
            ..none
        }]
    }

    fn describe(&self, described: &mut Value, _: f64, world: &World) {
        described["geo_origin"] = json!(world.get_resource::<GeoOrigin>().map(|GeoOrigin { place, at }| {
            json!({
                "latitude_degrees": place.latitude_degrees,
                "longitude_degrees": place.longitude_degrees,
                "altitude": place.altitude,
                "at": at.to_array(),
            })
        }));
        described["world_axes_on_earth"] = json!("X north, Y up, Z east");
    }
}
