//! Fields of described structs, read from their JSON schemas.

use super::check::Described;
use super::fault::{Fault, Trail};
use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde::de::{DeserializeOwned, Deserializer, Error, Visitor};
use serde_json::Value;
use std::any::TypeId;
use std::collections::HashMap;
use std::sync::{LazyLock, Mutex, PoisonError};

/// JSON schema of a type, with those of its fields in place of references.
pub fn schema<T: JsonSchema + 'static>() -> &'static Value {
    static KNOWN: LazyLock<Mutex<HashMap<TypeId, &'static Value>>> = LazyLock::new(Mutex::default);
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    known.entry(TypeId::of::<T>()).or_insert_with(|| {
        let settings = SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true);
        // One for each type, for as long as the program runs.
        Box::leak(Box::new(settings.into_generator().into_root_schema_for::<T>().to_value()))
    })
}

/// A field of a described struct.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Its name in scene files and in Python.
    pub name: &'static str,
    /// Its part of the struct's schema.
    pub schema: &'static Value,
}

impl Field {
    /// First paragraph of its documentation.
    pub fn doc(&self) -> &'static str {
        self.schema["description"].as_str().unwrap_or_default()
    }

    /// Symbol of its unit; empty where it has none.
    pub fn unit(&self) -> &'static str {
        self.schema["unit"].as_str().unwrap_or_default()
    }

    /// Strings that it may be, if it may be no other.
    pub fn names(&self) -> Vec<&'static str> {
        names(self.schema)
    }

    /// Tells if it is always there and has fields of its own, as the noise of a sensor.
    pub fn is_part(&self) -> bool {
        self.schema["type"] == "object" && self.schema["properties"].is_object()
    }

    /// The struct that may be there, or not.
    pub fn optional_part(&self) -> Option<&'static Value> {
        let choices = self.schema["anyOf"].as_array().into_iter().flatten();
        let may_be_none = |choice: &Value| choice["type"] == "null" || choice["type"][1] == "null";
        if ![self.schema].into_iter().chain(choices.clone()).any(may_be_none) {
            return None;
        }
        [self.schema].into_iter().chain(choices).find(|choice| choice["properties"].is_object())
    }

    /// Tells if the thing's kind has it.
    pub fn is_of(&self, kind: &str) -> bool {
        self.schema["kinds"].as_array().is_none_or(|kinds| kinds.iter().any(|own| own == kind))
    }

    /// Reason for which a thing of another kind does not have it. `thing`: `directional light`.
    pub fn refusal(&self, thing: &str) -> String {
        let kinds: Vec<&str> =
            self.schema["kinds"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        format!("a {thing} has none; only {} have it", kinds.join(" and "))
    }

    /// Tells if infinity is written by leaving it out.
    pub fn is_infinite(&self) -> bool {
        self.schema["infinite"] == true
    }
}

/// Strings that a value may be, if it may be no other.
pub fn names(schema: &Value) -> Vec<&str> {
    let choices = schema["oneOf"].as_array().into_iter().flatten();
    let values = schema["enum"].as_array().into_iter().flatten().chain(choices.map(|choice| &choice["const"]));
    values.map(Value::as_str).collect::<Option<_>>().unwrap_or_default()
}

/// Fields of a described struct, in their order.
pub fn fields<T: Described>() -> Vec<Field> {
    let properties = &schema::<T>()["properties"];
    field_names::<T>().iter().map(|name| Field { name, schema: &properties[name] }).collect()
}

/// Fields of the struct that a schema is of, in the order of their names.
pub fn fields_of(schema: &'static Value) -> impl Iterator<Item = Field> {
    let properties = schema["properties"].as_object().into_iter().flatten();
    properties.map(|(name, schema)| Field { name, schema })
}

/// Faults of fields that a thing of that kind does not have, and which are not as they are by default. `noun`: `light`,
/// for messages.
pub fn of_other_kinds<T: Described>(kind: &str, noun: &str, value: &T) -> Vec<Fault> {
    let Ok(values) = serde_json::to_value(value) else { return Vec::new() };
    let foreign = fields_of(schema::<T>()).filter(|field| !field.is_of(kind));
    let given = foreign.filter(|field| values[field.name] != field.schema["default"]);
    given.map(|field| Trail::default().field(field.name).fault(field.refusal(&format!("{kind} {noun}")))).collect()
}

/// Names of the fields that serde reads of a struct, in their order; of anything else none.
pub fn field_names<T: DeserializeOwned>() -> &'static [&'static str] {
    let mut names: &'static [&'static str] = &[];
    _ = T::deserialize(Names(&mut names));
    names
}

/// A deserializer that keeps the names of fields that it is asked for, and gives nothing.
struct Names<'a>(&'a mut &'static [&'static str]);

impl<'de> Deserializer<'de> for Names<'_> {
    type Error = serde::de::value::Error;

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Self::Error> {
        Err(Error::custom("nothing is there"))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Self::Error> {
        *self.0 = fields;
        self.deserialize_any(visitor)
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}
