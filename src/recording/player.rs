//! Reads a recording: all of it once, to see that it is sound and what comes when; then piece by piece.

use super::error::RecordingError;
use super::identity::Identity;
use super::recorder::{Header, Record};
use super::records::{Blocks, Next, RECORDING};
use std::path::Path;
use systems::Simulation;
use systems::run::inputs::{InputError, Inputs, SavedInput};
use systems::run::snapshot;
use systems::run::state::StateList;
use systems::run::state_hash::StateHash;

/// A recording that was read and found sound.
#[derive(Debug)]
pub struct Recording {
    blocks: Blocks,
    header: Header,
    /// Blocks and the steps that they follow, in the order of the file.
    index: Vec<Entry>,
    /// The last step that the run is known to have got to.
    last: u64,
    is_whole: bool,
    /// Position in the index during the replay.
    next: usize,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    step: u64,
    kind: Kind,
    /// Byte offset of the block.
    offset: u64,
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum Kind {
    Inputs,
    Snapshot,
    Hash(StateHash),
}

/// Identity of the run that was recorded: its scene's path as it was given then, its seed.
///
/// # Errors
/// [`RecordingError::Refused`]: not a recording, or one of another version.
pub fn identity_of(path: &Path) -> Result<Identity, RecordingError> {
    Ok(read_header(path, &mut Blocks::open(path, RECORDING)?)?.identity)
}

fn read_header(path: &Path, blocks: &mut Blocks) -> Result<Header, RecordingError> {
    match blocks.next::<Header>()? {
        Next::Block(_, header) => header.identity.check_program(path).map(|()| header),
        Next::Cut | Next::End => Err(RecordingError::refused(path, "truncated before the first step")),
    }
}

fn refused_input(path: &Path, offset: u64, error: &InputError) -> RecordingError {
    let message = match error {
        InputError::Unknown(_) => format!("at byte {offset}: {error}"),
        InputError::Invalid { .. } => format!("corrupt at byte {offset}: {error}"),
    };
    RecordingError::refused(path, message)
}

impl Recording {
    /// Opens a recording and reads it through. Its inputs are of the types that `known` has.
    ///
    /// # Errors
    /// [`RecordingError::Refused`]: not a recording, of another version, damaged, or with an input of another type. One
    /// that was cut short is none of these.
    pub fn open(path: &Path, known: &Inputs) -> Result<Self, RecordingError> {
        let mut blocks = Blocks::open(path, RECORDING)?;
        let header = read_header(path, &mut blocks)?;
        let (start, mut index, mut is_whole) = (header.start, Vec::new(), false);
        let mut last = start;
        while let Next::Block(offset, record) = blocks.next()? {
            is_whole = matches!(record, Record::End(..));
            let (step, kind) = match record {
                Record::Inputs(step, inputs) => {
                    let check = inputs.iter().try_for_each(|input| known.check(input));
                    check.map_err(|error| refused_input(path, offset, &error))?;
                    (step, Kind::Inputs)
                }
                Record::Snapshot(step, _) => (step, Kind::Snapshot),
                Record::Mark(step, hash) | Record::End(step, hash) => (step, Kind::Hash(hash)),
            };
            if step < last {
                let message = format!("corrupt at byte {offset}: step {step} comes after step {last}");
                return Err(RecordingError::refused(path, message));
            }
            last = step;
            index.push(Entry { step, kind, offset });
            if is_whole {
                blocks.finish()?;
            }
        }
        if start > 0 && index.first().is_none_or(|entry| (entry.step, entry.kind) != (start, Kind::Snapshot)) {
            return Err(RecordingError::refused(path, "truncated before the first step"));
        }
        Ok(Self { blocks, header, index, last, is_whole, next: 0 })
    }

    /// Identity of the recorded run.
    pub fn identity(&self) -> &Identity {
        &self.header.identity
    }

    /// Checks that its kinds of state are the program's: the hashes of others would differ from the first step on.
    ///
    /// # Errors
    /// [`RecordingError::Refused`] names a kind of state that only one of the two has.
    pub fn check_state(&self, now: &StateList) -> Result<(), RecordingError> {
        match now.difference(self.header.kinds.iter().map(String::as_str)) {
            Some(difference) => Err(RecordingError::refused(self.blocks.path(), difference)),
            None => Ok(()),
        }
    }

    /// The steps that it holds the states after, first and last.
    pub fn steps(&self) -> (u64, u64) {
        (self.header.start, self.last)
    }

    /// Tells if the run ended in order; else it was killed, and the recording ends a little earlier than it did.
    pub fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// Warning of one that is not whole.
    pub fn warning(&self) -> Option<String> {
        let told =
            || format!("{}: the recording is truncated; it ends with step {}", self.blocks.path().display(), self.last);
        (!self.is_whole).then(told)
    }

    /// Gets ready to play from a step: restores the nearest snapshot before it into a world that has just loaded the
    /// scene. The steps from there are to be taken.
    ///
    /// # Errors
    /// [`RecordingError::Refused`].
    pub fn seek(&mut self, step: u64, simulation: &mut Simulation) -> Result<(), RecordingError> {
        // A recording that began in the middle has a snapshot there.
        let step = step.max(self.header.start);
        let nearest = self.index.iter().rposition(|entry| entry.kind == Kind::Snapshot && entry.step <= step);
        let Some(position) = nearest else { return Ok(()) };
        let offset = self.index[position].offset;
        if let Record::Snapshot(_, state) = self.blocks.read(offset)? {
            let path = self.blocks.path();
            snapshot::restore(&mut simulation.world, &state)
                .map_err(|error| RecordingError::refused(path, format_args!("corrupt at byte {offset}: {error}")))?;
        }
        self.next = position + 1;
        Ok(())
    }

    /// Inputs between this step and the next.
    ///
    /// # Errors
    /// [`RecordingError::Refused`].
    pub fn inputs(&mut self, step: u64) -> Result<Vec<SavedInput>, RecordingError> {
        let mut inputs = Vec::new();
        while let Some(&Entry { kind, offset, .. }) = self.index.get(self.next).filter(|entry| entry.step <= step) {
            self.next += 1;
            if kind == Kind::Inputs
                && let Record::Inputs(_, more) = self.blocks.read(offset)?
            {
                inputs.extend(more);
            }
        }
        Ok(inputs)
    }

    /// The hash of the state after a step, where it was recorded. Steps are to be asked for in order.
    pub fn hash(&self, step: u64) -> Option<StateHash> {
        // Not what stands behind the inputs after it: those came later.
        let is_before = |entry: &&Entry| entry.step < step || entry.step == step && entry.kind != Kind::Inputs;
        let upcoming = self.index.get(self.next..)?.iter().take_while(is_before);
        upcoming.filter(|entry| entry.step == step).find_map(|entry| match entry.kind {
            Kind::Hash(hash) => Some(hash),
            Kind::Inputs | Kind::Snapshot => None,
        })
    }

    /// The hash of the state at its end, where the run ended in order.
    pub fn end(&self) -> Option<StateHash> {
        match self.index.last()?.kind {
            Kind::Hash(hash) if self.is_whole => Some(hash),
            _ => None,
        }
    }

    /// Error of a state after a step that is not the recorded one.
    pub fn diverged(&self, step: u64) -> RecordingError {
        RecordingError::Diverged { path: self.blocks.path().to_owned(), step }
    }
}
