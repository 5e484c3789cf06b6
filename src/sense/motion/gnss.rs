//! Readings of receivers of satellite navigation.

use super::kind::{Measuring, ReadingSensor};
use crate::sense::captures::motion::GnssCapture;
use bevy_ecs::prelude::*;
use glam::DVec3;
use serde_json::{Value, json};
use systems::sensors::{GeoOrigin, GnssReading, GnssSensor};

impl ReadingSensor for GnssSensor {
    const KIND: &'static str = "gnss";
    const POSES_BEFORE: usize = 1;
    const LACK: &'static str = "it has no velocity";
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
