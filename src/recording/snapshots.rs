//! Files of one snapshot: a block that says what it belongs to, and a block with the state.

use super::RecordingError;
use super::identity::Identity;
use super::records::{self, Blocks, Next, SNAPSHOT};
use crate::output;
use std::path::Path;
use systems::Simulation;
use systems::run::snapshot;

/// Writes the state as it is now, whole or not at all.
///
/// # Errors
/// [`RecordingError::Output`].
pub fn save_snapshot(path: &Path, identity: &Identity, simulation: &mut Simulation) -> Result<(), RecordingError> {
    let mut bytes = records::prelude(SNAPSHOT);
    let too_long = || RecordingError::unwritable(path, std::io::Error::other("the state exceeds 4 GB"));
    bytes.extend(records::block(identity, bytes.len() as u64).ok_or_else(too_long)?);
    let state = snapshot::save(&mut simulation.world);
    bytes.extend(records::block(&state, bytes.len() as u64).ok_or_else(too_long)?);
    Ok(output::write_whole(path, &bytes)?)
}

/// Gives a world that has just loaded the scene the state of a snapshot.
///
/// # Errors
/// [`RecordingError::Refused`]: no snapshot, or one of another version or scene. The world is of no use then.
pub fn load_snapshot(path: &Path, now: &Identity, simulation: &mut Simulation) -> Result<(), RecordingError> {
    let mut blocks = Blocks::open(path, SNAPSHOT)?;
    let identity: Identity = whole(path, blocks.next()?)?;
    identity.check(path, now)?;
    let state: Vec<u8> = whole(path, blocks.next()?)?;
    snapshot::restore(&mut simulation.world, &state).map_err(|error| RecordingError::refused(path, error))
}

fn whole<T>(path: &Path, next: Next<T>) -> Result<T, RecordingError> {
    match next {
        Next::Block(_, value) => Ok(value),
        Next::Cut | Next::End => Err(RecordingError::refused(path, "truncated")),
    }
}
