//! What can come into being while a simulation runs, described by data: a recording holds it, and a snapshot brings it
//! back by building it again.

use crate::components::Light;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use bevy_transform::components::Transform;
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
}

impl Spawn {
    /// Makes the entities; returns those that hang below no other. By [`crate::roster::spawn`], which numbers them.
    pub(crate) fn build(&self, world: &mut World) -> Vec<Entity> {
        match self {
            Self::Light { name, transform, light } => {
                vec![world.spawn((Name::new(name.clone()), *transform, light.clone())).id()]
            }
        }
    }

    /// Whether its numbers are numbers.
    pub(crate) fn is_sound(&self) -> bool {
        match self {
            Self::Light { transform, light, .. } => transform.is_finite() && light.is_sound(),
        }
    }
}
