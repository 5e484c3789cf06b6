//! Inputs of vehicles and signals, and spawning of vehicles.

use crate::ecs::clock::Clock;
use crate::space::interpolation::Interpolated;
use crate::space::transform::Transform;
use crate::vehicles::components::{Controls, ManualControl, Motion, OnRoute, Vehicle, VehicleTypeId};
use crate::vehicles::external::{External, StampedMotion};
use crate::vehicles::routes::Routes;
use crate::vehicles::signals::{self, Aspect, HeldSignals, Signal, Signals};
use crate::vehicles::steering;
use crate::vehicles::types::VehicleTypes;
use bevy_ecs::prelude::*;

/// Begins or ends manual control.
pub(super) fn set_manual_control(world: &mut World, vehicle: Entity, manual: bool) {
    if manual {
        world.entity_mut(vehicle).insert(ManualControl);
    } else {
        world.entity_mut(vehicle).remove::<ManualControl>();
        go_on(world, vehicle);
    }
}

/// Ends motion from outside. What moves by something else is left alone.
pub(super) fn release(world: &mut World, vehicle: Entity) {
    let Some(external) = world.entity_mut(vehicle).take::<External>() else { return };
    go_on(world, vehicle);
    if external.place().2.is_some() {
        // From here on it is as high as the ground.
        world.get_mut::<Interpolated>(vehicle).into_iter().for_each(|mut drawn| drawn.jump());
    }
}

/// Releases pedals and steering wheel.
fn release_pedals(world: &mut World, vehicle: Entity) {
    if let Some(mut controls) = world.get_mut::<Controls>(vehicle) {
        (controls.throttle, controls.brake, controls.steer) = (0.0, 0.0, 0.0);
    }
}

/// Lets a vehicle move by what it has: pedals are released, and its route goes on from where it is.
fn go_on(world: &mut World, vehicle: Entity) {
    release_pedals(world, vehicle);
    let place = world.get::<Transform>(vehicle).zip(world.get::<Motion>(vehicle)).map(|(transform, motion)| {
        let mut motion = *motion;
        motion.follow(transform.translation);
        motion.place
    });
    let on = place.zip(world.get::<OnRoute>(vehicle).copied());
    let nearest = on.and_then(|(place, on)| Some(world.resource::<Routes>().get(on.route)?.nearest(place)));
    if let (Some(at), Some(mut on)) = (nearest, world.get_mut::<OnRoute>(vehicle)) {
        on.at = at;
    }
}

/// Holds a signal, or releases it. Nothing happens where there is none of that name and number of groups.
pub(super) fn set_signal(world: &mut World, name: &str, shows: Option<&[Aspect]>) {
    let is_it = |signal: &Signal| signal.name == name && shows.is_none_or(|shows| shows.len() == signal.green.len());
    if !world.resource::<Signals>().iter().any(is_it) {
        return;
    }
    let mut held = world.resource_mut::<HeldSignals>();
    match shows {
        Some(shows) => _ = held.0.insert(name.to_owned(), shows.to_vec()),
        None => _ = held.0.remove(name),
    }
    signals::tick_signals_now(world);
    // It has no errors of its own.
    world.run_system_cached(signals::light_heads).ok();
}

/// Moves a vehicle from outside: takes a pose over, and jumps there where it is far. Nothing happens where the stamp is
/// not newer, or of another time.
pub(super) fn move_vehicle(world: &mut World, vehicle: Entity, given: &StampedMotion) {
    let seconds = world.resource::<Clock>().seconds();
    let Some(kind) = world.get::<Vehicle>(vehicle).map(|vehicle| vehicle.kind) else { return };
    let wheelbase = world.resource::<VehicleTypes>().get(kind).wheelbase;
    let Some((transform, mut motion)) =
        world.get::<Transform>(vehicle).copied().zip(world.get::<Motion>(vehicle).copied())
    else {
        return;
    };
    motion.follow(transform.translation);
    let before = world.get::<External>(vehicle);
    let taken = External::take(given, before, (&motion, transform.rotation, wheelbase), seconds);
    let (is_first, Some((external, jumps))) = (before.is_none(), taken) else { return };
    if is_first {
        // They would light brake lamps for as long as they cannot be changed.
        release_pedals(world, vehicle);
    }
    world.entity_mut(vehicle).insert(external);
    if jumps {
        let (place, yaw, tilt) = external.place();
        let [pitch, roll] = tilt.unwrap_or_default().map(|angle| angle as f32);
        let stands = steering::posture(yaw as f32, pitch, roll);
        world.entity_mut(vehicle).insert((
            Motion { place, yaw, hitch: 0.0, ..motion },
            transform.with_translation(place.as_vec3()).with_rotation(stands),
        ));
        world.get_mut::<Interpolated>(vehicle).into_iter().for_each(|mut drawn| drawn.jump());
    }
}

/// Lets a moving entity's motion follow its new place.
pub(super) fn put(world: &mut World, entity: Entity, at: Transform) {
    let Some(mut motion) = world.get_mut::<Motion>(entity) else { return };
    motion.yaw = steering::yaw(at.rotation);
    motion.follow(at.translation);
    let (place, yaw) = (motion.place, motion.yaw);
    world.get_mut::<External>(entity).into_iter().for_each(|mut external| external.put(place, yaw));
}

/// A vehicle of a type by name, the stand-in where there is none of that name.
pub(super) fn spawn(world: &mut World, kind: &str, paint: u32, manual: bool, others: impl Bundle) -> Entity {
    let kind = world.resource::<VehicleTypes>().find(kind).unwrap_or(VehicleTypeId::STAND_IN);
    let root = world.spawn((others, Vehicle::of(kind).painted(paint))).id();
    if manual {
        world.entity_mut(root).insert(ManualControl);
    }
    root
}
