//! The inputs that every simulation knows: edits of lights, portals, places, visibility and weather, what comes and
//! goes, manual control of vehicles, and signals that are held.

use super::inputs::{Input, Inputs};
use super::registry::{self, EntityRegistry, StateId};
use super::spawn::Spawn;
#[cfg(feature = "vehicles")]
use super::vehicle_inputs;
use crate::assets::mesh::{MeshId, MeshVariants};
use crate::cells::doors::{Door, Portal};
use crate::describe::check::check;
use crate::ecs::clock::Clock;
use crate::lights::components::Light;
use crate::space::geo_origin::GeoOrigin;
use crate::space::hidden::Hidden;
use crate::space::interpolation::{Interpolated, Moved};
use crate::space::transform::Transform;
#[cfg(feature = "vehicles")]
use crate::vehicles::components::Controls;
#[cfg(feature = "vehicles")]
use crate::vehicles::external::StampedMotion;
#[cfg(feature = "vehicles")]
use crate::vehicles::signals::Aspect;
use crate::weather::timeline::WeatherTimeline;
use crate::weather::weather::Weather;
use bevy_ecs::prelude::*;
use serde::{Deserialize, Serialize};

/// With all types of this file.
impl Default for Inputs {
    fn default() -> Self {
        let mut inputs = Self::empty();
        inputs.register::<EditLight>();
        inputs.register::<SetPortal>();
        inputs.register::<SetTransform>();
        inputs.register::<Hide>();
        inputs.register::<NextMeshVariant>();
        inputs.register::<SetWeather>();
        #[cfg(feature = "vehicles")]
        inputs.register::<Drive>();
        #[cfg(feature = "vehicles")]
        inputs.register::<SetManualControl>();
        #[cfg(feature = "vehicles")]
        inputs.register::<MoveVehicle>();
        #[cfg(feature = "vehicles")]
        inputs.register::<ReleaseVehicle>();
        #[cfg(feature = "vehicles")]
        inputs.register::<SetSignal>();
        inputs.register::<Spawn>();
        inputs.register::<Despawn>();
        inputs
    }
}

/// Queues an input about an entity. Nothing is queued for one that was not registered.
pub fn push_for<T: Input>(world: &mut World, entity: Entity, input: impl FnOnce(StateId) -> T) {
    if let Some(id) = world.resource::<EntityRegistry>().id(entity) {
        world.resource_mut::<Inputs>().push(input(id));
    }
}

/// A light gets other settings.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct EditLight {
    /// Whose.
    pub entity: StateId,
    /// All of them.
    pub light: Light,
}

impl Input for EditLight {
    const NAME: &'static str = "edit light";

    fn apply(&self, world: &mut World) {
        if let Some(mut edited) = find(world, self.entity).and_then(|entity| world.get_mut::<Light>(entity)) {
            edited.set_if_neq(self.light.clone());
        }
    }

    fn is_valid(&self) -> bool {
        self.light.is_valid()
    }
}

/// A portal is opened or shut. One that did so by itself does no more.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct SetPortal {
    /// Portal.
    pub entity: StateId,
    /// [`Portal::open`].
    pub open: f32,
}

impl Input for SetPortal {
    const NAME: &'static str = "set portal";

    fn apply(&self, world: &mut World) {
        let Some(entity) = find(world, self.entity) else { return };
        let Some(mut portal) = world.get_mut::<Portal>(entity) else { return };
        portal.set_if_neq(Portal { open: self.open });
        if let Some(mut door) = world.get_mut::<Door>(entity) {
            door.period = 0.0;
        }
    }

    fn is_valid(&self) -> bool {
        check(&Portal { open: self.open }).is_ok()
    }
}

/// Something is put elsewhere at once.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct SetTransform {
    /// Entity that is moved.
    pub entity: StateId,
    /// Relative to its parent.
    pub transform: Transform,
}

impl Input for SetTransform {
    const NAME: &'static str = "set transform";

    fn apply(&self, world: &mut World) {
        let Some(entity) = find(world, self.entity) else { return };
        let has_moved = world.get::<Transform>(entity).is_some_and(|placed| *placed != self.transform);
        if let Some(mut placed) = world.get_mut::<Transform>(entity) {
            *placed = self.transform;
        }
        if has_moved && world.get::<Interpolated>(entity).is_none() {
            world.entity_mut(entity).insert(Moved);
        }
        #[cfg(feature = "vehicles")]
        vehicle_inputs::put(world, entity, self.transform);
        if let Some(mut interpolated) = world.get_mut::<Interpolated>(entity) {
            interpolated.jump();
        }
    }

    fn is_valid(&self) -> bool {
        self.transform.is_valid()
    }
}

/// Something is hidden, or shown again.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Hide {
    /// Entity that is hidden or shown.
    pub entity: StateId,
    /// New state.
    pub hidden: bool,
}

impl Input for Hide {
    const NAME: &'static str = "hide";

    fn apply(&self, world: &mut World) {
        let Some(entity) = find(world, self.entity) else { return };
        let mut entity = world.entity_mut(entity);
        if self.hidden {
            entity.insert(Hidden)
        } else {
            entity.remove::<Hidden>()
        };
    }
}

/// Every entity with mesh variants shows its next one.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct NextMeshVariant;

impl Input for NextMeshVariant {
    const NAME: &'static str = "next figure";

    fn apply(&self, world: &mut World) {
        let mut figures = world.query::<(&mut MeshVariants, &mut MeshId)>();
        for (mut figure, mut mesh) in figures.iter_mut(world) {
            figure.shown = (figure.shown + 1) % figure.meshes.len().max(1);
            if let Some(&shown) = figure.meshes.get(figure.shown) {
                *mesh = shown;
            }
        }
    }
}

/// The weather becomes another.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct SetWeather {
    /// All of it, as it will be; its date is that of now.
    pub weather: Weather,
    /// Seconds of the clock that the change takes.
    pub over_seconds: f64,
}

impl SetWeather {
    /// The longest change: a day.
    pub const LONGEST: f64 = 86_400.0;
}

impl Input for SetWeather {
    const NAME: &'static str = "set weather";

    /// Changes nothing where the sun is to stand by its date and no [`GeoOrigin`] says where on Earth that is.
    fn apply(&self, world: &mut World) {
        if self.weather.needs_place() && world.get_resource::<GeoOrigin>().is_none() {
            return;
        }
        let clock = world.resource::<Clock>().clone();
        world.resource_mut::<WeatherTimeline>().change(self.weather.clone(), self.over_seconds, &clock);
    }

    fn is_valid(&self) -> bool {
        check(&self.weather).is_ok() && (0.0..=Self::LONGEST).contains(&self.over_seconds)
    }
}

/// Other controls under manual control.
#[cfg(feature = "vehicles")]
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Drive {
    /// Driven vehicle.
    pub vehicle: StateId,
    /// New controls.
    pub controls: Controls,
}

#[cfg(feature = "vehicles")]
impl Input for Drive {
    const NAME: &'static str = "drive";

    fn apply(&self, world: &mut World) {
        let vehicle = find(world, self.vehicle).and_then(|vehicle| world.get_mut::<Controls>(vehicle));
        vehicle.into_iter().for_each(|mut own| *own = self.controls);
    }

    fn is_valid(&self) -> bool {
        self.controls.is_valid()
    }
}

/// Begins or ends manual control of a vehicle that has a route.
#[cfg(feature = "vehicles")]
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct SetManualControl {
    /// Vehicle.
    pub vehicle: StateId,
    /// New state.
    pub manual: bool,
}

#[cfg(feature = "vehicles")]
impl Input for SetManualControl {
    const NAME: &'static str = "take wheel";

    fn apply(&self, world: &mut World) {
        let Some(vehicle) = find(world, self.vehicle) else { return };
        vehicle_inputs::set_manual_control(world, vehicle, self.manual);
    }
}

/// A vehicle's pose from outside, which moves it from the next step on. Nothing changes where its stamp is not newer
/// than the one before, or farther from the clock than [`STALE`](crate::vehicles::external::STALE).
#[cfg(feature = "vehicles")]
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct MoveVehicle {
    /// Vehicle.
    pub vehicle: StateId,
    /// Pose, velocity and stamp.
    pub motion: StampedMotion,
}

#[cfg(feature = "vehicles")]
impl Input for MoveVehicle {
    const NAME: &'static str = "move vehicle";

    fn apply(&self, world: &mut World) {
        let Some(vehicle) = find(world, self.vehicle) else { return };
        vehicle_inputs::move_vehicle(world, vehicle, &self.motion);
    }

    fn is_valid(&self) -> bool {
        self.motion.is_valid()
    }
}

/// Nothing from outside moves a vehicle any more: it goes on by its controls or its route.
#[cfg(feature = "vehicles")]
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct ReleaseVehicle(pub StateId);

#[cfg(feature = "vehicles")]
impl Input for ReleaseVehicle {
    const NAME: &'static str = "release vehicle";

    fn apply(&self, world: &mut World) {
        let Some(vehicle) = find(world, self.0) else { return };
        vehicle_inputs::release(world, vehicle);
    }
}

/// A traffic signal is held, or goes on by its times.
#[cfg(feature = "vehicles")]
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct SetSignal {
    /// Its name.
    pub signal: String,
    /// Aspect of each of its groups from now on; `None` releases it. With another number of groups than it has, nothing
    /// changes.
    pub shows: Option<Vec<Aspect>>,
}

#[cfg(feature = "vehicles")]
impl Input for SetSignal {
    const NAME: &'static str = "set signal";

    fn apply(&self, world: &mut World) {
        vehicle_inputs::set_signal(world, &self.signal, self.shows.as_deref());
    }
}

/// Something comes into being.
impl Input for Spawn {
    const NAME: &'static str = "spawn";

    fn apply(&self, world: &mut World) {
        registry::spawn(world, self.clone());
    }

    fn is_valid(&self) -> bool {
        Self::is_valid(self)
    }
}

/// Something goes, with all that is below it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Despawn(pub StateId);

impl Input for Despawn {
    const NAME: &'static str = "despawn";

    fn apply(&self, world: &mut World) {
        registry::despawn(world, self.0);
    }
}

fn find(world: &World, id: StateId) -> Option<Entity> {
    let entity = world.resource::<EntityRegistry>().entity(id)?;
    world.get_entity(entity).is_ok().then_some(entity)
}
