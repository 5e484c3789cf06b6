//! A world under a lock: what all objects of Python that belong to a `Sim` work on, away from the interpreter.

use crate::errors::{Failure, Outcome};
use crate::worlds::device;
#[cfg(target_os = "linux")]
use crate::worlds::lending::{self, Lent};
use crate::worlds::watch::Watch;
use pyo3::prelude::*;
use relief::bevy_ecs::name::Name;
use relief::bevy_ecs::prelude::{ChildOf, Entity};
use relief::glam::{DAffine3, DVec3};
use relief::recording::{self, Recording, RunFiles};
#[cfg(target_os = "linux")]
use relief::renderer::PackedLayout;
use relief::renderer::Settings;
use relief::scene::{Overrides, Template};
use relief::sense::{Capture, Captured, Wanted, WorldSensors};
use relief::session::Session;
use relief::systems::run::inputs::Input;
use relief::systems::run::registry::{EntityRegistry, StateId};
use relief::systems::run::spawn::Spawn;
use relief::systems::space::Transform;
use relief::systems::space::origin::Origin;
use std::collections::HashMap;
use std::ops::{Deref, DerefMut};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A session, and what objects of Python need to know of it.
pub struct World {
    session: Session,
    pub sensors: WorldSensors,
    pub watch: Watch,
    /// Spawn number of each spawned entity, counted from 1: ids are given again after a reset.
    births: HashMap<StateId, u64>,
    spawned: u64,
    /// Recordings that were begun.
    recordings: u64,
}

/// A world of Python is a session to those who step, look and change.
impl Deref for World {
    type Target = Session;

    fn deref(&self) -> &Session {
        &self.session
    }
}

impl DerefMut for World {
    fn deref_mut(&mut self) -> &mut Session {
        &mut self.session
    }
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
    /// At the beginning of a scene. `overrides`: in the place of its file's own fields.
    pub fn load(path: &Path, overrides: &Overrides, seed: Option<u64>) -> Outcome<Self> {
        Ok(Self::of(Session::of(Arc::new(Template::load_with(path, overrides)?), seed)))
    }

    pub fn of(session: Session) -> Self {
        Self {
            session,
            sensors: WorldSensors::default(),
            watch: Watch::default(),
            births: HashMap::new(),
            spawned: 0,
            recordings: 0,
        }
    }

    /// Origin of the world's coordinates, in the scene's.
    pub fn origin(&self) -> DVec3 {
        self.simulation.world.resource::<Origin>().0
    }

    pub fn step(&mut self, steps: u64) -> Outcome<u64> {
        for _ in 0..steps {
            self.session.step()?;
        }
        Ok(self.step_number())
    }

    /// Applies an input at once; a recording has it.
    pub fn apply<T: Input>(&mut self, input: T) -> Outcome<()> {
        if !input.is_valid() {
            return Err(Failure::value(format!("{}: expected finite numbers within their ranges", T::NAME)));
        }
        Ok(self.session.apply(input)?)
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
        let world = &self.simulation.world;
        let all = world.resource::<EntityRegistry>().iter();
        let named: Vec<(StateId, &str)> =
            all.filter_map(|(id, entity)| Some((id, world.get::<Name>(entity)?.as_str()))).collect();
        named.iter().find(|(_, own)| *own == name).map(|(id, _)| *id).ok_or_else(|| {
            let names: Vec<&str> = named.iter().map(|(_, own)| *own).collect();
            Failure::Name(format!("unknown entity {name:?}{}", relief::name::hint(&names, name)))
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

    /// Makes the state that of a snapshot. Where that fails it is as it was.
    pub fn restore(&mut self, bytes: &[u8]) -> Outcome<()> {
        self.change(|session| session.restore(bytes))?;
        // Spawned entities that are not in the state at hand.
        let next = self.simulation.world.resource::<EntityRegistry>().next_id();
        self.births.retain(|id, _| id.0 < next.0);
        Ok(())
    }

    /// Begins the run anew: what was spawned is gone.
    pub fn reset(&mut self, seed: Option<u64>) -> Outcome<()> {
        self.change(|session| session.reset(seed))?;
        self.births.clear();
        Ok(())
    }

    /// Reads the scene's files anew, and begins the run anew. Numbers of recordings are not given again.
    pub fn reload(&mut self) -> Outcome<()> {
        let recordings = self.recordings;
        *self = Self::of(self.reloaded()?);
        self.recordings = recordings;
        Ok(())
    }

    /// Does what may put another world in the place of this one, of which nothing is kept then.
    fn change<T, E: Into<Failure>>(&mut self, work: impl FnOnce(&mut Session) -> Result<T, E>) -> Outcome<T> {
        let before = self.simulation.draw_list().world;
        let done = work(&mut self.session);
        if self.simulation.draw_list().world != before {
            self.forget(before);
        }
        done.map_err(Into::into)
    }

    /// Begins to record; the recording's number.
    pub fn record(&mut self, path: &Path) -> Outcome<u64> {
        self.session.record(path)?;
        self.recordings += 1;
        Ok(self.recordings)
    }

    /// Ends a recording, unless it has ended.
    pub fn finish_recording(&mut self, number: u64) -> Outcome<()> {
        if number == self.recordings { Ok(self.finish()?) } else { Ok(()) }
    }

    /// Captures sensors, in one submission.
    pub fn capture(&mut self, wanted: Wanted<'_>) -> Outcome<Capture> {
        let mut captures = Self::capture_all(vec![(self, wanted)])?.into_iter();
        captures.next().ok_or_else(|| Failure::Gpu("nothing was captured".into()))
    }

    /// The parts of it that a capture takes, and the watch that notes it.
    fn captured<'a>(&'a mut self, wanted: Wanted<'a>) -> (Captured<'a>, &'a mut Watch) {
        ((&mut self.session.simulation, &mut self.sensors, wanted), &mut self.watch)
    }

    /// Captures a camera of each of several worlds into memory of the graphics device. `scale`: of steps of depths.
    /// Their watches note it.
    #[cfg(target_os = "linux")]
    pub fn share_all<'a>(
        worlds: Vec<(&'a mut Self, Wanted<'a>)>,
        scale: Vec<f32>,
    ) -> Outcome<(PackedLayout, Arc<Lent>)> {
        let (mut worlds, watches): (Vec<Captured<'a>>, Vec<_>) =
            worlds.into_iter().map(|(world, wanted)| world.captured(wanted)).unzip();
        let shared = device::with_drawing(|drawing| {
            let plan = drawing.plan_pack(&Settings::default(), &mut worlds, scale)?;
            let gpu = drawing.open()?;
            plan.layout().check(&gpu.device)?;
            let lent = lending::lend(gpu, plan.layout().bytes);
            let shared = lent.map(|lent| {
                drawing.pack(&mut worlds, &plan, lent.buffer.buffer())?;
                Ok((plan.layout().clone(), lent))
            });
            shared.map_or_else(|failure| Ok(Err(failure)), |shared| shared.map(Ok))
        })??;
        for ((simulation, ..), watch) in worlds.iter().zip(watches) {
            watch.note_look(&simulation.world);
        }
        Ok(shared)
    }

    /// Captures sensors of several worlds, in one submission. Their watches note it.
    pub fn capture_all<'a>(worlds: Vec<(&'a mut Self, Wanted<'a>)>) -> Outcome<Vec<Capture>> {
        let (mut worlds, watches): (Vec<Captured<'a>>, Vec<_>) =
            worlds.into_iter().map(|(world, wanted)| world.captured(wanted)).unzip();
        let captures = device::with_drawing(|drawing| drawing.capture(&Settings::default(), &mut worlds))?;
        for (((simulation, ..), watch), capture) in worlds.iter().zip(watches).zip(&captures) {
            watch.note(&simulation.world, capture);
        }
        Ok(captures)
    }

    /// Gives up what is uploaded of it, and what is kept of its sensors.
    pub fn rest(&mut self) {
        self.forget(self.simulation.draw_list().world);
    }

    fn forget(&mut self, world: u64) {
        device::forget(world);
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
    /// Warning of a recording that is not whole.
    pub warning: Option<String>,
}

impl Replay {
    /// At its beginning. `scene`: in the place of that which was recorded.
    pub fn begin(recording: &Path, scene: Option<&Path>) -> Outcome<Self> {
        let recorded = recording::identity_of(recording)?;
        let scene = scene.unwrap_or(Path::new(&recorded.scene));
        let mut world = World::load(scene, &Overrides::default(), Some(recorded.seed))?;
        world.begin(&RunFiles { replay: Some(recording.to_owned()), ..RunFiles::default() }, 0)?;
        let warning = world.recording().and_then(Recording::warning);
        Ok(Self { world, warning })
    }

    /// Takes so many steps, or fewer where the recording ends. Returns whether it has.
    pub fn step(&mut self, steps: u64) -> Outcome<bool> {
        for _ in 0..steps {
            if !self.world.play()? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The world at the end, every step of which came out as recorded.
    pub fn finish(mut self) -> Outcome<World> {
        self.world.finish()?;
        // Told when it was recorded.
        self.world.take_warnings();
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
