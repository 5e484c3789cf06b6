//! Errors of recordings, replays and snapshots.

use crate::output::OutputError;
use crate::scene::SceneError;
use std::path::{Path, PathBuf};
use systems::run::state::StateError;

/// Error of recording, replaying or continuing a run.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// A file that is refused.
    #[error("{}: {message}", path.display())]
    Refused {
        /// The file.
        path: PathBuf,
        /// Fault, and what was expected.
        message: String,
    },
    /// A step that does not come out as it was recorded.
    #[error(
        "{}: step {step} differs from the recording; was it recorded on another kind of machine?",
        path.display()
    )]
    Diverged {
        /// The recording.
        path: PathBuf,
        /// The first step that is known to differ.
        step: u64,
    },
    /// A state that is not the one that was expected.
    #[error("step {step}: the state is not that of relief split; was it made on another kind of machine?")]
    Parted {
        /// The step.
        step: u64,
    },
    /// A call that the run as it is does not allow.
    #[error("{0}")]
    Misused(&'static str),
    /// A state that a world of the scene does not take.
    #[error(transparent)]
    State(#[from] StateError),
    /// A state that no snapshot can hold.
    #[error("the state exceeds 4 GB")]
    TooLong,
    /// The scene cannot be read again.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A file that cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

impl RecordingError {
    pub(crate) fn refused(path: &Path, message: impl std::fmt::Display) -> Self {
        Self::Refused { path: path.to_owned(), message: message.to_string() }
    }

    /// A file that is to be written, and that the run needs for something else.
    pub(crate) fn taken(path: &Path) -> Self {
        Self::refused(path, "the run already reads or writes this file; expected another file")
    }

    pub(crate) fn unwritable(path: &Path, source: std::io::Error) -> Self {
        OutputError::io(path, source).into()
    }
}
