//! Errors of split runs.

use crate::frames::FrameError;
use std::path::{Path, PathBuf};

/// Error of splitting a run, rendering a shard, or putting shards together.
#[derive(Debug, thiserror::Error)]
pub enum ShardError {
    /// A file or a number that is refused.
    #[error("{}: {message}", path.display())]
    Refused {
        /// The file.
        path: PathBuf,
        /// Fault, and what was expected.
        message: String,
    },
    /// Shards that are not there, or not whole.
    #[error("{}: {} of {of} shards are missing: {}", job.display(), missing.len(), listed(missing))]
    Incomplete {
        /// The file of the job.
        job: PathBuf,
        /// Number that there are to be.
        of: usize,
        /// Their numbers, and the reason of each.
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
    /// Error that stops a run.
    #[error(transparent)]
    Frame(FrameError),
}

fn listed(shards: &[(usize, String)]) -> String {
    let listed: Vec<String> = shards.iter().map(|(shard, said)| format!("shard {shard}: {said}")).collect();
    listed.join("; ")
}

impl ShardError {
    pub(super) fn refused(path: &Path, message: impl std::fmt::Display) -> Self {
        Self::Refused { path: path.to_owned(), message: message.to_string() }
    }
}

impl<E: Into<FrameError>> From<E> for ShardError {
    fn from(error: E) -> Self {
        Self::Frame(error.into())
    }
}
