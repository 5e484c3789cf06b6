//! Vehicles: what they are made of, the models and bodies that they move by, and the rules of traffic.

mod crossings;
mod driving;
mod external;
mod parts;
mod physics;
mod precise;
mod proxies;
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

const STEP: f64 = 1.0 / 60.0;
/// A car of the type that stands in for unknown ones.
const CAR: Vehicle = Vehicle { kind: VehicleTypeId::STAND_IN, paint: 0 };

/// A world with these routes.
fn roads(plans: Vec<RoutePlan>) -> Simulation {
    let mut simulation = Simulation::new();
    simulation.world.insert_resource(Routes::new(plans, false, 1));
    simulation
}

/// A straight road toward +Z.
fn straight(metres: f64) -> RoutePlan {
    RoutePlan { points: vec![DVec3::ZERO, DVec3::Z * metres], ..RoutePlan::default() }
}

/// A ring of that radius, counter-clockwise seen from above (left turns all the way).
fn ring(radius: f32, lanes: u8) -> RoutePlan {
    let points = (0..48).map(|i| {
        let angle = i as f32 / 48.0 * std::f32::consts::TAU;
        (Vec3::new(angle.sin(), 0.0, angle.cos()) * radius).as_dvec3()
    });
    RoutePlan { points: points.collect(), spline: true, closed: true, lanes, ..RoutePlan::default() }
}

/// At so many metres of the first route.
fn on_road(at: impl Into<f64>) -> OnRoute {
    OnRoute::new(RouteId(0), 0, at.into())
}

/// Spawns a car that has a speed.
fn drive(simulation: &mut Simulation, car: impl Bundle, speed: impl Into<f64>) -> Entity {
    let entity = simulation.world.spawn(car).id();
    simulation.world.get_mut::<Motion>(entity).expect("a vehicle").speed = speed.into();
    entity
}

/// A signal of these groups, with an amber of 3 s and a red of 1 s.
fn signal(green: &[f32]) -> Signal {
    Signal { name: "s".into(), green: green.to_vec(), amber: 3.0, red: 1.0, offset: 0.0 }
}

fn steps(simulation: &mut Simulation, count: usize) {
    (0..count).for_each(|_| simulation.step());
}

fn state<T: Component + Clone>(simulation: &Simulation, entity: Entity) -> T {
    simulation.world.get::<T>(entity).expect("a component").clone()
}
