//! A world under a lock: what all objects of Python that belong to a `Sim` work on, away from the interpreter.

use crate::errors::{Failure, Outcome};
use crate::worlds::device;
use crate::worlds::watch::Watch;
use pyo3::prelude::*;
use relief::bevy_ecs::name::Name;
use relief::bevy_ecs::prelude::{ChildOf, Entity};
use relief::glam::{DAffine3, DVec3};
use relief::recording::{self, Identity, RunFiles, Snapshot, Stepper};
use relief::renderer::Settings;
use relief::scene::{LoadedScene, Overrides, Template};
use relief::sense::{Capture, Captured, Wanted, WorldSensors};
use relief::systems::Simulation;
use relief::systems::ecs::clock::{Clock, Seed};
use relief::systems::run::inputs::{Input, Inputs};
use relief::systems::run::registry::{EntityRegistry, StateId};
use relief::systems::run::snapshot;
use relief::systems::run::spawn::Spawn;
use relief::systems::space::Transform;
use relief::systems::space::origin::Origin;
use std::collections::HashMap;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// Name of snapshots in memory, for messages.
const SNAPSHOT: &str = "snapshot";

/// A scene that was read, and what recordings and snapshots of it belong to.
pub struct Scene {
    pub template: Template,
    /// In the place of its file's own fields.
    pub overrides: Overrides,
    identity: OnceLock<Identity>,
}

impl Scene {
    pub fn load(path: &Path, overrides: Overrides) -> Outcome<Self> {
        Ok(Self { template: Template::load_with(path, &overrides)?, overrides, identity: OnceLock::new() })
    }
}

/// A world of a scene, and its run.
pub struct World {
    pub scene: Arc<Scene>,
    /// Over the scene's own.
    pub seed: Option<u64>,
    pub simulation: Simulation,
    pub loaded: LoadedScene,
    pub stepper: Stepper,
    pub sensors: WorldSensors,
    pub watch: Watch,
    /// Spawn number of each spawned entity, counted from 1: ids are given again after a reset.
    births: HashMap<StateId, u64>,
    spawned: u64,
    /// Recordings that were begun.
    recordings: u64,
}

/// A world for several objects of Python, on any thread.
pub struct Shared(Mutex<World>);

impl Shared {
    pub fn new(world: World) -> Arc<Self> {
        Arc::new(Self(Mutex::new(world)))
    }

    /// Does something with the world, without the interpreter.
    pub fn with<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut World) -> Outcome<T> + Send) -> PyResult<T> {
        device::check_process()?;
        Ok(py.detach(|| work(&mut self.lock()))?)
    }

    /// The world, for what has let go of the interpreter already.
    pub fn lock(&self) -> MutexGuard<'_, World> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl World {
    pub fn new(scene: Arc<Scene>, seed: Option<u64>) -> Self {
        let (simulation, loaded) = scene.template.instantiate(seed);
        Self {
            scene,
            seed,
            simulation,
            loaded,
            stepper: Stepper::default(),
            sensors: WorldSensors::default(),
            watch: Watch::default(),
            births: HashMap::new(),
            spawned: 0,
            recordings: 0,
        }
    }

    pub fn step_number(&self) -> u64 {
        self.simulation.world.resource::<Clock>().step
    }

    /// Origin of the world's coordinates, in the scene's.
    pub fn origin(&self) -> DVec3 {
        self.simulation.world.resource::<Origin>().0
    }

    pub fn step(&mut self, steps: u64) -> Outcome<u64> {
        for _ in 0..steps {
            self.stepper.step(&mut self.simulation)?;
        }
        Ok(self.step_number())
    }

    /// Applies an input at once; a recording has it.
    pub fn apply<T: Input>(&mut self, input: T) -> Outcome<()> {
        if self.stepper.is_replay() {
            return Err(Failure::value("a replay takes no inputs of its own"));
        }
        if !input.is_valid() {
            return Err(Failure::value(format!("{}: expected finite numbers within their ranges", T::NAME)));
        }
        self.simulation.world.resource_mut::<Inputs>().push(input);
        Ok(self.stepper.apply_inputs(&mut self.simulation)?)
    }

    /// Brings something into being at once.
    pub fn spawn(&mut self, spawn: Spawn) -> Outcome<StateId> {
        let id = self.simulation.world.resource::<EntityRegistry>().next_id();
        self.apply(spawn)?;
        self.spawned += 1;
        self.births.insert(id, self.spawned);
        let step = self.step_number();
        self.living(id).into_iter().for_each(|entity| self.watch.mounted(entity, step));
        Ok(id)
    }

    /// Spawn number of an entity; 0: it was there when the run began, or came by a replay.
    pub fn birth(&self, id: StateId) -> u64 {
        self.births.get(&id).copied().unwrap_or_default()
    }

    /// Forgets spawned entities that are not in the state at hand.
    fn forget_later(&mut self) {
        let next = self.simulation.world.resource::<EntityRegistry>().next_id();
        self.births.retain(|id, _| id.0 < next.0);
    }

    /// The entity of a number, which lives.
    pub fn entity(&self, id: StateId) -> Outcome<Entity> {
        self.living(id).ok_or_else(|| Failure::Gone(format!("entity {}", id.0 + 1)))
    }

    pub fn living(&self, id: StateId) -> Option<Entity> {
        let entity = self.simulation.world.resource::<EntityRegistry>().entity(id)?;
        self.simulation.world.get_entity(entity).is_ok().then_some(entity)
    }

    pub fn id(&self, entity: Entity) -> Option<StateId> {
        self.simulation.world.resource::<EntityRegistry>().id(entity)
    }

    /// Living entities that pass, in the order in which they came to be.
    pub fn ids_where(&self, passes: impl Fn(&relief::bevy_ecs::world::World, Entity) -> bool) -> Vec<StateId> {
        let world = &self.simulation.world;
        let living = world.resource::<EntityRegistry>().iter();
        let living = living.filter(|&(_, entity)| world.get_entity(entity).is_ok() && passes(world, entity));
        living.map(|(id, _)| id).collect()
    }

    /// The first entity of a name; else the nearest name.
    pub fn find(&self, name: &str) -> Outcome<StateId> {
        let is_named = |world: &relief::bevy_ecs::world::World, entity| {
            world.get::<Name>(entity).is_some_and(|own| own.as_str() == name)
        };
        let found = self.ids_where(is_named).first().copied();
        found.ok_or_else(|| {
            let world = &self.simulation.world;
            let names: Vec<&str> = self
                .ids_where(|world, entity| world.get::<Name>(entity).is_some())
                .into_iter()
                .filter_map(|id| world.get::<Name>(self.living(id)?).map(Name::as_str))
                .collect();
            let hint = relief::name::hint(&names, name);
            Failure::Name(format!("unknown entity {name:?}{hint}"))
        })
    }

    /// From an entity to the scene's coordinates.
    pub fn scene_from(&self, entity: Entity) -> DAffine3 {
        let world = &self.simulation.world;
        let mut at = Some(entity);
        let mut scene_from_entity = DAffine3::IDENTITY;
        // Nothing is above itself.
        while let Some(own) = at {
            let place = world.get::<Transform>(own).copied().unwrap_or_default();
            let parent_from_own = DAffine3::from_scale_rotation_translation(
                place.scale.as_dvec3(),
                place.rotation.as_dquat(),
                self.place(own, &place),
            );
            scene_from_entity = parent_from_own * scene_from_entity;
            at = world.get::<ChildOf>(own).map(ChildOf::parent);
        }
        scene_from_entity.translation += self.origin();
        scene_from_entity
    }

    /// Place in its parent's axes; of a vehicle in full 64-bit precision.
    fn place(&self, entity: Entity, transform: &Transform) -> DVec3 {
        let motion = self.simulation.world.get::<relief::systems::vehicles::Motion>(entity);
        let exact = motion.map(|motion| motion.place).filter(|place| place.as_vec3() == transform.translation);
        exact.unwrap_or(transform.translation.as_dvec3())
    }

    /// Identity that recordings and snapshots of this run belong to.
    fn identity(&self) -> Outcome<Identity> {
        let template = &self.scene.template;
        let identity = match self.scene.identity.get() {
            Some(identity) => identity.clone(),
            None => {
                let read = Identity::of(template.path(), template.files(), &self.simulation)?;
                self.scene.identity.get_or_init(|| read).clone()
            }
        };
        Ok(Identity { seed: self.simulation.world.resource::<Seed>().0, ..identity })
    }

    pub fn snapshot(&mut self) -> Outcome<Vec<u8>> {
        let bytes = Snapshot::of(self.identity()?, &mut self.simulation).to_bytes();
        bytes.ok_or_else(|| Failure::Recording("the state exceeds 4 GB".into()))
    }

    /// Makes the state that of a snapshot. Where that fails the world is as it was.
    pub fn restore(&mut self, bytes: &[u8]) -> Outcome<()> {
        self.restore_state(bytes)?;
        self.forget_later();
        Ok(())
    }

    fn restore_state(&mut self, bytes: &[u8]) -> Outcome<()> {
        let saved = Snapshot::from_bytes(Path::new(SNAPSHOT), bytes)?;
        let now = Identity { seed: saved.identity.seed, ..self.identity()? };
        saved.identity.check(Path::new(SNAPSHOT), &now)?;
        self.refuse_while_kept()?;
        if saved.identity.seed == self.simulation.world.resource::<Seed>().0 {
            let before = snapshot::save(&mut self.simulation.world);
            if saved.restore(Path::new(SNAPSHOT), &now, &mut self.simulation).is_ok() {
                return Ok(());
            }
            // An entity of the scene is gone, or the snapshot fits no world: both are seen in a new one.
            let result = self.begin_anew(Some(saved.identity.seed), |simulation| {
                saved.restore(Path::new(SNAPSHOT), &now, simulation).map_err(Failure::from)
            });
            return match result {
                Ok(()) => Ok(()),
                Err(failure) => {
                    let seed = self.seed;
                    self.begin_anew(seed, |simulation| Ok(snapshot::restore(&mut simulation.world, &before)?))?;
                    Err(failure)
                }
            };
        }
        self.begin_anew(Some(saved.identity.seed), |simulation| {
            Ok(saved.restore(Path::new(SNAPSHOT), &now, simulation)?)
        })
    }

    /// A recording tells of one run from beginning to end.
    pub fn refuse_while_kept(&self) -> Outcome<()> {
        if self.stepper.is_replay() || self.stepper.is_recording() {
            return Err(Failure::value("not while the run is recorded or replayed"));
        }
        Ok(())
    }

    /// A new world of the scene in the place of this one, if it can be made what it is to be.
    pub fn begin_anew(&mut self, seed: Option<u64>, make: impl FnOnce(&mut Simulation) -> Outcome<()>) -> Outcome<()> {
        let (mut simulation, loaded) = self.scene.template.instantiate(seed);
        make(&mut simulation)?;
        self.rest();
        (self.simulation, self.loaded, self.seed) = (simulation, loaded, seed);
        Ok(())
    }

    /// Begins the run anew: what was spawned is gone.
    pub fn reset(&mut self, seed: Option<u64>) -> Outcome<()> {
        self.refuse_while_kept()?;
        self.begin_anew(seed.or(self.seed), |_| Ok(()))?;
        self.births.clear();
        Ok(())
    }

    /// Another world of the scene in the same state.
    pub fn fork(&mut self) -> Outcome<Self> {
        let state = snapshot::save(&mut self.simulation.world);
        let mut other = Self::new(self.scene.clone(), self.seed);
        snapshot::restore(&mut other.simulation.world, &state)?;
        Ok(other)
    }

    /// Begins to record; the recording's number.
    pub fn record(&mut self, path: &Path) -> Outcome<u64> {
        if !self.scene.overrides.is_empty() {
            let message = "expected a world whose clock, geo_origin and environment are those of the scene's file, by \
                           which recordings are replayed";
            return Err(Failure::value(message));
        }
        let template = &self.scene.template;
        self.stepper.record(path, (template.path(), template.files()), &mut self.simulation)?;
        self.recordings += 1;
        Ok(self.recordings)
    }

    /// Ends a recording, unless it has ended.
    pub fn finish_recording(&mut self, number: u64) -> Outcome<()> {
        if number == self.recordings { self.finish() } else { Ok(()) }
    }

    /// Ends a recording, if there is one.
    pub fn finish(&mut self) -> Outcome<()> {
        Ok(self.stepper.finish(&mut self.simulation)?)
    }

    /// Captures sensors, in one submission.
    pub fn capture(&mut self, wanted: Wanted<'_>) -> Outcome<Capture> {
        let mut captures = Self::capture_all(vec![(self, wanted)])?.into_iter();
        captures.next().ok_or_else(|| Failure::Gpu("nothing was captured".into()))
    }

    /// Captures sensors of several worlds, in one submission. Their watches note it.
    pub fn capture_all<'a>(worlds: Vec<(&'a mut Self, Wanted<'a>)>) -> Outcome<Vec<Capture>> {
        let split = |(world, wanted): (&'a mut Self, Wanted<'a>)| -> (Captured<'a>, &'a mut Watch) {
            ((&mut world.simulation, &mut world.sensors, wanted), &mut world.watch)
        };
        let (mut worlds, watches): (Vec<Captured<'a>>, Vec<_>) = worlds.into_iter().map(split).unzip();
        let captures = device::with_drawing(|drawing| drawing.capture(&Settings::default(), &mut worlds))?;
        for (((simulation, ..), watch), capture) in worlds.iter().zip(watches).zip(&captures) {
            watch.note(&simulation.world, capture);
        }
        Ok(captures)
    }

    /// Gives up what is uploaded of it, and what is kept of its sensors.
    pub fn rest(&mut self) {
        device::forget(self.simulation.draw_list().world);
        self.sensors = WorldSensors::default();
        self.watch.forget();
    }

    /// A component of an entity.
    pub fn component<T: relief::bevy_ecs::component::Component + Clone>(&self, id: StateId) -> Outcome<Option<T>> {
        Ok(self.simulation.world.get::<T>(self.entity(id)?).cloned())
    }
}

/// A world in which a recording is played.
pub struct Replay {
    world: World,
    stepper: Stepper,
    /// Warning of a recording that is not whole.
    pub warning: Option<String>,
}

impl Replay {
    /// At its beginning. `scene`: in the place of that which was recorded.
    pub fn begin(recording: &Path, scene: Option<&Path>) -> Outcome<Self> {
        let scene = scene.map_or_else(|| recording::scene_of(recording), |scene| Ok(scene.to_owned()))?;
        let seed = recording::seed_of(recording)?;
        let mut world = World::new(Arc::new(Scene::load(&scene, Overrides::default())?), Some(seed));
        let files = RunFiles { replay: Some(recording.to_owned()), ..RunFiles::default() };
        let template = &world.scene.template;
        let stepper = Stepper::begin(&files, (&scene, template.files()), 0, &mut world.simulation)?;
        let warning = stepper.recording().and_then(recording::Recording::warning);
        world.loaded.warnings.extend(warning.clone());
        Ok(Self { world, stepper, warning })
    }

    /// Takes so many steps, or fewer where the recording ends. Returns whether it has.
    pub fn step(&mut self, steps: u64) -> Outcome<bool> {
        for _ in 0..steps {
            if self.stepper.is_at_end(&self.world.simulation) {
                return Ok(true);
            }
            self.stepper.step(&mut self.world.simulation)?;
        }
        Ok(false)
    }

    /// The world at the end, every step of which came out as recorded.
    pub fn finish(mut self) -> Outcome<World> {
        self.stepper.finish(&mut self.world.simulation)?;
        Ok(self.world)
    }
}

impl Drop for World {
    fn drop(&mut self) {
        // A forked process has a recording's file from its parent, which goes on with it.
        if device::check_process().is_ok() {
            // Nobody is left to hear of it.
            let _ = self.finish();
        }
        device::forget(self.simulation.draw_list().world);
    }
}
