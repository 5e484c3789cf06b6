//! Takes the steps of a run, in a window and without one: the one place where inputs, steps, hashes and recordings
//! meet, so that all are in the same order everywhere.

use super::error::RecordingError;
use super::identity::Identity;
use super::player::Recording;
use super::recorder::Recorder;
use super::snapshots::{load_snapshot, save_snapshot};
use crate::import;
#[cfg(feature = "vehicles")]
use crate::name;
use crate::output;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use systems::Simulation;
use systems::ecs::clock::Clock;
use systems::run::inputs::Inputs;
use systems::run::state::StateList;
use systems::run::state_hash::StateHash;
use systems::run::{inputs, state_hash};
#[cfg(feature = "vehicles")]
use systems::vehicles::external::STALE;

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
}

/// Replay, recording and hashing in each step.
#[derive(Debug, Default)]
pub struct Stepper {
    hashes: Option<(PathBuf, File)>,
    recorder: Option<Recorder>,
    recording: Option<Recording>,
    /// States expected: [`RunFiles::states`].
    states: Vec<(u64, StateHash)>,
    /// Identity of the run from its files when it began; `None` if they could not be read again.
    identity: Option<Identity>,
    /// Warnings that nobody has taken yet.
    warnings: Vec<String>,
}

impl Stepper {
    /// Begins the run of a scene that has just been loaded, with the files that it names: restores the snapshot, or the
    /// nearest one of a recording before the step `from`, if one is asked for, and opens what is to be written.
    ///
    /// # Errors
    /// [`RecordingError`].
    pub fn begin(
        files: &RunFiles,
        (scene, named): (&Path, &[PathBuf]),
        from: u64,
        simulation: &mut Simulation,
    ) -> Result<Self, RecordingError> {
        refuse_overwriting(files, scene, named)?;
        // Before anything is begun: one of them comes after the last frame.
        files.written().try_for_each(output::check_folder)?;
        files.save_snapshot.as_deref().map_or(Ok(()), output::check_file)?;
        let mut stepper = Self { states: files.states.clone(), ..Self::default() };
        let identity = Identity::of(scene, named, &*simulation);
        let identity = match files {
            RunFiles { record: None, from_snapshot: None, replay: None, .. } => identity.ok(),
            _ => Some(identity?),
        };
        stepper.identity.clone_from(&identity);
        if let (Some(path), Some(identity)) = (&files.replay, &identity) {
            let mut recording = Recording::open(path, simulation.world.resource::<Inputs>())?;
            recording.identity().check(path, identity)?;
            recording.check_state(simulation.world.resource::<StateList>())?;
            recording.seek(from, simulation)?;
            stepper.recording = Some(recording);
        }
        if let (Some(path), Some(identity)) = (&files.from_snapshot, &identity) {
            load_snapshot(path, identity, simulation)?;
        }
        if let (Some(path), Some(identity)) = (&files.record, identity) {
            stepper.recorder = Some(Recorder::create(path, identity, simulation)?);
        }
        stepper.write_hashes(files.hash.as_deref(), simulation)?;
        let step = step_of(simulation);
        if stepper.state(step).is_some() {
            stepper.check_state(step, state_hash::hash(&mut simulation.world))?;
        }
        Ok(stepper)
    }

    /// Begins to record a run that is under way, from its state as it is. [`Self::finish`] ends the recording in order.
    ///
    /// # Errors
    /// [`RecordingError`]: a file that cannot be written or that the run reads; a replay, which is a recording already.
    pub fn record(
        &mut self,
        path: &Path,
        (scene, named): (&Path, &[PathBuf]),
        simulation: &mut Simulation,
    ) -> Result<(), RecordingError> {
        if self.recorder.is_some() || self.is_replay() {
            return Err(RecordingError::refused(path, "the run is being recorded or replayed already"));
        }
        let files = RunFiles { record: Some(path.to_owned()), ..RunFiles::default() };
        refuse_overwriting(&files, scene, named)?;
        output::check_folder(path)?;
        let identity = Identity::of(scene, named, &*simulation)?;
        self.recorder = Some(Recorder::create_under_way(path, identity, simulation)?);
        Ok(())
    }

    fn write_hashes(&mut self, path: Option<&Path>, simulation: &mut Simulation) -> Result<(), RecordingError> {
        let Some(path) = path else { return Ok(()) };
        let file = output::create_anew(path).map_err(|error| RecordingError::unwritable(path, error))?;
        self.hashes = Some((path.to_owned(), file));
        self.note_hash(step_of(simulation), state_hash::hash(&mut simulation.world))
    }

    /// Tells if a recording is replayed, rather than the keys of a window.
    pub fn is_replay(&self) -> bool {
        self.recording.is_some()
    }

    /// Tells if a recording is being written.
    pub fn is_recording(&self) -> bool {
        self.recorder.is_some()
    }

    /// The recording that is replayed.
    pub fn recording(&self) -> Option<&Recording> {
        self.recording.as_ref()
    }

    /// Tells if a replay has got to the end of what was recorded.
    pub fn is_at_end(&self, simulation: &Simulation) -> bool {
        self.recording.as_ref().is_some_and(|recording| step_of(simulation) >= recording.steps().1)
    }

    /// The step of the last state that is expected.
    pub fn last_state(&self) -> Option<u64> {
        self.states.last().map(|(step, _)| *step)
    }

    fn state(&self, step: u64) -> Option<StateHash> {
        self.states.iter().find(|(expected, _)| *expected == step).map(|(_, hash)| *hash)
    }

    fn check_state(&self, step: u64, hash: StateHash) -> Result<(), RecordingError> {
        let is_other = self.state(step).is_some_and(|expected| expected != hash);
        if is_other { Err(RecordingError::Parted { step }) } else { Ok(()) }
    }

    /// Writes a snapshot of the run as it is now.
    ///
    /// # Errors
    /// [`RecordingError`].
    pub fn save_snapshot(&self, path: &Path, simulation: &mut Simulation) -> Result<(), RecordingError> {
        let refused = || RecordingError::refused(path, "the scene's files could not be read when the run began");
        save_snapshot(path, self.identity.as_ref().ok_or_else(refused)?, simulation)
    }

    /// Applies what came from outside since the last step. A replay takes none.
    ///
    /// # Errors
    /// [`RecordingError::Output`].
    pub fn apply_inputs(&mut self, simulation: &mut Simulation) -> Result<(), RecordingError> {
        if self.is_replay() {
            simulation.world.resource_mut::<Inputs>().clear();
            return Ok(());
        }
        let applied = inputs::apply_queued(&mut simulation.world);
        match &mut self.recorder {
            Some(recorder) if !applied.is_empty() => recorder.inputs(step_of(simulation), applied),
            _ => Ok(()),
        }
    }

    /// Takes a step.
    ///
    /// # Errors
    /// [`RecordingError`]; a replay that comes out otherwise is one.
    pub fn step(&mut self, simulation: &mut Simulation) -> Result<(), RecordingError> {
        self.apply_inputs(simulation)?;
        if let Some(recording) = &mut self.recording {
            push_recorded(recording, simulation)?;
        }
        simulation.step();
        self.warnings.extend(warnings(simulation).into_iter().inspect(|warning| tracing::warn!("{warning}")));
        self.stepped(simulation)
    }

    fn stepped(&mut self, simulation: &mut Simulation) -> Result<(), RecordingError> {
        let step = step_of(simulation);
        let expected = self.recording.as_ref().and_then(|recording| recording.hash(step));
        let is_marked = self.recorder.as_ref().is_some_and(|recorder| recorder.wants_hash(step));
        let is_wanted = self.hashes.is_some() || is_marked || expected.is_some() || self.state(step).is_some();
        let hash = is_wanted.then(|| state_hash::hash(&mut simulation.world));
        if let Some(hash) = hash {
            self.note_hash(step, hash)?;
            self.check_state(step, hash)?;
        }
        if let Some(recorder) = &mut self.recorder {
            recorder.stepped(step, hash, simulation)?;
        }
        match &self.recording {
            Some(recording) if expected != hash && expected.is_some() => Err(recording.diverged(step)),
            _ => Ok(()),
        }
    }

    /// A line by one call to the system: a program that is killed leaves whole lines.
    fn note_hash(&mut self, step: u64, hash: StateHash) -> Result<(), RecordingError> {
        let Some((path, file)) = &mut self.hashes else { return Ok(()) };
        let line = format!("{step} {hash}\n");
        file.write_all(line.as_bytes()).map_err(|error| RecordingError::unwritable(path, error))
    }

    /// Takes the warnings of the steps so far, each once; a log has them already.
    pub fn take_warnings(&mut self) -> Vec<String> {
        std::mem::take(&mut self.warnings)
    }

    /// Ends the run in order. A replay that has got to the end takes what came after the last step, too.
    ///
    /// # Errors
    /// [`RecordingError`]; a replay that comes out otherwise is one.
    pub fn finish(&mut self, simulation: &mut Simulation) -> Result<(), RecordingError> {
        self.apply_inputs(simulation)?;
        let step = step_of(simulation);
        if let Some(recording) = self.recording.as_mut().filter(|recording| recording.steps().1 == step) {
            push_recorded(recording, simulation)?;
            inputs::apply_queued(&mut simulation.world);
            if recording.end().is_some_and(|end| end != state_hash::hash(&mut simulation.world)) {
                return Err(recording.diverged(step));
            }
        }
        let Some(recorder) = self.recorder.take() else { return Ok(()) };
        recorder.finish(step_of(simulation), state_hash::hash(&mut simulation.world))
    }

    /// Goes on without writing anything: what was to be written cannot be.
    pub fn stop_writing(&mut self) {
        (self.hashes, self.recorder) = (None, None);
    }
}

/// Queues what came after the present step.
fn push_recorded(recording: &mut Recording, simulation: &mut Simulation) -> Result<(), RecordingError> {
    let recorded = recording.inputs(step_of(simulation))?;
    let mut inputs = simulation.world.resource_mut::<Inputs>();
    recorded.into_iter().for_each(|input| inputs.push_saved(input));
    Ok(())
}

fn step_of(simulation: &Simulation) -> u64 {
    simulation.world.resource::<Clock>().step
}

/// Refuses to write a file that is read, or two things to the same file.
fn refuse_overwriting(files: &RunFiles, scene: &Path, named: &[PathBuf]) -> Result<(), RecordingError> {
    let read = import::with_files_named_by(named).chain([scene.to_owned()]);
    // A snapshot may take the place of the one before, which has been read by then.
    let is_replaced = |from: &PathBuf| files.save_snapshot.as_ref().is_some_and(|path| output::is_same(path, from));
    let from_snapshot = files.from_snapshot.as_ref().filter(|from| !is_replaced(from));
    let read = read.chain(files.replay.iter().chain(from_snapshot).cloned());
    let mut taken: Vec<PathBuf> = read.map(|path| output::real(&path)).collect();
    for path in files.written() {
        let real = output::real(path);
        if taken.contains(&real) {
            return Err(RecordingError::taken(path));
        }
        taken.push(real);
    }
    Ok(())
}

/// Faults of single vehicles in a step, each once; everything else goes on.
#[cfg(feature = "vehicles")]
fn warnings(simulation: &mut Simulation) -> Vec<String> {
    let world = &mut simulation.world;
    #[cfg(feature = "physics")]
    let mut found = world.resource_mut::<systems::physics::Physics>().take_warnings();
    #[cfg(not(feature = "physics"))]
    let mut found = Vec::new();
    let mut traffic = world.resource_mut::<systems::vehicles::traffic::Traffic>();
    let (faults, stale) = (std::mem::take(&mut traffic.faults), std::mem::take(&mut traffic.stale));
    let told = |vehicle, fault: &str| format!("{}: {fault}", name::of_entity(world, vehicle));
    let broken = "its position or speed is no longer finite; it stays at its last position";
    found.extend(faults.into_iter().map(|vehicle| told(vehicle, broken)));
    let old = format!("no pose has come from outside for {STALE} s; it brakes to a standstill");
    found.extend(stale.into_iter().map(|vehicle| told(vehicle, &old)));
    found
}

#[cfg(not(feature = "vehicles"))]
fn warnings(_: &mut Simulation) -> Vec<String> {
    Vec::new()
}
