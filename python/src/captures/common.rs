//! Parts of captures: step, time and place of a sensor, and arrays by name; and their getters, which classes share.

use crate::given::values::matrix;
use numpy::{Element, PyArray2, PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use relief::glam::DAffine3;
use relief::sense::SensorCapture;

/// Fields that captures of all sensors share.
pub struct Common {
    pub step: u64,
    pub nanoseconds: u64,
    pub name: String,
    /// From the axes of its outputs to the scene's coordinates.
    pub world_from_sensor: DAffine3,
}

impl Common {
    pub fn of(capture: &SensorCapture, step: u64, nanoseconds: u64) -> Self {
        Self { step, nanoseconds, name: capture.name.clone(), world_from_sensor: capture.world_from_outputs() }
    }

    pub fn seconds(&self) -> f64 {
        self.nanoseconds as f64 * 1e-9
    }

    pub fn matrix<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        matrix(py, &self.world_from_sensor)
    }
}

/// Arrays by name.
#[derive(Default)]
pub struct Arrays(Vec<(&'static str, Py<PyAny>)>);

impl Arrays {
    pub fn add(&mut self, name: &'static str, array: Bound<'_, PyAny>) {
        self.0.push((name, array.unbind()));
    }

    pub fn get(&self, py: Python<'_>, name: &str) -> Option<Py<PyAny>> {
        self.0.iter().find(|(known, _)| *known == name).map(|(_, array)| array.clone_ref(py))
    }

    /// The values that an array has now, so many; none where there is no such array.
    pub fn values<T: Element>(&self, py: Python<'_>, name: &str, count: usize) -> PyResult<Vec<T>> {
        let Some(array) = self.get(py, name) else { return Ok(Vec::new()) };
        let values = array.bind(py).cast::<PyArrayDyn<T>>().ok().and_then(|array| array.to_vec().ok());
        values.filter(|values| values.len() == count).ok_or_else(|| {
            PyValueError::new_err(format!(
                "capture: expected {name:?} in the type and the shape that it was captured in"
            ))
        })
    }

    /// The same in rows of some values.
    pub fn rows<T: Element + Copy, const N: usize>(
        &self,
        py: Python<'_>,
        name: &str,
        count: usize,
    ) -> PyResult<Vec<[T; N]>> {
        Ok(self.values(py, name, count * N)?.as_chunks().0.to_vec())
    }

    pub fn names(&self) -> Vec<&'static str> {
        self.0.iter().map(|(name, _)| *name).collect()
    }

    pub fn dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (name, array) in &self.0 {
            dict.set_item(name, array)?;
        }
        Ok(dict)
    }
}

/// Getters of what captures of all sensors have. `$pose`: documentation of the sensor's pose.
macro_rules! common {
    ($class:ident, $(#[$pose:meta])*) => {
        #[pymethods]
        impl $class {
            /// The sensor's full name.
            #[getter]
            fn name(&self) -> &str {
                &self.common.name
            }

            /// Step number of the clock.
            #[getter]
            fn step(&self) -> u64 {
                self.common.step
            }

            /// Seconds since the run began.
            #[getter]
            fn seconds(&self) -> f64 {
                self.common.seconds()
            }

            $(#[$pose])*
            #[getter]
            fn world_from_sensor<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
                self.common.matrix(py)
            }
        }
    };
}
pub(super) use common;

/// Getters of arrays, each with its name among the others, and what finds them by that.
macro_rules! arrays {
    ($class:ident: $($(#[$doc:meta])* $getter:ident $name:literal;)*) => {
        #[pymethods]
        impl $class {
            $(
                $(#[$doc])*
                #[getter]
                fn $getter(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
                    self.array(py, $name)
                }
            )*

            /// The names of the arrays that there are.
            fn keys(&self) -> Vec<&'static str> {
                self.arrays.names()
            }

            /// The arrays by name.
            fn arrays<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
                self.arrays.dict(py)
            }

            fn __getitem__(&self, py: Python<'_>, name: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
                let name: String = required("name", name)?;
                self.array(py, &name).map_err(|error| PyKeyError::new_err(error.value(py).to_string()))
            }

            fn __contains__(&self, name: &Bound<'_, PyAny>) -> PyResult<bool> {
                Ok(self.arrays.names().contains(&required::<String>("name", name)?.as_str()))
            }
        }
    };
}
pub(super) use arrays;
