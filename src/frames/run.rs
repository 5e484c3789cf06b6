//! A run of a scene, taken from frame to frame: frame n is the world after n steps of its clock.

use super::FrameError;
use super::stage::{Stage, begin_run};
use crate::recording::{RunFiles, Stepper};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use systems::Simulation;
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
    pub stage: Stage,
    pub frames: Range<u64>,
    stepper: Stepper,
    pace: Option<Pace>,
}

impl FrameRun {
    /// Begins a run. `realtime`: at the speed of the scene's clock rather than as fast as possible.
    ///
    /// # Errors
    /// [`FrameError`]: frames that the run does not have; what it is kept in and begins from.
    pub fn begin(
        mut stage: Stage,
        (scene, files): (&Path, &RunFiles),
        frames: &Frames,
        realtime: bool,
    ) -> Result<Self, FrameError> {
        let stepper = begin_run(&mut stage, scene, files, frames.start())?;
        let now = step_of(&stage.simulation);
        let (first, last) = stepper.recording().map_or((now, None), |recording| {
            let (first, last) = recording.steps();
            (first, Some(last))
        });
        let frames = frames.numbers(first, last)?;
        let pace = realtime.then(|| Pace::begin(stage.simulation.world.resource()));
        Ok(Self { stage, frames, stepper, pace })
    }

    /// The clock's step.
    pub fn step(&self) -> u64 {
        step_of(&self.stage.simulation)
    }

    /// Takes one step.
    ///
    /// # Errors
    /// A file of the run that cannot be written, or a state that differs from the replayed one.
    pub fn advance(&mut self) -> Result<(), FrameError> {
        self.pace.iter().for_each(|pace| pace.wait(step_of(&self.stage.simulation) + 1));
        Ok(self.stepper.step(&mut self.stage.simulation)?)
    }

    /// Writes a snapshot of the state as it is now.
    ///
    /// # Errors
    /// [`FrameError::Recording`].
    pub fn save_snapshot(&mut self, path: &Path) -> Result<(), FrameError> {
        Ok(self.stepper.save_snapshot(path, &mut self.stage.simulation)?)
    }

    /// After the last frame: goes on to the last state that is expected, and writes what the run is kept in. Returns
    /// the snapshot's file, if one was asked for.
    ///
    /// # Errors
    /// [`FrameError`].
    pub fn finish(&mut self, files: &RunFiles) -> Result<Option<PathBuf>, FrameError> {
        while self.stepper.last_state().is_some_and(|last| self.step() < last) {
            self.advance()?;
        }
        self.stepper.finish(&mut self.stage.simulation)?;
        if let Some(path) = &files.save_snapshot {
            self.save_snapshot(path)?;
        }
        Ok(files.save_snapshot.clone())
    }
}

fn step_of(simulation: &Simulation) -> u64 {
    simulation.world.resource::<Clock>().step
}
