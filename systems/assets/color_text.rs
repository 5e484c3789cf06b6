//! Colours as people write them: linear numbers, `#rrggbb` in sRGB, or a temperature.

use super::color::{linear_from_kelvin, linear_from_srgb};
use glam::Vec3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::ser::Error;
use serde::{Deserialize, Serialize, Serializer};
use std::borrow::Cow;
use std::fmt;

/// Largest component of a colour, and largest intensity.
pub const BRIGHTEST: f32 = 1e9;

/// A linear RGB colour, written in one of several ways.
#[derive(Deserialize, Clone, Copy, Debug, PartialEq)]
#[serde(from = "ColorText")]
pub struct Color(pub Result<Vec3, BadColor>);

/// Fault of a colour; kept as a value so that a check can report it beside everything else.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BadColor {
    /// Neither #rgb nor #rrggbb.
    Hex,
    /// Outside of what [`linear_from_kelvin`] knows.
    Kelvin,
}

impl fmt::Display for BadColor {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::Hex => "expected a colour like srgb(\"#ffcc88\") or srgb(\"#fc8\")",
            Self::Kelvin => "expected a temperature from 1667 to 25000 kelvin",
        })
    }
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a colour: (red, green, blue), srgb(\"#ffcc88\") or kelvin(2700)")]
enum ColorText {
    Linear([f32; 3]),
    Hex(Hex),
    Other(OtherColor),
}

/// Text that begins as a colour does.
#[derive(Deserialize)]
#[serde(try_from = "String")]
struct Hex(String);

impl TryFrom<String> for Hex {
    type Error = &'static str;

    fn try_from(text: String) -> Result<Self, &'static str> {
        if text.starts_with('#') { Ok(Self(text)) } else { Err("no colour") }
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum OtherColor {
    Srgb(String),
    Kelvin(f32),
}

impl From<ColorText> for Color {
    fn from(text: ColorText) -> Self {
        Self(match text {
            ColorText::Linear(rgb) => Ok(Vec3::from_array(rgb)),
            ColorText::Hex(Hex(hex)) | ColorText::Other(OtherColor::Srgb(hex)) => {
                linear_from_hex(&hex).ok_or(BadColor::Hex)
            }
            ColorText::Other(OtherColor::Kelvin(kelvin)) => linear_from_kelvin(kelvin).ok_or(BadColor::Kelvin),
        })
    }
}

/// Written as linear numbers. What is no colour cannot be written.
impl Serialize for Color {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.map_err(S::Error::custom)?.to_array().serialize(serializer)
    }
}

impl JsonSchema for Color {
    fn schema_name() -> Cow<'static, str> {
        "Color".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "anyOf": [
                {
                    "type": "array",
                    "items": { "type": "number" },
                    "minItems": 3,
                    "maxItems": 3,
                    "minimum": 0,
                    "maximum": BRIGHTEST,
                },
                { "type": "string", "pattern": "^#([0-9a-fA-F]{3}){1,2}$" },
                {
                    "type": "object",
                    "properties": {
                        "srgb": { "type": "string", "pattern": "^#([0-9a-fA-F]{3}){1,2}$" },
                        "kelvin": { "type": "number", "minimum": 1667, "maximum": 25000 },
                    },
                    "minProperties": 1,
                    "maxProperties": 1,
                    "additionalProperties": false,
                },
            ],
            "expected": "\"#rrggbb\" or three linear numbers",
            "see": "colour",
        })
    }
}

impl Color {
    /// A colour of linear components.
    pub const fn linear(rgb: Vec3) -> Self {
        Self(Ok(rgb))
    }

    /// Linear components; black where it is none, which a check has refused by then.
    pub fn rgb(self) -> Vec3 {
        self.0.unwrap_or(Vec3::ZERO)
    }
}

fn linear_from_hex(text: &str) -> Option<Vec3> {
    let hex = text.strip_prefix('#').filter(|hex| hex.bytes().all(|b| b.is_ascii_hexdigit()))?;
    let value = u32::from_str_radix(hex, 16).ok()?;
    let bytes = match hex.len() {
        3 => [8, 4, 0].map(|shift| (value >> shift & 15) * 17),
        6 => [16, 8, 0].map(|shift| value >> shift & 255),
        _ => return None,
    };
    Some(Vec3::from_array(bytes.map(|b| linear_from_srgb(b as f32 / 255.0))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hex_colours_are_decoded_from_srgb() {
        assert_eq!(linear_from_hex("#fff"), Some(Vec3::ONE));
        assert_eq!(linear_from_hex("#f80"), linear_from_hex("#ff8800"));
        let grey = linear_from_hex("#bcbcbc").expect("a colour");
        assert!((grey - 0.502_886).abs().max_element() < 1e-5, "{grey}");
        for bad in ["fff", "#ff", "#fffff", "#gggggg", "#+12345", "", "#"] {
            assert_eq!(linear_from_hex(bad), None, "{bad}");
        }
    }

    #[test]
    fn a_colour_is_read_in_each_of_its_ways() {
        let read = |text: &str| serde_json::from_str::<Color>(text).expect("a colour or a bad one");
        assert_eq!(read("[1, 0.5, 0]"), Color::linear(Vec3::new(1.0, 0.5, 0.0)));
        assert_eq!(read("\"#fff\""), read("{\"srgb\": \"#ffffff\"}"));
        assert_eq!(read("{\"kelvin\": 2700}").0.ok(), linear_from_kelvin(2700.0));
        assert_eq!((read("\"#ff\"").0, read("{\"kelvin\": 1}").0), (Err(BadColor::Hex), Err(BadColor::Kelvin)));
        assert!(serde_json::from_str::<Color>("\"red\"").is_err());
        let refused = serde_json::to_string(&read("\"#ff\"")).expect_err("no colour").to_string();
        assert_eq!(refused, BadColor::Hex.to_string());
    }
}
