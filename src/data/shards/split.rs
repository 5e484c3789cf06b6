//! Takes the steps of a run once, without a picture, and cuts it into shards.

use super::error::ShardError;
use super::job::{Job, Shard};
use crate::data::dataset::job::{SensorJob, steps_before};
use crate::frames::{FrameRun, Frames, LoadOptions, load_stage};
use crate::output;
use crate::recording::{PROGRAM, RunFiles};
use std::path::{Path, PathBuf};
use systems::ecs::clock::Clock;
use systems::run::state_hash;

/// A run to be split.
#[derive(Clone, Debug)]
pub struct SplitJob {
    /// Scene file or model.
    pub scene: PathBuf,
    /// The job's folder; made if missing.
    pub folder: PathBuf,
    /// Its frames.
    pub frames: Frames,
    /// Into how many parts.
    pub shards: usize,
    /// Pictures or captures that are rendered.
    pub work: Work,
    /// The same as options of `relief render`, for whoever renders the shards.
    pub options: Vec<String>,
    /// Options of loading the scene.
    pub load: LoadOptions,
    /// Snapshot that the run goes on from, rather than from the scene's beginning.
    pub from_snapshot: Option<PathBuf>,
}

/// Renderings of a run.
#[derive(Clone, Debug)]
pub enum Work {
    /// Pictures of a camera, by its name; `None`: the scene's first.
    Frames {
        /// The name.
        camera: Option<String>,
    },
    /// Captures of sensors.
    Sensors(Box<SensorJob>),
}

/// Splits a run; `progress` is called after each step with how many are taken, and of how many. Returns the job's file.
///
/// # Errors
/// [`ShardError`]: more shards than frames; what stops a run; what cannot be written. The job's file is written last.
pub fn split(split: &SplitJob, mut progress: impl FnMut(u64, u64)) -> Result<PathBuf, ShardError> {
    let SplitJob { scene, folder, .. } = split;
    let camera = match &split.work {
        Work::Frames { camera } => camera.as_deref(),
        Work::Sensors(_) => None,
    };
    let mut stage = load_stage(scene, camera, &split.load)?;
    let before = match &split.work {
        Work::Frames { .. } => 0,
        Work::Sensors(job) => steps_before(job, &mut stage.simulation.world)?,
    };
    let path = folder.join("shards.json");
    let snapshots = folder.join("snapshots");
    stage.check_outputs(|read| {
        output::is_same(read, &path) || output::real(read).starts_with(output::real(&snapshots))
    })?;
    let begins_there = split
        .from_snapshot
        .as_deref()
        .is_some_and(|from| output::is_same(from, &path) || output::real(from).starts_with(output::real(&snapshots)));
    if begins_there {
        let from = split.from_snapshot.as_deref().unwrap_or(&path);
        return Err(ShardError::refused(from, "the run begins with it, and the job would write over it"));
    }
    let files = RunFiles { from_snapshot: split.from_snapshot.clone(), ..RunFiles::default() };
    let mut run = FrameRun::begin(stage, (scene, &files), &split.frames, false)?;
    let (begin, frames) = (run.step(), run.frames.clone());
    let count = frames.end - frames.start;
    if split.shards == 0 || split.shards as u64 > count {
        let message = format!("expected 1 to {count} shards for frames {}..{}", frames.start, frames.end);
        return Err(ShardError::refused(scene, message));
    }
    output::make_folder(&snapshots)?;
    let border = |shard: usize| frames.start + (u128::from(count) * shard as u128 / split.shards as u128) as u64;
    let digits = (split.shards - 1).to_string().len().max(2);
    let shard = |number: usize| Shard {
        first: border(number),
        end: border(number + 1),
        state: String::new(),
        snapshot: Path::new("snapshots").join(format!("{number:0digits$}.snapshot")),
    };
    let mut shards: Vec<Shard> = (0..split.shards).map(shard).collect();
    let state = |run: &mut FrameRun| state_hash::hash(&mut run.stage.simulation.world).to_string();
    // The next to be saved, and the next whose first state is to be known.
    let (mut saved, mut known) = (0, 0);
    loop {
        while let Some(shard) =
            shards.get(saved).filter(|shard| shard.first.saturating_sub(before).max(begin) <= run.step())
        {
            run.save_snapshot(&folder.join(&shard.snapshot))?;
            saved += 1;
        }
        if let Some(shard) = shards.get_mut(known).filter(|shard| shard.first == run.step()) {
            shard.state = state(&mut run);
            known += 1;
        }
        progress(run.step() - begin, frames.end - 1 - begin);
        if run.step() + 1 >= frames.end {
            break;
        }
        run.advance()?;
    }
    let last_state = state(&mut run);
    let scene = std::path::absolute(scene).map_err(|error| ShardError::refused(scene, error))?;
    let step_seconds = run.stage.simulation.world.resource::<Clock>().step_seconds;
    let job =
        Job { version: PROGRAM.to_owned(), scene, options: split.options.clone(), step_seconds, shards, last_state };
    job.write(&path)?;
    Ok(path)
}
