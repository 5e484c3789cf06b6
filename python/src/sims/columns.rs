//! Sensors of several worlds as arrays, without an object for each.

use crate::captures::camera::{CameraBatch, array};
use crate::errors::{Failure, Outcome};
use crate::given::arguments::{Given, Names, optional, required};
use crate::sims::many::{are_alike, with_all, worlds};
use crate::sims::sim::warn;
use crate::worlds::world::World;
use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use relief::export::array::Values;
use relief::sense::{CameraCapture, Capture as Captured, OwnedColumn, SensorData, Wanted};

/// Measurements of the same sensor of several worlds.
enum Joined {
    Cameras(Vec<CameraCapture>),
    /// World of each record, and the columns of each world.
    Records(Vec<u32>, Vec<Vec<OwnedColumn>>),
}

/// Captures every sensor that is due, of several worlds, as `capture_due`. Returns of each full name what all worlds
/// measured: of a camera a `CameraBatch`, of a sensor without pictures a dict of arrays. These have a row for each
/// record: its fields as files have them, and `world`, the place of its world. `without`: full names of sensors that
/// are not captured, such as those that something else looks at. Raises KeyError where a world lacks a sensor of
/// `names` or it is not due, ValueError of lidars and where cameras differ in size or outputs, GpuError.
#[pyfunction]
#[pyo3(signature = (sims, names, *, without=None), text_signature = "(sims, names, *, without=())")]
pub fn capture_columns(
    py: Python<'_>,
    sims: &Bound<'_, PyAny>,
    names: &Bound<'_, PyAny>,
    without: Given<'_, '_>,
) -> PyResult<Vec<Py<PyAny>>> {
    let (sims, names) = (worlds("sims", sims)?, required::<Names>("names", names)?.all());
    let without = optional::<Names>("without", without)?.map_or(Vec::new(), Names::all);
    if sims.is_empty() {
        return Err(Failure::value("sims: expected at least one").into());
    }
    let (joined, steps, warnings) = with_all(py, &sims, |mut worlds| {
        let is_wanted = |name: &str| !without.iter().any(|own| own == name);
        let wanted = worlds.iter_mut().map(|world| (&mut **world, Wanted::Due(&is_wanted)));
        let mut captures = World::capture_all(wanted.collect())?;
        let joined = names.iter().map(|name| join(&mut captures, name)).collect::<Outcome<Vec<_>>>()?;
        let steps: Vec<u64> = captures.iter().map(|capture| capture.step).collect();
        let warnings: Vec<String> = worlds.into_iter().flat_map(|world| world.watch.warnings()).collect();
        Ok((joined, steps, warnings))
    })?;
    warn(py, &warnings)?;
    let object = |joined| match joined {
        Joined::Cameras(captures) => Ok(Py::new(py, CameraBatch::new(py, captures, steps.clone())?)?.into_any()),
        Joined::Records(world, columns) => Ok(records(py, world, &columns)?.into_any().unbind()),
    };
    joined.into_iter().map(object).collect()
}

/// Takes the sensor of a name out of the captures of worlds.
fn join(captures: &mut [Captured], name: &str) -> Outcome<Joined> {
    let (mut cameras, mut worlds, mut columns) = (Vec::new(), Vec::new(), Vec::new());
    for (place, capture) in captures.iter_mut().enumerate() {
        let Some(found) = capture.sensors.iter().position(|sensor| sensor.name == name) else {
            let message = format!("no sensor {name:?} was captured; it is not due, or there is none");
            return Err(Failure::Name(message).of_world(place));
        };
        match capture.sensors.swap_remove(found).data {
            SensorData::Camera(camera) => cameras.push(camera),
            SensorData::Reading(reading) => {
                worlds.extend(std::iter::repeat_n(place as u32, reading.rows()));
                columns.push(reading.columns().map_err(|error| Failure::value(error.to_string()))?);
            }
            SensorData::Lidar(_) => {
                let message = format!("expected {name:?} to be a camera or a sensor without pictures, found a lidar");
                return Err(Failure::value(message));
            }
        }
    }
    are_alike(&cameras)?;
    Ok(if cameras.is_empty() { Joined::Records(worlds, columns) } else { Joined::Cameras(cameras) })
}

/// Records as arrays by the names of their fields, of one world after the other.
fn records<'py>(py: Python<'py>, world: Vec<u32>, columns: &[Vec<OwnedColumn>]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (place, first) in columns.iter().flatten().take(columns.first().map_or(0, Vec::len)).enumerate() {
        let each = columns.iter().filter_map(|own| own.get(place)).map(OwnedColumn::column);
        let shape = [&[world.len()], first.column().shape].concat();
        macro_rules! joined {
            ($kind:ident) => {
                array(
                    py,
                    &shape,
                    each.flat_map(|own| if let Values::$kind(own) = own.values { own } else { &[] }).copied().collect(),
                )
            };
        }
        let values = match first.column().values {
            Values::U8(_) => joined!(U8),
            Values::U32(_) => joined!(U32),
            _ => joined!(F64),
        };
        dict.set_item(first.column().name, values?)?;
    }
    dict.set_item("world", world.into_pyarray(py))?;
    Ok(dict)
}
