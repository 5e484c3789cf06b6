//! A run in parts that many machines render: each by itself, from a snapshot of the state that it begins with.
//!
//! ```text
//! split      takes the steps of a run once, draws nothing, and writes a snapshot for each shard
//! job        what the shards of a run are: `JOB/shards.json`
//! shard      renders one into `JOB/07`, whole or not at all
//! manifest   `JOB/07/manifest.json`: which files there are, and what made them
//! merge      puts the shards together to what one process writes
//! ```
//!
//! A capture is a function of the states after its step and, at most, at the two steps before at which its sensor was
//! due. So a shard begins up to two intervals early, without files of these, and what it writes is what the whole run
//! writes there. Files that are about the whole run (logs, COCO's, films, `sensors.json`) are written in parts, and put
//! together by the writers that write those of a whole run.

mod job;
mod manifest;
mod merge;
mod shard;
mod split;

pub use job::{Job, Shard};
pub use merge::{MergeOptions, merge};
pub use shard::{ShardRun, render_shard};
pub use split::{SplitJob, Work, split};

use crate::frames::FrameError;
use crate::output::OutputError;
use crate::recording::RecordingError;
use crate::renderer::GpuError;
use crate::video::VideoError;
use std::path::{Path, PathBuf};

/// Why a run cannot be split, a shard not rendered, or shards not be put together.
#[derive(Debug, thiserror::Error)]
pub enum ShardError {
    /// A file or a number that is refused.
    #[error("{}: {message}", path.display())]
    Refused {
        /// The file.
        path: PathBuf,
        /// What is the matter, and what was expected.
        message: String,
    },
    /// Shards that are not there, or not whole.
    #[error("{}: {} of {of} shards are missing: {}", job.display(), missing.len(), listed(missing))]
    Incomplete {
        /// The file of the job.
        job: PathBuf,
        /// How many there are to be.
        of: usize,
        /// Which, and why each.
        missing: Vec<(usize, String)>,
    },
    /// Shards that different machines, drivers or versions of the program have rendered.
    #[error(
        "{}: rendered by {} kinds of machines, whose pictures may differ: {}",
        job.display(), machines.len(), listed(machines)
    )]
    Mixed {
        /// The file of the job.
        job: PathBuf,
        /// Each kind, with the first shard of it.
        machines: Vec<(usize, String)>,
    },
    /// What stops a run.
    #[error(transparent)]
    Frame(#[from] FrameError),
}

fn listed(shards: &[(usize, String)]) -> String {
    let listed: Vec<String> = shards.iter().map(|(shard, said)| format!("shard {shard}: {said}")).collect();
    listed.join("; ")
}

impl ShardError {
    fn refused(path: &Path, message: impl std::fmt::Display) -> Self {
        Self::Refused { path: path.to_owned(), message: message.to_string() }
    }
}

impl From<OutputError> for ShardError {
    fn from(error: OutputError) -> Self {
        FrameError::from(error).into()
    }
}

impl From<RecordingError> for ShardError {
    fn from(error: RecordingError) -> Self {
        FrameError::from(error).into()
    }
}

impl From<GpuError> for ShardError {
    fn from(error: GpuError) -> Self {
        FrameError::from(error).into()
    }
}

impl From<VideoError> for ShardError {
    fn from(error: VideoError) -> Self {
        FrameError::from(error).into()
    }
}
