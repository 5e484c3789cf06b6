//! The wheels of a physical vehicle's model go up and down with its springs.

use super::bodies::Physics;
use super::physical::{Physical, wheels};
use crate::space::transform::Transform;
use crate::vehicles::components::{Vehicle, VehicleNumber};
use crate::vehicles::parts::{Movement, MovingPart};
use crate::vehicles::types::VehicleTypes;
use bevy_ecs::prelude::*;
use glam::{Affine3A, Vec3};

/// A physical vehicle whose wheels have been found.
#[derive(Component, Clone, Copy, Debug)]
pub struct WheelsFound;

/// A wheel of a model, on a spring.
#[derive(Component, Clone, Copy, PartialEq, Debug)]
pub struct Sprung {
    /// Index among its vehicle's wheels.
    wheel: usize,
    /// Its place while the vehicle stands, in its parent's space.
    rest: Vec3,
    /// The vehicle's up in that space.
    up: Vec3,
}

type NewlyPhysical = (With<Physical>, Without<WheelsFound>);

/// Looks for the wheels of vehicles that have just become physical: each is the one whose hub is nearest.
pub fn find_wheels(
    mut commands: Commands,
    types: Res<VehicleTypes>,
    vehicles: Query<(Entity, &Vehicle), NewlyPhysical>,
    children: Query<&Children>,
    parts: Query<(&Transform, Option<&MovingPart>)>,
) {
    for (vehicle, kind) in &vehicles {
        commands.entity(vehicle).insert(WheelsFound);
        let hubs = wheels(types.get(kind.kind));
        let mut open = vec![(vehicle, Affine3A::IDENTITY)];
        while let Some((parent, vehicle_from_parent)) = open.pop() {
            for &child in children.get(parent).into_iter().flatten() {
                let Ok((transform, part)) = parts.get(child) else { continue };
                let at_rest = transform.with_rotation(part.map_or(transform.rotation, |part| part.rest));
                let vehicle_from_part = vehicle_from_parent * at_rest.compute_affine();
                open.push((child, vehicle_from_part));
                let hub = Vec3::from(vehicle_from_part.translation);
                let distance = |wheel: usize| hubs[wheel].hub.distance_squared(hub);
                let nearest = (0..hubs.len()).min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
                if let (Some(wheel), Some(Movement::Wheel { .. })) = (nearest, part.map(|part| part.movement)) {
                    // Not where it is, which is where its spring was when the world was saved.
                    let parent_from_vehicle = vehicle_from_parent.inverse();
                    let rest = parent_from_vehicle.transform_point3(hubs[wheel].hub);
                    let up = parent_from_vehicle.transform_vector3(Vec3::Y);
                    commands.entity(child).insert(Sprung { wheel, rest, up });
                }
            }
        }
    }
}

/// Puts sprung wheels where their springs are.
pub fn move_springs(
    physics: Res<Physics>,
    vehicles: Query<&VehicleNumber>,
    mut wheels: Query<(&MovingPart, &Sprung, &mut Transform)>,
) {
    for (part, sprung, mut transform) in &mut wheels {
        let body = vehicles.get(part.vehicle).ok().and_then(|number| physics.bodies.get(&number.0));
        let Some(travel) = body.and_then(|body| body.travel(sprung.wheel)) else { continue };
        let place = sprung.rest + sprung.up * travel as f32;
        if transform.translation != place {
            transform.translation = place;
        }
    }
}
