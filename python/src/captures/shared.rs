//! Pictures of a camera of several worlds in memory of the graphics device, for interfaces that import it.

use crate::errors::Failure;
use crate::worlds::lending::Lent;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use relief::renderer::{PackedArray, PackedLayout};
use std::os::fd::IntoRawFd;
use std::sync::Arc;

/// Pictures of the same camera of several worlds, in memory of the graphics device that stays theirs as long as this
/// lives. `relief.cuda` makes arrays of it.
#[pyclass(frozen, module = "relief._relief")]
pub struct SharedPictures {
    /// Step number of each world's clock.
    #[pyo3(get)]
    steps: Vec<u64>,
    /// Width and height, pixels.
    #[pyo3(get)]
    size: (u32, u32),
    layout: PackedLayout,
    memory: Arc<Lent>,
}

impl SharedPictures {
    pub fn new(steps: Vec<u64>, layout: PackedLayout, memory: Arc<Lent>) -> Self {
        Self { steps, size: layout.size, layout, memory }
    }
}

/// Array for Python: name, type, shape, strides, offset.
type Described = (&'static str, &'static str, Vec<u64>, Vec<u64>, u64);

/// Name, numpy's type and last axis of an array.
fn described(array: PackedArray) -> (&'static str, &'static str, Option<u64>) {
    match array {
        PackedArray::Color => ("color", "|u1", Some(3)),
        PackedArray::Depth => ("depth", "<f4", None),
        PackedArray::DepthSteps => ("depth_steps", "|u1", None),
        // Frameworks for learning know no unsigned ones of 32 bits.
        PackedArray::Instance => ("instance", "<i4", None),
        PackedArray::Part => ("part", "<i4", None),
        PackedArray::Class => ("class", "|u1", None),
    }
}

#[pymethods]
impl SharedPictures {
    /// Arrays: name, type as numpy writes it, shape, strides and offset in bytes.
    #[getter]
    fn arrays(&self) -> Vec<Described> {
        let (width, height) = (u64::from(self.size.0), u64::from(self.size.1));
        let each = self.layout.arrays.iter().map(|&(array, offset)| {
            let (name, kind, last) = described(array);
            let pixel = array.pixel_bytes();
            let mut shape = vec![self.layout.views as u64, height, width];
            let mut strides = vec![self.layout.view_bytes(array), width * pixel, pixel];
            if let Some(last) = last {
                shape.push(last);
                strides.push(pixel / last);
            }
            (name, kind, shape, strides, offset)
        });
        each.collect()
    }

    /// Number of the memory, which captures use again once nobody holds it; none other of the process has it.
    #[getter]
    fn memory(&self) -> u64 {
        self.memory.number
    }

    /// Bytes of the memory.
    #[getter]
    fn memory_bytes(&self) -> u64 {
        self.memory.buffer.allocation_size()
    }

    /// UUID of the device: 16 bytes.
    #[getter]
    fn device_uuid<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.memory.device.0)
    }

    /// Name of the device.
    #[getter]
    fn device_name(&self) -> &str {
        &self.memory.device.1
    }

    /// Opens a file descriptor of the memory, which is the caller's to close. Raises GpuError.
    fn open_fd(&self) -> PyResult<i32> {
        Ok(self.memory.buffer.fd().map_err(Failure::from)?.into_raw_fd())
    }
}
