//! One shard of a run, rendered by itself.

use super::error::ShardError;
use super::job::Job;
use super::manifest::{Machine, Manifest, NAME};
use crate::data::dataset::writer::PartOfRun;
use crate::frames::{FrameError, Frames};
use crate::output::{self, WholeFolder};
use crate::recording::RunFiles;
use crate::renderer::Gpu;
use std::path::{Path, PathBuf};

/// Part of a run, to be rendered as a job of frames or of sensors.
#[derive(Clone, Debug)]
pub struct ShardRun {
    /// Folder of its files.
    pub folder: PathBuf,
    /// Its frames.
    pub frames: Frames,
    /// The run that it is a part of.
    pub part: PartOfRun,
    /// The snapshot that it begins with, and the states that it must come to.
    pub run: RunFiles,
}

/// Renders a shard of a job, by its file and number, into a folder of its own; `render` does so, and returns the files
/// that it wrote. The folder is there when all is in it, `manifest.json` among it. Returns it; `None` where `resume` is
/// asked for, and it is there and whole already.
///
/// # Errors
/// [`ShardError`]; a shard that was there before stays.
pub fn render_shard(
    path: &Path,
    shard: usize,
    resume: bool,
    render: impl FnOnce(&Job, ShardRun) -> Result<Vec<PathBuf>, FrameError>,
) -> Result<Option<PathBuf>, ShardError> {
    let (job, hash) = Job::read(path)?;
    let Some(own) = job.shards.get(shard) else {
        let last = job.shards.len() - 1;
        return Err(ShardError::refused(path, format!("shard {shard}: expected 0 to {last}")));
    };
    let folder = job.folder_of(path, shard);
    if resume && Manifest::check(&folder, &hash).is_ok() {
        return Ok(None);
    }
    let whole = WholeFolder::begin(&folder)?;
    let states = job.states().map_err(|message| ShardError::refused(path, message))?;
    // There is one more of them than there are shards.
    let states = [states[shard], states[shard + 1]];
    let shard_run = ShardRun {
        folder: whole.folder().join(DATA),
        frames: Frames::Range(own.first..own.end),
        part: PartOfRun { frames: job.frames(), films: whole.folder().join(FILMS) },
        run: RunFiles {
            from_snapshot: Some(path.parent().unwrap_or(Path::new("")).join(&own.snapshot)),
            states: states.to_vec(),
            ..RunFiles::default()
        },
    };
    let files = render(&job, shard_run)?;
    let machine = Machine::of(&Gpu::headless()?);
    let manifest = Manifest::of(&hash, machine, states, (whole.folder(), &files))?;
    let text = serde_json::to_string_pretty(&manifest).map_err(|error| ShardError::refused(&folder, error))?;
    output::write_whole(&whole.folder().join(NAME), (text + "\n").as_bytes())?;
    whole.finish()?;
    Ok(Some(folder))
}

/// In a shard's folder, what a run writes.
pub(super) const DATA: &str = "data";
/// In a shard's folder, pictures of films.
pub(super) const FILMS: &str = "films";
