//! Takes the steps of a run once, without a picture, and cuts it into shards.

use super::error::ShardError;
use super::job::{Job, Shard};
use crate::data::dataset::job::steps_before;
use crate::data::work::Work;
use crate::frames::{FrameRun, Frames, RunJob, check_outputs, load_session};
use crate::output;
use crate::recording::{PROGRAM, RunFiles};
use std::path::{Path, PathBuf};
use systems::ecs::clock::Clock;

/// A run to be split.
#[derive(Clone, Debug)]
pub struct SplitJob {
    /// Rendering of the whole.
    pub work: Work,
    /// The job's folder; made if missing.
    pub folder: PathBuf,
    /// Number of the parts.
    pub shards: usize,
}

/// Splits a run; `progress` is called after each step with how many are taken, and of how many. Returns the job's file.
///
/// # Errors
/// [`ShardError`]: more shards than frames; what stops a run; what cannot be written. The job's file is written last.
pub fn split(split: &SplitJob, mut progress: impl FnMut(u64, u64)) -> Result<PathBuf, ShardError> {
    let SplitJob { work, folder, .. } = split;
    let RunJob { scene, load, files, frames, .. } = work.run();
    let camera = match work {
        Work::Frames(job) => job.camera.as_deref(),
        Work::Sensors(_) => None,
    };
    let mut session = load_session(scene, camera, load)?;
    let before = match work {
        Work::Frames(_) => 0,
        Work::Sensors(job) => steps_before(job, &mut session.simulation.world)?,
    };
    let path = folder.join("shards.json");
    let snapshots = folder.join("snapshots");
    check_outputs(&session.scene.files, |read| {
        output::is_same(read, &path) || output::real(read).starts_with(output::real(&snapshots))
    })?;
    let is_written =
        |from: &&PathBuf| output::is_same(from, &path) || output::real(from).starts_with(output::real(&snapshots));
    if let Some(from) = files.from_snapshot.as_ref().filter(is_written) {
        return Err(ShardError::refused(from, "the run begins with it, and the job would write over it"));
    }
    let files = RunFiles { from_snapshot: files.from_snapshot.clone(), ..RunFiles::default() };
    let mut run = FrameRun::begin(session, &files, frames, false)?;
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
    let state = |run: &mut FrameRun| run.session.hash().to_string();
    // The next to be saved, and the next whose first state is to be known.
    let (mut saved, mut known) = (0, 0);
    loop {
        while let Some(shard) =
            shards.get(saved).filter(|shard| shard.first.saturating_sub(before).max(begin) <= run.step())
        {
            run.session.save_snapshot(&folder.join(&shard.snapshot))?;
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
    let step_seconds = run.session.simulation.world.resource::<Clock>().step_seconds;
    let mut work = work.clone().anew_in(PathBuf::new());
    *work.run_mut() = RunJob { scene, frames: Frames::Range(frames), files: RunFiles::default(), ..work.run().clone() };
    let job = Job { version: PROGRAM.to_owned(), work, step_seconds, shards, last_state };
    job.write(&path)?;
    Ok(path)
}
