//! Values with more than one way of writing: colours, scales, and lists of named things.

use glam::{DVec3, Vec3};
use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, EnumAccess, Error, MapAccess, VariantAccess, Visitor};
use std::collections::HashMap;
use std::fmt;
use std::marker::PhantomData;
use systems::assets::color::{linear_from_kelvin, linear_from_srgb};
use systems::lights::Light;

/// `{ "name": value, … }` in the order of the file; the same name twice is kept for the check to find.
#[derive(Debug)]
pub struct Named<T> {
    entries: Vec<(String, T)>,
    /// The first entry of each name.
    index: HashMap<String, usize>,
}

impl<T> Default for Named<T> {
    fn default() -> Self {
        Self { entries: Vec::new(), index: HashMap::new() }
    }
}

impl<T> Named<T> {
    pub fn entries(&self) -> &[(String, T)] {
        &self.entries
    }

    pub fn entries_mut(&mut self) -> &mut [(String, T)] {
        &mut self.entries
    }

    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.entries.iter().map(|(name, _)| name.as_str())
    }

    /// Position of the first entry of that name.
    pub fn position(&self, name: &str) -> Option<usize> {
        self.index.get(name).copied()
    }

    pub fn get(&self, name: &str) -> Option<&T> {
        self.position(name).and_then(|i| self.entries.get(i)).map(|(_, value)| value)
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Named<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Entries<T> {
            type Value = Named<T>;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("named entries: { \"name\": … }")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut named = Named::default();
                while let Some((name, value)) = map.next_entry::<String, T>()? {
                    named.index.entry(name.clone()).or_insert(named.entries.len());
                    named.entries.push((name, value));
                }
                Ok(named)
            }
        }
        deserializer.deserialize_map(Entries(PhantomData))
    }
}

/// The names of a list.
pub const fn names<T: Copy, const N: usize>(all: &[(&'static str, T); N]) -> [&'static str; N] {
    let mut names = [""; N];
    let mut i = 0;
    while i < N {
        names[i] = all[i].0;
        i += 1;
    }
    names
}

/// Reads one of the names of a list as serde reads the variants of an enum.
pub fn one_of<'de, D: Deserializer<'de>, T: Copy>(
    all: &'static [(&'static str, T)],
    names: &'static [&'static str],
    deserializer: D,
) -> Result<T, D::Error> {
    #[derive(Clone, Copy)]
    struct OneOf<T: 'static> {
        all: &'static [(&'static str, T)],
        names: &'static [&'static str],
    }

    impl<'de, T: Copy> Visitor<'de> for OneOf<T> {
        type Value = T;

        fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
            write!(f, "one of {}", self.names.join(", "))
        }

        fn visit_enum<A: EnumAccess<'de>>(self, data: A) -> Result<T, A::Error> {
            let (value, rest) = data.variant_seed(self)?;
            rest.unit_variant()?;
            Ok(value)
        }

        fn visit_str<E: Error>(self, name: &str) -> Result<T, E> {
            let found = self.all.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| *value).ok_or_else(|| E::unknown_variant(name, self.names))
        }
    }

    impl<'de, T: Copy> DeserializeSeed<'de> for OneOf<T> {
        type Value = T;

        fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<T, D::Error> {
            deserializer.deserialize_identifier(self)
        }
    }

    deserializer.deserialize_enum("", names, OneOf { all, names })
}

/// A linear RGB colour, written in one of three ways.
#[derive(Deserialize, Clone, Copy, Debug, PartialEq)]
#[serde(from = "ColorText")]
pub struct Color(pub Result<Vec3, BadColor>);

/// Fault of a colour; kept as a value so that the check can report it beside everything else.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BadColor {
    /// Not #rgb or #rrggbb.
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
    Other(OtherColor),
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
            ColorText::Other(OtherColor::Srgb(hex)) => linear_from_hex(&hex).ok_or(BadColor::Hex),
            ColorText::Other(OtherColor::Kelvin(kelvin)) => linear_from_kelvin(kelvin).ok_or(BadColor::Kelvin),
        })
    }
}

impl Color {
    pub fn linear(rgb: Vec3) -> Self {
        Self(Ok(rgb))
    }

    /// The colour; black where it is bad, which the check has refused by then.
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

/// Constant, linear and quadratic; or `inverse_square`.
#[derive(Deserialize, Clone, Copy, Debug, PartialEq)]
#[serde(from = "AttenuationText")]
pub struct Attenuation(pub [f32; 3]);

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected (constant, linear, quadratic) or inverse_square")]
enum AttenuationText {
    Classic([f32; 3]),
    Named(NamedAttenuation),
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum NamedAttenuation {
    InverseSquare,
}

impl From<AttenuationText> for Attenuation {
    fn from(text: AttenuationText) -> Self {
        Self(match text {
            AttenuationText::Classic(coefficients) => coefficients,
            AttenuationText::Named(NamedAttenuation::InverseSquare) => Light::INVERSE_SQUARE.to_array(),
        })
    }
}

/// A place of a file as the world keeps it.
pub fn place(place: [f64; 3]) -> Vec3 {
    DVec3::from_array(place).as_vec3()
}

/// One number for all three axes, or one for each.
#[derive(Deserialize, Clone, Copy, Debug)]
#[serde(untagged, expecting = "expected a number or (x, y, z)")]
pub enum Scale {
    Uniform(f32),
    PerAxis([f32; 3]),
}

impl Default for Scale {
    fn default() -> Self {
        Self::Uniform(1.0)
    }
}

impl Scale {
    pub fn vec3(self) -> Vec3 {
        match self {
            Self::Uniform(s) => Vec3::splat(s),
            Self::PerAxis(s) => Vec3::from_array(s),
        }
    }
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
}
