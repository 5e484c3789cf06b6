//! Sun and moon as sources of light, as seen from the ground without air.

use super::almanac::{ASTRONOMICAL_UNIT, MEAN_MOON_DISTANCE, moon_illuminance, sun_and_moon};
use super::weather::{Angles, Weather};
use crate::space::geo_origin::GeoOrigin;
use glam::DVec3;

/// Illuminance of the sun at its mean distance, outside of the air: lux (solar constant of 1,361 W/m² by a luminous
/// efficacy of 94 lm/W).
const SUN_LUX: f64 = 128_000.0;
/// Radii of the sun (IAU 2015, resolution B3) and of the moon, metres.
const SUN_RADIUS: f64 = 6.957e8;
const MOON_RADIUS: f64 = 1.7374e6;

/// A source of light in the sky.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Body {
    /// Unit vector toward it: +X north, +Y up, +Z east.
    pub direction: DVec3,
    /// Illuminance of a surface that faces it, outside of the air.
    pub lux: f64,
    /// Radius of its disc, radians.
    pub radius: f64,
}

/// Both.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Bodies {
    pub sun: Body,
    pub moon: Body,
}

/// Direction of azimuth, from north over east, and elevation, radians.
fn direction(azimuth: f64, elevation: f64) -> DVec3 {
    let ((east, north), (up, flat)) = (azimuth.sin_cos(), elevation.sin_cos());
    DVec3::new(flat * north, up, flat * east)
}

/// Direction of azimuth and elevation, degrees.
pub(crate) fn of_angles((azimuth, elevation): Angles) -> DVec3 {
    direction(azimuth.to_radians(), elevation.to_radians())
}

impl Bodies {
    /// Sun and moon of a weather. Those that the weather leaves to the date need a place; without one they are below
    /// the ground and shine on nothing.
    pub fn of(weather: &Weather, place: Option<&GeoOrigin>) -> Self {
        let dated = place.map(|on_earth| {
            let place = on_earth.place;
            sun_and_moon(weather.date.0, place.latitude_degrees, place.longitude_degrees)
        });
        let below = Body { direction: DVec3::NEG_Y, lux: 0.0, radius: 0.0 };
        let given = |angles, lux, radius| Body { direction: of_angles(angles), lux, radius };
        let sun = weather.sun().map(|angles| given(angles, SUN_LUX, SUN_RADIUS / ASTRONOMICAL_UNIT)).or_else(|| {
            let sun = dated.as_ref()?.sun;
            let far = sun.distance / ASTRONOMICAL_UNIT;
            let (lux, radius) = (SUN_LUX / (far * far), SUN_RADIUS / sun.distance);
            Some(Body { direction: direction(sun.azimuth, sun.elevation), lux, radius })
        });
        let full = |angles| given(angles, moon_illuminance(0.0, MEAN_MOON_DISTANCE), MOON_RADIUS / MEAN_MOON_DISTANCE);
        let moon = weather.moon().map(full).or_else(|| {
            let (moon, phase_angle) = (dated.as_ref()?.moon, dated.as_ref()?.phase_angle);
            let (lux, radius) = (moon_illuminance(phase_angle, moon.distance), MOON_RADIUS / moon.distance);
            Some(Body { direction: direction(moon.azimuth, moon.elevation), lux, radius })
        });
        Self { sun: sun.unwrap_or(below), moon: moon.unwrap_or(below) }
    }
}
