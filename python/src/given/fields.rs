//! Fields of sensors by the names that scene files have for them, by serde: taken from keywords, and shown as
//! dictionaries. So their names, kinds and defaults are said once, beside the fields.

use crate::errors::Failure;
use crate::given::arguments::{Given, Keywords, finite, found, required, wrong_type};
use crate::given::values::Numbers;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyDict, PyList};
use relief::scene::Overrides;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

/// Lists and dictionaries in one another.
const DEEPEST: usize = 8;

/// Fields as keywords; those of its noise stand among them.
pub fn take<T: Default + Serialize + DeserializeOwned>(arguments: &mut Keywords<'_, '_>) -> PyResult<T> {
    let mut fields = object(&T::default())?;
    let mut compound = String::new();
    let mut take_all = |fields: &mut Map<String, Value>| -> PyResult<()> {
        for (name, value) in fields.iter_mut().filter(|(_, value)| !value.is_object()) {
            if let Some(given) = arguments.get(name)? {
                *value = like(name, value, &given)?;
                if value.is_object() || value.is_string() {
                    compound = format!("{name}: ");
                }
            }
        }
        Ok(())
    };
    take_all(&mut fields)?;
    if let Some(Value::Object(noise)) = fields.get_mut("noise") {
        take_all(noise)?;
    }
    // What has one kind of value is of that kind by now.
    Ok(serde_json::from_value(Value::Object(fields)).map_err(|error| Failure::value(format!("{compound}{error}")))?)
}

/// Fields in a dictionary.
pub fn of_dict<T: Default + Serialize + DeserializeOwned>(name: &str, given: &Bound<'_, PyAny>) -> PyResult<T> {
    let dict = given.cast::<PyDict>().map_err(|_| wrong_type(name, "a dictionary", given))?;
    let mut arguments = Keywords::of(name, dict);
    let fields = take(&mut arguments)?;
    arguments.finish()?;
    Ok(fields)
}

/// A value that may be written in several ways, as scene files have it. `expected`: for messages.
pub fn choice<T: DeserializeOwned>(name: &str, expected: &str, given: &Bound<'_, PyAny>) -> PyResult<T> {
    let refused = |why: String| Failure::value(format!("{name}: expected {expected}, found {}{why}", found(given)));
    let value = json(given, DEEPEST).map_err(|_| refused(String::new()))?;
    Ok(serde_json::from_value(value).map_err(|error| refused(format!(": {error}")))?)
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
            let value = json(dict, DEEPEST).map_err(|error| Failure::value(format!("{name}: {error}")))?;
            // By itself, so that messages name it.
            let own = Value::Object([(name.to_owned(), value.clone())].into_iter().collect());
            let read: Result<Overrides, _> = serde_json::from_value(own);
            read.map_err(|error| Failure::value(format!("{name}: {error}")))?;
            fields.insert(name.into(), value);
        }
    }
    Ok(serde_json::from_value(Value::Object(fields)).map_err(|error| Failure::value(error.to_string()))?)
}

/// All fields as a dictionary.
pub fn dict<'py, T: Serialize>(py: Python<'py>, of: &T) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (name, value) in object(of)? {
        dict.set_item(name, shown(py, &value)?)?;
    }
    Ok(dict)
}

fn object<T: Serialize>(of: &T) -> PyResult<Map<String, Value>> {
    match serde_json::to_value(of) {
        Ok(Value::Object(fields)) => Ok(fields),
        _ => Err(Failure::value("no fields").into()),
    }
}

/// A value of the kind that a field has by default.
fn like(name: &str, default: &Value, given: &Bound<'_, PyAny>) -> PyResult<Value> {
    Ok(match default {
        Value::Bool(_) => required::<bool>(name, given)?.into(),
        Value::Number(number) if number.is_f64() => finite(name, required(name, given)?)?.into(),
        Value::Number(_) => required::<u32>(name, given)?.into(),
        Value::Array(numbers) if numbers.len() == 2 => required::<Numbers<2>>(name, given)?.0.to_vec().into(),
        Value::Array(_) => required::<Numbers<3>>(name, given)?.0.to_vec().into(),
        Value::String(_) if given.is_instance_of::<PyDict>() => {
            json(given, DEEPEST).map_err(|error| Failure::value(format!("{name}: {error}")))?
        }
        _ => required::<String>(name, given)?.into(),
    })
}

/// Numbers, strings, lists and dictionaries.
fn json(given: &Bound<'_, PyAny>, deepest: usize) -> PyResult<Value> {
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
    if let Ok(number) = given.extract::<f64>() {
        return Ok(finite("values", number)?.into());
    }
    if let Ok(text) = given.extract::<String>() {
        return Ok(text.into());
    }
    if let Ok(dict) = given.cast::<PyDict>() {
        let item = |(name, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
            Ok((name.extract().map_err(|_| wrong_type("names", "strings", &name))?, json(&value, deeper)?))
        };
        return Ok(Value::Object(dict.iter().map(item).collect::<PyResult<_>>()?));
    }
    if given.is_instance_of::<PyBytes>() {
        return Err(refused());
    }
    let items = given.try_iter().map_err(|_| refused())?;
    Ok(Value::Array(items.map(|item| json(&item?, deeper)).collect::<PyResult<_>>()?))
}

/// Its value for Python.
fn shown<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Null => py.None().into_bound(py),
        Value::Bool(value) => value.into_pyobject(py)?.to_owned().into_any(),
        Value::Number(number) => match number.as_i64() {
            Some(number) => number.into_pyobject(py)?.into_any(),
            None => number.as_f64().into_pyobject(py)?,
        },
        Value::String(text) => text.into_pyobject(py)?.into_any(),
        Value::Array(items) => {
            let items: Vec<_> = items.iter().map(|item| shown(py, item)).collect::<PyResult<_>>()?;
            PyList::new(py, items)?.into_any()
        }
        Value::Object(fields) => {
            let dict = PyDict::new(py);
            for (name, value) in fields {
                dict.set_item(name, shown(py, value)?)?;
            }
            dict.into_any()
        }
    })
}
