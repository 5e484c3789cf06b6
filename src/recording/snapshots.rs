//! Snapshots: a block that says what it belongs to, and a block with the state. Files of them, and their bytes.

use super::error::RecordingError;
use super::identity::Identity;
use super::records::{self, Blocks, Next, SNAPSHOT};
use crate::output;
use std::io::{Cursor, Read, Seek};
use std::path::Path;
use systems::Simulation;
use systems::run::snapshot;

/// The state of a run at some step, and what it belongs to.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Identity of the run.
    pub identity: Identity,
    state: Vec<u8>,
}

impl Snapshot {
    /// The state as it is now.
    pub fn of(identity: Identity, simulation: &mut Simulation) -> Self {
        Self { identity, state: snapshot::save(&mut simulation.world) }
    }

    /// Contents of a file; `None`: longer than a file may be.
    pub fn to_bytes(&self) -> Option<Vec<u8>> {
        let mut bytes = records::prelude(SNAPSHOT);
        bytes.extend(records::block(&self.identity, bytes.len() as u64)?);
        bytes.extend(records::block(&self.state, bytes.len() as u64)?);
        Some(bytes)
    }

    /// Writes a file, whole or not at all.
    ///
    /// # Errors
    /// [`RecordingError::Output`].
    pub fn write(&self, path: &Path) -> Result<(), RecordingError> {
        let too_long = || RecordingError::unwritable(path, std::io::Error::other("the state exceeds 4 GB"));
        Ok(output::write_whole(path, &self.to_bytes().ok_or_else(too_long)?)?)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`RecordingError::Refused`]: no snapshot, or a damaged one.
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        Self::of_blocks(path, Blocks::open(path, SNAPSHOT)?)
    }

    /// Reads the bytes of a file; messages call it `path`.
    ///
    /// # Errors
    /// The same as [`Self::read`].
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self, RecordingError> {
        Self::of_blocks(path, Blocks::of(path, Cursor::new(bytes), bytes.len() as u64, SNAPSHOT)?)
    }

    fn of_blocks<R: Read + Seek>(path: &Path, mut blocks: Blocks<R>) -> Result<Self, RecordingError> {
        let snapshot = Self { identity: whole(path, blocks.next()?)?, state: whole(path, blocks.next()?)? };
        blocks.finish().map(|()| snapshot)
    }

    /// Gives a world of the scene that state. Messages call the snapshot `path`.
    ///
    /// # Errors
    /// [`RecordingError::Refused`]: one of another version or scene, or a world in which an entity of the scene is gone
    /// that the snapshot has. The world is of no use then.
    pub fn restore(&self, path: &Path, now: &Identity, simulation: &mut Simulation) -> Result<(), RecordingError> {
        self.identity.check(path, now)?;
        snapshot::restore(&mut simulation.world, &self.state).map_err(|error| RecordingError::refused(path, error))
    }
}

fn whole<T>(path: &Path, next: Next<T>) -> Result<T, RecordingError> {
    match next {
        Next::Block(_, value) => Ok(value),
        Next::Cut | Next::End => Err(RecordingError::refused(path, "truncated")),
    }
}
