//! Captures of sensors as objects of Python: arrays that own their memory, which is Rust's, handed over.

use crate::captures::camera::CameraCapture;
use crate::captures::common::Common;
use crate::captures::points::LidarCapture;
use crate::captures::readings::Reading;
use crate::given::arguments::required;
use crate::worlds::world::Shared;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use relief::bevy_ecs::world::World;
use relief::name;
use relief::sense::{Capture as Captured, SensorCapture, SensorData};
use relief::systems::sensors::Classes;
use relief::systems::sensors::collision::Collision;
use std::sync::{Arc, Weak};

/// Measurements of all sensors that were due after a step, by name. A sensor's name is below that of the thing that it
/// is mounted on ("ego/front"); the last part is enough where it is the only one.
#[pyclass(frozen, mapping, module = "relief")]
pub struct Capture {
    /// Step number of the clock.
    #[pyo3(get)]
    step: u64,
    /// Nanoseconds since the run began, rounded once.
    #[pyo3(get)]
    nanoseconds: u64,
    /// Measurements without the arrays, which Python's objects have.
    sensors: Vec<(SensorCapture, Py<PyAny>)>,
    /// World that it is of; of what was looked at whether due or not, none.
    world: Weak<Shared>,
}

impl Capture {
    pub fn new(py: Python<'_>, captured: Captured, classes: &Classes, world: Weak<Shared>) -> PyResult<Self> {
        let Captured { step, nanoseconds, sensors } = captured;
        let sensors = sensors.into_iter().map(|mut sensor| {
            let common = Common::of(&sensor, step, nanoseconds);
            let object = object(py, &mut sensor, common, classes)?;
            Ok((sensor, object))
        });
        Ok(Self { step, nanoseconds, sensors: sensors.collect::<PyResult<_>>()?, world })
    }

    /// The classes of a world where contacts that were captured may have one; else none.
    pub fn classes(world: &World, captured: &Captured) -> Classes {
        let has_contacts =
            |sensor: &SensorCapture| sensor.records().is_some_and(|found: &[Collision]| !found.is_empty());
        let is_needed = captured.sensors.iter().any(has_contacts);
        if is_needed { world.resource::<Classes>().clone() } else { Classes(Vec::new()) }
    }

    /// The world that it is of.
    pub fn world(&self) -> Option<Arc<Shared>> {
        self.world.upgrade()
    }

    /// Measurements with the values that the arrays have now.
    pub fn captured(&self, py: Python<'_>) -> PyResult<Captured> {
        let sensors = self.sensors.iter().map(|(sensor, object)| {
            let mut sensor = sensor.clone();
            match &mut sensor.data {
                SensorData::Camera(camera) => object.bind(py).cast::<CameraCapture>()?.get().give_back(py, camera)?,
                SensorData::Lidar(lidar) => object.bind(py).cast::<LidarCapture>()?.get().give_back(py, lidar)?,
                _ => {}
            }
            Ok(sensor)
        });
        let sensors = sensors.collect::<PyResult<_>>()?;
        Ok(Captured { step: self.step, nanoseconds: self.nanoseconds, sensors })
    }

    fn find(&self, name: &str) -> Option<&Py<PyAny>> {
        if let Some((_, found)) = self.sensors.iter().find(|(known, _)| known.name == name) {
            return Some(found);
        }
        let ends_so = |known: &str| known.rsplit_once('/').is_some_and(|(_, last)| last == name);
        let mut found = self.sensors.iter().filter(|(known, _)| ends_so(&known.name));
        let first = found.next();
        first.filter(|_| found.next().is_none()).map(|(_, found)| found)
    }
}

/// Converts a measurement to the Python class of its kind, which takes its arrays.
fn object(py: Python<'_>, sensor: &mut SensorCapture, common: Common, classes: &Classes) -> PyResult<Py<PyAny>> {
    Ok(match &mut sensor.data {
        SensorData::Camera(camera) => Py::new(py, CameraCapture::new(py, camera, common)?)?.into_any(),
        SensorData::Lidar(lidar) => Py::new(py, LidarCapture::new(py, lidar, common)?)?.into_any(),
        SensorData::Reading(reading) => Reading::object(py, reading.clone(), common, classes)?,
    })
}

#[pymethods]
impl Capture {
    /// Seconds since the run began.
    #[getter]
    fn seconds(&self) -> f64 {
        self.nanoseconds as f64 * 1e-9
    }

    fn __getitem__(&self, py: Python<'_>, name: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        let name: &str = &required::<String>("name", name)?;
        self.find(name).map(|found| found.clone_ref(py)).ok_or_else(|| {
            let known: Vec<&str> = self.sensors.iter().map(|(sensor, _)| sensor.name.as_str()).collect();
            let hint = name::hint(&known, name);
            let message = format!(
                "no sensor {name:?} was captured{hint}; it was not due, or there is none or several of that name"
            );
            PyKeyError::new_err(message)
        })
    }

    fn __contains__(&self, name: &Bound<'_, PyAny>) -> PyResult<bool> {
        Ok(self.find(&required::<String>("name", name)?).is_some())
    }

    fn __len__(&self) -> usize {
        self.sensors.len()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(self.keys().into_pyobject(py)?.try_iter()?.into_any())
    }

    /// The full names of the sensors that were captured, in the order in which they came to be.
    fn keys(&self) -> Vec<String> {
        self.sensors.iter().map(|(sensor, _)| sensor.name.clone()).collect()
    }

    /// Captures of the sensors, in that order.
    fn values(&self, py: Python<'_>) -> Vec<Py<PyAny>> {
        self.sensors.iter().map(|(_, sensor)| sensor.clone_ref(py)).collect()
    }

    /// Pairs of both.
    fn items(&self, py: Python<'_>) -> Vec<(String, Py<PyAny>)> {
        self.sensors.iter().map(|(sensor, object)| (sensor.name.clone(), object.clone_ref(py))).collect()
    }

    fn __repr__(&self) -> String {
        format!("<capture of step {}: {}>", self.step, self.keys().join(", "))
    }
}
