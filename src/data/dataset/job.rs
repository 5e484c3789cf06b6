//! The sensors of a run as files: a folder per sensor, with a file for each of its captures and outputs.
//!
//! ```text
//! DIR/ego/front/color_00012.png    of the sensor `front` on `ego`, after step 12
//! DIR/sensors.json                 what the sensors are, and where they were at each capture
//! DIR/sensors.mcap                 all captures in one log, if it is asked for; others of this kind are in formats
//! DIR/manifest.json                a hash of each of these files
//! ```
//!
//! Each file is written whole or not at all, so that an interrupted run can be resumed by what is there; but for what
//! is made of a whole run.

use super::description;
use super::manifest::Manifest;
use super::names::{DESCRIPTION, MANIFEST, WHOLE, fault_of_name};
use super::numbers;
use crate::data::formats::files::{self, OutputFile};
use crate::data::formats::format::FileFormat;
use crate::data::formats::run_writer::{Poses, RunInfo};
use crate::data::formats::writers;
use crate::frames::{FrameError, FrameRun, Frames, LoadOptions, check_outputs, is_written, load_stage};
use crate::name;
use crate::output::{self, OutputError};
use crate::recording::{RecordingError, RunFiles};
use crate::renderer::{Gpu, Settings};
use crate::sense::motion::place;
use crate::sense::motion::track::poses_needed;
use crate::sense::rays::scene::RayWarnings;
use crate::sense::world::due::nanoseconds;
use crate::sense::world::names::sensor_names;
use crate::sense::world::suite::SensorSuite;
use bevy_ecs::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::ops::Range;
use std::path::{Path, PathBuf};
use systems::ecs::clock::Clock;
use systems::lights::{LightPolicies, LightPolicy};
use systems::sensors::{CameraOutput, Classes, Sensor, SensorKind};

/// Captures to be written of a run.
#[derive(Clone, Debug)]
pub struct SensorJob {
    /// Scene file.
    pub scene: PathBuf,
    /// Folder of the files; made if missing.
    pub folder: PathBuf,
    /// Frames: of these, those after which a sensor is due.
    pub frames: Frames,
    /// Names of sensors; `None`: all.
    pub sensors: Option<Vec<String>>,
    /// Forms of files, at least one.
    pub formats: Vec<FileFormat>,
    /// Settings of cameras, but for what a sensor says itself.
    pub settings: Settings,
    /// Lights everything by this policy; `None`: as the scene has it.
    pub lights: Option<LightPolicy>,
    /// Leaves captures alone whose files are all there; none where something of the whole run is asked for, as a log.
    pub resume: bool,
    /// Options of loading the scene. Texels are kept: rays read them.
    pub load: LoadOptions,
    /// Files that the run begins from and is kept in.
    pub run: RunFiles,
    /// Takes the steps at the speed of the scene's clock rather than as fast as possible.
    pub realtime: bool,
    /// The run that this is a part of, to be put together with the others.
    pub part: Option<PartOfRun>,
}

/// The whole of a run, as its parts know it.
#[derive(Clone, Debug)]
pub struct PartOfRun {
    /// All its frames.
    pub frames: Range<u64>,
    /// Folder of films' pictures, which are kept instead of films.
    pub films: PathBuf,
}

impl SensorJob {
    /// The files of a sensor's capture: of a step, when the first that has files is that one.
    fn files_of(&self, name: &str, sensor: &Sensor, steps: (u64, u64)) -> Vec<(PathBuf, OutputFile)> {
        let files = files::files_of(sensor, &self.formats, steps).into_iter();
        files.map(|file| (self.folder.join(name).join(&file.name), file)).collect()
    }

    /// Tells if a file may be one of the job's, as far as that is known before its sensors are: those of its formats in
    /// folders below its own, and what describes the whole.
    fn writes(&self, path: &Path) -> bool {
        let (path, folder) = (output::real(path), output::real(&self.folder));
        let Ok(within) = path.strip_prefix(folder) else { return false };
        let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default();
        let is_of_a_sensor =
            within.components().count() > 1 && self.formats.iter().any(|format| format.endings().contains(&extension));
        is_of_a_sensor || WHOLE.iter().any(|name| within == Path::new(name))
    }
}

/// Captures a job; `progress` is called after each frame with how many are done, and of how many. Returns the files
/// written.
///
/// # Errors
/// [`FrameError`]; files written before stay.
pub fn render_sensors(job: &SensorJob, mut progress: impl FnMut(u64, u64)) -> Result<Vec<PathBuf>, FrameError> {
    if let Some(path) = job.run.written().find(|path| job.writes(path)) {
        return Err(RecordingError::taken(path).into());
    }
    let begun_from: Vec<PathBuf> = job.run.replay.iter().chain(&job.run.from_snapshot).cloned().collect();
    check_outputs(&begun_from, |path| job.writes(path))?;
    // The driver and its pipelines take their time; the scene loads meanwhile.
    let opening = std::thread::spawn(|| Gpu::headless().map(|gpu| SensorSuite::new(&gpu)));
    let load = LoadOptions { keep_texels: true, ..job.load.clone() };
    let stage = load_stage(&job.scene, None, &load);
    let suite = opening.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    let mut stage = stage?;
    stage.check_outputs(|path| job.writes(path))?;
    let chosen = choose(job, &mut stage.simulation.world)?;
    for warning in numbers::warnings(&mut stage.simulation.world, &chosen, &job.formats) {
        tracing::warn!("{warning}");
    }
    let draws = chosen.values().any(|sensor| matches!(sensor.kind, SensorKind::Camera(_)));
    // What needs no picture needs no adapter.
    let mut suite = if draws { suite? } else { SensorSuite::default() };
    let mut run = FrameRun::begin(stage, (&job.scene, &job.run), &job.frames, job.realtime)?;
    let frames = run.frames.clone();
    output::make_folder(&job.folder)?;
    if job.formats.iter().any(|format| format.is_per_capture()) {
        for name in chosen.keys() {
            output::make_folder(&job.folder.join(name))?;
        }
    }
    // The first of which there are files.
    let first = job.part.as_ref().map_or(frames.start, |part| part.frames.start);
    let mut writers = writers::begin(&run_info(job, &chosen, first, &run.stage.simulation.world))?;
    run.stage.simulation.world.resource_mut::<LightPolicies>().forced = job.lights;
    suite.settings = job.settings;
    let (mut written, mut all, mut captures) = (Vec::new(), BTreeSet::new(), BTreeMap::new());
    let mut has_warned = false;
    loop {
        let step = run.step();
        // Before the first frame, too: lidars that sweep begin where they were when they were due last.
        let mut due = suite.due(&mut run.stage.simulation, |name| chosen.contains_key(name));
        if step >= frames.start {
            let world = &run.stage.simulation.world;
            for writer in &mut writers {
                writer.tick(nanoseconds(world.resource::<Clock>(), step))?;
            }
            let mut missing = BTreeMap::new();
            for due in &due {
                let files_of = |step| job.files_of(&due.name, &due.sensor, (step, first));
                let is_there = |(path, file): &(PathBuf, OutputFile)| job.resume && is_whole(path, &due.sensor, file);
                let files = files_of(step);
                all.extend(files.iter().map(|(path, _)| path.clone()));
                captures.entry(due.name.clone()).or_insert_with(Vec::new).push(description::capture(due, step, world));
                if !writers.is_empty() || !files.iter().all(is_there) {
                    missing.insert(due.name.clone(), files);
                } else if let Some(next) = next_of_pair(&due.sensor, step)
                    && next < frames.end
                    && !files_of(next).iter().all(is_there)
                {
                    // Flow from here to there goes by both pictures.
                    missing.insert(due.name.clone(), Vec::new());
                }
            }
            due.retain(|due| missing.contains_key(&due.name));
            if !due.is_empty() {
                let capture = suite.capture_due(&mut run.stage.simulation, due)?;
                for sensor in &capture.sensors {
                    for (path, file) in missing.remove(&sensor.name).into_iter().flatten() {
                        let bytes = files::encode(sensor, &file).map_err(|error| OutputError::io(&path, error))?;
                        let Some(bytes) = bytes else {
                            all.remove(&path);
                            continue;
                        };
                        output::write_whole(&path, &bytes)?;
                        written.push(path);
                    }
                }
                if !writers.is_empty() {
                    let poses = poses(&mut run.stage.simulation.world);
                    writers.iter_mut().try_for_each(|writer| writer.write(&capture, &poses))?;
                }
                has_warned = has_warned || warn_of_rays(suite.ray_warnings());
            }
            progress(step + 1 - frames.start, frames.end - frames.start);
        } else {
            // So that the first flow does not depend on where a run begins.
            due.retain(|due| next_of_pair(&due.sensor, step).is_some_and(|next| next >= frames.start));
            if !due.is_empty() {
                suite.capture_due(&mut run.stage.simulation, due)?;
            }
        }
        if step + 1 >= frames.end {
            break;
        }
        run.advance()?;
    }
    for writer in writers {
        let files = writer.finish()?;
        all.extend(files.iter().cloned());
        written.extend(files);
    }
    written.extend(run.finish(&job.run)?);
    let world = &mut run.stage.simulation.world;
    let path = job.folder.join(DESCRIPTION);
    output::write_whole(&path, description::of_sensors(world, &chosen, &captures).as_bytes())?;
    all.insert(path.clone());
    written.push(path);
    let path = job.folder.join(MANIFEST);
    let text = Manifest::of_files(&job.folder, &all, suite.gpu(), world)?.text();
    let text = text.map_err(|error| OutputError::io(&path, error.into()))?;
    output::write_whole(&path, text.as_bytes())?;
    written.push(path);
    Ok(written)
}

fn run_info<'a>(
    job: &'a SensorJob,
    sensors: &'a BTreeMap<String, Sensor>,
    first: u64,
    world: &'a World,
) -> RunInfo<'a> {
    RunInfo {
        folder: &job.folder,
        formats: &job.formats,
        sensors,
        classes: world.resource::<Classes>(),
        step_seconds: world.resource::<Clock>().step_seconds,
        first,
        films: job.part.as_ref().map(|part| &*part.films),
    }
}

/// Poses of all sensors.
fn poses(world: &mut World) -> Poses {
    let named = sensor_names(world);
    let placed = |(name, sensor): (String, Entity)| (name, place::pose(world, sensor).world_from_entity());
    named.into_iter().map(placed).collect()
}

/// Steps before a frame at which a run has to begin for its captures from there on to be those of a longer run: so many
/// intervals as a sensor measures over.
///
/// # Errors
/// [`FrameError`]: what [`render_sensors`] refuses of the job's sensors and formats.
pub(crate) fn steps_before(job: &SensorJob, world: &mut World) -> Result<u64, FrameError> {
    let steps = |sensor: Sensor| {
        let intervals = poses_needed(&sensor.kind).max(usize::from(next_of_pair(&sensor, 0).is_some()));
        intervals as u64 * u64::from(sensor.every)
    };
    Ok(choose(job, world)?.into_values().map(steps).max().unwrap_or_default())
}

/// The sensors that a job asks for, by their names.
fn choose(job: &SensorJob, world: &mut World) -> Result<BTreeMap<String, Sensor>, FrameError> {
    let known = sensor_names(world);
    let names: Vec<&str> = known.iter().map(|(name, _)| name.as_str()).collect();
    if names.is_empty() {
        return Err(FrameError::NoSensors { scene: job.scene.clone() });
    }
    let mut wanted: Vec<String> =
        job.sensors.clone().unwrap_or_else(|| names.iter().map(ToString::to_string).collect());
    if job.sensors.is_some() {
        wanted.sort_unstable();
        wanted.dedup();
    }
    for name in &wanted {
        match names.iter().filter(|known| **known == name.as_str()).count() {
            0 => {
                let (scene, wanted) = (job.scene.clone(), name.clone());
                let known = names.iter().map(ToString::to_string).collect();
                let nearest = name::nearest(&names, name).map(str::to_owned);
                return Err(FrameError::NoSensor { scene, wanted, nearest, known });
            }
            1 => {}
            _ => return Err(FrameError::SharedSensorName { scene: job.scene.clone(), name: name.clone() }),
        }
    }
    let mut folders = BTreeSet::new();
    for name in &wanted {
        let fault = fault_of_name(name);
        // Some file systems do not tell capitals from small letters.
        let fault =
            fault.or((!folders.insert(name.to_lowercase())).then_some("differs from another in its case alone"));
        if let Some(fault) = fault {
            let (scene, name) = (job.scene.clone(), name.clone());
            return Err(FrameError::BadSensorName { scene, name, fault });
        }
    }
    let chosen = known.iter().filter(|(name, _)| wanted.contains(name));
    let chosen: BTreeMap<String, Sensor> =
        chosen.filter_map(|(name, entity)| Some((name.clone(), world.get::<Sensor>(*entity)?.clone()))).collect();
    let info = run_info(job, &chosen, 0, world);
    writers::check(&info)?;
    for (name, sensor) in &chosen {
        let left_out = files::left_out(sensor, &job.formats);
        if !left_out.is_empty() {
            let outputs = left_out.join(", ");
            return Err(FrameError::NoFormat { sensor: name.clone(), outputs });
        }
        let things = world.resource::<Classes>().0.iter().filter(|class| class.is_thing);
        let beyond = things.map(|class| class.id).find(|&id| id > files::MOST_THINGS);
        if let Some(id) = beyond.filter(|_| files::has_panoptic_picture(sensor, &job.formats)) {
            return Err(FrameError::NoPanoptic { sensor: name.clone(), id });
        }
    }
    writers::check_programs(&info)?;
    Ok(chosen)
}

/// Says what of lidars' rays is not as it is drawn. Returns whether anything was said.
fn warn_of_rays(RayWarnings { solid_masks, plain_maps, left_out }: RayWarnings) -> bool {
    let warnings = [
        (solid_masks, "masked objects are solid to lidars: their texels were released"),
        (plain_maps, "objects have one colour for lidars: the texels of their base maps were released"),
        (left_out, "objects are met by no beam: their meshes have no surface, or one too large"),
    ];
    let said = warnings.into_iter().filter(|(count, _)| *count > 0);
    said.map(|(count, message)| tracing::warn!("{count} {message}")).count() > 0
}

/// Next step at which a sensor is due that measures between captures: flow, and the motion of boxes.
fn next_of_pair(sensor: &Sensor, step: u64) -> Option<u64> {
    let SensorKind::Camera(camera) = &sensor.kind else { return None };
    let is_of_pairs = camera.outputs.has_any(&[CameraOutput::Flow, CameraOutput::FlowBack, CameraOutput::Boxes]);
    is_of_pairs.then(|| step + u64::from(sensor.every))
}

/// Tells if a file is there, as far as can be told without its contents: files are written whole.
fn is_whole(path: &Path, sensor: &Sensor, file: &OutputFile) -> bool {
    match (&sensor.kind, file.format) {
        (SensorKind::Camera(camera), FileFormat::Png) => is_written(path, camera.size),
        _ => path.metadata().is_ok_and(|found| found.is_file() && found.len() > 0),
    }
}
