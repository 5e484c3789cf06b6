//! Hooks and required components of vehicles, and the making of an entity into one.

use super::components::{Motion, NextVehicleNumber, OnRoute, Vehicle, VehicleNumber};
use super::ground::Grounds;
use super::lamps::{Lamps, Switches};
use super::routes::Routes;
use super::signals::{HeldSignals, Signals};
use super::traffic::traffic::Traffic;
use super::types::VehicleTypes;
use super::{parts, steering, turns};
use crate::sensors::labels::Instance;
use crate::space::transform::Transform;
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;
use glam::Vec3;

/// Registers the hooks and the required components of vehicles, and inserts the resources that they need.
/// [`Simulation::new`](crate::Simulation::new) does so; a world that is made otherwise is to be given to it before its
/// first vehicle: without, a vehicle has neither a number nor parts.
///
/// # Panics
/// If an entity of the world is or was a vehicle, or the world was registered before.
pub fn register(world: &mut World) {
    world.register_required_components::<Vehicle, Switches>();
    world.register_required_components::<Vehicle, Lamps>();
    world.register_required_components::<Vehicle, Instance>();
    world.register_component_hooks::<Vehicle>().on_add(become_vehicle);
    world.register_component_hooks::<OnRoute>().on_add(stand_on_route);
    world.init_resource::<VehicleTypes>();
    world.init_resource::<NextVehicleNumber>();
    world.init_resource::<Routes>();
    world.init_resource::<Signals>();
    world.init_resource::<HeldSignals>();
    world.init_resource::<Grounds>();
    world.init_resource::<Traffic>();
}

/// Numbers a new vehicle, turns it as its entity stands, and has its parts spawned.
fn become_vehicle(mut world: DeferredWorld, context: HookContext) {
    let entity = context.entity;
    let own = world.get::<VehicleNumber>(entity).copied().unwrap_or_default();
    let mut next = world.resource_mut::<NextVehicleNumber>();
    if own == VehicleNumber::NONE {
        let number = VehicleNumber(next.0);
        next.0 += 1;
        if let Some(mut own) = world.get_mut(entity) {
            *own = number;
        }
    } else {
        next.0 = next.0.max(own.0.saturating_add(1));
    }
    if let Some(at) = world.get::<Transform>(entity).copied()
        && let Some(mut motion) = world.get_mut::<Motion>(entity)
    {
        motion.yaw = steering::yaw(at.rotation);
        motion.follow(at.translation);
    }
    world.commands().queue(move |world: &mut World| parts::spawn(world, entity));
}

/// Puts a vehicle that was placed nowhere else to its place on the route.
fn stand_on_route(mut world: DeferredWorld, context: HookContext) {
    let entity = context.entity;
    let Some(on) = world.get::<OnRoute>(entity).copied() else { return };
    let Some((place, yaw)) = world.get_resource::<Routes>().map(|routes| routes.stand_at(&on)) else { return };
    let is_nowhere = world.get::<Transform>(entity).is_some_and(|at| at.translation == Vec3::ZERO);
    if is_nowhere && let Some(mut transform) = world.get_mut::<Transform>(entity) {
        (transform.translation, transform.rotation) = (place.as_vec3(), turns::about_y(yaw as f32));
        if let Some(mut motion) = world.get_mut::<Motion>(entity) {
            (motion.place, motion.yaw) = (place, yaw);
        }
    }
}
