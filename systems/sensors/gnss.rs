//! Receivers of satellite navigation: latitude, longitude, altitude and velocity, from a scene whose place on Earth is
//! known.

use super::philox::{Noise, normal};
use crate::describe::check::Described;
use crate::space::geo_origin::GeoOrigin;
use crate::space::wgs84::Geodetic;
use glam::{DVec3, Vec3Swizzles};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Channels of its random numbers.
const PLACE: u32 = 0;
const VELOCITY: u32 = 1;

/// A receiver; its antenna is the entity.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GnssSensor {
    /// Errors of real receivers.
    pub noise: GnssNoise,
}

/// Standard deviations of a receiver; by default there is no noise. Each reading's errors are its own, where those of
/// real receivers wander.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GnssNoise {
    /// To the east, and to the north.
    #[schemars(range(min = 0.0, max = 1e4), extend("unit" = "m"))]
    pub horizontal_sigma: f32,
    /// Up and down.
    #[schemars(range(min = 0.0, max = 1e4), extend("unit" = "m"))]
    pub vertical_sigma: f32,
    /// In each direction.
    #[schemars(range(min = 0.0, max = 1e4), extend("unit" = "m/s"))]
    pub velocity_sigma: f32,
}

/// Measurement of the sensor.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct GnssReading {
    /// Measured place.
    pub place: Geodetic,
    /// To the east, north and up of where it is, m/s.
    pub velocity: DVec3,
}

impl Described for GnssSensor {}

impl GnssSensor {
    /// Measures at a point, and with a velocity (m/s), in the coordinates of the scene's file.
    pub fn measure(&self, origin: &GeoOrigin, point: DVec3, velocity: DVec3, noise: Noise) -> GnssReading {
        let GnssNoise { horizontal_sigma, vertical_sigma, velocity_sigma } = self.noise;
        let truth = origin.geodetic(point);
        let ecef_from_enu = truth.ecef_from_enu();
        let place = if horizontal_sigma == 0.0 && vertical_sigma == 0.0 {
            truth
        } else {
            let sigmas = [horizontal_sigma, horizontal_sigma, vertical_sigma];
            let off = numbers(noise, PLACE) * DVec3::from_array(sigmas.map(f64::from));
            Geodetic::from_ecef(truth.ecef() + ecef_from_enu * off)
        };
        let of_earth = origin.place.ecef_from_enu() * velocity.zxy();
        let velocity = ecef_from_enu.transpose() * of_earth + numbers(noise, VELOCITY) * f64::from(velocity_sigma);
        GnssReading { place, velocity }
    }
}

fn numbers(noise: Noise, channel: u32) -> DVec3 {
    let [x, y, z, _] = noise.words(0, channel).map(|word| f64::from(normal(word)));
    DVec3::new(x, y, z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::describe::check::check;

    fn munich() -> GeoOrigin {
        let place = Geodetic { latitude_degrees: 48.137, longitude_degrees: 11.575, altitude: 519.0 };
        GeoOrigin { place, at: DVec3::new(5e6, 100.0, 7e5) }
    }

    #[test]
    fn the_scene_s_axes_are_east_north_and_up() {
        let origin = munich();
        let noise = Noise::new(0, 0, 0);
        let read = |off: DVec3, velocity| GnssSensor::default().measure(&origin, origin.at + off, velocity, noise);
        let here = read(DVec3::ZERO, DVec3::ZERO).place;
        assert!((here.latitude_degrees - 48.137).abs() < 1e-12 && (here.altitude - 519.0).abs() < 1e-8, "{here:?}");
        // A degree of latitude is 111,195 m there, one of longitude 74,410 m, within 0.5 %.
        let [north, east, up] = [DVec3::X, DVec3::Z, DVec3::Y].map(|axis| read(axis * 10.0, axis * 3.0));
        assert!(((north.place.latitude_degrees - 48.137) * 111_195.0 - 10.0).abs() < 0.05, "{north:?}");
        assert!((north.place.longitude_degrees - 11.575).abs() < 1e-9);
        assert!(((east.place.longitude_degrees - 11.575) * 74_410.0 - 10.0).abs() < 0.05, "{east:?}");
        assert!((up.place.altitude - 529.0).abs() < 1e-8 && (up.place.latitude_degrees - 48.137).abs() < 1e-12);
        for (reading, expected) in [(north, DVec3::Y), (east, DVec3::X), (up, DVec3::Z)] {
            // 10 m turn the directions by 10 m over 6,400 km, to the east by tan(latitude) of that.
            assert!(reading.velocity.abs_diff_eq(expected * 3.0, 3.0 * 2e-6), "{reading:?}");
        }
    }

    #[test]
    fn the_earth_bends_away_from_the_plane() {
        let origin = GeoOrigin::default();
        for metres in [1e3, 1e4, 1e5] {
            // East along the equator, which is a circle.
            let place = origin.geodetic(DVec3::Z * metres);
            let radius = 6_378_137.0f64;
            assert!((place.altitude - (radius.hypot(metres) - radius)).abs() < 1e-8, "{place:?}");
            assert!((place.longitude_degrees - (metres / radius).atan().to_degrees()).abs() < 1e-12);
        }
    }

    #[test]
    fn noise_has_the_deviations_that_it_is_given() {
        let noise = GnssNoise { horizontal_sigma: 1.5, vertical_sigma: 3.0, velocity_sigma: 0.1 };
        let (sensor, origin, count) = (GnssSensor { noise }, munich(), 20_000);
        let axes = origin.place.ecef_from_enu().transpose();
        let (mut sums, mut squares) = ([DVec3::ZERO; 2], [DVec3::ZERO; 2]);
        for step in 0..count {
            let found = sensor.measure(&origin, origin.at, DVec3::ZERO, Noise::new(1, 2, step));
            let off = axes * (found.place.ecef() - origin.place.ecef());
            for (i, value) in [off, found.velocity].into_iter().enumerate() {
                sums[i] += value;
                squares[i] += value * value;
            }
        }
        let n = count as f64;
        for (i, sigma) in [DVec3::new(1.5, 1.5, 3.0), DVec3::splat(0.1)].into_iter().enumerate() {
            let mean = sums[i] / n / sigma;
            // Three deviations of a mean, and of a variance; sigmas are 32-bit.
            assert!(mean.abs().max_element() < 3.0 / n.sqrt(), "{i}: {mean}");
            let spread = squares[i] / n / (sigma * sigma) - mean * mean - 1.0;
            assert!(spread.abs().max_element() < 3.0 * (1.99 / n).sqrt() + 1e-6, "{i}: {spread}");
        }
    }

    #[test]
    fn faults_are_named() {
        let noise = GnssNoise { vertical_sigma: f32::INFINITY, ..GnssNoise::default() };
        let fault = check(&GnssSensor { noise }).expect_err("out of range");
        assert_eq!(fault.to_string(), "noise.vertical_sigma: expected a number from 0 to 10000, found inf");
    }
}
