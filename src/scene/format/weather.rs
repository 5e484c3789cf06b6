//! Weather of a scene: a preset's name, or fields.

use crate::name;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Visitor};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fmt;
use systems::describe::{Described, Fault};
use systems::weather::{PRESETS, Weather};

/// Weather, written as the name of a preset or as its fields.
#[derive(Serialize, Clone, Debug, Default)]
#[serde(transparent)]
pub struct GivenWeather(pub Weather);

impl Described for GivenWeather {
    fn check_whole(&self) -> Vec<Fault> {
        self.0.check_whole()
    }
}

/// Weather of a preset.
///
/// # Errors
/// No preset has that name; the message has the nearest.
pub fn preset(name: &str) -> Result<Weather, String> {
    let names = PRESETS.iter().map(|preset| preset.name);
    Weather::preset(name).ok_or_else(|| name::unknown("weather", names, name))
}

/// By hand and not `untagged`, which would lose the place and the nearest name of an unknown field.
impl<'de> Deserialize<'de> for GivenWeather {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NameOrFields;
        impl<'de> Visitor<'de> for NameOrFields {
            type Value = GivenWeather;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("the name of a preset in quotes, as \"golden_hour\", or fields, as (sky: atmosphere)")
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<GivenWeather, E> {
                preset(name).map(GivenWeather).map_err(E::custom)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<GivenWeather, A::Error> {
                Weather::deserialize(MapAccessDeserializer::new(map)).map(GivenWeather)
            }
        }
        deserializer.deserialize_any(NameOrFields)
    }
}

impl JsonSchema for GivenWeather {
    fn schema_name() -> Cow<'static, str> {
        "GivenWeather".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let fields = generator.subschema_for::<Weather>();
        let names: Vec<&str> = PRESETS.iter().map(|preset| preset.name).collect();
        json_schema!({ "anyOf": [fields, { "type": "string", "enum": names }], "see": "[weather](weather.md#fields)" })
    }
}
