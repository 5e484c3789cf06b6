//! Barometers: the pressure of the standard atmosphere at an altitude.

use super::philox::{Noise, normal};
use crate::describe::check::Described;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Constants of the U.S. Standard Atmosphere, 1976 (NOAA-S/T 76-1562, tables 2 to 4): standard gravity, m/s²; molar
/// mass of air, kg/mol; gas constant, J/(mol K); radius of the Earth by which altitudes become geopotential, metres.
const STANDARD_GRAVITY: f64 = 9.806_65;
const MOLAR_MASS: f64 = 0.028_964_4;
const GAS: f64 = 8.314_32;
const EARTH_RADIUS: f64 = 6_356_766.0;
/// Layers from below up: geopotential metres where each begins, and how much warmer a metre higher is, K/m.
const LAYERS: [(f64, f64); 7] = [
    (0.0, -0.0065),
    (11_000.0, 0.0),
    (20_000.0, 0.001),
    (32_000.0, 0.0028),
    (47_000.0, 0.0),
    (51_000.0, -0.0028),
    (71_000.0, -0.002),
];

/// A barometer, which measures the static pressure of the air.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BarometerSensor {
    /// Pressure of the air at sea level.
    #[schemars(range(min = 80_000.0, max = 120_000.0), extend("unit" = "Pa"))]
    pub sea_level_pressure: f32,
    /// Temperature of the air at sea level.
    #[schemars(range(min = 200.0, max = 340.0), extend("unit" = "K"))]
    pub sea_level_temperature: f32,
    /// Errors of real ones.
    pub noise: BarometerNoise,
}

impl Default for BarometerSensor {
    /// The standard atmosphere.
    fn default() -> Self {
        Self { sea_level_pressure: 101_325.0, sea_level_temperature: 288.15, noise: BarometerNoise::default() }
    }
}

/// Noise of a barometer; by default there is none.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BarometerNoise {
    /// Standard deviation of the pressure, of each reading by itself.
    #[schemars(range(min = 0.0, max = 1e4), extend("unit" = "Pa"))]
    pub pressure_sigma: f32,
    /// Added to every pressure.
    #[schemars(range(min = -1e4, max = 1e4), extend("unit" = "Pa"))]
    pub pressure_bias: f32,
}

impl Described for BarometerSensor {}

impl BarometerSensor {
    /// Measures the pressure, Pa, at an altitude above sea level, metres.
    pub fn measure(&self, altitude: f64, noise: Noise) -> f64 {
        let BarometerNoise { pressure_sigma, pressure_bias } = self.noise;
        let error = normal(noise.words(0, 0)[0]) * pressure_sigma + pressure_bias;
        self.pressure(altitude) + f64::from(error)
    }

    /// Pressure at an altitude, layer by layer: p (T′/T)^(−g M/(R L)) where it is L K warmer a metre higher, and
    /// p exp(−g M ΔH/(R T)) where it is as warm (U.S. Standard Atmosphere, 1976, equations 33a and 33b).
    fn pressure(&self, altitude: f64) -> f64 {
        let height = EARTH_RADIUS * altitude / (EARTH_RADIUS + altitude);
        let per_metre = STANDARD_GRAVITY * MOLAR_MASS / GAS;
        let ends = LAYERS[1..].iter().map(|(begin, _)| *begin).chain([f64::INFINITY]);
        let (mut pressure, mut temperature) =
            (f64::from(self.sea_level_pressure), f64::from(self.sea_level_temperature));
        for ((begin, lapse), end) in LAYERS.into_iter().zip(ends) {
            let through = height.min(end) - begin;
            // The lowest goes on below the sea.
            if through <= 0.0 && begin > 0.0 {
                break;
            }
            let above = temperature + lapse * through;
            pressure *= match lapse {
                0.0 => (-per_metre * through / temperature).exp(),
                _ => (above / temperature).powf(-per_metre / lapse),
            };
            temperature = above;
        }
        pressure
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pressures_are_those_of_the_table_of_the_standard_atmosphere() {
        let quiet = Noise::new(0, 0, 0);
        // Geometric metres and pascals of table I of the standard, to the four or five digits that it has.
        let table =
            [(-500.0, 107_480.0), (0.0, 101_325.0), (1000.0, 89_876.0), (5000.0, 54_048.0), (15_000.0, 12_111.0)];
        for (altitude, expected) in table {
            let found = BarometerSensor::default().measure(altitude, quiet);
            assert!((found / expected - 1.0).abs() < 1e-4, "{altitude} m: {found} Pa");
        }
    }

    #[test]
    fn noise_has_its_deviation_and_its_bias() {
        let noise = BarometerNoise { pressure_sigma: 12.0, pressure_bias: -30.0 };
        let (sensor, count) = (BarometerSensor { noise, ..BarometerSensor::default() }, 50_000);
        let errors = (0..count).map(|step| sensor.measure(0.0, Noise::new(1, 2, step)) - 101_325.0);
        let (sum, squares) = errors.fold((0.0, 0.0), |(sum, squares), off| (sum + off, squares + off * off));
        let n = count as f64;
        let mean = sum / n;
        // Three deviations of a mean, and of a variance.
        assert!((mean + 30.0).abs() < 3.0 * 12.0 / n.sqrt(), "{mean}");
        let spread = (squares / n - mean * mean) / 144.0 - 1.0;
        assert!(spread.abs() < 3.0 * (2.0 / n).sqrt(), "{spread}");
    }
}
