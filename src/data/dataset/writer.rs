//! A data set that is being written, capture by capture: by a job, or by a program that takes the steps itself.

use super::description;
use super::manifest::Manifest;
use super::names::{DESCRIPTION, MANIFEST, WHOLE, fault_of_name};
use super::numbers;
use crate::data::formats::files;
use crate::data::formats::format::{CaptureFile, FileFormat, Poses, RunInfo, RunWriter};
use crate::data::formats::writers;
use crate::frames::{FrameError, check_outputs, is_written};
use crate::name;
use crate::output::{self, OutputError};
use crate::renderer::Gpu;
use crate::sense::captures::capture::{Capture, FirstColumn, SensorCapture};
use crate::sense::motion::place;
use crate::sense::world::due::{Due, nanoseconds};
use crate::sense::world::names::sensor_names;
use bevy_ecs::prelude::*;
use glam::DAffine3;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::ops::Range;
use std::path::{Path, PathBuf};
use systems::ecs::clock::Clock;
use systems::sensors::{CameraOutput, Classes, Sensor, SensorKind};
use systems::space::origin::Origin;

/// Choices for a data set.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DatasetOptions {
    /// Folder of the files; made if missing.
    pub folder: PathBuf,
    /// Names of sensors; `None`: all.
    pub sensors: Option<Vec<String>>,
    /// Forms of files, at least one.
    pub formats: Vec<FileFormat>,
    /// Leaves captures alone whose files are all there; none where something of the whole run is asked for, as a log.
    pub resume: bool,
    /// The run that this is a part of, to be put together with the others.
    pub part: Option<PartOfRun>,
}

/// The whole of a run, as its parts know it.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PartOfRun {
    /// All its frames.
    pub frames: Range<u64>,
    /// Folder of films' pictures, which are kept instead of films.
    pub films: PathBuf,
}

impl DatasetOptions {
    /// All sensors, as pictures, in a folder.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), sensors: None, formats: vec![FileFormat::PNG], resume: false, part: None }
    }

    /// Tells if a file may be one of the data set, as far as that is known before its sensors are: those of its formats
    /// in folders below its own, and what describes the whole.
    pub(super) fn writes(&self, path: &Path) -> bool {
        let (path, folder) = (output::real(path), output::real(&self.folder));
        let Ok(within) = path.strip_prefix(folder) else { return false };
        let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default();
        let is_of_a_sensor =
            within.components().count() > 1 && self.formats.iter().any(|format| format.endings.contains(&extension));
        is_of_a_sensor || WHOLE.iter().any(|name| within == Path::new(name))
    }

    /// The sensors that are asked for, by their names. `scene`: its file, for messages.
    ///
    /// # Errors
    /// [`FrameError`]: a name without a sensor or a folder, a sensor without a format, or a format without a sensor.
    pub(super) fn choose(&self, scene: &Path, world: &mut World) -> Result<BTreeMap<String, Sensor>, FrameError> {
        let known = sensor_names(world);
        let names: Vec<&str> = known.iter().map(|(name, _)| name.as_str()).collect();
        if names.is_empty() {
            return Err(FrameError::NoSensors { scene: scene.to_owned() });
        }
        let mut wanted: Vec<String> =
            self.sensors.clone().unwrap_or_else(|| names.iter().map(ToString::to_string).collect());
        if self.sensors.is_some() {
            wanted.sort_unstable();
            wanted.dedup();
        }
        for name in &wanted {
            match names.iter().filter(|known| **known == name.as_str()).count() {
                0 => {
                    let (scene, wanted) = (scene.to_owned(), name.clone());
                    let known = names.iter().map(ToString::to_string).collect();
                    let nearest = name::nearest(&names, name).map(str::to_owned);
                    return Err(FrameError::NoSensor { scene, wanted, nearest, known });
                }
                1 => {}
                _ => return Err(FrameError::SharedSensorName { scene: scene.to_owned(), name: name.clone() }),
            }
        }
        let mut folders = BTreeSet::new();
        for name in &wanted {
            let fault = fault_of_name(name);
            // Some file systems do not tell capitals from small letters.
            let fault =
                fault.or((!folders.insert(name.to_lowercase())).then_some("differs from another in its case alone"));
            if let Some(fault) = fault {
                let (scene, name) = (scene.to_owned(), name.clone());
                return Err(FrameError::BadSensorName { scene, name, fault });
            }
        }
        let chosen = known.iter().filter(|(name, _)| wanted.contains(name));
        let chosen: BTreeMap<String, Sensor> =
            chosen.filter_map(|(name, entity)| Some((name.clone(), world.get::<Sensor>(*entity)?.clone()))).collect();
        let run = self.run_info(&chosen, 0, world);
        writers::check_needs(&run)?;
        for (name, sensor) in &chosen {
            let left_out = files::left_out(sensor, &self.formats);
            if !left_out.is_empty() {
                let outputs = left_out.join(", ");
                return Err(FrameError::NoFormat { sensor: name.clone(), outputs });
            }
        }
        self.formats.iter().try_for_each(|format| (format.check)(&run))?;
        Ok(chosen)
    }

    fn run_info<'a>(&'a self, sensors: &'a BTreeMap<String, Sensor>, first: u64, world: &'a World) -> RunInfo<'a> {
        RunInfo {
            folder: &self.folder,
            formats: &self.formats,
            sensors,
            classes: world.resource::<Classes>(),
            step_seconds: world.resource::<Clock>().step_seconds,
            first,
            films: self.part.as_ref().map(|part| &*part.films),
        }
    }
}

/// A data set that is being written.
pub struct DatasetWriter {
    options: DatasetOptions,
    chosen: BTreeMap<String, Sensor>,
    /// The first frame of which there are files.
    first: u64,
    writers: Vec<Box<dyn RunWriter>>,
    /// Sensors whose files of the step at hand are not to be written.
    kept: BTreeSet<String>,
    /// Descriptions of captures, by names of sensors.
    captures: BTreeMap<String, Vec<Value>>,
    /// All its files.
    files: BTreeSet<PathBuf>,
    /// Those of these that were written.
    written: Vec<PathBuf>,
}

impl DatasetWriter {
    /// Begins a data set of a world, whose first frame is that at hand, and makes its folder. `scene`: its file;
    /// `files`: all that it was made from. Returns warnings, too.
    ///
    /// # Errors
    /// [`FrameError`]: what [`render_sensors`](super::job::render_sensors) refuses of sensors, formats and folders; a
    /// folder or file that cannot be written.
    pub fn begin(
        mut options: DatasetOptions,
        (scene, files): (&Path, &[PathBuf]),
        world: &mut World,
    ) -> Result<(Self, Vec<String>), FrameError> {
        options.formats = writers::in_order(&options.formats);
        check_outputs(files, |path| options.writes(path))?;
        let chosen = options.choose(scene, world)?;
        let warnings = numbers::warnings(world, &chosen, &options.formats);
        let first = world.resource::<Clock>().step;
        Ok((Self::begin_with(options, chosen, first, world)?, warnings))
    }

    /// Begins the data set of sensors that were chosen, whose first frame is known.
    pub(super) fn begin_with(
        options: DatasetOptions,
        chosen: BTreeMap<String, Sensor>,
        first: u64,
        world: &World,
    ) -> Result<Self, FrameError> {
        output::make_folder(&options.folder)?;
        if options.formats.iter().any(|format| format.is_per_capture()) {
            for name in chosen.keys() {
                output::make_folder(&options.folder.join(name))?;
            }
        }
        let first = options.part.as_ref().map_or(first, |part| part.frames.start);
        let writers = writers::begin(&options.run_info(&chosen, first, world))?;
        let (kept, captures) = (BTreeSet::new(), BTreeMap::new());
        Ok(Self { options, chosen, first, writers, kept, captures, files: BTreeSet::new(), written: Vec::new() })
    }

    /// Its sensors, by their names, with their settings as it began.
    pub fn sensors(&self) -> &BTreeMap<String, Sensor> {
        &self.chosen
    }

    /// Notes that a step has been taken: each from the first frame on, that one, too.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn tick(&mut self, clock: &Clock, step: u64) -> Result<(), FrameError> {
        self.writers.iter_mut().try_for_each(|writer| writer.tick(nanoseconds(clock, step)))
    }

    /// Writes what its sensors measured after the last step that was noted; `world` is as it was then.
    ///
    /// # Errors
    /// A file that cannot be written, or a value that does not fit into its form.
    pub fn write(&mut self, mut capture: Capture, world: &mut World) -> Result<(), FrameError> {
        capture.sensors.retain(|sensor| self.chosen.contains_key(&sensor.name));
        for sensor in &capture.sensors {
            let SensorCapture { name, world_from_sensor, first_column, .. } = sensor;
            self.describe(name, (capture.step, capture.nanoseconds), *world_from_sensor, *first_column);
        }
        self.write_files(&capture, world)
    }

    fn describe(
        &mut self,
        name: &str,
        time: (u64, u64),
        world_from_sensor: DAffine3,
        first_column: Option<FirstColumn>,
    ) {
        let described = description::capture(time, world_from_sensor, first_column);
        self.captures.entry(name.to_owned()).or_default().push(described);
    }

    /// The files of a sensor's capture.
    fn files_of(&self, name: &str, sensor: &Sensor, step: u64) -> Vec<(PathBuf, CaptureFile)> {
        let files = files::files_of(sensor, &self.options.formats, (step, self.first)).into_iter();
        files.map(|(file, made)| (self.options.folder.join(name).join(file), made)).collect()
    }

    /// Describes all that is due after the clock's step, and leaves of it what is to be captured, in a run up to the
    /// frame `end`.
    pub(super) fn leave_missing(&mut self, due: &mut Vec<Due>, end: u64, world: &World) {
        let (step, origin) = (world.resource::<Clock>().step, world.resource::<Origin>().0);
        let time = (step, nanoseconds(world.resource::<Clock>(), step));
        self.kept.clear();
        due.retain(|due| {
            self.describe(&due.name, time, due.in_scene(origin), due.first_column(world));
            if !self.writers.is_empty() || !self.has_files(due, step) {
                return true;
            }
            let files = self.files_of(&due.name, &due.sensor, step);
            self.files.extend(files.into_iter().map(|(path, _)| path));
            self.kept.insert(due.name.clone());
            // Flow from here to there goes by both pictures.
            next_of_pair(&due.sensor, step).is_some_and(|next| next < end && !self.has_files(due, next))
        });
    }

    fn has_files(&self, due: &Due, step: u64) -> bool {
        let is_there = |(path, file): &(PathBuf, CaptureFile)| is_whole(path, &due.sensor, file);
        self.options.resume && self.files_of(&due.name, &due.sensor, step).iter().all(is_there)
    }

    /// Writes a capture whose sensors are described already.
    pub(super) fn write_files(&mut self, capture: &Capture, world: &mut World) -> Result<(), FrameError> {
        if capture.sensors.is_empty() {
            return Ok(());
        }
        for sensor in capture.sensors.iter().filter(|sensor| !self.kept.contains(&sensor.name)) {
            let Some(settings) = world.get::<Sensor>(sensor.entity) else { continue };
            for (path, file) in self.files_of(&sensor.name, settings, capture.step) {
                let bytes = (file.encode)(sensor, file.output).map_err(|error| OutputError::io(&path, error))?;
                if let Some(bytes) = bytes {
                    output::write_whole(&path, &bytes)?;
                    self.files.insert(path.clone());
                    self.written.push(path);
                }
            }
        }
        if !self.writers.is_empty() {
            let poses = poses(world);
            self.writers.iter_mut().try_for_each(|writer| writer.write(capture, &poses))?;
        }
        Ok(())
    }

    /// Ends what is made of the run as a whole.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(super) fn finish_writers(&mut self) -> Result<(), FrameError> {
        for writer in std::mem::take(&mut self.writers) {
            let files = writer.finish()?;
            self.files.extend(files.iter().cloned());
            self.written.extend(files);
        }
        Ok(())
    }

    /// Ends the data set with a state. Returns the files that were written; among them others' of the run, which are
    /// `besides`.
    ///
    /// # Errors
    /// A file that cannot be written, or read back.
    pub fn finish(
        mut self,
        state: LastState,
        besides: impl IntoIterator<Item = PathBuf>,
    ) -> Result<Vec<PathBuf>, FrameError> {
        self.finish_writers()?;
        self.written.extend(besides);
        let LastState { described, mut manifest } = state;
        let path = self.options.folder.join(DESCRIPTION);
        output::write_whole(&path, description::text(described, self.captures).as_bytes())?;
        self.files.insert(path.clone());
        self.written.push(path);
        let path = self.options.folder.join(MANIFEST);
        manifest.blake3 = output::hashes_of(&self.options.folder, &self.files)?;
        let text = manifest.text().map_err(|error| OutputError::io(&path, error.into()))?;
        output::write_whole(&path, text.as_bytes())?;
        self.written.push(path);
        Ok(self.written)
    }

    /// The state of a world as it is now, for [`Self::finish`]. `gpu`: the device, if anything was drawn.
    pub fn state(&self, world: &mut World, gpu: Option<&Gpu>) -> LastState {
        LastState { described: description::of_sensors(world, &self.chosen), manifest: Manifest::of_world(world, gpu) }
    }
}

/// Facts of the state that a data set ends with.
pub struct LastState {
    described: Value,
    manifest: Manifest,
}

/// Poses of all sensors.
fn poses(world: &mut World) -> Poses {
    let named = sensor_names(world);
    let placed = |(name, sensor): (String, Entity)| (name, place::pose(world, sensor).world_from_entity());
    named.into_iter().map(placed).collect()
}

/// Next step at which a sensor is due that measures between captures: flow, and the motion of boxes.
pub(super) fn next_of_pair(sensor: &Sensor, step: u64) -> Option<u64> {
    let SensorKind::Camera(camera) = &sensor.kind else { return None };
    let is_of_pairs = camera.outputs.has_any(&[CameraOutput::Flow, CameraOutput::FlowBack, CameraOutput::Boxes]);
    is_of_pairs.then(|| step + u64::from(sensor.every))
}

/// Tells if a file is there, as far as can be told without its contents: files are written whole.
fn is_whole(path: &Path, sensor: &Sensor, file: &CaptureFile) -> bool {
    match &sensor.kind {
        SensorKind::Camera(camera) if file.output.is_some() && path.extension() == Some(OsStr::new("png")) => {
            is_written(path, camera.size)
        }
        _ => path.metadata().is_ok_and(|found| found.is_file() && found.len() > 0),
    }
}
