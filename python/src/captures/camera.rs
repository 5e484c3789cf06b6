//! Captures of cameras: one of one world, or the same camera of several.

use crate::captures::common::{Arrays, Common, arrays as array_getters, common};
use crate::captures::lens::{camera_matrix, coefficients, model};
use crate::given::arguments::required;
use numpy::ndarray::ArrayD;
use numpy::{Element, IntoPyArray, PyArray1, PyArray2};
use pyo3::exceptions::{PyAttributeError, PyKeyError, PyRuntimeError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use relief::data::boxes_as_npy;
use relief::sense::{CameraCapture as Captured, Flow};
use relief::systems::draw::Intrinsics;
use relief::systems::sensors::{CameraOutput, Lens};

/// Capture of a camera. Arrays have rows from the top, axes X right, Y down, Z forward; pixel (u, v) has its middle at
/// integers. An output that the camera was not asked for raises AttributeError.
#[pyclass(frozen, module = "relief")]
pub struct CameraCapture {
    common: Common,
    intrinsics: Option<Intrinsics>,
    lens: Lens,
    #[pyo3(get)]
    /// Width and height, pixels.
    size: (u32, u32),
    #[pyo3(get)]
    /// Factor that linear colours were multiplied by.
    exposure: f32,
    /// Tells of both flows if the capture before is known.
    has_flow: [bool; 2],
    arrays: Arrays,
}

/// Captures of the same camera of several worlds: the arrays of `CameraCapture` with the worlds as their first axis.
#[pyclass(frozen, module = "relief")]
pub struct CameraBatch {
    /// Step number of each world's clock.
    #[pyo3(get)]
    steps: Vec<u64>,
    #[pyo3(get)]
    /// Width and height, pixels.
    size: (u32, u32),
    arrays: Arrays,
}

/// A vector that becomes the memory of an array.
pub fn array<'py, T: Element>(py: Python<'py>, shape: &[usize], values: Vec<T>) -> PyResult<Bound<'py, PyAny>> {
    let array = ArrayD::from_shape_vec(shape, values);
    let array =
        array.map_err(|error| PyRuntimeError::new_err(format!("a sensor's output has no such shape: {error}")))?;
    Ok(array.into_pyarray(py).into_any())
}

/// The vectors of several captures as one, taken out of them.
fn taken<T>(captures: &mut [Captured], field: fn(&mut Captured) -> &mut Vec<T>) -> Vec<T> {
    let mut each = captures.iter_mut().map(|captured| std::mem::take(field(captured))).collect::<Vec<_>>().into_iter();
    let mut all = each.next().unwrap_or_default();
    all.reserve_exact(each.as_slice().iter().map(Vec::len).sum());
    each.for_each(|mut more| all.append(&mut more));
    all
}

/// Boxes as a structured array.
fn boxes<'py>(py: Python<'py>, captured: &Captured) -> PyResult<Bound<'py, PyAny>> {
    let bytes = boxes_as_npy(&captured.boxes)?;
    let file = py.import("io")?.getattr("BytesIO")?.call1((PyBytes::new(py, &bytes),))?;
    py.import("numpy.lib.format")?.getattr("read_array")?.call1((file,))
}

/// All arrays of some captures of one camera, taken out of them. `lead`: their first axes, none for one, their number
/// for several.
fn arrays(py: Python<'_>, captures: &mut [Captured], lead: &[usize]) -> PyResult<Arrays> {
    let mut arrays = Arrays::default();
    let Some(first) = captures.first() else { return Ok(arrays) };
    let (height, width) = (first.height as usize, first.width as usize);
    let is_whole = !first.outputs.iter().any(|(_, output)| output == CameraOutput::Boxes);
    let outputs = first.outputs;
    let shape = |last: &[usize]| [lead, &[height, width], last].concat();
    let (pixels, triples, pairs) = (shape(&[]), shape(&[3]), shape(&[2]));
    if !is_whole && lead.is_empty() {
        arrays.add("boxes", boxes(py, first)?);
    } else if !is_whole {
        let of_each = captures.iter().map(|captured| boxes(py, captured)).collect::<PyResult<Vec<_>>>()?;
        arrays.add("boxes", of_each.into_pyobject(py)?.into_any());
    }
    for captured in captures.iter_mut() {
        let flows = [(CameraOutput::Flow, &mut captured.flow), (CameraOutput::FlowBack, &mut captured.flow_back)];
        for (_, flow) in flows.into_iter().filter(|(output, _)| outputs.has(*output)) {
            // None of a camera that captured nothing before.
            flow.pixels.resize(height * width, [0.0; 2]);
            flow.flags.resize(height * width, 0);
        }
    }
    macro_rules! output {
        ($output:ident, $name:literal, $($field:ident).+, $shape:expr $(, $flat:ident)?) => {
            if outputs.has(CameraOutput::$output) {
                let values = taken(captures, |captured| &mut captured.$($field).+);
                arrays.add($name, array(py, $shape, values$(.$flat())?)?);
            }
        };
    }
    output!(Color, "color", color, &triples, into_flattened);
    output!(Linear, "linear", linear, &triples, into_flattened);
    output!(Depth, "depth", depth, &pixels);
    output!(Range, "range", range, &pixels);
    output!(Normal, "normal", normal, &triples, into_flattened);
    output!(Instance, "instance", instance, &pixels);
    output!(Part, "part", part, &pixels);
    output!(Class, "class", class, &pixels);
    output!(Panoptic, "panoptic", panoptic, &pixels);
    output!(Flow, "flow", flow.pixels, &pairs, into_flattened);
    output!(Flow, "flow_flags", flow.flags, &pixels);
    output!(FlowBack, "flow_back", flow_back.pixels, &pairs, into_flattened);
    output!(FlowBack, "flow_back_flags", flow_back.flags, &pixels);
    Ok(arrays)
}

impl CameraCapture {
    /// Capture with the arrays of another, which are taken out of that.
    pub fn new(py: Python<'_>, captured: &mut Captured, common: Common) -> PyResult<Self> {
        let Captured { width, height, intrinsics, lens, exposure, .. } = *captured;
        let has_flow = [&captured.flow, &captured.flow_back].map(|flow| !flow.flags.is_empty());
        let arrays = arrays(py, std::slice::from_mut(captured), &[])?;
        Ok(Self { common, intrinsics, lens, size: (width, height), exposure, has_flow, arrays })
    }

    /// Gives what the arrays were taken from the values that they have now.
    pub fn give_back(&self, py: Python<'_>, captured: &mut Captured) -> PyResult<()> {
        let (arrays, count) = (&self.arrays, self.size.0 as usize * self.size.1 as usize);
        captured.color = arrays.rows(py, "color", count)?;
        captured.linear = arrays.rows(py, "linear", count)?;
        captured.depth = arrays.values(py, "depth", count)?;
        captured.range = arrays.values(py, "range", count)?;
        captured.normal = arrays.rows(py, "normal", count)?;
        captured.instance = arrays.values(py, "instance", count)?;
        captured.part = arrays.values(py, "part", count)?;
        captured.class = arrays.values(py, "class", count)?;
        captured.panoptic = arrays.values(py, "panoptic", count)?;
        let flow = |name: &str, flags: &str| -> PyResult<Flow> {
            Ok(Flow { pixels: arrays.rows(py, name, count)?, flags: arrays.values(py, flags, count)? })
        };
        if self.has_flow[0] {
            captured.flow = flow("flow", "flow_flags")?;
        }
        if self.has_flow[1] {
            captured.flow_back = flow("flow_back", "flow_back_flags")?;
        }
        Ok(())
    }

    fn array(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        output(py, &self.arrays, name)
    }
}

impl CameraBatch {
    pub fn new(py: Python<'_>, mut captures: Vec<Captured>, steps: Vec<u64>) -> PyResult<Self> {
        let size = captures.first().map_or((0, 0), |first| (first.width, first.height));
        let count = captures.len();
        Ok(Self { steps, size, arrays: arrays(py, &mut captures, &[count])? })
    }

    fn array(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        output(py, &self.arrays, name)
    }
}

/// An output, or what there is instead.
fn output(py: Python<'_>, arrays: &Arrays, name: &str) -> PyResult<Py<PyAny>> {
    arrays.get(py, name).ok_or_else(|| {
        let known = arrays.names().join(", ");
        PyAttributeError::new_err(format!("the camera does not give {name:?}; its outputs are: {known}"))
    })
}

common! { CameraCapture,
    /// From camera axes, X right, Y down, Z forward, to the scene's coordinates: float64 (4, 4).
}

/// Getters of all outputs. Those of batches have the worlds as their first axis.
macro_rules! outputs {
    ($($class:ident)*) => {
        $(array_getters! { $class:
            /// Tone-mapped, sRGB: uint8 (H, W, 3).
            color "color";
            /// Linear, exposed, before the tone map: float16 (H, W, 3).
            linear "linear";
            /// Metres along the optical axis, infinite where there is nothing: float32 (H, W).
            depth "depth";
            /// Metres from the optical centre, infinite where there is nothing: float32 (H, W).
            range "range";
            /// Unit shading normals in camera axes, 0 where there is nothing: float32 (H, W, 3).
            normal "normal";
            /// Ids of things, 0 where there is nothing: uint32 (H, W).
            instance "instance";
            /// Ids of drawn entities, 0 where there is nothing: uint32 (H, W).
            part "part";
            /// Semantic classes, 0 where there is none: uint8 (H, W). `cap["class"]` is the same.
            cls "class";
            /// Instance ids in the encoding of Cityscapes: uint32 (H, W).
            panoptic "panoptic";
            /// A record for each thing in the picture: a structured array (N,), see docs/sensors.md; of a
            /// batch, one for each world.
            boxes "boxes";
            /// Forward optical flow: places in this capture of points that the pixels of the one before show, float32
            /// (H, W, 2), pixels right and down.
            flow "flow";
            /// Flags of that flow: uint8 (H, W); 1 valid, 2 inside the picture, 4 seen there, 8 sky, added up.
            flow_flags "flow_flags";
            /// Backward optical flow: places in the capture before of points that the pixels show, float32 (H, W, 2),
            /// pixels right and down.
            flow_back "flow_back";
            /// Flags of that flow: uint8 (H, W).
            flow_back_flags "flow_back_flags";
        })*
    };
}

outputs! { CameraCapture CameraBatch }

#[pymethods]
impl CameraCapture {
    /// The camera's matrix: float64 (3, 3), pixels. ``None`` where the projection is parallel.
    #[getter]
    #[allow(non_snake_case)]
    fn K<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f64>>> {
        self.intrinsics.as_ref().map(|intrinsics| camera_matrix(py, intrinsics))
    }

    /// Distortion coefficients of the lens in OpenCV's order, as `Sensor.D`: float64 (5,), (8,) or (4,). ``None``
    /// where the projection is parallel.
    #[getter]
    #[allow(non_snake_case)]
    fn D<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.intrinsics.map(|_| coefficients(py, &self.lens))
    }

    /// "plumb_bob", "rational_polynomial" or "equidistant", as ROS calls what `D` has. ``None`` where the
    /// projection is parallel.
    #[getter]
    fn distortion_model(&self) -> Option<&'static str> {
        self.intrinsics.map(|_| model(&self.lens))
    }

    fn __repr__(&self) -> String {
        let (width, height) = self.size;
        format!("<camera {:?}, {width}x{height}: {}>", self.common.name, self.arrays.names().join(", "))
    }
}

#[pymethods]
impl CameraBatch {
    fn __len__(&self) -> usize {
        self.steps.len()
    }

    fn __repr__(&self) -> String {
        let (width, height) = self.size;
        let (count, names) = (self.steps.len(), self.arrays.names().join(", "));
        format!("<pictures of {count} worlds, {width}x{height}: {names}>")
    }
}
