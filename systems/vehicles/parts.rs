//! Parts of a vehicle: entities below it, some of which move with it.

use super::components::{Controls, Motion, Vehicle, VehicleNumber, VehicleTypeId, Wanted};
use super::lamps::{Lamp, LampKind, Switches};
use super::turns::{about_x, about_y};
use super::types::VehicleTypes;
use crate::assets::material::MaterialId;
use crate::assets::mesh::MeshId;
use crate::draw::pieces::PieceOf;
use crate::ecs::changes::{LIGHT_ROWS, Since, rows_per_task};
use crate::ecs::clock::Clock;
use crate::ecs::columns::Column;
use crate::ecs::parallel::in_parallel;
use crate::lights::components::Light;
use crate::sensors::labels::{Class, Classes, Instance};
use crate::space::interpolation::{Interpolated, Interpolation};
use crate::space::transform::Transform;
use bevy_ecs::change_detection::ContiguousRef;
use bevy_ecs::prelude::*;
use bevy_ecs::query::ArchetypeFilter;
use glam::Quat;
use std::f64::consts::TAU;

/// The class of trailers, if there is one of that name.
const TRAILER: &str = "trailer";

/// One part of a [`crate::vehicles::types::VehicleType`].
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Part {
    /// Name of its node.
    pub name: String,
    /// The part that it is fixed to, one of those before it; `None`: the vehicle.
    pub parent: Option<usize>,
    /// `parent_from_part` while the vehicle stands straight.
    pub rest: Transform,
    /// Mesh and material that are drawn here.
    pub drawn: Option<(MeshId, MaterialId)>,
    /// The material in each of the type's paints; empty where it is not painted.
    pub painted: Vec<MaterialId>,
    /// Drawn in its place, and in that of other parts, where the vehicle is small in the picture.
    pub proxies: Vec<Drawn>,
    /// Movement against its parent.
    pub movement: Option<Movement>,
    /// Kind of lamp.
    pub lamp: Option<PartLamp>,
}

/// A mesh of a type, with its material.
#[derive(Clone, PartialEq, Debug)]
pub struct Drawn {
    /// The mesh.
    pub mesh: MeshId,
    /// The material.
    pub material: MaterialId,
    /// The material in each of the type's paints; empty where it is not painted.
    pub painted: Vec<MaterialId>,
}

/// A lamp of a type: the kind, its light, and its glass while it is on.
#[derive(Clone, PartialEq, Debug)]
pub struct PartLamp {
    /// When it is on.
    pub kind: LampKind,
    /// Its light while it is on, along the part's −Z; `None`: it only glows.
    pub light: Option<Light>,
    /// The part's material while the lamp is on.
    pub lit: Option<MaterialId>,
}

/// Movement of a part of a vehicle against its parent.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Movement {
    /// Turns about X as the vehicle rolls, and about Y with the steering angle.
    Wheel {
        /// Metres rolled per radian.
        radius: f32,
        /// Set if it turns with the steering.
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
        /// Part of a swing, 0..1.
        phase: f32,
    },
    /// Turns about Y by the angle of the hitch.
    Trailer,
}

/// A part that moves with its vehicle's [`Motion`]; [`move_parts`] or [`turn_parts`] writes the entity's rotation.
#[derive(Component, Clone, Copy, PartialEq, Debug)]
#[require(Transform)]
pub struct MovingPart {
    /// The vehicle.
    pub vehicle: Entity,
    /// Movement against its parent.
    pub movement: Movement,
    /// The rotation at rest.
    pub rest: Quat,
}

/// A part that is turned where a frame is made and not in steps, because nothing that happens in a step depends on it:
/// a wheel that no spring holds, a fork, a leg. Its rotation follows from its vehicle's [`Motion`] and is no state.
#[derive(Component, Clone, Copy, PartialEq, Debug)]
pub struct FramePart;

/// Spawns the parts of a new vehicle below it.
pub(super) fn spawn(world: &mut World, entity: Entity) {
    let Some(&vehicle) = world.get::<Vehicle>(entity) else { return };
    if vehicle.kind == VehicleTypeId::STAND_IN {
        world.resource_scope(|world, mut types: Mut<VehicleTypes>| types.build_stand_in(&mut world.resource_mut()));
    }
    let switches = first_switches(world, entity);
    world.resource_scope(|world, types: Mut<VehicleTypes>| {
        let class = world.get_resource::<Classes>().and_then(|classes| classes.find(&types.get(vehicle.kind).class));
        if let Some(class) = class.filter(|_| world.get::<Class>(entity).is_none()) {
            world.entity_mut(entity).insert(class);
        }
        let mut spawned: Vec<Entity> = Vec::new();
        for part in &types.get(vehicle.kind).parts {
            let parent = part.parent.and_then(|index| spawned.get(index).copied()).unwrap_or(entity);
            spawned.push(part.spawn(world, vehicle, entity, parent, switches));
        }
    });
    // The lamps came as these have them.
    world.entity_mut(entity).insert(switches);
}

/// Lamps are on from the first frame.
fn first_switches(world: &World, entity: Entity) -> Switches {
    let state = world.get::<VehicleNumber>(entity).zip(world.get::<Motion>(entity)).zip(world.get::<Controls>(entity));
    let seconds = world.resource::<Clock>().seconds();
    state.map_or(Switches::default(), |((number, motion), controls)| Switches::of(*number, motion, controls, seconds))
}

impl Part {
    fn spawn(&self, world: &mut World, vehicle: Vehicle, root: Entity, parent: Entity, switches: Switches) -> Entity {
        let mut entity = world.spawn((self.rest, ChildOf(parent)));
        let in_paint = |painted: &[MaterialId], plain: MaterialId| {
            painted.get(vehicle.paint as usize % painted.len().max(1)).copied().unwrap_or(plain)
        };
        if let Some((mesh, plain)) = self.drawn {
            entity.insert((mesh, in_paint(&self.painted, plain)));
        }
        let part = entity.id();
        for Drawn { mesh, material, painted } in &self.proxies {
            let drawn = (*mesh, in_paint(painted, *material));
            entity.world_scope(|world| _ = world.spawn((drawn, Transform::IDENTITY, ChildOf(part), PieceOf(part))));
        }
        if let Some(movement) = self.movement {
            entity.insert(MovingPart { vehicle: root, movement, rest: self.rest.rotation });
            match movement {
                // What hangs on behind shows a small turn as a long way.
                Movement::Trailer => {
                    let classes = entity.world().get_resource::<Classes>();
                    let class = classes.and_then(|classes| classes.find(TRAILER));
                    entity.insert((Interpolated::default(), Instance));
                    class.into_iter().for_each(|class| _ = entity.insert(class));
                }
                Movement::Wheel { .. } | Movement::Fork | Movement::Swing { .. } => _ = entity.insert(FramePart),
            }
            let part = entity.id();
            // What moves the vehicle moves its wheels, too.
            if world.get::<Wanted>(root).is_some() {
                turn_in_steps(world, part);
            }
            entity = world.entity_mut(part);
        }
        if let Some(source) = &self.lamp {
            let intensity = source.light.as_ref().map_or(0.0, |light| light.intensity);
            let glass = self.drawn.map(|(_, dark)| dark).zip(source.lit);
            let lamp = Lamp { vehicle: root, kind: source.kind, intensity, glass };
            let (enabled, intensity) = lamp.light(switches);
            source.light.iter().for_each(|light| _ = entity.insert(Light { enabled, intensity, ..light.clone() }));
            lamp.glass(switches).into_iter().for_each(|material| _ = entity.insert(material));
            entity.insert(lamp);
        }
        entity.id()
    }
}

/// In a step: turns trailers and sprung wheels as their vehicles moved; what did not move is not written.
pub fn move_parts(
    vehicles: Query<Ref<Motion>>,
    mut parts: Query<(Ref<MovingPart>, &mut Transform), Without<FramePart>>,
) {
    turn(&mut parts, |part, is_new| {
        let motion = vehicles.get(part.vehicle).ok()?;
        (motion.is_changed() || is_new).then(|| part.rotation(&motion, motion.rolled))
    });
}

/// In a frame: turns wheels, forks and legs as their vehicles moved, between the last two steps as the vehicles
/// themselves are drawn; what did not move is not written.
pub fn turn_parts(
    clock: Res<Clock>,
    interpolation: Res<Interpolation>,
    mut last_fraction: Local<f32>,
    vehicles: Query<Ref<Motion>>,
    mut parts: Query<(Ref<MovingPart>, &mut Transform), With<FramePart>>,
) {
    let fraction = interpolation.drawn();
    let is_between = std::mem::replace(&mut *last_fraction, fraction) != fraction;
    // A still frame looks at its vehicles and not at their parts, which are several times as many.
    if !is_between && !vehicles.iter().any(|motion| motion.is_changed()) {
        return;
    }
    let seconds_ago = f64::from(1.0 - fraction) * clock.step_seconds;
    turn(&mut parts, |part, is_new| {
        let motion = vehicles.get(part.vehicle).ok()?;
        let is_turned = motion.is_changed() || is_new || is_between && motion.speed != 0.0;
        is_turned.then(|| part.rotation(&motion, motion.rolled - motion.speed * seconds_ago))
    });
}

/// Writes the rotations of parts that have another one now. `rotation`: of a part, which may be new; `None`: as it is.
fn turn<F: ArchetypeFilter>(
    parts: &mut Query<(Ref<MovingPart>, &mut Transform), F>,
    rotation: impl Fn(&MovingPart, bool) -> Option<Quat> + Sync,
) {
    for (parts, transforms) in parts.contiguous_iter_mut().into_iter().flatten() {
        let (parts, ticks) = ContiguousRef::split(parts);
        let since = Since::new(ticks.last_run(), ticks.this_run());
        let mut transforms = Column::new(transforms);
        let rows = rows_per_task(transforms.len(), LIGHT_ROWS);
        in_parallel(transforms.parts(0, rows), |mut part| {
            for row in part.rows() {
                let is_new = since.contains(&ticks.changed()[row]);
                let transform = *part.get(row);
                if let Some(rotation) = rotation(&parts[row], is_new).filter(|own| *own != transform.rotation) {
                    part.set(row, transform.with_rotation(rotation));
                }
            }
        });
    }
}

/// Wheels at an entity and below it turn in steps.
pub(crate) fn turn_in_steps(world: &mut World, entity: Entity) {
    let below = world.get::<Children>(entity).map(|children| children.to_vec());
    below.into_iter().flatten().for_each(|child| turn_in_steps(world, child));
    if world.get::<MovingPart>(entity).is_some_and(|part| matches!(part.movement, Movement::Wheel { .. })) {
        world.entity_mut(entity).remove::<FramePart>().insert_if_new(Interpolated::default());
    }
}

impl MovingPart {
    /// `rolled`: metres that the vehicle has rolled.
    fn rotation(&self, motion: &Motion, rolled: f64) -> Quat {
        self.movement.rotation(motion, rolled) * self.rest
    }
}

impl Movement {
    /// `rest_from_moved`: the turn in the parent's space.
    fn rotation(self, motion: &Motion, rolled: f64) -> Quat {
        match self {
            Self::Wheel { radius, steers } => {
                let turns = rolled / (TAU * f64::from(radius));
                let roll = about_x(((turns - turns.floor()) * TAU) as f32);
                if steers { about_y(motion.steering) * roll } else { roll }
            }
            Self::Fork => about_y(motion.steering),
            Self::Swing { angle, stride, phase } => {
                let turns = rolled / f64::from(stride) + f64::from(phase);
                about_x(angle * (turns.fract() * TAU).sin() as f32)
            }
            Self::Trailer => about_y(motion.hitch as f32),
        }
    }
}
