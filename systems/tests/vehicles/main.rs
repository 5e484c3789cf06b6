//! Vehicles: what they are made of, the models and bodies that they move by, and the rules of traffic.

mod crossings;
mod driving;
mod external;
mod parts;
mod physics;
mod precise;
mod rules;
mod traffic;

use bevy_ecs::prelude::*;
use glam::{DVec3, Quat, Vec2, Vec3};
use proptest::prelude::*;
use systems::Simulation;
use systems::assets::{Library, MaterialId, MeshId, shapes};
use systems::ecs::clock::Clock;
use systems::lights::Light;
use systems::physics::{Physical, Physics};
use systems::run::inputs::{Inputs, apply_queued};
use systems::run::{snapshot, state_hash};
use systems::space::Transform;
use systems::vehicles::forks::{Chooser, Fork};
use systems::vehicles::ground::Grounds;
use systems::vehicles::lamps::{LampKind, Switches};
use systems::vehicles::routes::{RoutePlan, Routes, Stop, Wait};
use systems::vehicles::signals::{Aspect, Signal, Signals};
use systems::vehicles::types::{Driver, Trailer};
use systems::vehicles::{
    Controls, Indicator, ManualControl, Motion, OnRoute, RouteId, Stalled, Vehicle, VehicleNumber, VehicleType,
    VehicleTypeId, VehicleTypes, steering,
};

fn steps(simulation: &mut Simulation, count: usize) {
    (0..count).for_each(|_| simulation.step());
}

fn state<T: Component + Clone>(simulation: &Simulation, entity: Entity) -> T {
    simulation.world.get::<T>(entity).expect("a component").clone()
}
