//! Readings of motion sensors, and of those for what is around a vehicle.

use crate::captures::common::{Common, common};
use crate::errors::Failure;
use crate::given::arguments::required;
use crate::given::described::shown;
use numpy::PyArray2;
use pyo3::exceptions::PyAttributeError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use relief::export::ros::{Encoded, Header};
use relief::sense as captures;
use relief::systems::describe::Field;
use relief::systems::sensors::collision::Collision;
use relief::systems::sensors::{Class, Classes};
use serde_json::Value;
use std::sync::{Arc, OnceLock};

/// Measurement of a sensor without pictures: a record, whose fields are attributes of the class of its kind.
#[pyclass(frozen, subclass, module = "relief")]
pub struct Reading {
    common: Arc<Common>,
    own: captures::Reading,
    /// Fields and records as JSON, once a field was asked for: one is seldom asked for alone.
    shown: OnceLock<(Vec<Field>, Vec<Value>)>,
}

impl Reading {
    fn of(common: Arc<Common>, own: captures::Reading) -> Self {
        Self { common, own, shown: OnceLock::new() }
    }

    /// An object of the class that `relief.described` makes of a kind; contacts have one of their own.
    pub fn object(py: Python<'_>, own: captures::Reading, common: Common, classes: &Classes) -> PyResult<Py<PyAny>> {
        let contacts = own.records().map(|contacts| Collisions::new(contacts.to_vec(), classes));
        let reading = Self::of(Arc::new(common), own);
        if let Some(contacts) = contacts {
            return Ok(Py::new(py, (contacts, reading))?.into_any());
        }
        let known = py.import("relief.described")?.getattr("READINGS")?;
        Ok(known.get_item(reading.own.kind)?.call1((reading,))?.unbind())
    }
}

#[pymethods]
impl Reading {
    /// The same reading.
    #[new]
    fn new(reading: &Self) -> Self {
        Self::of(reading.common.clone(), reading.own.clone())
    }

    /// The value of a field.
    fn _field<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let (fields, records) = match self.shown.get() {
            Some(shown) => shown,
            None => {
                let records = self.own.values().map_err(|error| Failure::value(error.to_string()))?;
                self.shown.get_or_init(|| (self.own.fields(), records))
            }
        };
        let field = fields.iter().find(|field| field.name == name);
        match (records.first(), field) {
            (Some(record), Some(field)) => shown(py, &record[name], field.schema),
            _ => Err(PyAttributeError::new_err(format!("{name:?}"))),
        }
    }

    /// Messages of ROS 2, as the log of a run has them: last part of the topic, type and bytes (CDR) of each. `frame`:
    /// that of the sensor.
    fn _messages<'py>(
        &self,
        py: Python<'py>,
        frame: &str,
    ) -> PyResult<Vec<(&'static str, &'static str, Bound<'py, PyBytes>)>> {
        let header = Header { nanoseconds: self.common.nanoseconds, frame };
        let messages = self.own.messages(header).map_err(|error| Failure::value(error.to_string()))?;
        let given = |(topic, message): (_, Encoded)| (topic, message.message_type, PyBytes::new(py, &message.bytes));
        Ok(messages.into_iter().map(given).collect())
    }
}

common! { Reading,
    /// From the sensor's axes, X forward, Y left, Z up, to the scene's coordinates: float64 (4, 4).
}

/// Contact with another entity.
#[pyclass(frozen, module = "relief")]
pub struct Contact {
    /// The id of the other.
    #[pyo3(get)]
    instance: u32,
    /// The name of its semantic class; ``None`` for none.
    #[pyo3(get)]
    class_: Option<String>,
    /// Metres that the two would have to be moved apart to be beside each other; negative where they are apart by it.
    #[pyo3(get)]
    depth: f64,
    /// The way from the other, unit, in the sensor's axes: forward, left, up.
    #[pyo3(get)]
    normal: (f64, f64, f64),
    /// m/s at which they come nearer along it.
    #[pyo3(get)]
    speed: f64,
}

/// All that something touches.
#[pyclass(frozen, sequence, extends = Reading, module = "relief")]
pub struct Collisions {
    own: Vec<Collision>,
    classes: Vec<Option<String>>,
}

impl Collisions {
    fn new(own: Vec<Collision>, classes: &Classes) -> Self {
        let name = |collision: &Collision| {
            let known = classes.get(Class(collision.class)).filter(|_| collision.class != 0);
            known.map(|info| info.name.clone())
        };
        let classes = own.iter().map(name).collect();
        Self { own, classes }
    }

    fn contact(&self, index: usize) -> Option<Contact> {
        let Collision { instance, depth, normal, speed, .. } = *self.own.get(index)?;
        let class_ = self.classes.get(index).cloned().flatten();
        Some(Contact { instance, class_, depth, normal: normal.into(), speed })
    }
}

#[pymethods]
impl Collisions {
    fn __len__(&self) -> usize {
        self.own.len()
    }

    fn __getitem__(&self, index: &Bound<'_, PyAny>) -> PyResult<Contact> {
        let index: isize = required("index", index)?;
        let place = if index < 0 { index + self.own.len() as isize } else { index };
        let contact = usize::try_from(place).ok().and_then(|place| self.contact(place));
        contact.ok_or_else(|| pyo3::exceptions::PyIndexError::new_err(format!("contact {index} of {}", self.own.len())))
    }
}
