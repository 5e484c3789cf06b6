//! Weather by name. A preset has its sun at angles, so it needs no place on Earth.

use super::weather::{SkyModel, Weather};

/// Azimuth of a preset's sun and moon: degrees from north over east.
const AZIMUTH: f64 = 150.0;

/// A preset: the fields in which it differs from others.
#[derive(Clone, Copy, Debug)]
pub struct Preset {
    /// Name in scenes, on the command line, in Python and in the window.
    pub name: &'static str,
    /// Elevation of the sun, degrees.
    sun: f64,
    /// Elevation of the full moon, degrees.
    moon: Option<f64>,
    haze: f64,
    clouds: f64,
}

/// All presets.
pub const PRESETS: [Preset; 5] = [
    Preset { name: "clear_noon", sun: 55.0, moon: None, haze: 40_000.0, clouds: 0.0 },
    Preset { name: "overcast", sun: 40.0, moon: None, haze: 20_000.0, clouds: 1.0 },
    Preset { name: "golden_hour", sun: 6.0, moon: None, haze: 25_000.0, clouds: 0.1 },
    Preset { name: "dusk", sun: -5.0, moon: None, haze: 30_000.0, clouds: 0.1 },
    Preset { name: "night", sun: -40.0, moon: Some(35.0), haze: 40_000.0, clouds: 0.0 },
];

impl Weather {
    /// The weather of that name.
    pub fn preset(name: &str) -> Option<Self> {
        let preset = PRESETS.iter().find(|preset| preset.name == name)?;
        Some(Self {
            sky: SkyModel::Atmosphere,
            sun_azimuth_degrees: Some(AZIMUTH),
            sun_elevation_degrees: Some(preset.sun),
            moon_azimuth_degrees: preset.moon.map(|_| AZIMUTH),
            moon_elevation_degrees: preset.moon,
            haze: preset.haze,
            clouds: preset.clouds,
            ..Self::default()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::describe::check::check;

    #[test]
    fn presets_are_valid_and_need_no_place() {
        for preset in PRESETS {
            let weather = Weather::preset(preset.name).expect("its name");
            assert!(check(&weather).is_ok() && !weather.needs_place(), "{}", preset.name);
        }
        assert!(Weather::preset("noon").is_none());
    }
}
