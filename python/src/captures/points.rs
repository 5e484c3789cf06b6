//! Captures of lidars.

use crate::captures::common::{Arrays, Common};
use crate::given::arguments::required;
use crate::given::values::matrix;
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2};
use pyo3::exceptions::{PyKeyError, PyRuntimeError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use relief::glam::DAffine3;
use relief::sense::{LidarCapture as Captured, LidarScan};

/// Returns of a lidar since it was due before: arrays with an element for each beam, column after column, in each by
/// ring. Axes are X forward, Y left, Z up. Where a beam has no return, `hit` is 0, and all but ring and time are.
#[pyclass(frozen, module = "relief")]
pub struct LidarCapture {
    common: Common,
    arrays: Arrays,
    beams: usize,
    nanoseconds: u64,
    sweep: bool,
    /// When the first column was fired.
    world_from_sensor_before: DAffine3,
}

impl LidarCapture {
    /// Capture with the arrays of another, which are taken out of that.
    pub fn new(py: Python<'_>, captured: &mut Captured, common: Common) -> PyResult<Self> {
        let world_from_sensor_before = captured.scene_from_column(0);
        let (nanoseconds, sweep) = (captured.nanoseconds, captured.sweep);
        let scan = std::mem::take(&mut captured.scan);
        let beams = scan.len();
        let xyz = Array2::from_shape_vec((beams, 3), scan.xyz.into_flattened());
        let xyz = xyz.map_err(|error| PyRuntimeError::new_err(format!("points have no such shape: {error}")))?;
        let (instance, class) = (std::mem::take(&mut captured.instance), std::mem::take(&mut captured.class));
        let mut arrays = Arrays::default();
        arrays.add("xyz", xyz.into_pyarray(py).into_any());
        arrays.add("range", scan.range.into_pyarray(py).into_any());
        arrays.add("intensity", scan.intensity.into_pyarray(py).into_any());
        arrays.add("ring", scan.ring.into_pyarray(py).into_any());
        arrays.add("time", scan.time.into_pyarray(py).into_any());
        arrays.add("instance", instance.into_pyarray(py).into_any());
        arrays.add("class", class.into_pyarray(py).into_any());
        arrays.add("hit", scan.hit.into_pyarray(py).into_any());
        captured.scan.entity = scan.entity;
        Ok(Self { common, arrays, beams, nanoseconds, sweep, world_from_sensor_before })
    }

    /// Gives what the arrays were taken from the values that they have now.
    pub fn give_back(&self, py: Python<'_>, captured: &mut Captured) -> PyResult<()> {
        let (arrays, beams) = (&self.arrays, self.beams);
        captured.instance = arrays.values(py, "instance", beams)?;
        captured.class = arrays.values(py, "class", beams)?;
        captured.scan = LidarScan {
            xyz: arrays.rows(py, "xyz", beams)?,
            range: arrays.values(py, "range", beams)?,
            intensity: arrays.values(py, "intensity", beams)?,
            ring: arrays.values(py, "ring", beams)?,
            time: arrays.values(py, "time", beams)?,
            entity: std::mem::take(&mut captured.scan.entity),
            hit: arrays.values(py, "hit", beams)?,
        };
        Ok(())
    }

    fn array(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        self.arrays.get(py, name).ok_or_else(|| PyKeyError::new_err(format!("a lidar has no {name:?}")))
    }
}

#[pymethods]
impl LidarCapture {
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

    /// Nanoseconds since the run began when the first column was fired, which `time` counts from.
    #[getter]
    fn nanoseconds(&self) -> u64 {
        self.nanoseconds
    }

    /// True if each column was fired at its time, from where the sensor was then. If not, all are fired from where it
    /// is at the capture.
    #[getter]
    fn sweep(&self) -> bool {
        self.sweep
    }

    /// From the axes of the points to the scene's coordinates, at the end of the interval: float64 (4, 4).
    #[getter]
    fn world_from_sensor<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        self.common.matrix(py)
    }

    /// The same when the first column was fired: float64 (4, 4). Equal to the other unless the sensor sweeps, and in
    /// its first capture. Between the two it goes straight ahead and turns evenly.
    #[getter]
    fn world_from_sensor_before<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        matrix(py, &self.world_from_sensor_before)
    }

    /// Metres in the sensor's axes: float32 (N, 3).
    #[getter]
    fn xyz(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.array(py, "xyz")
    }

    /// Metres along the beam: float32 (N,).
    #[getter]
    fn range(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.array(py, "range")
    }

    /// Albedo times the cosine of the angle of incidence times what the air leaves, 0 to 1: float32 (N,).
    #[getter]
    fn intensity(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.array(py, "intensity")
    }

    /// The beam's place in its column: uint16 (N,).
    #[getter]
    fn ring(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.array(py, "ring")
    }

    /// Seconds since the first column: float32 (N,).
    #[getter]
    fn time(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.array(py, "time")
    }

    /// Ids of things, 0 where there is no return: uint32 (N,).
    #[getter]
    fn instance(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.array(py, "instance")
    }

    /// Semantic classes, 0 where there is none: uint8 (N,). `cap["class"]` is the same.
    #[getter]
    fn cls(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.array(py, "class")
    }

    /// 1 where the beam has a return, else 0: uint8 (N,).
    #[getter]
    fn hit(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        self.array(py, "hit")
    }

    /// The names of the arrays.
    fn keys(&self) -> Vec<&'static str> {
        self.arrays.names()
    }

    /// The arrays by name.
    fn arrays<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.arrays.dict(py)
    }

    fn __getitem__(&self, py: Python<'_>, name: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        self.array(py, &required::<String>("name", name)?)
    }

    fn __len__(&self) -> usize {
        self.beams
    }

    fn __repr__(&self) -> String {
        format!("<lidar {:?}, {} beams>", self.common.name, self.beams)
    }
}
