//! Exposure and noise of cameras: as data, and as formulas of a pixel.
//!
//! Noise is that of the linear model of EMVA Standard 1288 (release 3.1, sections 2.1 and 2.2), with a normal number
//! for the Poisson distribution of electrons. Light L is exposed, 1 fills a well:
//!
//! ```text
//! electrons = L · full_well + dark,  and  √(electrons + read²) · n  more, with n of mean 0 and variance 1
//! counts    = black + gain · (2^bits − 1 − black) / full_well · electrons, rounded, from 0 to 2^bits − 1
//! L'        = (counts − black) / (gain · (2^bits − 1 − black))
//! ```
//!
//! So the variance of counts is affine in their mean: with K counts an electron it is
//! K · (mean − black) + K² · read² + 1/12, the last for rounding.

use super::components::CameraSensor;
use crate::describe::check::{Described, check};
use crate::describe::fault::{Fault, Trail};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Exposure of a camera.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Exposure {
    /// The scene's exposure.
    #[default]
    Scene,
    /// Times linear colours, in place of the scene's.
    Fixed(#[schemars(range(min = 0.0, max = 1e6))] f32),
    /// By what it sees in the same picture: such that the mean of log₂ luminance becomes log₂ `key` (Reinhard, Stark,
    /// Shirley, Ferwerda: "Photographic Tone Reproduction for Digital Images", SIGGRAPH 2002, section 3). Black pixels
    /// do not count.
    Metered {
        /// Luminance that the mean becomes.
        #[serde(default = "middle_grey")]
        #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 100))]
        key: f32,
        /// Powers of 2 by which it may differ from the scene's, both ways.
        #[serde(default = "most_stops")]
        #[schemars(range(min = 0.0, max = 32.0), extend("unit" = "stops"))]
        stops: f32,
    },
}

fn middle_grey() -> f32 {
    0.18
}

fn most_stops() -> f32 {
    8.0
}

/// Image sensor's part in a picture: noise, black and steps.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ImageNoise {
    /// Electrons of a linear colour of 1.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1_000_000_000), extend("unit" = "electrons"))]
    pub full_well: f32,
    /// Standard deviation of what reading adds.
    #[schemars(range(min = 0.0, max = 1e6), extend("unit" = "electrons"))]
    pub read: f32,
    /// Electrons without light, in mean.
    #[schemars(range(min = 0.0, max = 1e9), extend("unit" = "electrons"))]
    pub dark: f32,
    /// Counts an electron; at 1 a full well has the largest count.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1_000_000))]
    pub gain: f32,
    /// Bits of a count.
    #[schemars(extend("enum" = [8, 12]))]
    pub bits: u32,
    /// Count where there are no electrons; at most half of the largest.
    pub black: u32,
}

impl Default for ImageNoise {
    fn default() -> Self {
        Self { full_well: 10_000.0, read: 3.0, dark: 0.0, gain: 1.0, bits: 12, black: 64 }
    }
}

/// A luminance's log₂ in these parts is counted in whole numbers, so that sums do not depend on their order.
const PARTS: f64 = 65536.0;

/// Luminances from here on count: the least normal half float.
const DARKEST: f64 = 1.0 / 16384.0;

impl Described for Exposure {}

impl CameraSensor {
    /// Says what is wrong with its exposure or noise.
    ///
    /// # Errors
    /// The field, and what was expected.
    pub fn check_light(&self) -> Result<(), Fault> {
        let within = |field, fault: Fault| Trail::default().field(field).around(&fault);
        check(&self.exposure).map_err(|fault| within("exposure", fault))?;
        self.noise.map_or(Ok(()), |noise| check(&noise)).map_err(|fault| within("noise", fault))
    }
}

/// Log₂ luminances of a picture, as they are summed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LightMeter {
    sum: i64,
    count: i64,
}

impl LightMeter {
    /// With one more linear colour, of the sRGB primaries (luminance: ITU-R BT.709).
    #[must_use]
    pub fn with(self, [r, g, b]: [f64; 3]) -> Self {
        let luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        if !(DARKEST..f64::INFINITY).contains(&luminance) {
            return self;
        }
        self.and(Self { sum: (luminance.log2() * PARTS).round() as i64, count: 1 })
    }

    /// With those of another part of the picture.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self { sum: self.sum + other.sum, count: self.count + other.count }
    }

    /// Times what colours have their mean the key; 1 of a black picture.
    pub fn factor(self, key: f32, stops: f32) -> f64 {
        if self.count == 0 {
            return 1.0;
        }
        let mean = self.sum as f64 / PARTS / self.count as f64;
        let stops = f64::from(stops);
        (f64::from(key).log2() - mean).clamp(-stops, stops).exp2()
    }
}

impl Described for ImageNoise {
    fn check_whole(&self) -> Vec<Fault> {
        let most = self.largest() / 2;
        let expected = || format!("expected a whole number from 0 to {most}, found {}", self.black);
        let fault = || Trail::default().field("black").fault(expected());
        (self.black > most).then(fault).into_iter().collect()
    }
}

impl ImageNoise {
    fn largest(&self) -> u32 {
        (1 << self.bits.min(16)) - 1
    }

    /// K: counts an electron.
    pub fn counts_per_electron(&self) -> f64 {
        f64::from(self.gain) * f64::from(self.largest() - self.black) / f64::from(self.full_well)
    }

    /// Count of linear light after exposure. `n`: a random number of mean 0 and variance 1.
    pub fn counts(&self, light: f64, n: f64) -> u32 {
        let electrons = light.max(0.0) * f64::from(self.full_well) + f64::from(self.dark);
        let read = f64::from(self.read);
        let electrons = electrons + (electrons + read * read).sqrt() * n;
        let counts = f64::from(self.black) + self.counts_per_electron() * electrons;
        // Numbers that are none become 0.
        counts.round().clamp(0.0, self.largest().into()) as u32
    }

    /// The linear light that counts stand for; below 0 where they are below black.
    pub fn light(&self, counts: u32) -> f64 {
        let above_black = f64::from(counts) - f64::from(self.black);
        above_black / (self.counts_per_electron() * f64::from(self.full_well))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_those_of_the_model() {
        let noise = ImageNoise { full_well: 1000.0, read: 3.0, dark: 16.0, gain: 1.0, bits: 8, black: 5 };
        // 0.25 counts an electron.
        assert_eq!(noise.counts_per_electron(), 0.25);
        assert_eq!((noise.counts(0.0, 0.0), noise.counts(0.5, 0.0)), (9, 5 + 129));
        // √(16 + 9) = 5 electrons; √(384 + 16 + 9) = 20.22.
        assert_eq!((noise.counts(0.0, 2.0), noise.counts(0.0, -2.0)), (12, 7));
        assert_eq!(noise.counts(0.384, -2.0), (5.0 + 0.25 * (400.0 - 40.45_f64)).round() as u32);
        assert_eq!((noise.counts(2.0, 0.0), noise.counts(0.0, -20.0), noise.counts(f64::NAN, 0.0)), (255, 0, 9));
        assert_eq!((noise.light(5), noise.light(255), noise.light(0)), (0.0, 1.0, -0.02));
        let brighter = ImageNoise { gain: 4.0, ..noise };
        assert_eq!((brighter.counts(0.25, 0.0), brighter.light(255)), (255, 0.25));
    }

    #[test]
    fn a_meter_finds_the_geometric_mean() {
        let half = LightMeter::default().with([0.5; 3]).with([0.125; 3]).with([0.0; 3]);
        // log₂ 0.25 is −2, and weights of luminances add up to 1.
        assert!((half.factor(0.5, 8.0) - 2.0).abs() < 1e-4);
        assert!((half.factor(100.0, 3.0) - 8.0).abs() < 1e-12 && (half.factor(1e-4, 3.0) - 0.125).abs() < 1e-12);
        assert_eq!(LightMeter::default().with([f64::INFINITY; 3]).factor(0.18, 8.0), 1.0);
        let parts = LightMeter::default().with([0.125; 3]).and(LightMeter::default().with([0.5; 3]));
        assert_eq!(half, parts);
    }

    #[test]
    fn what_no_sensor_has_is_refused() {
        let noise = ImageNoise::default();
        let camera = |noise| CameraSensor { noise: Some(noise), ..CameraSensor::default() };
        assert_eq!(camera(noise).check_light(), Ok(()));
        let refusal = |noise: ImageNoise| camera(noise).check_light().unwrap_err().to_string();
        assert!(refusal(ImageNoise { full_well: 0.0, ..noise }).starts_with("noise.full_well: "));
        assert!(refusal(ImageNoise { read: f32::NAN, ..noise }).starts_with("noise.read: "));
        assert_eq!(refusal(ImageNoise { bits: 10, ..noise }), "noise.bits: expected 8 or 12, found 10");
        let black = ImageNoise { bits: 8, black: 128, ..noise };
        assert_eq!(refusal(black), "noise.black: expected a whole number from 0 to 127, found 128");
        let exposed = |exposure| CameraSensor { exposure, ..CameraSensor::default() }.check_light().unwrap_err().place;
        assert_eq!(exposed(Exposure::Fixed(-1.0)), "exposure");
        assert_eq!(exposed(Exposure::Metered { key: 0.0, stops: 1.0 }), "exposure.key");
    }
}
