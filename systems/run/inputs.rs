//! What changes the world from outside: the only way from a window, a recording or a program into a running
//! simulation, so that a recording of the inputs is a recording of the run.
//!
//! [`Inputs::push`] queues; [`apply_queued`] applies, between steps: the first system of the step schedule does it, and
//! a window does it in every frame, so that an edit shows while the clock stands. Nothing happens between two steps
//! that steps read, so it makes no difference when between them an input comes.

use super::roster::{self, Roster, StateId};
use super::spawn::Spawn;
#[cfg(feature = "vehicles")]
use super::vehicle_inputs;
use crate::assets::mesh::{Figure, MeshId};
use crate::lights::components::Light;
use crate::space::hidden::Hidden;
use crate::space::interpolation::Interpolated;
use crate::space::transform::Transform;
#[cfg(feature = "vehicles")]
use crate::vehicles::components::Controls;
use bevy_ecs::prelude::*;
use serde::{Deserialize, Serialize};

/// A change from outside. One that names an entity that is gone, or has no such component, changes nothing.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub enum Input {
    /// A light gets other settings.
    EditLight {
        /// Whose.
        entity: StateId,
        /// All of them.
        light: Light,
    },
    /// Something is put elsewhere at once.
    SetTransform {
        /// What.
        entity: StateId,
        /// Relative to its parent.
        transform: Transform,
    },
    /// Something is hidden, or shown again.
    Hide {
        /// What.
        entity: StateId,
        /// Whether it is hidden now.
        hidden: bool,
    },
    /// Every entity with mesh variants shows its next one.
    NextFigure,
    /// Other controls under manual control.
    #[cfg(feature = "vehicles")]
    Drive {
        /// What is driven.
        vehicle: StateId,
        /// What is wanted.
        controls: Controls,
    },
    /// Begins or ends manual control of a vehicle that has a route.
    #[cfg(feature = "vehicles")]
    TakeWheel {
        /// Which.
        vehicle: StateId,
        /// Whether it is under manual control now.
        by_hand: bool,
    },
    /// Something comes into being.
    Spawn(Spawn),
    /// Something goes, with all that is below it.
    Despawn(StateId),
}

/// Inputs that wait for the time between two steps.
#[derive(Resource, Default, Debug)]
pub struct Inputs {
    queued: Vec<Input>,
}

impl Inputs {
    /// Queues an input.
    pub fn push(&mut self, input: Input) {
        self.queued.push(input);
    }

    /// Whether nothing waits.
    pub fn is_empty(&self) -> bool {
        self.queued.is_empty()
    }

    /// Forgets what is queued.
    pub fn clear(&mut self) {
        self.queued.clear();
    }
}

/// Queues other settings for an entity's light. Nothing is queued for an entity that was not registered.
pub fn edit_light(world: &mut World, entity: Entity, light: Light) {
    if let Some(entity) = world.resource::<Roster>().id(entity) {
        world.resource_mut::<Inputs>().push(Input::EditLight { entity, light });
    }
}

/// Applies what is queued, in order, and returns it.
pub fn apply_queued(world: &mut World) -> Vec<Input> {
    if world.resource::<Inputs>().queued.is_empty() {
        return Vec::new();
    }
    let mut queued = std::mem::take(&mut world.resource_mut::<Inputs>().queued);
    queued.retain(Input::is_sound);
    queued.iter().for_each(|input| apply(world, input));
    queued
}

/// The first system of a step.
pub(crate) fn apply_inputs(world: &mut World) {
    apply_queued(world);
}

fn apply(world: &mut World, input: &Input) {
    match input {
        Input::EditLight { entity, light } => {
            if let Some(mut edited) = find(world, *entity).and_then(|entity| world.get_mut::<Light>(entity)) {
                edited.set_if_neq(light.clone());
            }
        }
        Input::SetTransform { entity, transform } => set_transform(world, *entity, *transform),
        Input::Hide { entity, hidden } => {
            let Some(entity) = find(world, *entity) else { return };
            let mut entity = world.entity_mut(entity);
            if *hidden {
                entity.insert(Hidden)
            } else {
                entity.remove::<Hidden>()
            };
        }
        Input::NextFigure => next_figure(world),
        #[cfg(feature = "vehicles")]
        Input::Drive { vehicle, controls } => {
            let vehicle = find(world, *vehicle).and_then(|vehicle| world.get_mut::<Controls>(vehicle));
            vehicle.into_iter().for_each(|mut own| *own = *controls);
        }
        #[cfg(feature = "vehicles")]
        Input::TakeWheel { vehicle, by_hand } => {
            let Some(vehicle) = find(world, *vehicle) else { return };
            vehicle_inputs::take_wheel(world, vehicle, *by_hand);
        }
        Input::Spawn(spawn) => _ = roster::spawn(world, spawn.clone()),
        Input::Despawn(entity) => roster::despawn(world, *entity),
    }
}

fn find(world: &World, id: StateId) -> Option<Entity> {
    let entity = world.resource::<Roster>().entity(id)?;
    world.get_entity(entity).is_ok().then_some(entity)
}

fn set_transform(world: &mut World, id: StateId, transform: Transform) {
    let Some(entity) = find(world, id) else { return };
    if let Some(mut placed) = world.get_mut::<Transform>(entity) {
        *placed = transform;
    }
    #[cfg(feature = "vehicles")]
    vehicle_inputs::put(world, entity, transform);
    if let Some(mut interpolated) = world.get_mut::<Interpolated>(entity) {
        interpolated.jump();
    }
}

fn next_figure(world: &mut World) {
    let mut figures = world.query::<(&mut Figure, &mut MeshId)>();
    for (mut figure, mut mesh) in figures.iter_mut(world) {
        figure.shown = (figure.shown + 1) % figure.meshes.len().max(1);
        if let Some(&shown) = figure.meshes.get(figure.shown) {
            *mesh = shown;
        }
    }
}

impl Input {
    /// Whether its numbers are numbers. Others are dropped: they may come from a file.
    fn is_sound(&self) -> bool {
        match self {
            Self::EditLight { light, .. } => light.is_sound(),
            Self::SetTransform { transform, .. } => transform.is_finite(),
            Self::Spawn(spawn) => spawn.is_sound(),
            #[cfg(feature = "vehicles")]
            Self::Drive { controls, .. } => controls.is_sound(),
            #[cfg(feature = "vehicles")]
            Self::TakeWheel { .. } => true,
            Self::Hide { .. } | Self::NextFigure | Self::Despawn(_) => true,
        }
    }
}
