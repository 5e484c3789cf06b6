//! Several worlds at once: stepped on all threads, and captured together.

use crate::captures::camera::CameraBatch;
use crate::captures::capture::Capture;
use crate::errors::{Failure, Outcome};
use crate::given::arguments::{Given, items, optional, required, wrong_type};
use crate::sims::sim::{MOST_STEPS, STEPS_AT_ONCE, Sim, is_among, warn};
use crate::worlds::device;
use crate::worlds::world::{Replay, World};
use pyo3::prelude::*;
use pyo3::types::IntoPyDict;
use relief::bevy_ecs::prelude::Entity;
use relief::sense::{CameraCapture, Capture as Captured, SensorData, Wanted, sensor_names};
use relief::systems::ecs::parallel::map_in_parallel;
use relief::systems::sensors::{Sensor, SensorKind};
use std::path::PathBuf;
use std::sync::Arc;

/// Several worlds.
pub fn worlds(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<Py<Sim>>> {
    let expected = "a list of Sim";
    if given.is_instance_of::<Sim>() {
        return Err(wrong_type(name, expected, given));
    }
    let items = items(given).map_err(|_| wrong_type(name, expected, given))?;
    let world = |(i, item): (usize, PyResult<Bound<'_, PyAny>>)| {
        let item = item?;
        let world = item.cast::<Sim>().map(|world| world.clone().unbind());
        world.map_err(|_| wrong_type(&format!("{name}[{i}]"), "a Sim", &item))
    };
    items.enumerate().map(world).collect()
}

/// Does something with several worlds, in the order in which they are given, without the interpreter.
pub fn with_all<T: Send>(
    py: Python<'_>,
    sims: &[Py<Sim>],
    work: impl FnOnce(Vec<&mut World>) -> Outcome<T> + Send,
) -> PyResult<T> {
    device::check_process()?;
    let shared: Vec<_> = sims.iter().map(|sim| sim.get().shared.clone()).collect();
    for (i, own) in shared.iter().enumerate() {
        if shared[..i].iter().any(|before| Arc::ptr_eq(before, own)) {
            return Err(Failure::value("sims: expected every world once").into());
        }
    }
    Ok(py.detach(|| {
        // In the same order everywhere, lest two calls wait for each other.
        let mut order: Vec<usize> = (0..shared.len()).collect();
        order.sort_by_key(|&i| Arc::as_ptr(&shared[i]));
        let mut locked: Vec<_> = order.iter().map(|&i| (i, shared[i].lock())).collect();
        locked.sort_by_key(|(i, _)| *i);
        work(locked.iter_mut().map(|(_, world)| &mut **world).collect())
    })?)
}

fn steps_of_each(given: &Bound<'_, PyAny>) -> PyResult<Vec<u64>> {
    let items = items(given).map_err(|_| wrong_type("n", "a whole number, or a list of those", given))?;
    items.enumerate().map(|(i, item)| required(&format!("n[{i}]"), &item?)).collect()
}

/// Takes so many steps of every world, several worlds at a time. `n`: of all, or a list with those of each. Results are
/// the same as one after the other. Returns the numbers of steps done. Raises what `Sim.step` raises, of the first
/// world that does.
#[pyfunction]
#[pyo3(signature = (sims, n=None), text_signature = "(sims, n=1)")]
pub fn step(py: Python<'_>, sims: &Bound<'_, PyAny>, n: Given<'_, '_>) -> PyResult<Vec<u64>> {
    let sims = worlds("sims", sims)?;
    let each = match n {
        Some(given) if given.extract::<f64>().is_err() && !given.is_none() => steps_of_each(given)?,
        _ => vec![optional("n", n)?.unwrap_or(1); sims.len()],
    };
    if each.len() != sims.len() {
        let message = format!("n: expected a number, or one for each of {} worlds, found {}", sims.len(), each.len());
        return Err(Failure::value(message).into());
    }
    if let Some(n) = each.iter().find(|&&n| n > MOST_STEPS) {
        return Err(Failure::value(format!("n: expected at most {MOST_STEPS} steps, found {n}")).into());
    }
    let mut left = each;
    loop {
        // In between the keyboard may interrupt.
        let now: Vec<u64> = left.iter().map(|&left| left.min(STEPS_AT_ONCE)).collect();
        left.iter_mut().zip(&now).for_each(|(left, now)| *left -= now);
        let steps = with_all(py, &sims, |worlds| {
            let worlds: Vec<_> = worlds.into_iter().zip(now).collect();
            let stepped = |(world, n): (&mut World, u64)| Ok((world.step(n)?, world.take_warnings()));
            map_in_parallel(worlds.into_iter(), stepped).into_iter().collect::<Outcome<Vec<_>>>()
        })?;
        let (steps, warnings): (Vec<u64>, Vec<Vec<String>>) = steps.into_iter().unzip();
        warn(py, &warnings.concat())?;
        if left.iter().all(|&left| left == 0) {
            return Ok(steps);
        }
        py.check_signals()?;
    }
}

/// Captures every sensor that is due, of several worlds: of each what `Sim.capture` gives, bit for bit, with the
/// cameras of all worlds in one submission to the graphics device. Raises GpuError.
#[pyfunction]
pub fn capture_due(py: Python<'_>, sims: &Bound<'_, PyAny>) -> PyResult<Vec<Capture>> {
    let sims = worlds("sims", sims)?;
    let (captured, warnings) = with_all(py, &sims, |worlds| {
        let mut worlds = worlds;
        let wanted = worlds.iter_mut().map(|world| (&mut **world, Wanted::Due(&|_| true)));
        let captures = World::capture_all(wanted.collect())?;
        let with_classes = |(capture, world): (Captured, &&mut World)| {
            let classes = Capture::classes(&world.simulation.world, &capture);
            (capture, classes)
        };
        let captures: Vec<_> = captures.into_iter().zip(&worlds).map(with_classes).collect();
        let warnings: Vec<String> = worlds.into_iter().flat_map(|world| world.watch.warnings()).collect();
        Ok((captures, warnings))
    })?;
    warn(py, &warnings)?;
    let captured = captured
        .into_iter()
        .zip(&sims)
        .map(|((captured, classes), sim)| Capture::new(py, captured, &classes, Arc::downgrade(&sim.get().shared)));
    captured.collect()
}

/// The pictures of the same camera of several worlds, which is due in each: arrays with the worlds as their first axis.
/// The bits of a picture do not depend on the other worlds. `device`: "cpu", where they are numpy's; "cuda", where they
/// stay on the graphics device, a `relief.cuda.CudaBatch`; "auto", CUDA's if it can be had. Raises KeyError where a
/// world has no such camera, ValueError where one is not due or they differ in size or outputs, GpuError.
#[pyfunction]
#[pyo3(signature = (sims, sensor, *, device=None), text_signature = "(sims, sensor, *, device='cpu')")]
pub fn capture<'py>(
    py: Python<'py>,
    sims: &Bound<'py, PyAny>,
    sensor: &Bound<'py, PyAny>,
    device: Given<'_, 'py>,
) -> PyResult<Bound<'py, PyAny>> {
    pictures(py, sims, sensor, true, device)
}

/// The same as `capture`, whether the cameras are due or not. Raises what `capture` raises of such cameras.
#[pyfunction]
#[pyo3(signature = (sims, sensor, *, device=None), text_signature = "(sims, sensor, *, device='cpu')")]
pub fn look<'py>(
    py: Python<'py>,
    sims: &Bound<'py, PyAny>,
    sensor: &Bound<'py, PyAny>,
    device: Given<'_, 'py>,
) -> PyResult<Bound<'py, PyAny>> {
    pictures(py, sims, sensor, false, device)
}

fn pictures<'py>(
    py: Python<'py>,
    sims: &Bound<'py, PyAny>,
    sensor: &Bound<'py, PyAny>,
    is_to_be_due: bool,
    device: Given<'_, 'py>,
) -> PyResult<Bound<'py, PyAny>> {
    let device = optional::<String>("device", device)?.unwrap_or_else(|| "cpu".to_owned());
    if device != "cpu" {
        let keywords = [("due", is_to_be_due)].into_py_dict(py)?;
        return py.import("relief.cuda")?.call_method("pictures", (sims, sensor, device), Some(&keywords));
    }
    let (captures, steps, warnings) = with_cameras(py, sims, sensor, is_to_be_due, |mut cameras, looked_at| {
        let wanted = looked_at.iter().map(|camera| Wanted::Look(camera));
        let captures = World::capture_all(cameras.iter_mut().map(|world| &mut **world).zip(wanted).collect())?;
        let warnings: Vec<String> = cameras.iter_mut().flat_map(|world| world.watch.warnings()).collect();
        let pictures =
            captures.into_iter().flat_map(|capture| capture.sensors).filter_map(|sensor| match sensor.data {
                SensorData::Camera(camera) => Some(camera),
                _ => None,
            });
        let pictures: Vec<CameraCapture> = pictures.collect();
        are_alike(&pictures)?;
        Ok((pictures, steps_of(&cameras), warnings))
    })?;
    warn(py, &warnings)?;
    Ok(Bound::new(py, CameraBatch::new(py, captures, steps)?)?.into_any())
}

/// Step number of each world's clock.
pub fn steps_of(worlds: &[&mut World]) -> Vec<u64> {
    worlds.iter().map(|world| world.step_number()).collect()
}

/// Does something with several worlds and the camera of the same name in each.
pub fn with_cameras<T: Send>(
    py: Python<'_>,
    sims: &Bound<'_, PyAny>,
    sensor: &Bound<'_, PyAny>,
    is_to_be_due: bool,
    work: impl FnOnce(Vec<&mut World>, Vec<[Entity; 1]>) -> Outcome<T> + Send,
) -> PyResult<T> {
    let (sims, sensor) = (worlds("sims", sims)?, required::<String>("sensor", sensor)?);
    if sims.is_empty() {
        return Err(Failure::value("sims: expected at least one").into());
    }
    with_all(py, &sims, |mut worlds| {
        let looked_at = worlds.iter_mut().enumerate().map(|(i, world)| {
            let camera = camera(world, &sensor, is_to_be_due);
            Ok([camera.map_err(|failure| failure.of_world(i))?])
        });
        let looked_at = looked_at.collect::<Outcome<Vec<_>>>()?;
        work(worlds, looked_at)
    })
}

/// Refuses pictures of worlds that cannot be one array.
pub fn are_alike(pictures: &[CameraCapture]) -> Outcome<()> {
    let of = |own: &CameraCapture| (own.width, own.height, own.outputs);
    let differ = |first| pictures.iter().position(|own| of(own) != of(first));
    match pictures.first().and_then(differ) {
        Some(i) => {
            Err(Failure::value(format!("world {i}: expected a camera of the size and outputs of that of world 0")))
        }
        None => Ok(()),
    }
}

/// The only camera of that name.
fn camera(world: &mut World, name: &str, is_to_be_due: bool) -> Outcome<Entity> {
    let step = world.step_number();
    let names = [name.to_owned()];
    let all = sensor_names(&mut world.simulation.world);
    let found: Vec<_> = all.into_iter().filter(|(name, _)| is_among(&names, name)).map(|(_, sensor)| sensor).collect();
    let [only] = found[..] else {
        return Err(Failure::Name(format!("expected one sensor {name:?}, found {}", found.len())));
    };
    let sensor = world.simulation.world.get::<Sensor>(only);
    match sensor {
        Some(sensor) if is_to_be_due && !sensor.is_due(step) => {
            let message = format!("{name:?} is not due after step {step}; relief.look takes it all the same");
            Err(Failure::value(message))
        }
        Some(Sensor { kind: SensorKind::Camera(_), .. }) => Ok(only),
        _ => Err(Failure::value(format!("expected {name:?} to be a camera"))),
    }
}

/// Plays a recording to its end and compares every step. Returns the world as it ended. `scene`: its file, if it has
/// moved since. Warns where the recording was cut short; the world is that of its last step then. Raises RecordingError
/// at the first step that comes out otherwise, SceneError.
#[pyfunction]
#[pyo3(signature = (recording, *, scene=None))]
pub fn replay(py: Python<'_>, recording: &Bound<'_, PyAny>, scene: Given<'_, '_>) -> PyResult<Sim> {
    let recording: PathBuf = required("recording", recording)?;
    let scene = optional::<PathBuf>("scene", scene)?;
    device::check_process()?;
    let mut replay = py.detach(|| Replay::begin(&recording, scene.as_deref()))?;
    while !py.detach(|| replay.step(STEPS_AT_ONCE))? {
        py.check_signals()?;
    }
    warn(py, replay.warning.as_slice())?;
    Ok(Sim::of(py.detach(|| replay.finish())?))
}

/// The graphics adapter that this process draws with: its name, kind and backend. Opens it if nothing has. Raises
/// GpuError, ForkedError.
#[pyfunction]
pub fn adapter(py: Python<'_>) -> PyResult<String> {
    Ok(py.detach(|| device::with_drawing(|drawing| Ok(drawing.open()?.name())))?)
}

/// Sets the number of threads that step worlds: 1 to 1024, set before the first world. Raises ValueError where the
/// process has others already.
#[pyfunction]
pub fn set_threads(threads: &Bound<'_, PyAny>) -> PyResult<()> {
    let threads: usize = required("threads", threads)?;
    device::check_process()?;
    if !(1..=1024).contains(&threads) {
        return Err(Failure::value(format!("threads: expected 1 to 1024, found {threads}")).into());
    }
    match relief::systems::set_threads(Some(threads)) {
        own if own == threads => Ok(()),
        own => {
            let message = format!("threads: expected to be set before the first world; they are {own} in this process");
            Err(Failure::value(message).into())
        }
    }
}
