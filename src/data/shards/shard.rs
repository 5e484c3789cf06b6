//! One shard of a run, rendered by itself.

use super::error::ShardError;
use super::job::Job;
use super::manifest::{Machine, Manifest, NAME};
use crate::data::dataset::writer::PartOfRun;
use crate::data::work::Work;
use crate::frames::Frames;
use crate::output::{self, WholeFolder};
use crate::recording::RunFiles;
use crate::renderer::Gpu;
use crate::session::LoadOptions;
use std::path::{Path, PathBuf};

/// A shard to be rendered.
#[derive(Clone, Debug)]
pub struct ShardJob {
    /// The file of the job.
    pub file: PathBuf,
    /// Number of the shard.
    pub number: usize,
    /// Place of the scene, if it has moved since.
    pub scene: Option<PathBuf>,
    /// Leaves alone what is there and whole.
    pub resume: bool,
    /// Loading of the scene: [`LoadOptions::simulation`] and [`LoadOptions::watch`], which no file holds.
    pub load: LoadOptions,
}

/// Renders a shard of a job into a folder of its own. The folder is there when all is in it, `manifest.json` among it.
/// `progress` is called after each frame with how many are done, and of how many. Returns the folder, and whether it
/// was rendered: not where it is to be left alone.
///
/// # Errors
/// [`ShardError`]; a shard that was there before stays.
pub fn render_shard(shard: &ShardJob, progress: impl FnMut(u64, u64)) -> Result<(PathBuf, bool), ShardError> {
    let ShardJob { file: path, number, .. } = shard;
    let (job, hash) = Job::read(path)?;
    let Some(own) = job.shards.get(*number) else {
        let last = job.shards.len() - 1;
        return Err(ShardError::refused(path, format!("shard {number}: expected 0 to {last}")));
    };
    let folder = job.folder_of(path, *number);
    if shard.resume && Manifest::check(&folder, &hash).is_ok() {
        return Ok((folder, false));
    }
    let whole = WholeFolder::begin(&folder)?;
    let states = job.states().map_err(|message| ShardError::refused(path, message))?;
    // There is one more of them than there are shards.
    let states = [states[*number], states[number + 1]];
    let mut work = job.work.clone().anew_in(whole.folder().join(DATA));
    let run = work.run_mut();
    run.scene = shard.scene.clone().unwrap_or_else(|| run.scene.clone());
    run.frames = Frames::Range(own.first..own.end);
    run.realtime = false;
    run.load = LoadOptions { simulation: shard.load.simulation, watch: shard.load.watch, ..run.load.clone() };
    run.files = RunFiles {
        from_snapshot: Some(path.parent().unwrap_or(Path::new("")).join(&own.snapshot)),
        states: states.to_vec(),
        ..RunFiles::default()
    };
    if let Work::Sensors(job_of_sensors) = &mut work {
        let films = whole.folder().join(FILMS);
        job_of_sensors.dataset.part = Some(PartOfRun { frames: job.frames(), films });
    }
    let files = work.render(progress)?;
    let machine = Machine::of(&Gpu::headless()?);
    let manifest = Manifest::of(&hash, machine, states, (whole.folder(), &files))?;
    let text = serde_json::to_string_pretty(&manifest).map_err(|error| ShardError::refused(&folder, error))?;
    output::write_whole(&whole.folder().join(NAME), (text + "\n").as_bytes())?;
    whole.finish()?;
    Ok((folder, true))
}

/// In a shard's folder, what a run writes.
pub(super) const DATA: &str = "data";
/// In a shard's folder, pictures of films.
pub(super) const FILMS: &str = "films";
