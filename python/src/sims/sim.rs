//! `Sim`: a world of a scene, and its run.

use crate::captures::capture::Capture;
use crate::errors::{Failure, Outcome};
use crate::getters::getters;
use crate::given::arguments::{Bytes, Given, optional, required};
use crate::given::described;
use crate::worlds::world::{Shared, World};
use pyo3::exceptions::{PyTypeError, PyUserWarning};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyTuple};
use relief::bevy_ecs::prelude::Entity as BevyEntity;
use relief::name;
use relief::sense::Wanted;
use relief::systems::ecs::clock::{Clock, Seed};
use relief::systems::run::standard_inputs::NextMeshVariant;
use relief::systems::run::state_hash;
use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Weak};

/// Steps of a call.
pub const MOST_STEPS: u64 = 1 << 40;
/// Steps between which the keyboard may interrupt.
pub const STEPS_AT_ONCE: u64 = 1000;

/// A world of a scene, and its run.
///
/// `scene`: a scene file (.ron) or a model (.gltf, .glb); without one, an open field with a sun, on which vehicles of
/// all types can be spawned. In the place of the scene's own: `seed`; `step_seconds` of the clock; `geo_origin`, a dict
/// with `latitude_degrees`, `longitude_degrees` and perhaps `altitude` and `at`; `environment`, a dict as `environment`
/// gives it, what is left out by default. Such worlds are not recorded. Any thread may use it, one after the other.
/// Raises SceneError.
#[pyclass(frozen, module = "relief")]
pub struct Sim {
    pub shared: Arc<Shared>,
}

impl Sim {
    pub fn of(world: World) -> Self {
        Self { shared: Shared::new(world) }
    }

    pub fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut World) -> Result<T, Failure> + Send,
    ) -> PyResult<T> {
        self.shared.with(py, work)
    }

    /// Does something for a getter.
    pub fn read<T: Send>(own: &PyRef<'_, Self>, work: impl FnOnce(&mut World) -> Outcome<T> + Send) -> PyResult<T> {
        own.with(own.py(), work)
    }

    fn captured(&self, py: Python<'_>, names: &Bound<'_, PyTuple>, which: Captured) -> PyResult<Capture> {
        let names = each_name(names)?;
        let (captured, warnings, classes) = self.with(py, move |world| {
            let all = world.check_sensors(&names)?.into_iter();
            let is_named = |name: &str| is_among(&names, name);
            let named: Vec<_> = all.filter(|(name, _)| is_named(name)).map(|(_, sensor)| sensor).collect();
            let captured = world.capture(match which {
                Captured::Due => Wanted::Due(&is_named),
                Captured::Now => Wanted::Look(&named),
            })?;
            let classes = Capture::classes(&world.simulation.world, &captured);
            Ok((captured, world.watch.warnings(), classes))
        })?;
        warn(py, &warnings)?;
        let world = if which == Captured::Due { Arc::downgrade(&self.shared) } else { Weak::new() };
        Capture::new(py, captured, &classes, world)
    }
}

/// Sensors that are captured: those that are due, or all, of the state at hand.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Captured {
    Due,
    Now,
}

/// The open field.
fn field(py: Python<'_>) -> PyResult<PathBuf> {
    py.import("relief")?.getattr("assets")?.call0()?.call_method1("joinpath", ("field.ron",))?.extract()
}

/// Warns of each as a UserWarning.
pub fn warn(py: Python<'_>, warnings: &[String]) -> PyResult<()> {
    let category = py.get_type::<PyUserWarning>();
    warnings.iter().try_for_each(|warning| PyErr::warn(py, &category, &CString::new(warning.replace('\0', " "))?, 1))
}

/// Says where a scene of the package is, to who names it by its file's name alone.
fn of_package(py: Python<'_>, scene: &Path) -> PyResult<()> {
    let Some(name) = scene.file_name().filter(|_| !scene.exists()) else { return Ok(()) };
    let own: PathBuf =
        py.import("relief")?.getattr("assets")?.call0()?.call_method1("joinpath", ("scenes", name))?.extract()?;
    if !own.is_file() {
        return Ok(());
    }
    let name = name.to_string_lossy();
    let message = format!("{}: No such file; the package's is relief.assets() / \"scenes/{name}\"", scene.display());
    let class = py.import("relief.errors")?.getattr("SceneError")?;
    Err(PyErr::from_value(class.call1((message,))?))
}

/// Reads several arguments, each a name.
fn each_name(names: &Bound<'_, PyTuple>) -> PyResult<Vec<String>> {
    names.iter().enumerate().map(|(i, name)| required(&format!("names[{i}]"), &name)).collect()
}

getters! { Sim::read, Sim:
    /// The scene's file name without its extension.
    name: String = |world| world.scene.name.clone();
    /// Warnings of the loaded scene.
    warnings: Vec<String> = |world| world.scene.warnings.clone();
    /// The scene's file and those that it names.
    files: Vec<PathBuf> = |world| world.scene.files.clone();
    /// Seed of the run's random numbers.
    seed: u64 = |world| world.simulation.world.resource::<Seed>().0;
    /// Steps done since the run began.
    steps: u64 = |world| world.step_number();
    /// Length of a step, seconds.
    step_seconds: f64 = |world| world.simulation.world.resource::<Clock>().step_seconds;
    /// Seconds since the run began.
    seconds: f64 = |world| world.simulation.world.resource::<Clock>().seconds();
}

#[pymethods]
impl Sim {
    #[new]
    #[pyo3(signature = (scene=None, *, seed=None, step_seconds=None, geo_origin=None, environment=None))]
    fn new(
        py: Python<'_>,
        scene: Given<'_, '_>,
        seed: Given<'_, '_>,
        step_seconds: Given<'_, '_>,
        geo_origin: Given<'_, '_>,
        environment: Given<'_, '_>,
    ) -> PyResult<Self> {
        let step_seconds = optional::<f64>("step_seconds", step_seconds)?;
        let overrides = described::overrides(step_seconds, [("geo_origin", geo_origin), ("environment", environment)])?;
        let (scene, seed) = (optional::<PathBuf>("scene", scene)?, optional::<u64>("seed", seed)?);
        crate::worlds::device::check_process()?;
        let scene = scene.map_or_else(|| field(py), Ok)?;
        of_package(py, &scene)?;
        let made = py.detach(|| World::load(&scene, &overrides, seed));
        Ok(Self::of(made?))
    }

    /// Takes so many steps of the clock. Returns the number of steps done since the run began. What goes wrong with
    /// single vehicles is told as a UserWarning. Raises RecordingError
    /// where a replay comes out otherwise, OutputError where a recording cannot be written.
    #[pyo3(signature = (n=None), text_signature = "($self, n=1)")]
    fn step(&self, py: Python<'_>, n: Given<'_, '_>) -> PyResult<u64> {
        let n = optional::<u64>("n", n)?.unwrap_or(1);
        if n > MOST_STEPS {
            return Err(Failure::value(format!("n: expected at most {MOST_STEPS} steps, found {n}")).into());
        }
        let mut left = n;
        loop {
            // In between the keyboard may interrupt.
            let now = left.min(STEPS_AT_ONCE);
            let (step, warnings) = self.with(py, move |world| Ok((world.step(now)?, world.take_warnings())))?;
            warn(py, &warnings)?;
            left -= now;
            if left == 0 {
                return Ok(step);
            }
            py.check_signals()?;
        }
    }

    /// Captures every sensor that is due after the step, in one submission to the graphics device. With `names`, of
    /// these those alone, by their full names or the last parts of them. IMUs, receivers, lidars and flow measure since
    /// they were due before: where that was not captured, a UserWarning says so, once for each sensor. Raises
    /// GpuError.
    #[pyo3(signature = (*names))]
    fn capture(&self, py: Python<'_>, names: &Bound<'_, PyTuple>) -> PyResult<Capture> {
        self.captured(py, names, Captured::Due)
    }

    /// Captures sensors of the state at hand, whether they are due or not: all, or those of `names`.
    #[pyo3(signature = (*names))]
    fn look(&self, py: Python<'_>, names: &Bound<'_, PyTuple>) -> PyResult<Capture> {
        self.captured(py, names, Captured::Now)
    }

    /// Every entity with mesh variants shows its next one.
    fn next_mesh_variant(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, |world| world.apply(NextMeshVariant))
    }

    /// A hash of the whole state, 32 hexadecimal digits: equal states, equal hashes.
    fn hash(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |world| Ok(state_hash::hash(&mut world.simulation.world).to_string()))
    }

    /// The whole state, as a file of `relief run --save-snapshot` holds it.
    fn snapshot<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = self.with(py, |world| Ok(world.snapshot()?))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Makes the state that of a snapshot of this scene. Entities that are in both stay what they are. Raises
    /// RecordingError; the state is what it was then.
    fn restore(&self, py: Python<'_>, snapshot: &Bound<'_, PyAny>) -> PyResult<()> {
        let Bytes(snapshot) = required("snapshot", snapshot)?;
        self.with(py, move |world| world.restore(&snapshot))
    }

    /// Another world of the scene in the same state, which shares its meshes and images.
    fn fork(&self, py: Python<'_>) -> PyResult<Self> {
        self.with(py, |world| Ok(Self::of(World::of(world.fork()?))))
    }

    fn __copy__(&self, py: Python<'_>) -> PyResult<Self> {
        self.fork(py)
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.fork(py)
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(PyTypeError::new_err(
            "worlds cannot be pickled: use sim.fork() for a copy in this process, and sim.snapshot(), whose bytes \
             another world of the scene takes by restore()",
        ))
    }

    /// Another world of the scene as it begins, which shares its meshes and images. `seed`: in the place of this one's.
    #[pyo3(signature = (*, seed=None))]
    fn fresh(&self, py: Python<'_>, seed: Given<'_, '_>) -> PyResult<Self> {
        let seed = optional::<u64>("seed", seed)?;
        let made = self.with(py, move |world| Ok(World::of(world.fresh(seed)?)));
        made.map(Self::of)
    }

    /// Begins the run anew, with a `seed` in the place of this one's if one is given. What was spawned is gone.
    #[pyo3(signature = (*, seed=None))]
    fn reset(&self, py: Python<'_>, seed: Given<'_, '_>) -> PyResult<()> {
        let seed = optional::<u64>("seed", seed)?;
        self.with(py, move |world| world.reset(seed))
    }

    /// Reads the scene's files anew, and begins the run anew. Raises SceneError; nothing changes then.
    fn reload(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, World::reload)
    }

    /// Begins to record the run, from its state as it is: `with sim.record("run.rec"): …`. At the end of the block, or
    /// by `close`, the recording ends in order. `relief replay run.rec --check` and `relief.replay` compare every step.
    /// Raises RecordingError, OutputError.
    fn record(&self, py: Python<'_>, path: &Bound<'_, PyAny>) -> PyResult<Recording> {
        let path: PathBuf = required("path", path)?;
        if path.file_name().is_none() {
            return Err(Failure::value(format!("path: expected the name of a file, found {path:?}")).into());
        }
        let number = self.with(py, move |world| world.record(&path))?;
        Ok(Recording { shared: self.shared.clone(), number })
    }

    /// Gives back what it takes on the graphics device, and ends a recording. It can still be used.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, |world| {
            world.rest();
            Ok(world.finish()?)
        })
    }

    fn __enter__(own: Py<Self>) -> Py<Self> {
        own
    }

    #[pyo3(signature = (*_exception))]
    fn __exit__(&self, py: Python<'_>, _exception: &Bound<'_, PyTuple>) -> PyResult<()> {
        self.close(py)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |world| Ok(format!("<Sim of {:?}, step {}>", world.scene.name, world.step_number())))
    }
}

impl World {
    /// The sensors of the world, among which there is one of each name.
    fn check_sensors(&mut self, names: &[String]) -> Outcome<Vec<(String, BevyEntity)>> {
        let all = relief::sense::sensor_names(&mut self.simulation.world);
        for name in names {
            if !all.iter().any(|(full, _)| is_among(std::slice::from_ref(name), full)) {
                let known = all.iter().map(|(full, _)| full.as_str());
                return Err(Failure::Name(name::unknown("sensor", known, name)));
            }
        }
        Ok(all)
    }
}

/// Tells if a sensor is wanted: all are where no names are given.
pub fn is_among(names: &[String], full: &str) -> bool {
    let last = full.rsplit_once('/').map_or(full, |(_, last)| last);
    names.is_empty() || names.iter().any(|name| name == full || name == last)
}

/// A recording that is being written.
#[pyclass(frozen, module = "relief")]
pub struct Recording {
    shared: Arc<Shared>,
    number: u64,
}

#[pymethods]
impl Recording {
    /// Ends it in order. Nothing happens where it has ended.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        let number = self.number;
        self.shared.with(py, move |world| world.finish_recording(number))
    }

    fn __enter__(own: Py<Self>) -> Py<Self> {
        own
    }

    #[pyo3(signature = (*_exception))]
    fn __exit__(&self, py: Python<'_>, _exception: &Bound<'_, PyTuple>) -> PyResult<()> {
        self.close(py)
    }
}
