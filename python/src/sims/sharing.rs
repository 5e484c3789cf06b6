//! Cameras of several worlds, drawn into memory of the graphics device that other interfaces import.

use crate::captures::depth_steps::steps_of_scale;
use crate::captures::shared::SharedPictures;
use crate::given::arguments::required;
use crate::sims::many::{steps_of, with_cameras};
use crate::worlds::world::World;
use crate::worlds::{device, lending};
use gpu_share::dlpack;
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCapsule};
use relief::sense::Wanted;

/// Draws what `capture` gives, or `look` where the cameras are not to be `due`, into memory of the graphics device; and
/// where there are depths and a `scale`, steps of that, as `depth_steps`. Raises what these raise, and ValueError of
/// cameras whose pictures are made on the CPU.
#[pyfunction]
#[pyo3(signature = (sims, sensor, due, *, scale=None))]
pub fn share(
    py: Python<'_>,
    sims: &Bound<'_, PyAny>,
    sensor: &Bound<'_, PyAny>,
    due: bool,
    scale: Option<PyReadonlyArray1<'_, f32>>,
) -> PyResult<SharedPictures> {
    let scale = scale.map_or(Ok(Vec::new()), |scale| steps_of_scale(&scale))?;
    let ((layout, memory), steps) = with_cameras(py, sims, sensor, due, |mut cameras, looked_at| {
        let wanted = looked_at.iter().map(|camera| Wanted::Look(camera));
        let worlds = cameras.iter_mut().map(|world| &mut **world).zip(wanted).collect();
        Ok((World::share_all(worlds, scale)?, steps_of(&cameras)))
    })?;
    Ok(SharedPictures::new(steps, layout, memory))
}

/// Sets how many bytes of the graphics device all shared pictures may take together.
#[pyfunction]
pub fn set_shared_memory_limit(bytes: &Bound<'_, PyAny>) -> PyResult<()> {
    lending::set_most_bytes(required("bytes", bytes)?);
    Ok(())
}

/// Numbers of the memory that captures have, or could use again. Raises ForkedError.
#[pyfunction]
pub fn shared_memory_numbers() -> PyResult<Vec<u64>> {
    device::check_process()?;
    Ok(lending::numbers())
}

/// UUID, 16 bytes, and name of the graphics device. Opens it if nothing has. Raises GpuError where its memory cannot be
/// shared, ForkedError.
#[pyfunction]
pub fn sharing_device(py: Python<'_>) -> PyResult<(Bound<'_, PyBytes>, String)> {
    let found = py.detach(|| device::with_drawing(|drawing| Ok(lending::device(drawing.open()?))))?;
    let (uuid, name) = found?;
    Ok((PyBytes::new(py, &uuid), name))
}

/// A capsule of DLPack: `address` in memory of a `device`, its kind and number; `kind`: code and bits of a number;
/// `shape`, and `strides` in numbers. Holds `owner`.
#[pyfunction]
pub fn dlpack_capsule<'py>(
    py: Python<'py>,
    address: u64,
    device: (i32, i32),
    kind: (u8, u8),
    shape: Vec<i64>,
    strides: Vec<i64>,
    owner: Py<PyAny>,
) -> PyResult<Bound<'py, PyCapsule>> {
    let (code, bits) = kind;
    dlpack::capsule(py, dlpack::Array { address, device, code, bits, shape, strides }, owner)
}
