//! Sensors of a world.

use crate::entity::Entity;
use crate::errors::{Failure, Outcome};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2};
use pyo3::prelude::*;
use relief::systems::draw::Intrinsics;
use relief::systems::sensors::{self, SensorKind};

/// A matrix of 3 by 3, float64.
pub fn camera_matrix<'py>(py: Python<'py>, own: &Intrinsics) -> Bound<'py, PyArray2<f64>> {
    let rows = [[own.fx, 0.0, own.cx], [0.0, own.fy, own.cy], [0.0, 0.0, 1.0]];
    Array2::from_shape_fn((3, 3), |(row, column)| rows[row][column]).into_pyarray(py)
}

/// A sensor of a world.
#[pyclass(frozen, extends = Entity, module = "relief")]
pub struct Sensor;

impl Sensor {
    fn read<T: Send>(own: &PyRef<'_, Self>, value: impl FnOnce(&sensors::Sensor) -> T + Send) -> PyResult<T> {
        let entity: &Entity = own.as_super();
        let id = entity.id;
        entity.with(own.py(), move |world| -> Outcome<T> {
            let sensor = world.component::<sensors::Sensor>(id)?;
            sensor.as_ref().map(value).ok_or_else(|| Failure::Gone(format!("the sensor of entity {}", id.0 + 1)))
        })
    }
}

#[pymethods]
impl Sensor {
    /// "camera", "lidar", "imu", "gnss", "collision" or "lane".
    #[getter]
    fn kind(own: PyRef<'_, Self>) -> PyResult<&'static str> {
        Self::read(&own, |sensor| match sensor.kind {
            SensorKind::Camera(_) => "camera",
            SensorKind::Lidar(_) => "lidar",
            SensorKind::Imu(_) => "imu",
            SensorKind::Gnss(_) => "gnss",
            SensorKind::Collision(_) => "collision",
            SensorKind::Lane(_) => "lane",
        })
    }

    /// It is due once in so many steps.
    #[getter]
    fn every(own: PyRef<'_, Self>) -> PyResult<u32> {
        Self::read(&own, |sensor| sensor.every)
    }

    /// It is due after step s where s mod `every` is this.
    #[getter]
    fn phase(own: PyRef<'_, Self>) -> PyResult<u32> {
        Self::read(&own, |sensor| sensor.phase)
    }

    /// Of a camera: the names of what it gives. Of others none.
    #[getter]
    fn outputs(own: PyRef<'_, Self>) -> PyResult<Vec<&'static str>> {
        Self::read(&own, |sensor| match &sensor.kind {
            SensorKind::Camera(camera) => camera.outputs.iter().map(|(name, _)| name).collect(),
            _ => Vec::new(),
        })
    }

    /// Of a camera: width and height of its pictures, pixels.
    #[getter]
    fn size(own: PyRef<'_, Self>) -> PyResult<Option<(u32, u32)>> {
        Self::read(&own, |sensor| match &sensor.kind {
            SensorKind::Camera(camera) => Some(camera.size),
            _ => None,
        })
    }

    /// Of a camera: its matrix, float64 (3, 3), pixels; integers are the middles of pixels. ``None`` where the
    /// projection is parallel.
    #[getter]
    #[allow(non_snake_case)]
    fn K(own: PyRef<'_, Self>) -> PyResult<Option<Py<PyArray2<f64>>>> {
        let intrinsics = Self::read(&own, |sensor| match &sensor.kind {
            SensorKind::Camera(camera) => camera.intrinsics(),
            _ => None,
        })?;
        Ok(intrinsics.map(|intrinsics| camera_matrix(own.py(), &intrinsics).unbind()))
    }
}
