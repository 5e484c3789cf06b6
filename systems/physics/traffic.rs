//! Kinematic vehicles near physical ones: bodies that nothing pushes, for physical vehicles to bump into.

use super::bodies::Physics;
use super::body::{chassis_collider, pose};
use super::physical::wheels;
use crate::ecs::sub_steps::SubStep;
use crate::space::transform::Transform;
use crate::vehicles::components::{Motion, Vehicle, VehicleNumber};
use crate::vehicles::types::VehicleTypes;
use bevy_ecs::prelude::*;
use glam::Vec3;
use rapier3d_f64::prelude::*;
use std::collections::{BTreeMap, HashSet};

/// Metres; a kinematic vehicle is a body while it is in a cell of this size with a physical one in it or beside it.
const CELL: f32 = 32.0;

/// m/s; what moves faster was put elsewhere, and pushes nothing on its way.
const FASTEST: f64 = 150.0;

/// Gives kinematic vehicles near physical ones a body, moves it along with them, and takes it when they are far.
pub fn follow_traffic(
    mut physics: ResMut<Physics>,
    now: Res<SubStep>,
    types: Res<VehicleTypes>,
    vehicles: Query<(&VehicleNumber, &Vehicle, &Transform, &Motion)>,
) {
    let Physics { world, bodies, others, .. } = &mut *physics;
    let cells: HashSet<(i32, i32)> = bodies.values().flat_map(|body| around(cell(body.written.0))).collect();
    let near: BTreeMap<u32, (&Vehicle, Pose)> = vehicles
        .iter()
        .filter(|(number, _, at, _)| cells.contains(&cell(at.translation)) && !bodies.contains_key(&number.0))
        .filter(|(_, _, at, _)| at.translation.is_finite() && at.rotation.is_finite())
        .map(|(number, vehicle, at, motion)| (number.0, (vehicle, pose(at, motion))))
        .collect();
    let before = others.len();
    others.retain(|number, handle| {
        let stays = near.contains_key(number);
        if !stays {
            world.remove_body(*handle);
        }
        stays
    });
    // A body that takes the slot of one removed in the same step is in none of rapier's islands.
    let may_insert = others.len() == before;
    let farthest = FASTEST * now.seconds;
    for (number, (vehicle, at)) in near {
        let Some(&handle) = others.get(&number) else {
            if !may_insert {
                continue;
            }
            let kind = types.get(vehicle.kind);
            let body = RigidBodyBuilder::kinematic_position_based().pose(at);
            others.insert(number, world.insert(body, chassis_collider(kind, &wheels(kind))).0);
            continue;
        };
        let Some(body) = world.bodies.get_mut(handle) else { continue };
        if body.translation().distance(at.translation) <= farthest {
            body.set_next_kinematic_position(at);
        } else {
            body.set_position(at, true);
        }
    }
}

fn cell(place: Vec3) -> (i32, i32) {
    ((place.x / CELL).floor() as i32, (place.z / CELL).floor() as i32)
}

fn around((x, z): (i32, i32)) -> impl Iterator<Item = (i32, i32)> {
    (-1..=1).flat_map(move |dx: i32| (-1..=1).map(move |dz: i32| (x.saturating_add(dx), z.saturating_add(dz))))
}
