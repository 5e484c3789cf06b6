//! Weather as people describe it: in scene files, in Python, in the window.

use super::date::Date;
use crate::describe::check::Described;
use crate::describe::fault::{Fault, Trail};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Source of the sky's light.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SkyModel {
    /// Three colours of the [`Environment`](crate::draw::Environment): zenith, horizon and ground. No other field of
    /// the weather has an effect.
    #[default]
    Gradient,
    /// Air that scatters the light of sun and moon.
    Atmosphere,
}

/// Weather at a moment, and the way in which its date goes on.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Weather {
    /// Source of the sky's light: `gradient` of the environment's three colours, or `atmosphere`, in which sun and moon
    /// shine. All other fields are the atmosphere's.
    pub sky: SkyModel,
    /// Date and time at which this weather begins, by ISO 8601 with the offset from UTC.
    pub date: Date,
    /// Seconds by which the date goes on in a second of the clock.
    #[schemars(range(min = 0.0, max = 1e4))]
    pub time_speed: f64,
    /// Direction to the sun, from north (+X) over east (+Z); by default that of the date and the scene's `geo_origin`.
    #[schemars(range(min = -360.0, max = 360.0), extend("unit" = "°"))]
    pub sun_azimuth_degrees: Option<f64>,
    /// Elevation of the sun's middle, beside `sun_azimuth_degrees`.
    #[schemars(range(min = -90.0, max = 90.0), extend("unit" = "°"))]
    pub sun_elevation_degrees: Option<f64>,
    /// Direction to a full moon, from north over east; by default to the date's moon, of its own phase.
    #[schemars(range(min = -360.0, max = 360.0), extend("unit" = "°"))]
    pub moon_azimuth_degrees: Option<f64>,
    /// Elevation of the full moon's middle, beside `moon_azimuth_degrees`.
    #[schemars(range(min = -90.0, max = 90.0), extend("unit" = "°"))]
    pub moon_elevation_degrees: Option<f64>,
    /// Visibility in the air: the distance at which the contrast of black with the horizon falls to 0.02.
    #[schemars(range(min = 2000.0, max = 200_000.0), extend("unit" = "m"))]
    pub haze: f64,
    /// Part of the sky that clouds cover, evenly: they have no shapes.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub clouds: f64,
    /// Luminance of the night sky without sun and moon; a town's is 0.01 to 0.1.
    #[schemars(range(min = 0.0, max = 10.0), extend("unit" = "cd/m²"))]
    pub glow: f64,
}

impl Default for Weather {
    fn default() -> Self {
        Self {
            sky: SkyModel::default(),
            date: Date::default(),
            time_speed: 1.0,
            sun_azimuth_degrees: None,
            sun_elevation_degrees: None,
            moon_azimuth_degrees: None,
            moon_elevation_degrees: None,
            haze: 40_000.0,
            clouds: 0.0,
            glow: 0.0002,
        }
    }
}

/// Direction of a body: azimuth and elevation, degrees.
pub(crate) type Angles = (f64, f64);

impl Weather {
    /// Message where it needs a place and there is none.
    pub const EXPECTED_PLACE: &str = "expected sun_azimuth_degrees and sun_elevation_degrees, or the scene's geo_origin, \
                                      by which the sun stands at its date";

    /// Direction of the sun, if it is not the date's: azimuth and elevation, degrees.
    pub(crate) fn sun(&self) -> Option<Angles> {
        self.sun_azimuth_degrees.zip(self.sun_elevation_degrees)
    }

    /// Direction of a full moon, if it is not the date's: azimuth and elevation, degrees.
    pub(crate) fn moon(&self) -> Option<Angles> {
        self.moon_azimuth_degrees.zip(self.moon_elevation_degrees)
    }

    /// Tells if it makes sense only where the scene's place on Earth is known.
    pub fn needs_place(&self) -> bool {
        let is_given = self.sun_azimuth_degrees.is_some() || self.sun_elevation_degrees.is_some();
        self.sky == SkyModel::Atmosphere && !is_given
    }

    /// Part `t` of the way from this weather to another. Azimuths go the shorter way; a sun that one has by
    /// its date and the other by angles jumps at once, as does the source of the sky's light.
    pub(crate) fn toward(&self, other: &Self, t: f64) -> Self {
        let mix = |from: f64, to: f64| from + (to - from) * t;
        let elevation = |from: Option<f64>, to: Option<f64>| from.zip(to).map(|(from, to)| mix(from, to)).or(to);
        let azimuth = |from: Option<f64>, to: Option<f64>| {
            let shorter = |from: f64, to: f64| from + ((to - from + 180.0).rem_euclid(360.0) - 180.0) * t;
            // Within the range of the field: beyond one turn it is another name of the same.
            let within = |azimuth: f64| if azimuth.abs() > 360.0 { azimuth % 360.0 } else { azimuth };
            from.zip(to).map(|(from, to)| within(shorter(from, to))).or(to)
        };
        Self {
            sky: other.sky,
            date: Date(mix(self.date.0, other.date.0)),
            time_speed: other.time_speed,
            sun_azimuth_degrees: azimuth(self.sun_azimuth_degrees, other.sun_azimuth_degrees),
            sun_elevation_degrees: elevation(self.sun_elevation_degrees, other.sun_elevation_degrees),
            moon_azimuth_degrees: azimuth(self.moon_azimuth_degrees, other.moon_azimuth_degrees),
            moon_elevation_degrees: elevation(self.moon_elevation_degrees, other.moon_elevation_degrees),
            haze: mix(self.haze, other.haze),
            clouds: mix(self.clouds, other.clouds),
            glow: mix(self.glow, other.glow),
        }
    }
}

impl Described for Weather {
    fn check_whole(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        let mut both = |body: &str, azimuth: &'static str, elevation: &'static str, angles: [Option<f64>; 2]| {
            let missing = match angles {
                [Some(_), None] => elevation,
                [None, Some(_)] => azimuth,
                _ => return,
            };
            let message =
                format!("expected azimuth and elevation of the {body}, or none of them; {missing} is missing");
            let given = if missing == azimuth { elevation } else { azimuth };
            faults.push(Trail::default().field(given).fault(message));
        };
        let sun = [self.sun_azimuth_degrees, self.sun_elevation_degrees];
        both("sun", "sun_azimuth_degrees", "sun_elevation_degrees", sun);
        let moon = [self.moon_azimuth_degrees, self.moon_elevation_degrees];
        both("moon", "moon_azimuth_degrees", "moon_elevation_degrees", moon);
        if !self.date.is_known() {
            faults.push(Trail::default().field("date").fault("expected a date from 1900 to 2100"));
        }
        faults
    }
}
