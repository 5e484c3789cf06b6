//! Fields of what is described: taken from keywords, and shown, by the JSON schemas of their structs. So what a field
//! is stands once, beside it.

use crate::errors::{Failure, Outcome};
use crate::given::arguments::{Given, Keywords, Names, Row, finite, found, items, number, required, wrong_type};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyList, PyString, PyTuple};
use relief::name;
use relief::scene::Overrides;
use relief::sense::record_schemas;
use relief::systems::describe::{Described, Field, check, fields_of, names, schema};
use relief::systems::lights::LightFields;
use relief::systems::sensors::{Rate, SensorKind};
use relief::systems::weather::Weather;
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// Lists and dictionaries in one another.
const DEEPEST: usize = 8;

/// JSON schemas of what is described, by its name, as a JSON text.
#[pyfunction]
pub fn descriptions() -> String {
    let all = json!({
        "light": schema::<LightFields>(),
        "rate": schema::<Rate>(),
        "readings": record_schemas().iter().copied().collect::<BTreeMap<_, _>>(),
        "sensor": schema::<SensorKind>(),
        "weather": schema::<Weather>(),
    });
    all.to_string()
}

/// The value of a choice, such as a sensor of a kind: the schema of the struct behind it.
pub fn of_kind(schema: &'static Value, kind: &str) -> &'static Value {
    let mut kinds = schema["oneOf"].as_array().into_iter().flatten();
    kinds.find_map(|choice| choice["properties"].get(kind)).unwrap_or(&Value::Null)
}

/// Takes fields that are given as keywords. Fields of a part, as its noise, stand among them. `wanted`: those that are
/// read here; `read`: reads the struct with some of its fields.
pub fn take(
    arguments: &mut Keywords<'_, '_>,
    schema: &'static Value,
    wanted: &dyn Fn(&Field) -> bool,
    read: &dyn Fn(Value) -> Result<(), String>,
) -> PyResult<Map<String, Value>> {
    let mut taken = Map::new();
    for field in fields_of(schema).filter(wanted) {
        let within = |value: Value| json!({ field.name: value });
        if field.is_part() {
            let part = take(arguments, field.schema, &|_| true, &|part| read(within(part)))?;
            taken.insert(field.name.into(), part.into());
        } else if let Some(given) = arguments.get(field.name)? {
            taken.insert(field.name.into(), convert(&field, &given, &|value| read(within(value)))?);
        }
    }
    Ok(taken)
}

/// Reads fields that were taken, and checks them.
pub fn read<T: Described>(fields: Value) -> PyResult<T> {
    Ok(checked(fields)?)
}

/// Does the same without Python.
pub fn checked<T: Described>(fields: Value) -> Outcome<T> {
    let value: T = serde_json::from_value(fields).map_err(|error| Failure::value(error.to_string()))?;
    check(&value).map_err(|fault| Failure::value(fault.to_string()))?;
    Ok(value)
}

/// Does the same for the one value of a field.
pub fn convert(field: &Field, given: &Bound<'_, PyAny>, read: &dyn Fn(Value) -> Result<(), String>) -> PyResult<Value> {
    let part = field.optional_part();
    let Field { name, schema: field } = *field;
    let names = names(field);
    if let Some(part) = part {
        let dict = given.cast::<PyDict>().map_err(|_| wrong_type(name, "a dictionary", given))?;
        let mut arguments = Keywords::of(name, dict);
        let value = take(&mut arguments, part, &|_| true, read)?.into();
        arguments.finish()?;
        return Ok(value);
    }
    let value = if let Some(short) = in_short(field, given) {
        short
    } else if let Some(expected) = field["expected"].as_str() {
        let is_of_type = |error: &PyErr| error.is_instance_of::<PyTypeError>(given.py());
        json(given).map_err(|error| {
            let refused = || Failure::value(format!("{name}: expected {expected}, found {}", found(given))).into();
            if is_of_type(&error) { wrong_type(name, expected, given) } else { refused() }
        })?
    } else if !names.is_empty() {
        return one_of(name, &names, required::<String>(name, given)?);
    } else if is_a(field, "boolean") {
        required::<bool>(name, given)?.into()
    } else if is_a(field, "integer") {
        required::<u32>(name, given)?.into()
    } else if is_a(field, "number") {
        match required::<f64>(name, given)? {
            f64::INFINITY if field["infinite"] == true => Value::Null,
            number => finite(name, number)?.into(),
        }
    } else if is_a(field, "array") {
        return list(name, field, given);
    } else {
        match json(given).map_err(|error| Failure::value(format!("{name}: {error}")))? {
            choice @ (Value::String(_) | Value::Object(_)) => choice,
            _ => return Err(wrong_type(name, "a string or a dictionary", given)),
        }
    };
    read(value.clone()).map_err(|error| match field["expected"].as_str() {
        Some(expected) => Failure::value(format!("{name}: expected {expected}, found {}", found(given))),
        None => Failure::value(format!("{name}: {error}")),
    })?;
    Ok(value)
}

/// A choice by what is in it: a number for one that is a number, its name for one whose fields may all be left out.
fn in_short(schema: &Value, given: &Bound<'_, PyAny>) -> Option<Value> {
    let mut choices =
        schema["oneOf"].as_array()?.iter().filter_map(|choice| choice["properties"].as_object()).flatten();
    let name = given.extract::<String>().ok();
    let number = given.extract::<f64>().ok().filter(|number| number.is_finite() && !given.is_instance_of::<PyBool>());
    choices.find_map(|(own, value)| match (&name, number) {
        (Some(name), _) if name == own && value["properties"].is_object() && value["required"].is_null() => {
            Some(json!({ own: {} }))
        }
        (_, Some(number)) if is_a(value, "number") => Some(json!({ own: number })),
        _ => None,
    })
}

/// Numbers, as many as there are to be, or names.
fn list(name: &str, field: &Value, given: &Bound<'_, PyAny>) -> PyResult<Value> {
    let known = names(&field["items"]);
    if !known.is_empty() {
        let given = required::<Names>(name, given)?.all();
        return given.into_iter().map(|given| one_of(name, &known, given)).collect();
    }
    let Row(numbers) = required(name, given)?;
    match field["minItems"].as_u64() {
        Some(count) if numbers.len() as u64 != count => {
            Err(Failure::value(format!("{name}: expected {count} numbers, found {}", found(given))).into())
        }
        _ => Ok(numbers.into()),
    }
}

fn one_of(name: &str, names: &[&str], given: String) -> PyResult<Value> {
    if names.contains(&given.as_str()) {
        return Ok(given.into());
    }
    let (hint, known) = (name::hint(names, &given), names.join(", "));
    Err(Failure::value(format!("{name}: unknown value {given:?}{hint}; expected one of: {known}")).into())
}

fn is_a(schema: &Value, kind: &str) -> bool {
    match &schema["type"] {
        Value::Array(kinds) => kinds.iter().any(|own| own == kind),
        own => own == kind,
    }
}

/// Fields in the place of a scene file's own.
pub fn overrides<const N: usize>(step_seconds: Option<f64>, given: [(&str, Given<'_, '_>); N]) -> PyResult<Overrides> {
    let mut fields = Map::new();
    if let Some(seconds) = step_seconds {
        fields.insert("step_seconds".into(), finite("step_seconds", seconds)?.into());
    }
    for (name, given) in given {
        if let Some(given) = given.filter(|given| !given.is_none()) {
            let dict = given.cast::<PyDict>().map_err(|_| wrong_type(name, "a dictionary", given))?;
            let value = json(dict).map_err(|error| Failure::value(format!("{name}: {error}")))?;
            // By itself, so that messages name it.
            let own = Value::Object([(name.to_owned(), value.clone())].into_iter().collect());
            let read: Result<Overrides, _> = serde_json::from_value(own);
            read.map_err(|error| Failure::value(format!("{name}: {error}")))?;
            fields.insert(name.into(), value);
        }
    }
    Ok(serde_json::from_value(Value::Object(fields)).map_err(|error| Failure::value(error.to_string()))?)
}

/// Numbers, strings, lists and dictionaries.
pub fn json(given: &Bound<'_, PyAny>) -> PyResult<Value> {
    json_within(given, DEEPEST)
}

fn json_within(given: &Bound<'_, PyAny>, deepest: usize) -> PyResult<Value> {
    let expected = "numbers, strings, lists and dictionaries";
    let refused = || wrong_type("values", expected, given);
    let deeper = deepest.checked_sub(1).ok_or_else(refused)?;
    if given.is_none() {
        return Ok(Value::Null);
    }
    if given.is_instance_of::<PyBool>() {
        return Ok(given.extract::<bool>()?.into());
    }
    if let Ok(number) = given.extract::<i64>() {
        return Ok(number.into());
    }
    if let Ok(number) = number(given) {
        return Ok(finite("values", number)?.into());
    }
    if let Ok(text) = given.extract::<String>() {
        return Ok(text.into());
    }
    if let Ok(dict) = given.cast::<PyDict>() {
        let item = |(name, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
            Ok((name.extract().map_err(|_| wrong_type("names", "strings", &name))?, json_within(&value, deeper)?))
        };
        return Ok(Value::Object(dict.iter().map(item).collect::<PyResult<_>>()?));
    }
    let items = items(given).map_err(|_| refused())?;
    Ok(Value::Array(items.map(|item| json_within(&item?, deeper)).collect::<PyResult<_>>()?))
}

/// A described value as JSON.
pub fn values<T: Serialize>(of: &T) -> PyResult<Value> {
    Ok(serde_json::to_value(of).map_err(|error| Failure::value(error.to_string()))?)
}

/// A value for Python. Numbers of a place or a colour are a tuple.
pub fn shown<'py>(py: Python<'py>, value: &Value, schema: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Null if schema["infinite"] == true => f64::INFINITY.into_pyobject(py)?.into_any(),
        Value::Null => py.None().into_bound(py),
        Value::Bool(value) => value.into_pyobject(py)?.to_owned().into_any(),
        Value::Number(number) => match number.as_i64() {
            Some(number) => number.into_pyobject(py)?.into_any(),
            None => number.as_f64().into_pyobject(py)?,
        },
        Value::String(text) => PyString::new(py, text).into_any(),
        Value::Array(items) => {
            let all_numbers = items.iter().all(Value::is_number);
            let items: Vec<_> = items.iter().map(|item| shown(py, item, &schema["items"])).collect::<PyResult<_>>()?;
            if all_numbers && !items.is_empty() {
                PyTuple::new(py, items)?.into_any()
            } else {
                PyList::new(py, items)?.into_any()
            }
        }
        Value::Object(fields) => {
            let dict = PyDict::new(py);
            for (name, value) in fields {
                dict.set_item(name, shown(py, value, &schema["properties"][name])?)?;
            }
            dict.into_any()
        }
    })
}
