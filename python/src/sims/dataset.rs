//! `Dataset`: captures of a world as the files of a data set.

use crate::captures::capture::Capture;
use crate::errors::{Failure, Outcome};
use crate::given::arguments::{Given, Names, optional, required, wrong_type};
use crate::sims::sim::warn;
use crate::worlds::device;
use crate::worlds::world::{Shared, World};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use relief::data::{DatasetOptions, DatasetWriter, FileFormat, LastState};
use relief::frames::FrameError;
use relief::name;
use relief::renderer::Gpu;
use relief::sense::Capture as Captured;
use relief::systems::ecs::clock::Clock;
use relief::systems::sensors::SensorKind;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

/// A data set that is written capture by capture: with the same captures, the files of
/// `relief render --sensors all -o FOLDER --format …`, byte for byte.
///
/// `folder` is made by the first capture, which also chooses the world. `formats`: "png" and others, one or several, as
/// `relief render --help` lists them. `sensors`: full names; without them, all that the world has then.
#[pyclass(frozen, module = "relief")]
pub struct Dataset(Mutex<State>);

/// State of a data set.
enum State {
    /// Nothing is captured yet.
    New(DatasetOptions),
    /// Captures are being written.
    Begun(Box<Begun>),
    Closed,
}

struct Begun {
    world: Weak<Shared>,
    writer: DatasetWriter,
    /// Names of sensors were asked for.
    is_choice: bool,
    step: u64,
    state: LastState,
}

#[pymethods]
impl Dataset {
    #[new]
    #[pyo3(signature = (folder, *, formats=None, sensors=None))]
    fn new(folder: &Bound<'_, PyAny>, formats: Given<'_, '_>, sensors: Given<'_, '_>) -> PyResult<Self> {
        let mut options = DatasetOptions::new(required::<PathBuf>("folder", folder)?);
        options.sensors = names("sensors", sensors)?;
        if let Some(formats) = names("formats", formats)? {
            let find = |format: String| name::find("format", &FileFormat::ALL, &format);
            let found: Result<Vec<FileFormat>, String> = formats.into_iter().map(find).collect();
            options.formats = found.map_err(|message| Failure::value(format!("formats: {message}")))?;
        }
        Ok(Self(Mutex::new(State::New(options))))
    }

    /// Writes what `Sim.capture` or `relief.capture_due` gave, before the world's next step, with the values that the
    /// arrays have now. Steps between are noted without captures. Raises ValueError for sensors, formats and folders
    /// that `relief render` refuses, OutputError.
    fn write(&self, py: Python<'_>, capture: &Bound<'_, PyAny>) -> PyResult<()> {
        let given = capture.cast::<Capture>().map_err(|_| wrong_type("capture", "a Capture", capture))?.get();
        device::check_process()?;
        let Some(world) = given.world() else {
            let message = "capture: expected one that Sim.capture or relief.capture_due gave, of a world that is there";
            return Err(Failure::value(message).into());
        };
        let captured = given.captured(py)?;
        let warnings = py.detach(|| self.lock().write(captured, &world))?;
        warn(py, &warnings)
    }

    /// Ends the data set: with what is made of a run as a whole, and with what describes it. Nothing happens where it
    /// has ended, or nothing was written. Raises OutputError.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        device::check_process()?;
        Ok(py.detach(|| match self.lock().end() {
            State::Begun(begun) => Ok(begun.writer.finish(begun.state, None).map(drop)?),
            _ => Ok::<_, Failure>(()),
        })?)
    }

    fn __enter__(own: Py<Self>) -> Py<Self> {
        own
    }

    /// Ends it. After an exception the files of single captures stay, and nothing describes them.
    #[pyo3(signature = (*exception))]
    fn __exit__(&self, py: Python<'_>, exception: &Bound<'_, PyTuple>) -> PyResult<()> {
        if exception.iter().all(|part| part.is_none()) {
            return self.close(py);
        }
        py.detach(|| drop(self.lock().end()));
        Ok(())
    }
}

impl Dataset {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn end(&mut self) -> Self {
        std::mem::replace(self, Self::Closed)
    }

    /// Writes a capture of a world. Returns warnings. Where a file cannot be written, the data set ends.
    fn write(&mut self, captured: Captured, shared: &Arc<Shared>) -> Outcome<Vec<String>> {
        let mut world = shared.lock();
        let now = world.step_number();
        if captured.step != now {
            let step = captured.step;
            let message =
                format!("capture: expected one of step {now}, at which its world is, found one of step {step}");
            return Err(Failure::value(message));
        }
        let mut warnings = Vec::new();
        match self {
            Self::Closed => return Err(Failure::value("the data set has ended")),
            Self::New(options) => {
                let begun = Begun::new(options.clone(), shared, &mut world)?;
                warnings = begun.1;
                *self = Self::Begun(Box::new(begun.0));
            }
            Self::Begun(begun) => begun.check(&captured, shared)?,
        }
        let Self::Begun(begun) = self else { return Ok(warnings) };
        if let Err(error) = begun.write(captured, &mut world) {
            self.end();
            return Err(error);
        }
        Ok(warnings)
    }
}

impl Begun {
    fn new(options: DatasetOptions, shared: &Arc<Shared>, world: &mut World) -> Outcome<(Self, Vec<String>)> {
        let is_choice = options.sensors.is_some();
        let (scene, files) = (world.path().to_owned(), world.scene.files.clone());
        let begun = DatasetWriter::begin(options, (&scene, &files), &mut world.simulation.world);
        let (mut writer, warnings) = begun.map_err(refused)?;
        let step = world.step_number();
        writer.tick(world.simulation.world.resource::<Clock>(), step)?;
        let state = state(&writer, world)?;
        Ok((Self { world: Arc::downgrade(shared), writer, is_choice, step, state }, warnings))
    }

    /// Makes sure that a capture continues those before.
    fn check(&self, captured: &Captured, shared: &Arc<Shared>) -> Outcome<()> {
        if !Weak::ptr_eq(&self.world, &Arc::downgrade(shared)) {
            return Err(Failure::value("capture: expected one of the world whose captures were written before"));
        }
        let (step, last) = (captured.step, self.step);
        if step <= last {
            let message =
                format!("capture: expected one after step {last}, which is written, found one of step {step}");
            return Err(Failure::value(message));
        }
        let is_new = |name: &&String| !self.is_choice && !self.writer.sensors().contains_key(*name);
        match captured.sensors.iter().map(|sensor| &sensor.name).find(is_new) {
            Some(name) => {
                let message = format!("capture: sensor {name:?} was not there when the data set began; sensors=");
                Err(Failure::value(format!("{message} chooses those to be written")))
            }
            None => Ok(()),
        }
    }

    fn write(&mut self, captured: Captured, world: &mut World) -> Outcome<()> {
        let clock = world.simulation.world.resource::<Clock>();
        (self.step + 1..=captured.step).try_for_each(|step| self.writer.tick(clock, step))?;
        self.step = captured.step;
        self.writer.write(captured, &mut world.simulation.world)?;
        self.state = state(&self.writer, world)?;
        Ok(())
    }
}

/// Facts of the world as it is now, with the device, if the data set has cameras.
fn state(writer: &DatasetWriter, world: &mut World) -> Outcome<LastState> {
    let draws = writer.sensors().values().any(|sensor| matches!(sensor.kind, SensorKind::Camera(_)));
    let gpu: Option<Gpu> = draws.then(|| device::with_drawing(|drawing| drawing.open().cloned())).transpose()?;
    Ok(writer.state(&mut world.simulation.world, gpu.as_ref()))
}

/// Failure of beginning a data set, with the argument at fault.
fn refused(error: FrameError) -> Failure {
    let argument = match &error {
        FrameError::NoSensors { .. }
        | FrameError::NoSensor { .. }
        | FrameError::SharedSensorName { .. }
        | FrameError::BadSensorName { .. } => "sensors",
        FrameError::NoFormat { .. }
        | FrameError::NoPanoptic { .. }
        | FrameError::NotBuiltIn { .. }
        | FrameError::NothingToHold { .. }
        | FrameError::SharedFrameName { .. } => "formats",
        FrameError::Overwrites { .. } => "folder",
        _ => return error.into(),
    };
    Failure::value(format!("{argument}: {error}"))
}

/// One name or several, at least one.
fn names(argument: &str, given: Given<'_, '_>) -> PyResult<Option<Vec<String>>> {
    let names = optional::<Names>(argument, given)?.map(Names::all);
    match &names {
        Some(names) if names.is_empty() => Err(Failure::value(format!("{argument}: expected at least one")).into()),
        _ => Ok(names),
    }
}
