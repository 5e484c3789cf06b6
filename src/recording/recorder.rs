//! Writes a recording while the run goes on.
//!
//! Inputs are written as they come, a mark with the state's hash every simulated second, and a snapshot now and then: a
//! killed run loses a second at the most. Steps without inputs write nothing.

use super::error::RecordingError;
use super::identity::Identity;
use super::records::{self, RECORDING};
use crate::output;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use systems::Simulation;
use systems::ecs::clock::Clock;
use systems::run::inputs::SavedInput;
use systems::run::snapshot;
use systems::run::state::StateList;
use systems::run::state_hash::StateHash;

/// The first block of a recording.
#[derive(Serialize, Deserialize, Debug)]
pub struct Header {
    /// Identity of the recorded run.
    pub identity: Identity,
    /// The step that it begins after: 0, or that of a snapshot, which is the next block.
    pub start: u64,
    /// The names of the kinds of state that hashes and snapshots go by.
    pub kinds: Vec<String>,
}

/// A block of a recording. Numbers of steps are those done before.
#[derive(Serialize, Deserialize, Debug)]
pub enum Record {
    /// Inputs from outside between this step and the next.
    Inputs(u64, Vec<SavedInput>),
    /// The run got as far as this step, and what its state was.
    Mark(u64, StateHash),
    /// The whole state after this step, before any input.
    Snapshot(u64, Vec<u8>),
    /// The run ended here, and was not killed.
    End(u64, StateHash),
}

/// Snapshots are at least so many simulated seconds apart,
const SNAPSHOT_SECONDS: f64 = 10.0;
/// and so far that they take no more than so many bytes of a recording per simulated second.
const SNAPSHOT_BYTES_PER_SECOND: f64 = 65536.0;

/// A recording that is being written.
#[derive(Debug)]
pub struct Recorder {
    path: PathBuf,
    file: File,
    offset: u64,
    steps_per_second: f64,
    next_mark: u64,
    next_snapshot: u64,
}

impl Recorder {
    /// Begins a recording of a run that has got as far as its clock says, and to which nothing came before its first
    /// step.
    ///
    /// # Errors
    /// [`RecordingError::Output`].
    pub fn create(path: &Path, identity: Identity, simulation: &mut Simulation) -> Result<Self, RecordingError> {
        let file = output::create_anew(path).map_err(|error| RecordingError::unwritable(path, error))?;
        let steps_per_second = 1.0 / identity.step_seconds;
        let start = simulation.world.resource::<Clock>().step;
        let (path, next) = (path.to_owned(), start + 1);
        let mut recorder = Self { path, file, offset: 0, steps_per_second, next_mark: next, next_snapshot: next };
        recorder.put(&records::prelude(RECORDING))?;
        let kinds = simulation.world.resource::<StateList>().names().map(str::to_owned).collect();
        recorder.write(&Header { identity, start, kinds })?;
        recorder.next_snapshot = recorder.after(start, SNAPSHOT_SECONDS);
        if start > 0 {
            recorder.snapshot(start, simulation)?;
        }
        Ok(recorder)
    }

    /// Notes what came between this step and the next.
    ///
    /// # Errors
    /// [`RecordingError::Output`].
    pub fn inputs(&mut self, step: u64, inputs: Vec<SavedInput>) -> Result<(), RecordingError> {
        self.write(&Record::Inputs(step, inputs))
    }

    /// Tells if the step's hash is wanted.
    pub fn wants_hash(&self, step: u64) -> bool {
        step >= self.next_mark
    }

    /// Notes that a step was taken.
    ///
    /// # Errors
    /// [`RecordingError::Output`].
    pub fn stepped(
        &mut self,
        step: u64,
        hash: Option<StateHash>,
        simulation: &mut Simulation,
    ) -> Result<(), RecordingError> {
        if let Some(hash) = hash.filter(|_| self.wants_hash(step)) {
            self.next_mark = self.after(step, 1.0);
            self.write(&Record::Mark(step, hash))?;
        }
        if step >= self.next_snapshot { self.snapshot(step, simulation) } else { Ok(()) }
    }

    /// Notes that the run ended in order.
    ///
    /// # Errors
    /// [`RecordingError::Output`].
    pub fn finish(mut self, step: u64, hash: StateHash) -> Result<(), RecordingError> {
        self.write(&Record::End(step, hash))
    }

    /// Notes the state after a step, before any input.
    pub(crate) fn snapshot(&mut self, step: u64, simulation: &mut Simulation) -> Result<(), RecordingError> {
        let state = snapshot::save(&mut simulation.world);
        let seconds = SNAPSHOT_SECONDS.max(state.len() as f64 / SNAPSHOT_BYTES_PER_SECOND);
        self.next_snapshot = self.after(step, seconds);
        self.write(&Record::Snapshot(step, state))
    }

    /// The step that comes so many simulated seconds later.
    fn after(&self, step: u64, seconds: f64) -> u64 {
        step + ((seconds * self.steps_per_second).round() as u64).max(1)
    }

    fn write<T: Serialize>(&mut self, value: &T) -> Result<(), RecordingError> {
        // A snapshot that is too long for a block is left out; it is there for speed only.
        match records::block(value, self.offset) {
            Some(block) => self.put(&block),
            None => Ok(()),
        }
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), RecordingError> {
        self.file.write_all(bytes).map_err(|error| RecordingError::unwritable(&self.path, error))?;
        self.offset += bytes.len() as u64;
        Ok(())
    }
}
