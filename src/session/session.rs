//! The world of a scene and its run.

use super::load::{self, LoadOptions};
use super::warnings;
use crate::output;
use crate::recording::{Identity, Recorder, Recording, RecordingError, RunFiles, Snapshot};
use crate::scene::{LoadedScene, SceneError, Template};
use crate::viewpoint::Viewpoint;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use systems::Simulation;
use systems::ecs::clock::{Clock, Seed};
use systems::run::inputs::{Input, Inputs};
use systems::run::registry::EntityRegistry;
use systems::run::standard_inputs::SetWeather;
use systems::run::state::StateList;
use systems::run::state_hash::StateHash;
use systems::run::{inputs, snapshot, state_hash};

/// Name of snapshots in memory, for messages.
const SNAPSHOT: &str = "snapshot";

/// The world of a scene and its run: the steps, and what they begin from and are kept in.
pub struct Session {
    /// The world.
    pub simulation: Simulation,
    /// Report of the loader, with what is to be said of a recording that is replayed.
    pub scene: LoadedScene,
    /// Viewpoint of its pictures: at first the scene's first camera.
    pub viewpoint: Viewpoint,
    path: PathBuf,
    source: Source,
    /// Over the scene's own.
    seed: Option<u64>,
    /// Identity of the scene, from its files when they were first read for it; of all sessions of a template. `None`:
    /// they could not be read when a run began.
    identity: Arc<OnceLock<Option<Identity>>>,
    hashes: Option<(PathBuf, File)>,
    recorder: Option<Recorder>,
    recording: Option<Recording>,
    /// States expected: [`RunFiles::states`].
    states: Vec<(u64, StateHash)>,
    /// Warnings that nobody has taken yet.
    warnings: Vec<String>,
}

/// Origin of worlds of the scene.
enum Source {
    /// The file, read for each.
    File(LoadOptions),
    /// A scene that was read once.
    Template(Arc<Template>),
}

impl Session {
    /// Loads a scene; its warnings are logged.
    ///
    /// # Errors
    /// [`SceneError`].
    pub fn load(path: &Path, options: &LoadOptions) -> Result<Self, SceneError> {
        let (simulation, scene) = load::world(path, options)?;
        Ok(Self::new(path.to_owned(), Source::File(options.clone()), options.seed, simulation, scene))
    }

    /// A session of a scene that was read. A `seed` takes the place of the scene's own.
    pub fn of(template: Arc<Template>, seed: Option<u64>) -> Self {
        let (simulation, scene) = template.instantiate(seed);
        Self::new(template.path().to_owned(), Source::Template(template), seed, simulation, scene)
    }

    fn new(path: PathBuf, source: Source, seed: Option<u64>, simulation: Simulation, scene: LoadedScene) -> Self {
        let camera = scene.cameras.first().map_or(Entity::PLACEHOLDER, |(_, camera)| *camera);
        Self {
            simulation,
            scene,
            viewpoint: camera.into(),
            path,
            source,
            seed,
            identity: Arc::default(),
            hashes: None,
            recorder: None,
            recording: None,
            states: Vec::new(),
            warnings: Vec::new(),
        }
    }

    /// Another session of the scene as it begins, seen from where this one is. `seed`: in the place of this one's.
    ///
    /// # Errors
    /// [`RecordingError::Scene`]: a file that was loaded cannot be read any more. Worlds of a template cannot fail.
    pub fn fresh(&self, seed: Option<u64>) -> Result<Self, RecordingError> {
        let seed = seed.or(self.seed);
        let other = match &self.source {
            Source::File(options) => Self::load(&self.path, &LoadOptions { seed, ..options.clone() })?,
            Source::Template(template) => Self { identity: self.identity.clone(), ..Self::of(template.clone(), seed) },
        };
        Ok(other.seen_like(self))
    }

    /// The same of a scene that is still what it was when its identity was read.
    fn unchanged(&self, seed: Option<u64>) -> Result<Self, RecordingError> {
        if let Source::Template(_) = &self.source {
            return self.fresh(seed);
        }
        let own = self.identity()?;
        let other = self.fresh(seed)?;
        match own.changed_file(&other.identity()?) {
            Some(name) => Err(RecordingError::refused(&self.path, format!("{name} has changed since it was loaded"))),
            None => Ok(other),
        }
    }

    /// Seen from where another session of the scene is, if that is there.
    fn seen_like(mut self, other: &Self) -> Self {
        let (own, others) = (&self.simulation.world, &other.simulation.world);
        let by_id = |entity| {
            let id = others.resource::<EntityRegistry>().id(entity)?;
            let found = own.resource::<EntityRegistry>().entity(id)?;
            (own.get_entity(found).is_ok() && own.get::<Name>(found) == others.get::<Name>(entity)).then_some(found)
        };
        // In a scene that has changed.
        let by_name = |entity| {
            let (wanted, _) = other.scene.cameras.iter().find(|(_, camera)| *camera == entity)?;
            self.scene.cameras.iter().find(|(name, _)| name == wanted).map(|(_, camera)| *camera)
        };
        let seen = other.viewpoint.at_another(|entity| by_id(entity).or_else(|| by_name(entity)));
        self.viewpoint = seen.unwrap_or(self.viewpoint);
        self
    }

    /// Another session of the scene, whose files are read anew.
    ///
    /// # Errors
    /// [`RecordingError::Scene`]; [`RecordingError::Misused`] while the run is kept.
    pub fn reloaded(&self) -> Result<Self, RecordingError> {
        self.refuse_while_kept()?;
        let other = match &self.source {
            Source::File(_) => self.fresh(None)?,
            Source::Template(template) => {
                let read = Template::load_with(&self.path, template.overrides())?;
                Self::of(Arc::new(read), self.seed).seen_like(self)
            }
        };
        Ok(Self { warnings: self.warnings.clone(), ..other })
    }

    /// Another session of the scene in the same state.
    ///
    /// # Errors
    /// Those of [`Self::fresh`]; [`RecordingError::Refused`]: a file has changed since [`Self::identity`] read it.
    pub fn fork(&mut self) -> Result<Self, RecordingError> {
        let state = snapshot::save(&mut self.simulation.world);
        Ok(self.unchanged(None)?.with_state(&state)?.seen_like(self))
    }

    /// The same with a state that a world of the scene had.
    fn with_state(mut self, state: &[u8]) -> Result<Self, RecordingError> {
        snapshot::restore(&mut self.simulation.world, state)?;
        Ok(self)
    }

    /// Goes on as another session of the scene, with the warnings that nobody has taken yet.
    fn go_on_as(&mut self, other: Self) {
        let warnings = std::mem::take(&mut self.warnings);
        *self = Self { warnings, ..other.seen_like(self) };
    }

    /// Begins the run anew: the world is another, without what was spawned. `seed`: in the place of this one's.
    ///
    /// # Errors
    /// Those of [`Self::fresh`]; [`RecordingError::Misused`] while the run is kept.
    pub fn reset(&mut self, seed: Option<u64>) -> Result<(), RecordingError> {
        self.refuse_while_kept()?;
        self.go_on_as(self.fresh(seed)?);
        Ok(())
    }

    /// A recording tells of one run from beginning to end.
    fn refuse_while_kept(&self) -> Result<(), RecordingError> {
        let is_written = self.recorder.is_some() || self.hashes.is_some();
        let message = "not while the run is recorded or replayed, or hashes of its states are written or expected";
        let is_kept = is_written || self.is_replay() || !self.states.is_empty();
        if is_kept { Err(RecordingError::Misused(message)) } else { Ok(()) }
    }

    /// File of the scene.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Identity that recordings and snapshots of this run belong to. Reads the scene's files at the first call.
    ///
    /// # Errors
    /// Those of [`Identity::of`]; the files could not be read when the run began.
    pub fn identity(&self) -> Result<Identity, RecordingError> {
        self.identity_for(&self.path)
    }

    /// The same for a file, which a refusal names.
    fn identity_for(&self, path: &Path) -> Result<Identity, RecordingError> {
        let known = match self.identity.get() {
            Some(known) => known,
            None => {
                let read = Identity::of(&self.path, &self.scene.files, &self.simulation)?;
                self.identity.get_or_init(|| Some(read))
            }
        };
        let refused = || RecordingError::refused(path, "the scene's files could not be read when the run began");
        let identity = known.clone().ok_or_else(refused)?;
        Ok(Identity { seed: self.simulation.world.resource::<Seed>().0, ..identity })
    }

    /// Gives images that a renderer has taken the texels of ([`Library::keep_texels`](systems::assets::Library)) their
    /// texels again, from the files that the world was loaded from: for another renderer, where that one's device was
    /// lost. Worlds of templates keep theirs.
    ///
    /// # Errors
    /// [`SceneError`]: the files cannot be read any more, or have changed.
    pub fn restore_texels(&mut self) -> Result<(), SceneError> {
        match &self.source {
            Source::File(options) => load::restore_texels(&self.path, options, &mut self.simulation),
            Source::Template(_) => Ok(()),
        }
    }

    /// Begins the run of a world that has just been made: restores the snapshot, or the nearest one of a recording
    /// before the step `from`, if one is asked for, and opens what is to be written.
    ///
    /// # Errors
    /// [`RecordingError`]: nothing is kept then, but the state may be another; [`RecordingError::Misused`] while the
    /// run is kept already.
    pub fn begin(&mut self, files: &RunFiles, from: u64) -> Result<(), RecordingError> {
        self.refuse_while_kept()?;
        files.refuse_overwriting(&self.scene.files)?;
        // Before anything is begun: one of them comes after the last frame.
        files.written().try_for_each(output::check_folder)?;
        files.save_snapshot.as_deref().map_or(Ok(()), output::check_file)?;
        // Where nothing needs it yet, too: files may change while the run goes on.
        match self.identity() {
            Err(error) if files.need_identity() => return Err(error),
            Err(_) => _ = self.identity.set(None),
            Ok(_) => {}
        }
        let recording = files.replay.as_ref().map(|path| self.replay(path, from)).transpose()?;
        if let Some(path) = &files.from_snapshot {
            let identity = self.identity()?;
            Snapshot::read(path)?.restore(path, &identity, &mut self.simulation)?;
        }
        let recorder = match &files.record {
            Some(path) => Some(Recorder::create(path, self.identity()?, &mut self.simulation)?),
            None => None,
        };
        let create = |path: &PathBuf| match output::create_anew(path) {
            Ok(file) => Ok((path.clone(), file)),
            Err(error) => Err(RecordingError::unwritable(path, error)),
        };
        self.hashes = files.hash.as_ref().map(create).transpose()?;
        self.states.clone_from(&files.states);
        if let Err(error) = self.note_state(false) {
            (self.hashes, self.states) = (None, Vec::new());
            return Err(error);
        }
        let warning = recording.as_ref().and_then(Recording::warning);
        self.scene.warnings.extend(warning.into_iter().inspect(|warning| tracing::warn!("{warning}")));
        (self.recording, self.recorder) = (recording, recorder);
        if let Source::File(LoadOptions { weather: Some(weather), .. }) = &self.source
            && files.from_snapshot.is_none()
            && files.replay.is_none()
        {
            self.apply(SetWeather { weather: weather.clone(), over_seconds: 0.0 })?;
        }
        Ok(())
    }

    fn replay(&mut self, path: &Path, from: u64) -> Result<Recording, RecordingError> {
        let (identity, world) = (self.identity()?, &self.simulation.world);
        let mut recording = Recording::open(path, world.resource::<Inputs>())?;
        recording.identity().check(path, &identity)?;
        recording.check_state(world.resource::<StateList>())?;
        recording.seek(from, &mut self.simulation)?;
        Ok(recording)
    }

    /// Begins to record a run that is under way, from its state as it is. [`Self::finish`] ends the recording in order.
    ///
    /// # Errors
    /// [`RecordingError`]: a file that cannot be written or that the run reads; a replay, which is a recording already;
    /// a scene with fields in the place of its file's own.
    pub fn record(&mut self, path: &Path) -> Result<(), RecordingError> {
        if let Source::Template(template) = &self.source
            && !template.overrides().is_empty()
        {
            let message = "expected a world whose clock, geo_origin and environment are those of the scene's file, by \
                           which recordings are replayed";
            return Err(RecordingError::Misused(message));
        }
        if self.recorder.is_some() || self.is_replay() {
            return Err(RecordingError::refused(path, "the run is being recorded or replayed already"));
        }
        let files = RunFiles { record: Some(path.to_owned()), ..RunFiles::default() };
        files.refuse_overwriting(&self.scene.files)?;
        output::check_folder(path)?;
        let mut recorder = Recorder::create(path, self.identity_for(path)?, &mut self.simulation)?;
        if self.step_number() == 0 {
            // The state may be another than the scene's even before the first step.
            recorder.snapshot(0, &mut self.simulation)?;
        }
        self.recorder = Some(recorder);
        Ok(())
    }

    /// Steps done since the run began.
    pub fn step_number(&self) -> u64 {
        self.simulation.world.resource::<Clock>().step
    }

    /// A hash of the whole state.
    pub fn hash(&mut self) -> StateHash {
        state_hash::hash(&mut self.simulation.world)
    }

    /// Tells if a recording is replayed, rather than the keys of a window.
    pub fn is_replay(&self) -> bool {
        self.recording.is_some()
    }

    /// The recording that is replayed.
    pub fn recording(&self) -> Option<&Recording> {
        self.recording.as_ref()
    }

    /// Tells if a replay has got to the end of what was recorded.
    pub fn is_at_end(&self) -> bool {
        self.recording.as_ref().is_some_and(|recording| self.step_number() >= recording.steps().1)
    }

    /// The step of the last state that is expected.
    pub fn last_state(&self) -> Option<u64> {
        self.states.last().map(|(step, _)| *step)
    }

    /// Takes the hash of the state if it is wanted, is to be written or is expected.
    fn note_state(&mut self, is_wanted: bool) -> Result<Option<StateHash>, RecordingError> {
        let step = self.step_number();
        let expected = self.states.iter().find(|(expected, _)| *expected == step).map(|(_, hash)| *hash);
        if !is_wanted && self.hashes.is_none() && expected.is_none() {
            return Ok(None);
        }
        let hash = self.hash();
        if let Some((path, file)) = &mut self.hashes {
            // By one call to the system: a program that is killed leaves whole lines.
            let line = format!("{step} {hash}\n");
            file.write_all(line.as_bytes()).map_err(|error| RecordingError::unwritable(path, error))?;
        }
        if expected.is_some_and(|expected| expected != hash) {
            return Err(RecordingError::Parted { step });
        }
        Ok(Some(hash))
    }

    /// Snapshot of the run as it is now, for a file.
    fn saved(&mut self, path: &Path) -> Result<Snapshot, RecordingError> {
        Ok(Snapshot::of(self.identity_for(path)?, &mut self.simulation))
    }

    /// Writes a snapshot of the run as it is now, whole or not at all.
    ///
    /// # Errors
    /// [`RecordingError`].
    pub fn save_snapshot(&mut self, path: &Path) -> Result<(), RecordingError> {
        self.saved(path)?.write(path)
    }

    /// Contents of such a file.
    ///
    /// # Errors
    /// [`RecordingError`].
    pub fn snapshot(&mut self) -> Result<Vec<u8>, RecordingError> {
        self.saved(Path::new(SNAPSHOT))?.to_bytes().ok_or(RecordingError::TooLong)
    }

    /// Makes the state that of a snapshot, in a new world where this one does not take it. Where that fails the state
    /// is as it was.
    ///
    /// # Errors
    /// [`RecordingError`].
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), RecordingError> {
        let name = Path::new(SNAPSHOT);
        let saved = Snapshot::from_bytes(name, bytes)?;
        let (own, seed) = (self.identity()?, saved.identity.seed);
        let now = Identity { seed, ..own };
        saved.identity.check(name, &now)?;
        self.refuse_while_kept()?;
        let (is_own, is_template) = (seed == own.seed, matches!(self.source, Source::Template(_)));
        // Its worlds cannot fail; those of a file can, so one is made before this one is touched.
        let before = (is_own && is_template).then(|| snapshot::save(&mut self.simulation.world));
        if before.is_some() && saved.restore(name, &now, &mut self.simulation).is_ok() {
            return Ok(());
        }
        // The seed is another, an entity of the scene is gone, or the snapshot fits no world: a new one shows which.
        let mut other = self.unchanged(Some(seed))?;
        let restored = saved.restore(name, &now, &mut other.simulation);
        match (&restored, before) {
            (Ok(()), None) if is_own && saved.restore(name, &now, &mut self.simulation).is_ok() => {}
            (Ok(()), _) => self.go_on_as(other),
            (Err(_), Some(before)) => self.go_on_as(self.fresh(None)?.with_state(&before)?),
            (Err(_), None) => {}
        }
        restored
    }

    /// Applies an input from outside now, between two steps.
    ///
    /// # Errors
    /// [`RecordingError::Output`]; [`RecordingError::Misused`]: a replay takes none.
    pub fn apply<T: Input>(&mut self, input: T) -> Result<(), RecordingError> {
        if self.is_replay() {
            return Err(RecordingError::Misused("a replay takes no inputs of its own"));
        }
        self.simulation.world.resource_mut::<Inputs>().push(input);
        self.apply_inputs()
    }

    /// Applies what came from outside since the last step. A replay drops it.
    ///
    /// # Errors
    /// [`RecordingError::Output`].
    pub fn apply_inputs(&mut self) -> Result<(), RecordingError> {
        if self.is_replay() {
            self.simulation.world.resource_mut::<Inputs>().clear();
            return Ok(());
        }
        let (applied, step) = (inputs::apply_queued(&mut self.simulation.world), self.step_number());
        match &mut self.recorder {
            Some(recorder) if !applied.is_empty() => recorder.inputs(step, applied),
            _ => Ok(()),
        }
    }

    /// Takes a step.
    ///
    /// # Errors
    /// [`RecordingError`]; a replay that comes out otherwise is one.
    pub fn step(&mut self) -> Result<(), RecordingError> {
        self.apply_inputs()?;
        if let Some(recording) = &mut self.recording {
            push_recorded(recording, &mut self.simulation)?;
        }
        self.simulation.step();
        let warnings = warnings::take(&mut self.simulation);
        self.warnings.extend(warnings.into_iter().inspect(|warning| tracing::warn!("{warning}")));
        let step = self.step_number();
        let expected = self.recording.as_ref().and_then(|recording| recording.hash(step));
        let is_marked = self.recorder.as_ref().is_some_and(|recorder| recorder.wants_hash(step));
        let hash = self.note_state(is_marked || expected.is_some())?;
        if let Some(recorder) = &mut self.recorder {
            recorder.stepped(step, hash, &mut self.simulation)?;
        }
        match &self.recording {
            Some(recording) if expected != hash && expected.is_some() => Err(recording.diverged(step)),
            _ => Ok(()),
        }
    }

    /// Takes a step, but not beyond the end of a replay. Returns whether it was taken.
    ///
    /// # Errors
    /// Those of [`Self::step`].
    pub fn play(&mut self) -> Result<bool, RecordingError> {
        let goes_on = !self.is_at_end();
        if goes_on {
            self.step()?;
        }
        Ok(goes_on)
    }

    /// Takes the warnings of the steps so far, each once; a log has them already.
    pub fn take_warnings(&mut self) -> Vec<String> {
        std::mem::take(&mut self.warnings)
    }

    /// Ends a recording in order, or a replay, whose world is free then. One that has got to the end takes what came
    /// after the last step, too. Hashes are neither written nor expected any more.
    ///
    /// # Errors
    /// [`RecordingError`]; a replay that comes out otherwise is one.
    pub fn finish(&mut self) -> Result<(), RecordingError> {
        self.apply_inputs()?;
        (self.hashes, self.states) = (None, Vec::new());
        let step = self.step_number();
        if let Some(mut recording) = self.recording.take().filter(|recording| recording.steps().1 == step) {
            push_recorded(&mut recording, &mut self.simulation)?;
            inputs::apply_queued(&mut self.simulation.world);
            if recording.end().is_some_and(|end| end != self.hash()) {
                return Err(recording.diverged(step));
            }
        }
        let Some(recorder) = self.recorder.take() else { return Ok(()) };
        recorder.finish(step, self.hash())
    }

    /// Goes on without writing anything: what was to be written cannot be.
    pub fn stop_writing(&mut self) {
        (self.hashes, self.recorder) = (None, None);
    }
}

/// Queues what came after the present step.
fn push_recorded(recording: &mut Recording, simulation: &mut Simulation) -> Result<(), RecordingError> {
    let recorded = recording.inputs(simulation.world.resource::<Clock>().step)?;
    let mut inputs = simulation.world.resource_mut::<Inputs>();
    recorded.into_iter().for_each(|input| inputs.push_saved(input));
    Ok(())
}
