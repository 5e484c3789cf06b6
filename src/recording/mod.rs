//! Runs that can be had again: recordings of inputs, snapshots of the state, hashes of every step.
//!
//! ```text
//! stepper    takes the steps of a run, for the window and without one: inputs, step, hash, recording
//! recorder   writes a recording as the run goes on
//! player     reads one: what comes at which step, and the nearest snapshot to begin from
//! records    the file's form: blocks with checksums, one after another
//! identity   which program and which scene, with every file it names, a file belongs to
//! snapshots  one snapshot: its file, and the bytes of that
//! ```
//!
//! A run follows from its scene and its inputs. So a recording holds no frames and no movements but what is asked for
//! at the start, and what came from outside at which step; snapshots in between are there to begin in the middle.

mod identity;
mod player;
mod recorder;
mod records;
mod snapshots;
mod stepper;

pub use identity::Identity;
pub(crate) use identity::PROGRAM;
pub use player::{Recording, scene_of, seed_of};
pub use recorder::Recorder;
pub use snapshots::{Snapshot, load_snapshot, save_snapshot};
pub use stepper::{RunFiles, Stepper};

use crate::output::OutputError;
use std::path::{Path, PathBuf};

/// Why a run cannot be recorded, replayed or continued.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// A file that is refused.
    #[error("{}: {message}", path.display())]
    Refused {
        /// The file.
        path: PathBuf,
        /// What is the matter, and what was expected.
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
    /// A file that cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

impl RecordingError {
    fn refused(path: &Path, message: impl std::fmt::Display) -> Self {
        Self::Refused { path: path.to_owned(), message: message.to_string() }
    }

    /// A file that is to be written, and that the run needs for something else.
    pub(crate) fn taken(path: &Path) -> Self {
        Self::refused(path, "the run already reads or writes this file; expected another file")
    }

    fn unwritable(path: &Path, source: std::io::Error) -> Self {
        OutputError::io(path, source).into()
    }
}
