//! Sensors with their rate, and the classes that outputs have for what is seen. What a sensor of a kind is stands on
//! its settings in [`systems::sensors`].

use super::custom::{Beside, Others, beside};
use super::values::Named;
use crate::scene::text::faults::suggestion;
use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Error as _, MapAccess};
use serde::ser::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;
use std::borrow::Cow;
use systems::assets::color::srgb_from_linear;
use systems::assets::color_text::Color;
use systems::describe::{Described, field_names};
use systems::sensors::{ClassInfo, Classes, Rate, Sensor, SensorKind};

/// A sensor as a file has it: `lidar(hz: 10, every: 6)`.
#[derive(Debug)]
pub struct Mounted(pub Sensor);

impl<'de> Deserialize<'de> for Mounted {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (kind, Rate { every, phase }) = read_with_rate(deserializer, |inner| SensorKind::deserialize(inner))?;
        Ok(Self(Sensor { kind, every, phase }))
    }
}

/// Reads settings with the fields of [`Rate`] among them. `derived`: reads them alone.
///
/// # Errors
/// Those of the deserializer.
pub(crate) fn read_with_rate<'de, D: Deserializer<'de>, T>(
    deserializer: D,
    derived: impl FnOnce(Beside<'_, D, RateBeside>) -> Result<T, D::Error>,
) -> Result<(T, Rate), D::Error> {
    let (settings, RateBeside { every, phase }) = beside(deserializer, derived)?;
    let usual = Rate::default();
    Ok((settings, Rate { every: every.unwrap_or(usual.every), phase: phase.unwrap_or(usual.phase) }))
}

impl Serialize for Mounted {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Sensor { kind, every, phase } = &self.0;
        let mut value = serde_json::to_value(kind).map_err(S::Error::custom)?;
        for settings in value.as_object_mut().into_iter().flat_map(|kinds| kinds.values_mut()) {
            (settings["every"], settings["phase"]) = ((*every).into(), (*phase).into());
        }
        value.serialize(serializer)
    }
}

/// Settings of each kind, with the fields of [`Rate`] among them.
impl JsonSchema for Mounted {
    fn schema_name() -> Cow<'static, str> {
        "Sensor".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let settings = SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true);
        let mut generator = settings.into_generator();
        let (mut schema, rate) = (SensorKind::json_schema(&mut generator), Rate::json_schema(&mut generator));
        let kinds = schema.get_mut("oneOf").and_then(Value::as_array_mut).into_iter().flatten();
        for settings in kinds.filter_map(|kind| kind["properties"].as_object_mut()).flat_map(|kind| kind.values_mut()) {
            if let (Some(own), Some(Value::Object(fields))) =
                (settings["properties"].as_object_mut(), rate.get("properties"))
            {
                own.extend(fields.clone());
            }
        }
        schema
    }
}

/// The fields of [`Rate`] among those of a kind of sensor.
#[derive(Default)]
pub(crate) struct RateBeside {
    every: Option<u32>,
    phase: Option<u32>,
}

impl Others for RateBeside {
    fn take<'de, A: MapAccess<'de>>(
        &mut self,
        name: String,
        own: &'static [&'static str],
        map: &mut A,
    ) -> Result<(), A::Error> {
        let names = field_names::<Rate>();
        let (field, name) = match names.iter().position(|known| *known == name) {
            Some(0) => (&mut self.every, names[0]),
            Some(_) => (&mut self.phase, names[1]),
            None => {
                let known: Vec<&str> = own.iter().chain(names).copied().collect();
                return Err(A::Error::custom(format!("unknown field {name:?}{}", suggestion(&name, &known))));
            }
        };
        if field.replace(map.next_value()?).is_some() {
            return Err(A::Error::duplicate_field(name));
        }
        Ok(())
    }
}

/// A semantic class of a scene's own.
#[derive(Serialize, Deserialize, JsonSchema, Debug)]
#[serde(deny_unknown_fields)]
pub struct Class {
    /// Number of the class in outputs; 0 is what has no class.
    #[schemars(range(min = 1))]
    pub id: u8,
    /// Colour in pictures of labels.
    #[serde(default = "black")]
    #[schemars(extend("maximum" = 1))]
    pub color: Color,
    /// Counted one by one, as vehicles and persons are.
    #[serde(default)]
    pub thing: bool,
    /// Number of the class in training; 255: left out.
    #[serde(default = "not_trained")]
    pub train_id: u8,
}

impl Described for Class {}

fn black() -> Color {
    Color::linear(glam::Vec3::ZERO)
}

fn not_trained() -> u8 {
    255
}

/// A scene's classes; those of Cityscapes where it has none of its own.
pub fn classes(own: &Named<Class>) -> Classes {
    if own.entries().is_empty() {
        return Classes::cityscapes();
    }
    let unlabeled = Classes::cityscapes().0.into_iter().take(1);
    let class = |(name, class): &(String, Class)| ClassInfo {
        id: class.id,
        name: name.clone(),
        color: class.color.rgb().to_array().map(|linear| (srgb_from_linear(linear) * 255.0).round() as u8),
        is_thing: class.thing,
        train_id: class.train_id,
    };
    Classes(unlabeled.chain(own.entries().iter().map(class)).collect())
}
