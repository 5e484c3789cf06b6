//! What can come into being while a simulation runs, described by data: a recording holds it, and a snapshot brings it
//! back by building it again.

use crate::lights::components::Light;
use crate::space::transform::Transform;
#[cfg(feature = "vehicles")]
use crate::vehicles::components::Controls;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use serde::{Deserialize, Serialize};

/// Something to spawn. Equal ones build equal entities in worlds that began with the same scene.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub enum Spawn {
    /// A light.
    Light {
        /// For people.
        name: String,
        /// In the world.
        transform: Transform,
        /// What it shines like.
        light: Light,
    },
    /// A vehicle, under manual control or not.
    #[cfg(feature = "vehicles")]
    Vehicle {
        /// For people.
        name: String,
        /// In the world, the middle of the rear axle.
        transform: Transform,
        /// The name of its type; the stand-in where there is none of that name.
        kind: String,
        /// Which of the type's paints; counted round.
        paint: u32,
        /// How it stands there.
        controls: Controls,
        /// Whether it goes by its controls even where it has a route.
        manual: bool,
    },
}

impl Spawn {
    /// Makes the entities; returns those that hang below no other. By [`crate::run::registry::spawn`], which numbers
    /// them.
    pub(crate) fn build(&self, world: &mut World) -> Vec<Entity> {
        match self {
            Self::Light { name, transform, light } => {
                vec![world.spawn((Name::new(name.clone()), *transform, light.clone())).id()]
            }
            #[cfg(feature = "vehicles")]
            Self::Vehicle { name, transform, kind, paint, controls, manual } => {
                let others = (Name::new(name.clone()), *transform, *controls);
                vec![super::vehicle_inputs::spawn(world, kind, *paint, *manual, others)]
            }
        }
    }

    /// Whether its numbers are numbers.
    pub(crate) fn is_sound(&self) -> bool {
        match self {
            Self::Light { transform, light, .. } => transform.is_finite() && light.is_sound(),
            #[cfg(feature = "vehicles")]
            Self::Vehicle { transform, controls, .. } => transform.is_finite() && controls.is_sound(),
        }
    }
}
