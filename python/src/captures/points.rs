//! Captures of lidars.

use crate::captures::common::{Arrays, Common, arrays, common};
use crate::given::arguments::required;
use crate::given::values::matrix;
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2};
use pyo3::exceptions::{PyAttributeError, PyKeyError, PyRuntimeError};
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
    /// Nanoseconds since the run began when the first column was fired, which `time` counts from.
    #[pyo3(get)]
    nanoseconds: u64,
    /// True if each column was fired at its time, from where the sensor was then. If not, all are fired from where it
    /// is at the capture.
    #[pyo3(get)]
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
        self.arrays.get(py, name).ok_or_else(|| PyAttributeError::new_err(format!("a lidar has no {name:?}")))
    }
}

common! { LidarCapture,
    /// From the axes of the points to the scene's coordinates, at the end of the interval: float64 (4, 4).
}

arrays! { LidarCapture:
    /// Metres in the sensor's axes: float32 (N, 3).
    xyz "xyz";
    /// Metres along the beam: float32 (N,).
    range "range";
    /// Albedo times the cosine of the angle of incidence times what the air leaves, 0 to 1: float32 (N,).
    intensity "intensity";
    /// The beam's place in its column: uint16 (N,).
    ring "ring";
    /// Seconds since the first column: float32 (N,).
    time "time";
    /// Ids of things, 0 where there is no return: uint32 (N,).
    instance "instance";
    /// Semantic classes, 0 where there is none: uint8 (N,). `cap["class"]` is the same.
    cls "class";
    /// 1 where the beam has a return, else 0: uint8 (N,).
    hit "hit";
}

#[pymethods]
impl LidarCapture {
    /// `world_from_sensor` when the first column was fired: float64 (4, 4). Equal to that unless the sensor sweeps, and
    /// in its first capture. Between the two it goes straight ahead and turns evenly.
    #[getter]
    fn world_from_sensor_before<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        matrix(py, &self.world_from_sensor_before)
    }

    fn __len__(&self) -> usize {
        self.beams
    }

    fn __repr__(&self) -> String {
        format!("<lidar {:?}, {} beams>", self.common.name, self.beams)
    }
}
