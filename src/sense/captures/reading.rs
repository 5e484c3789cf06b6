//! Readings: what sensors without pictures measure, as records of named values.
//!
//! A record is a described struct: its fields have documentation and units. Files, `sensors.json`, Python and the window
//! go by that, and know no kind of sensor.

use crate::export::array::{Column, Values};
use crate::export::ros::{Encoded, Header};
use serde_json::Value;
use std::any::Any;
use std::fmt::Debug;
use std::io::{Error, Result};
use std::sync::Arc;
use systems::describe::{Described, Field, fields};

/// A record of what a sensor measured.
///
/// Attributes of a field, beside its documentation: `unit`, which `sensors.json` lists it by; `column`, the name of its
/// column in files, of nanoseconds that become seconds there; false for none.
pub trait Record: Described + Clone + PartialEq + Debug + Send + Sync {
    /// Last part of its topic in logs of ROS 2; `None`: these have no message of it.
    const TOPIC: Option<&'static str> = None;

    /// Message of it in these; `None`: this one has none. `header`: time of the capture, and the sensor's frame.
    ///
    /// # Errors
    /// A value that the message has no place for.
    fn message(&self, _header: Header) -> Result<Option<Encoded>> {
        Ok(None)
    }
}

/// Measurement of a sensor without pictures.
#[derive(Clone, Debug)]
pub struct Reading {
    /// Name of the sensor's kind.
    pub kind: &'static str,
    records: Arc<dyn Records>,
}

impl Reading {
    /// Reading of a kind: a record, or any number of them.
    pub fn new<T: Record>(kind: &'static str, records: Vec<T>) -> Self {
        Self { kind, records: Arc::new(records) }
    }

    /// Records of a type; `None` where they are of another.
    pub fn records<T: Record>(&self) -> Option<&[T]> {
        (&*self.records as &dyn Any).downcast_ref::<Vec<T>>().map(Vec::as_slice)
    }

    /// Number of records.
    pub fn rows(&self) -> usize {
        self.records.rows()
    }

    /// Fields of a record, in their order.
    pub fn fields(&self) -> Vec<Field> {
        self.records.fields()
    }

    /// Each record as an object of JSON.
    ///
    /// # Errors
    /// A value that JSON has no form for.
    pub fn values(&self) -> Result<Vec<Value>> {
        self.records.values()
    }

    /// Last part of its topic in logs of ROS 2, and its messages.
    ///
    /// # Errors
    /// A value that a message has no place for.
    pub fn messages(&self, header: Header) -> Result<Vec<(&'static str, Encoded)>> {
        self.records.messages(header)
    }

    /// Columns of its records, as files have them: truth values as bytes, times in seconds.
    ///
    /// # Errors
    /// A field that no column can hold.
    pub fn columns(&self) -> Result<Vec<OwnedColumn>> {
        let records = self.values()?;
        let held = self.fields().into_iter().filter(|field| field.schema["column"] != false);
        held.map(|field| OwnedColumn::new(&field, records.iter().map(|record| &record[field.name]))).collect()
    }

    /// Its values with their units, a line each.
    pub fn text(&self) -> String {
        let Ok(records) = self.values() else { return String::new() };
        let [record] = &records[..] else { return format!("{} found", records.len()) };
        if record["valid"] == false {
            return "not known".to_owned();
        }
        let shown = self.fields().into_iter().filter(|field| !field.unit().is_empty());
        let line = |field: Field| format!("{} {} {}", field.name, rounded(&record[field.name]), field.unit());
        shown.map(line).collect::<Vec<_>>().join("\n")
    }
}

impl PartialEq for Reading {
    fn eq(&self, other: &Self) -> bool {
        self.kind == other.kind && self.records.is_equal(&*other.records)
    }
}

/// Seven digits of a number.
fn rounded(value: &Value) -> String {
    match value {
        Value::Array(items) => items.iter().map(rounded).collect::<Vec<_>>().join(", "),
        Value::Number(number) if number.is_f64() => {
            let number = number.as_f64().unwrap_or_default();
            let digits = 6 - (number.abs().max(1.0).log10() as usize).min(6);
            format!("{number:.digits$}")
        }
        other => other.to_string(),
    }
}

/// Records of some type.
trait Records: Any + Debug + Send + Sync {
    fn rows(&self) -> usize;
    fn fields(&self) -> Vec<Field>;
    fn values(&self) -> Result<Vec<Value>>;
    fn messages(&self, header: Header) -> Result<Vec<(&'static str, Encoded)>>;
    fn is_equal(&self, other: &dyn Records) -> bool;
}

impl<T: Record> Records for Vec<T> {
    fn rows(&self) -> usize {
        self.len()
    }

    fn fields(&self) -> Vec<Field> {
        fields::<T>()
    }

    fn values(&self) -> Result<Vec<Value>> {
        self.iter().map(|record| serde_json::to_value(record).map_err(Error::from)).collect()
    }

    fn messages(&self, header: Header) -> Result<Vec<(&'static str, Encoded)>> {
        let Some(topic) = T::TOPIC else { return Ok(Vec::new()) };
        let messages = self.iter().filter_map(|record| record.message(header).transpose());
        messages.map(|message| Ok((topic, message?))).collect()
    }

    fn is_equal(&self, other: &dyn Records) -> bool {
        (other as &dyn Any).downcast_ref::<Self>() == Some(self)
    }
}

/// A column with its values.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnedColumn {
    name: &'static str,
    /// Of the values that one record has.
    shape: Vec<usize>,
    values: OwnedValues,
}

#[derive(Clone, Debug, PartialEq)]
enum OwnedValues {
    U8(Vec<u8>),
    U32(Vec<u32>),
    F64(Vec<f64>),
}

impl OwnedColumn {
    /// By the schema of the field; JSON's null is not a number.
    fn new<'a>(field: &Field, records: impl Iterator<Item = &'a Value>) -> Result<Self> {
        let schema = field.schema;
        let shape = schema["minItems"].as_u64().map(|count| count as usize).into_iter().collect();
        let one = if schema["items"].is_object() { &schema["items"] } else { schema };
        let flat = records.flat_map(|value| value.as_array().map_or(std::slice::from_ref(value), Vec::as_slice));
        let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
        let values = match (one["type"].as_str(), one["format"].as_str()) {
            (Some("boolean"), _) => OwnedValues::U8(flat.map(|value| u8::from(*value == true)).collect()),
            (_, Some("uint8")) => OwnedValues::U8(flat.map(|value| number(value) as u8).collect()),
            (_, Some("uint32")) => OwnedValues::U32(flat.map(|value| number(value) as u32).collect()),
            (_, Some("uint64")) => OwnedValues::F64(flat.map(|value| number(value) * 1e-9).collect()),
            (Some("number"), _) => OwnedValues::F64(flat.map(number).collect()),
            (kind, format) => {
                let found = format.or(kind).unwrap_or("nothing");
                let expected =
                    "a truth value, u8, u32, nanoseconds as u64, a number, or as many of these as in the others";
                return Err(Error::other(format!("{}: expected {expected}, found {found}", field.name)));
            }
        };
        Ok(Self { name: schema["column"].as_str().unwrap_or(field.name), shape, values })
    }

    /// The column.
    pub fn column(&self) -> Column<'_> {
        let values = match &self.values {
            OwnedValues::U8(values) => Values::U8(values),
            OwnedValues::U32(values) => Values::U32(values),
            OwnedValues::F64(values) => Values::F64(values),
        };
        Column { name: self.name, shape: &self.shape, values }
    }
}
