//! A run of a scene, taken from frame to frame: frame n is the world after n steps of its clock.

use super::FrameError;
use crate::recording::{Recording, RunFiles};
use crate::session::Session;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use systems::ecs::clock::{Clock, SPEEDS};

/// Frames of a run. Frame n shows the state after n steps.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Frames {
    /// So many, from where the run begins: 0, or a snapshot's step.
    First(u64),
    /// These.
    Range(Range<u64>),
    /// All of a recording; without one, the first.
    All,
}

impl Frames {
    /// The numbers, of a run whose first and last steps are known, the last of a recording only.
    fn numbers(&self, first: u64, last: Option<u64>) -> Result<Range<u64>, FrameError> {
        let wanted = match self {
            Self::First(count) => first..first + count,
            Self::Range(range) => range.clone(),
            Self::All => first..last.unwrap_or(first) + 1,
        };
        if wanted.start < first {
            return Err(FrameError::NoFrames { wanted, known: format!("begins with frame {first}") });
        }
        match last {
            Some(last) if wanted.end > last + 1 => {
                Err(FrameError::NoFrames { wanted, known: format!("ends with frame {last}") })
            }
            _ => Ok(wanted),
        }
    }

    /// The first that is known to be wanted.
    fn start(&self) -> u64 {
        if let Self::Range(range) = self { range.start } else { 0 }
    }
}

/// Steps at the speed of the clock.
struct Pace {
    began: Instant,
    first: u64,
    seconds_per_step: f64,
}

impl Pace {
    fn begin(clock: &Clock) -> Self {
        let seconds_per_step = clock.step_seconds / clock.speed.clamp(*SPEEDS.start(), *SPEEDS.end());
        Self { began: Instant::now(), first: clock.step, seconds_per_step }
    }

    /// Waits until a step is due; one that is late is not waited for.
    fn wait(&self, step: u64) {
        let due = Duration::from_secs_f64((step - self.first) as f64 * self.seconds_per_step);
        std::thread::sleep(due.saturating_sub(self.began.elapsed()));
    }
}

/// A run under way, and which frames of it are wanted.
pub(crate) struct FrameRun {
    pub session: Session,
    pub frames: Range<u64>,
    pace: Option<Pace>,
}

impl FrameRun {
    /// Begins a run. `realtime`: at the speed of the scene's clock rather than as fast as possible.
    ///
    /// # Errors
    /// [`FrameError`]: frames that the run does not have; what it is kept in and begins from.
    pub fn begin(mut session: Session, files: &RunFiles, frames: &Frames, realtime: bool) -> Result<Self, FrameError> {
        session.begin(files, frames.start())?;
        let (first, last) = match session.recording().map(Recording::steps) {
            Some((first, last)) => (first, Some(last)),
            None => (session.step_number(), None),
        };
        let frames = frames.numbers(first, last)?;
        let pace = realtime.then(|| Pace::begin(session.simulation.world.resource()));
        Ok(Self { session, frames, pace })
    }

    /// The clock's step.
    pub fn step(&self) -> u64 {
        self.session.step_number()
    }

    /// Takes one step.
    ///
    /// # Errors
    /// A file of the run that cannot be written, or a state that differs from the replayed one.
    pub fn advance(&mut self) -> Result<(), FrameError> {
        self.pace.iter().for_each(|pace| pace.wait(self.step() + 1));
        Ok(self.session.step()?)
    }

    /// After the last frame: goes on to the last state that is expected, and writes what the run is kept in. Returns
    /// the snapshot's file, if one was asked for.
    ///
    /// # Errors
    /// [`FrameError`].
    pub fn finish(&mut self, files: &RunFiles) -> Result<Option<PathBuf>, FrameError> {
        while self.session.last_state().is_some_and(|last| self.step() < last) {
            self.advance()?;
        }
        self.session.finish()?;
        if let Some(path) = &files.save_snapshot {
            self.session.save_snapshot(path)?;
        }
        Ok(files.save_snapshot.clone())
    }
}
