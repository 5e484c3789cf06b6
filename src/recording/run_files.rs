//! Files that a run is kept in and begins from.

use super::error::RecordingError;
use crate::{import, output};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use systems::run::state_hash::StateHash;

/// The files that a run is kept in and begins from.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunFiles {
    /// A line for each step: its number and the hash of the state after it.
    pub hash: Option<PathBuf>,
    /// The recording of the run.
    pub record: Option<PathBuf>,
    /// A snapshot of the state after the last frame.
    pub save_snapshot: Option<PathBuf>,
    /// Snapshot that the run goes on from, rather than from the scene's beginning.
    pub from_snapshot: Option<PathBuf>,
    /// The recording of a run that is to be had again, whose scene this is.
    pub replay: Option<PathBuf>,
    /// States that the run must come to: steps, ascending, with the hashes after them. It goes on to the last of these.
    pub states: Vec<(u64, StateHash)>,
}

impl RunFiles {
    /// Those that are written.
    pub fn written(&self) -> impl Iterator<Item = &Path> {
        [&self.save_snapshot, &self.record, &self.hash].into_iter().flatten().map(PathBuf::as_path)
    }

    /// Tells if the run is kept in, or begins from, a file that belongs to the scene.
    pub(crate) fn need_identity(&self) -> bool {
        self.record.is_some() || self.from_snapshot.is_some() || self.replay.is_some()
    }

    /// Refuses to write a file that is read, or two things to the same file. `read`: files that the scene is made from.
    pub(crate) fn refuse_overwriting(&self, read: &[PathBuf]) -> Result<(), RecordingError> {
        // A snapshot may take the place of the one before, which has been read by then.
        let is_replaced = |from: &PathBuf| self.save_snapshot.as_ref().is_some_and(|path| output::is_same(path, from));
        let from_snapshot = self.from_snapshot.as_ref().filter(|from| !is_replaced(from));
        let read = import::with_files_named_by(read).chain(self.replay.iter().chain(from_snapshot).cloned());
        let mut taken: Vec<PathBuf> = read.map(|path| output::real(&path)).collect();
        for path in self.written() {
            let real = output::real(path);
            if taken.contains(&real) {
                return Err(RecordingError::taken(path));
            }
            taken.push(real);
        }
        Ok(())
    }
}
