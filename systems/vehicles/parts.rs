//! What a vehicle consists of: entities below it, some of which move with it.

use super::lamps::{Lamp, LampKind};
use super::{Motion, Vehicle, VehicleTypes};
use crate::library::{MaterialId, MeshId};
use bevy_ecs::prelude::*;
use bevy_transform::components::Transform;
use glam::Quat;
use std::f64::consts::TAU;

/// One part of a [`super::VehicleType`].
#[derive(Clone, PartialEq, Debug)]
pub struct Part {
    /// As its node is called.
    pub name: String,
    /// The part that it is fixed to, one of those before it; `None`: the vehicle.
    pub parent: Option<usize>,
    /// `parent_from_part` while the vehicle stands straight.
    pub rest: Transform,
    /// What is drawn; the third value: for each paint of the type, the material in that paint. Empty: not painted.
    pub drawn: Vec<(MeshId, MaterialId, Vec<MaterialId>)>,
    /// How it moves against its parent.
    pub movement: Option<Movement>,
    /// What lamp it is.
    pub lamp: Option<PartLamp>,
}

/// A lamp of a type: the kind, its light, and its glass while it is on.
#[derive(Clone, PartialEq, Debug)]
pub struct PartLamp {
    /// When it is on.
    pub kind: LampKind,
    /// Its light while it is on, along the part's −Z; `None`: it only glows.
    pub light: Option<crate::components::Light>,
    /// For each of the part's `drawn`, its material while the lamp is on.
    pub lit: Vec<MaterialId>,
}

/// How a part of a vehicle moves against its parent.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Movement {
    /// Turns about X as the vehicle rolls, and about Y with the steering angle.
    Wheel {
        /// Metres rolled per radian.
        radius: f32,
        /// Whether it turns with the steering.
        steers: bool,
    },
    /// Turns about Y with the steering angle: a fork.
    Fork,
    /// Swings about X, as legs do.
    Swing {
        /// Radians to either side.
        angle: f32,
        /// Metres rolled per swing there and back.
        stride: f32,
        /// Of a swing, 0..1.
        phase: f32,
    },
    /// Turns about Y by the angle of the hitch.
    Trailer,
}

/// A part that moves with its vehicle's [`Motion`]; [`move_parts`] writes the entity's rotation.
#[derive(Component, Clone, Copy, PartialEq, Debug)]
#[require(Transform)]
pub struct MovingPart {
    /// The vehicle.
    pub vehicle: Entity,
    /// How.
    pub movement: Movement,
    /// The rotation at rest.
    pub rest: Quat,
}

/// Spawns the parts of a new vehicle below it.
pub(super) fn spawn(world: &mut World, entity: Entity) {
    let Some(&vehicle) = world.get::<Vehicle>(entity) else { return };
    world.resource_scope(|world, types: Mut<VehicleTypes>| {
        let mut spawned: Vec<Entity> = Vec::new();
        for part in &types.get(vehicle.kind).parts {
            let parent = part.parent.and_then(|index| spawned.get(index).copied()).unwrap_or(entity);
            spawned.push(spawn_part(world, part, vehicle, entity, parent));
        }
    });
}

fn spawn_part(world: &mut World, part: &Part, vehicle: Vehicle, root: Entity, parent: Entity) -> Entity {
    let mut entity = world.spawn((part.rest, ChildOf(parent)));
    if let Some(movement) = part.movement {
        entity.insert(MovingPart { vehicle: root, movement, rest: part.rest.rotation });
    }
    let own = part.lamp.as_ref().and_then(|lamp| lamp.light.clone());
    if let Some(light) = own {
        entity.insert(crate::components::Light { enabled: false, ..light });
    }
    let material = |&(mesh, plain, ref painted): &(MeshId, MaterialId, Vec<MaterialId>)| {
        let paint = painted.len().checked_sub(1).map(|_| painted[vehicle.paint as usize % painted.len()]);
        (mesh, paint.unwrap_or(plain))
    };
    let lamp = |index: usize, dark: Option<MaterialId>| {
        part.lamp.as_ref().map(|lamp| Lamp {
            vehicle: root,
            kind: lamp.kind,
            intensity: lamp.light.as_ref().map_or(0.0, |light| light.intensity),
            glass: dark.zip(lamp.lit.get(index).copied()),
        })
    };
    // One thing to draw needs no entity beside the part's.
    if let [drawn] = part.drawn.as_slice() {
        entity.insert(material(drawn));
        lamp(0, Some(drawn.1)).into_iter().for_each(|lamp| _ = entity.insert(lamp));
        return entity.id();
    }
    lamp(0, None).into_iter().for_each(|lamp| _ = entity.insert(lamp));
    let entity = entity.id();
    for (index, drawn) in part.drawn.iter().enumerate() {
        let mut below = world.spawn((material(drawn), ChildOf(entity)));
        lamp(index, Some(drawn.1)).into_iter().for_each(|lamp| _ = below.insert(lamp));
    }
    entity
}

/// Turns wheels, forks, legs and trailers as their vehicles moved; what did not move is not written.
pub fn move_parts(vehicles: Query<&Motion>, mut parts: Query<(&MovingPart, &mut Transform)>) {
    parts.par_iter_mut().for_each(|(part, mut transform)| {
        let Ok(motion) = vehicles.get(part.vehicle) else { return };
        let rotation = part.movement.rotation(motion) * part.rest;
        if transform.rotation != rotation {
            transform.rotation = rotation;
        }
    });
}

impl Movement {
    /// `rest_from_moved`: the turn in the parent's space.
    fn rotation(self, motion: &Motion) -> Quat {
        match self {
            Self::Wheel { radius, steers } => {
                let angle = (motion.rolled / f64::from(radius)).rem_euclid(TAU) as f32;
                let roll = Quat::from_rotation_x(angle);
                if steers { Quat::from_rotation_y(motion.steering) * roll } else { roll }
            }
            Self::Fork => Quat::from_rotation_y(motion.steering),
            Self::Swing { angle, stride, phase } => {
                let turns = motion.rolled / f64::from(stride) + f64::from(phase);
                Quat::from_rotation_x(angle * (turns.fract() * TAU).sin() as f32)
            }
            Self::Trailer => Quat::from_rotation_y(motion.hitch),
        }
    }
}
