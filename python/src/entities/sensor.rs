//! Sensors of a world.

use crate::captures::lens::{camera_matrix, coefficients, model};
use crate::entities::entity::Entity;
use crate::errors::{Failure, Outcome};
use crate::given::described::{of_kind, shown, values};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use relief::sense::sensor_name;
use relief::systems::describe::schema;
use relief::systems::sensors::{self, Lens, SensorKind};

/// Lens of a camera whose projection is not parallel.
fn lens(own: &PyRef<'_, Sensor>) -> PyResult<Option<Lens>> {
    Sensor::read(own, |sensor| match &sensor.kind {
        SensorKind::Camera(camera) => camera.intrinsics().map(|_| camera.lens),
        _ => None,
    })
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
    fn kind(own: PyRef<'_, Self>) -> PyResult<String> {
        let kind = Self::read(&own, |sensor| values(&sensor.kind))??;
        Ok(kind.as_object().and_then(|kinds| kinds.keys().next()).cloned().unwrap_or_default())
    }

    /// The name by which captures call it: its own, below that of the thing that it is mounted on, such as "ego/front".
    #[getter]
    fn full_name(own: PyRef<'_, Self>) -> PyResult<String> {
        let entity: &Entity = own.as_super();
        let id = entity.id;
        entity.with(own.py(), move |world| {
            let sensor = world.entity(id)?;
            Ok(sensor_name(&world.simulation.world, sensor))
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

    /// Names of a camera's outputs; of other sensors none.
    #[getter]
    fn outputs(own: PyRef<'_, Self>) -> PyResult<Vec<&'static str>> {
        Self::read(&own, |sensor| match &sensor.kind {
            SensorKind::Camera(camera) => camera.outputs.iter().map(|(name, _)| name).collect(),
            _ => Vec::new(),
        })
    }

    /// Width and height of a camera's pictures, pixels.
    #[getter]
    fn size(own: PyRef<'_, Self>) -> PyResult<Option<(u32, u32)>> {
        Self::read(&own, |sensor| match &sensor.kind {
            SensorKind::Camera(camera) => Some(camera.size),
            _ => None,
        })
    }

    /// Intrinsic matrix of a camera, float64 (3, 3), pixels; integers are the middles of pixels. ``None`` where the
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

    /// Distortion coefficients of a camera's lens, OpenCV's for its `distortion_model`, float64: (k1, k2, p1, p2, k3),
    /// all 0 where nothing is distorted; with k4, k5, k6 after these; or of a fisheye (k1, k2, k3, k4). ``None`` where
    /// the projection is parallel.
    #[getter]
    #[allow(non_snake_case)]
    fn D(own: PyRef<'_, Self>) -> PyResult<Option<Py<PyArray1<f64>>>> {
        Ok(lens(&own)?.map(|lens| coefficients(own.py(), &lens).unbind()))
    }

    /// Distortion model of a camera in ROS's names: "plumb_bob", "rational_polynomial" or "equidistant". ``None`` where
    /// the projection is parallel.
    #[getter]
    fn distortion_model(own: PyRef<'_, Self>) -> PyResult<Option<&'static str>> {
        Ok(lens(&own)?.map(|lens| model(&lens)))
    }

    /// Settings of its kind: a dict by the names that scene files have (docs/sensors.md).
    #[getter]
    fn settings<'py>(own: PyRef<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let kinds = values(&Self::read(&own, |sensor| sensor.kind.clone())?)?;
        let Some((kind, fields)) = kinds.as_object().and_then(|kinds| kinds.iter().next()) else {
            return Ok(own.py().None().into_bound(own.py()));
        };
        shown(own.py(), fields, of_kind(schema::<SensorKind>(), kind))
    }

    /// Noise model of the sensor: `settings["noise"]`, of a camera for instance `full_well`, `read`, `dark`, `gain`,
    /// `bits` and `black`. ``None`` of a camera without noise, and of kinds that have none.
    #[getter]
    fn noise<'py>(own: PyRef<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let py = own.py();
        let settings = Self::settings(own)?;
        Ok(settings.call_method1("get", ("noise",)).unwrap_or_else(|_| py.None().into_bound(py)))
    }
}
