//! Vehicles as rigid bodies, and what they bump into. A build without physics has `no_physics.rs` instead.

use crate::name;
use crate::scene::format::entities::Obstacle;
use bevy_ecs::prelude::*;
use systems::ecs::clock::Clock;
use systems::physics::{Physical, unheld};
use systems::vehicles::{Vehicle, VehicleNumber, VehicleTypes};

/// Warns of springs that count as another number than is given: of the first vehicle, and how many others have
/// some.
pub fn warnings(world: &mut World) -> Vec<String> {
    let mut vehicles = world.query::<(&VehicleNumber, Entity, &Vehicle, &Physical)>();
    let (types, clock) = (world.resource::<VehicleTypes>(), world.resource::<Clock>());
    let unheld = |(number, entity, vehicle, physical): (&VehicleNumber, Entity, &Vehicle, &Physical)| {
        Some((*number, entity, unheld(physical, types.get(vehicle.kind), clock))).filter(|row| !row.2.is_empty())
    };
    let mut found: Vec<_> = vehicles.iter(world).filter_map(unheld).collect();
    found.sort_unstable_by_key(|row| row.0);
    let others = match found.len().saturating_sub(1) {
        0 => String::new(),
        others => format!("; the same holds for {others} more"),
    };
    let first = found.into_iter().next();
    let told = first.map(|(_, entity, told)| (name::of_entity(world, entity), told));
    told.into_iter()
        .flat_map(|(name, told)| told.into_iter().map(move |told| format!("{name:?}: {told}")))
        .map(|told| format!("{told}{others}"))
        .collect()
}

/// Has a vehicle simulated as a body.
pub fn make_physical(vehicle: &mut EntityWorldMut, physical: Physical) {
    vehicle.insert(physical);
}

/// Puts an entity in the way of physical vehicles.
pub fn make_obstacle(entity: &mut EntityWorldMut, obstacle: Obstacle) {
    entity.insert(match obstacle {
        Obstacle::Box => systems::physics::Obstacle::Box,
        Obstacle::Mesh => systems::physics::Obstacle::Mesh,
    });
}
