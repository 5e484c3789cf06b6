//! Readings: what sensors without pictures measure, as records of named values.
//!
//! A record is a described struct: its fields have documentation and units. Files, `sensors.json`, Python and the
//! window go by that, and know no kind of sensor.

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
/// Attributes of a field (`#[schemars(extend(…))]`), beside its documentation:
///
/// - `"unit"`: its unit in words, for `sensors.json`, which lists the fields that have one.
/// - `"column" = false`: files have no column of it.
/// - `"seconds" = "time"`: it is nanoseconds, u64; files have a column of that name, in seconds.
/// - `"shown" = "offset {3} m"`: its line in the window, with so many decimals.
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

    /// Its values in the window, a line for each field that is shown; of a list its length.
    pub fn text(&self) -> String {
        let (fields, records) = (self.fields(), self.values().unwrap_or_default());
        let line = |field: &Field| {
            let (before, rest) = field.schema["shown"].as_str()?.split_once('{')?;
            let (decimals, after) = rest.split_once('}')?;
            let value = rounded(records.first()?.get(field.name)?, decimals.parse().ok()?);
            Some(format!("{before}{value}{after}"))
        };
        let lines: Vec<String> = fields.iter().filter_map(line).collect();
        match &records[..] {
            [] => "nothing".to_owned(),
            [record] if record["valid"] == false => "not known".to_owned(),
            [_] if !lines.is_empty() => lines.join("\n"),
            records => format!("{} found", records.len()),
        }
    }
}

impl PartialEq for Reading {
    fn eq(&self, other: &Self) -> bool {
        self.kind == other.kind && self.records.is_equal(&*other.records)
    }
}

/// A number with so many decimals, or several.
fn rounded(value: &Value, decimals: usize) -> String {
    match value {
        Value::Array(items) => items.iter().map(|item| rounded(item, decimals)).collect::<Vec<_>>().join(", "),
        Value::Number(number) if number.is_f64() => format!("{:.decimals$}", number.as_f64().unwrap_or_default()),
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
    /// Shape of the values that one record has.
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
    /// Column of a field, by its schema. JSON's null is a number that is none.
    fn new<'a>(field: &Field, records: impl Iterator<Item = &'a Value>) -> Result<Self> {
        let schema = field.schema;
        let shape = schema["minItems"].as_u64().map(|count| count as usize).into_iter().collect();
        let one = if schema["items"].is_object() { &schema["items"] } else { schema };
        let flat = records.flat_map(|value| value.as_array().map_or(std::slice::from_ref(value), Vec::as_slice));
        let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
        // One that may be null has two types.
        let kind = one["type"].as_str().or(one["type"][0].as_str().filter(|kind| *kind == "number"));
        let seconds = schema["seconds"].as_str();
        let values = match (kind, one["format"].as_str(), seconds) {
            (Some("integer"), Some("uint64"), Some(_)) => {
                OwnedValues::F64(flat.map(|value| number(value) * 1e-9).collect())
            }
            (Some("boolean"), _, None) => OwnedValues::U8(flat.map(|value| u8::from(*value == true)).collect()),
            (Some("integer"), Some("uint8"), None) => OwnedValues::U8(flat.map(|value| number(value) as u8).collect()),
            (Some("integer"), Some("uint32"), None) => {
                OwnedValues::U32(flat.map(|value| number(value) as u32).collect())
            }
            (Some("number"), _, None) => OwnedValues::F64(flat.map(number).collect()),
            _ => {
                let expected = "bool, u8, u32, f32, f64 or an array of these, or nanoseconds as u64";
                return Err(Error::other(format!("{}: expected {expected}, found {}", field.name, one["type"])));
            }
        };
        Ok(Self { name: seconds.unwrap_or(field.name), shape, values })
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

#[cfg(test)]
mod tests {
    use super::*;
    use schemars::JsonSchema;
    use serde::{Deserialize, Serialize};

    #[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
    struct Weather {
        valid: bool,
        #[schemars(extend("seconds" = "time"))]
        nanoseconds: u64,
        station: u32,
        #[schemars(extend("shown" = "wind {1} m/s"))]
        wind: [f64; 2],
        gust: Option<f64>,
        #[schemars(extend("column" = false))]
        sigma: f32,
    }

    impl Described for Weather {}
    impl Record for Weather {}

    #[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
    struct Count {
        count: u64,
    }

    impl Described for Count {}
    impl Record for Count {}

    #[test]
    fn columns_have_the_types_and_the_order_of_fields() {
        let first =
            Weather { valid: true, nanoseconds: 1_500_000_000, station: 7, wind: [1.0, -2.5], ..Weather::default() };
        let second = Weather { gust: Some(9.0), ..Weather::default() };
        let columns = Reading::new("weather", vec![first, second]).columns().expect("columns");
        let named: Vec<_> = columns.iter().map(|column| (column.name, column.shape.clone())).collect();
        let expected = [("valid", vec![]), ("time", vec![]), ("station", vec![]), ("wind", vec![2]), ("gust", vec![])];
        assert_eq!(named, expected);
        assert_eq!(columns[0].values, OwnedValues::U8(vec![1, 0]));
        assert_eq!(columns[1].values, OwnedValues::F64(vec![1.5, 0.0]));
        assert_eq!(columns[2].values, OwnedValues::U32(vec![7, 0]));
        assert_eq!(columns[3].values, OwnedValues::F64(vec![1.0, -2.5, 0.0, 0.0]));
        assert!(matches!(&columns[4].values, OwnedValues::F64(gusts) if gusts[0].is_nan() && gusts[1] == 9.0));
        let none = Reading::new("weather", Vec::<Weather>::new()).columns().expect("columns without records");
        assert_eq!((none.len(), &none[2].values), (5, &OwnedValues::U32(vec![])));
    }

    #[test]
    fn a_number_that_is_no_time_is_not_taken_for_one() {
        let error = Reading::new("count", vec![Count { count: 5 }]).columns().expect_err("no column holds it");
        assert!(error.to_string().starts_with("count: expected bool, u8, u32, f32, f64"), "{error}");
    }

    #[test]
    fn text_has_the_fields_that_are_shown() {
        let text = |records| Reading::new("weather", records).text();
        let known = Weather { valid: true, wind: [1.25, -2.0], ..Weather::default() };
        assert_eq!(text(vec![known.clone()]), "wind 1.2, -2.0 m/s");
        assert_eq!([text(vec![]), text(vec![Weather::default()])], ["nothing", "not known"]);
        assert_eq!(text(vec![known.clone(), known]), "2 found");
    }
}
