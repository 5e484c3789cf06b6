//! Spawning of entities while a simulation runs, described by data: a recording holds it, and a snapshot brings it back
//! by building it again.

use super::registry::{EntityRegistry, StateId};
use crate::assets::material::MaterialId;
use crate::assets::mesh::MeshId;
use crate::draw::pieces::{PieceOf, WholeMesh};
use crate::lights::components::{Light, NoShadow};
use crate::sensors::components::Sensor;
use crate::sensors::labels::{Class, Instance};
use crate::space::transform::Transform;
#[cfg(feature = "vehicles")]
use crate::vehicles::components::{Controls, FASTEST, Motion, OnRoute};
#[cfg(feature = "vehicles")]
use crate::vehicles::routes::Routes;
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
        /// The light component.
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
        /// Index of the type's paint; counted round.
        paint: u32,
        /// Initial controls.
        controls: Controls,
        /// Set if it goes by its controls even where it has a route.
        manual: bool,
    },
    /// A sensor, on its own or mounted on something.
    Sensor {
        /// Below that of what it is mounted on; outputs call it so.
        name: String,
        /// In what it is mounted on, else in the world.
        transform: Transform,
        /// Entity that it is mounted on; where nothing is there, it stands alone.
        parent: Option<StateId>,
        /// Measurement and its timing.
        sensor: Sensor,
    },
    /// Drawn copy of an entity that the scene began with, and of the entities below it.
    Copy {
        /// For people.
        name: String,
        /// In the world.
        transform: Transform,
        /// Entity that is copied; of another than the scene's own nothing is drawn.
        of: StateId,
    },
    /// A vehicle on a route.
    #[cfg(feature = "vehicles")]
    Driver {
        /// For people.
        name: String,
        /// The name of its type; the stand-in where there is none of that name.
        kind: String,
        /// Index of the type's paint; counted round.
        paint: u32,
        /// Place on the route where it starts.
        on: OnRoute,
        /// Metres per second along its own forward, 0 to [`FASTEST`].
        speed: f64,
        /// Set if it goes by its controls all the same.
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
            #[cfg(feature = "vehicles")]
            Self::Driver { name, kind, paint, on, speed, manual } => {
                let routes = world.resource::<Routes>();
                let (stands, (place, yaw)) = (routes.stand(on), routes.stand_at(on));
                let motion = Motion { place, yaw, speed: *speed, ..Motion::default() };
                let others = (Name::new(name.clone()), stands, motion, *on);
                vec![super::vehicle_inputs::spawn(world, kind, *paint, *manual, others)]
            }
            Self::Sensor { name, transform, parent, sensor } => {
                let mounted_on = parent.and_then(|parent| living(world, parent));
                let mut built = world.spawn((Name::new(name.clone()), *transform, sensor.clone()));
                if let Some(parent) = mounted_on {
                    built.insert(ChildOf(parent));
                }
                vec![built.id()]
            }
            Self::Copy { name, transform, of } => {
                let root = world.spawn((Name::new(name.clone()), *transform)).id();
                if of.0 < world.resource::<EntityRegistry>().scene_len()
                    && let Some(drawn) = living(world, *of)
                {
                    copy_drawn(world, drawn, root);
                }
                vec![root]
            }
        }
    }

    /// Tells if its numbers are finite and in range.
    pub(crate) fn is_valid(&self) -> bool {
        match self {
            Self::Light { transform, light, .. } => transform.is_valid() && light.is_valid(),
            #[cfg(feature = "vehicles")]
            Self::Vehicle { transform, controls, .. } => transform.is_valid() && controls.is_valid(),
            #[cfg(feature = "vehicles")]
            Self::Driver { on, speed, .. } => on.is_valid() && (0.0..=FASTEST).contains(speed),
            Self::Sensor { transform, sensor, .. } => transform.is_valid() && sensor.faults().is_empty(),
            Self::Copy { transform, .. } => transform.is_valid(),
        }
    }
}

fn living(world: &World, id: StateId) -> Option<Entity> {
    let entity = world.resource::<EntityRegistry>().entity(id)?;
    world.get_entity(entity).is_ok().then_some(entity)
}

/// Gives an entity, and entities that are made below it, what others are drawn with and called.
fn copy_drawn(world: &mut World, from: Entity, to: Entity) {
    // With as many as a scene may have below an entity, which is a tree.
    let mut open = vec![(from, to)];
    while let Some((from, to)) = open.pop() {
        let own = world.entity(from);
        let whole = own.get::<WholeMesh>().map(|whole| whole.mesh);
        let drawn = (own.get::<MeshId>().copied().or(whole), own.get::<MaterialId>().copied());
        let labels = (own.get::<Class>().copied(), own.contains::<Instance>(), own.contains::<NoShadow>());
        let children: Vec<(Entity, Transform)> = own.get::<Children>().map_or_else(Vec::new, |children| {
            let placed = |child| Some((child, *world.get::<Transform>(child)?));
            let is_whole = |&child: &Entity| world.get::<PieceOf>(child).is_none();
            children.iter().filter(is_whole).filter_map(placed).collect()
        });
        let mut made = world.entity_mut(to);
        if let (Some(mesh), Some(material)) = drawn {
            made.insert((mesh, material));
        }
        if let Some(class) = labels.0 {
            made.insert(class);
        }
        if labels.1 {
            made.insert(Instance);
        }
        if labels.2 {
            made.insert(NoShadow);
        }
        for (child, at) in children {
            let below = world.spawn((at, ChildOf(to))).id();
            open.push((child, below));
        }
    }
}
