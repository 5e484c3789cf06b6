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

use super::numbers;
use super::writer::{DatasetOptions, DatasetWriter, next_of_pair};
use crate::data::formats::writers;
use crate::frames::{FrameError, FrameRun, RunJob, check_outputs, load_session};
use crate::recording::RecordingError;
use crate::renderer::Gpu;
use crate::sense::motion::kind::poses_before;
use crate::sense::rays::scene::RayWarnings;
use crate::sense::world::suite::SensorSuite;
use crate::session::LoadOptions;
use bevy_ecs::prelude::*;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use systems::ecs::clock::Clock;
use systems::lights::LightPolicies;
use systems::sensors::{Sensor, SensorKind};

/// Captures to be written of a run: of its frames, those after which a sensor is due.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorJob {
    /// The run. Texels are kept: rays read them.
    pub run: RunJob,
    /// Its files.
    pub dataset: DatasetOptions,
}

/// Captures a job; `progress` is called after each frame with how many are done, and of how many. Returns the files
/// written.
///
/// # Errors
/// [`FrameError`]; files written before stay.
pub fn render_sensors(job: &SensorJob, mut progress: impl FnMut(u64, u64)) -> Result<Vec<PathBuf>, FrameError> {
    let dataset = DatasetOptions { formats: writers::in_order(&job.dataset.formats), ..job.dataset.clone() };
    if let Some(path) = job.run.files.written().find(|path| dataset.writes(path)) {
        return Err(RecordingError::taken(path).into());
    }
    let begun_from: Vec<PathBuf> = job.run.files.replay.iter().chain(&job.run.files.from_snapshot).cloned().collect();
    check_outputs(&begun_from, |path| dataset.writes(path))?;
    // The driver and its pipelines take their time; the scene loads meanwhile.
    let opening = std::thread::spawn(|| Gpu::headless().map(|gpu| SensorSuite::new(&gpu)));
    let load = LoadOptions { keep_texels: true, ..job.run.load.clone() };
    let session = load_session(&job.run.scene, None, &load);
    let suite = opening.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    let mut session = session?;
    check_outputs(&session.scene.files, |path| dataset.writes(path))?;
    let chosen = dataset.choose(&job.run.scene, &mut session.simulation.world)?;
    for warning in numbers::warnings(&mut session.simulation.world, &chosen, &dataset.formats) {
        tracing::warn!("{warning}");
    }
    let draws = chosen.values().any(|sensor| matches!(sensor.kind, SensorKind::Camera(_)));
    // What needs no picture needs no adapter.
    let mut suite = if draws { suite? } else { SensorSuite::default() };
    let mut run = FrameRun::begin(session, &job.run.files, &job.run.frames, job.run.realtime)?;
    let frames = run.frames.clone();
    let mut dataset = DatasetWriter::begin_with(dataset, chosen, frames.start, &run.session.simulation.world)?;
    run.session.simulation.world.resource_mut::<LightPolicies>().forced = job.run.lights;
    suite.settings = job.run.settings;
    let mut has_warned = false;
    loop {
        let step = run.step();
        // Before the first frame, too: lidars that sweep begin where they were when they were due last.
        let mut due = suite.due(&mut run.session.simulation, |name| dataset.sensors().contains_key(name));
        let simulation = &mut run.session.simulation;
        if step >= frames.start {
            dataset.tick(simulation.world.resource::<Clock>(), step)?;
            dataset.leave_missing(&mut due, frames.end, &simulation.world);
            if !due.is_empty() {
                let capture = suite.capture_due(simulation, due)?;
                dataset.write_files(&capture, &mut simulation.world)?;
                has_warned = has_warned || warn_of_rays(suite.ray_warnings());
            }
            progress(step + 1 - frames.start, frames.end - frames.start);
        } else {
            // So that the first flow does not depend on where a run begins.
            due.retain(|due| next_of_pair(&due.sensor, step).is_some_and(|next| next >= frames.start));
            if !due.is_empty() {
                suite.capture_due(simulation, due)?;
            }
        }
        if step + 1 >= frames.end {
            break;
        }
        run.advance()?;
    }
    dataset.finish_writers()?;
    let snapshot = run.finish(&job.run.files)?;
    let state = dataset.state(&mut run.session.simulation.world, suite.gpu());
    dataset.finish(state, snapshot)
}

/// Steps before a frame at which a run has to begin for its captures from there on to be those of a longer run: so many
/// intervals as a sensor measures over.
///
/// # Errors
/// [`FrameError`]: what [`render_sensors`] refuses of the job's sensors and formats.
pub(crate) fn steps_before(job: &SensorJob, world: &mut World) -> Result<u64, FrameError> {
    let chosen = job.dataset.choose(&job.run.scene, world)?;
    let steps = |sensor: Sensor| {
        let intervals = poses_before(world, &sensor.kind).max(usize::from(next_of_pair(&sensor, 0).is_some()));
        intervals as u64 * u64::from(sensor.every)
    };
    Ok(chosen.into_values().map(steps).max().unwrap_or_default())
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
