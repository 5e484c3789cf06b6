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
use systems::Simulation;

fn steps(simulation: &mut Simulation, count: usize) {
    (0..count).for_each(|_| simulation.step());
}

fn state<T: Component + Clone>(simulation: &Simulation, entity: Entity) -> T {
    simulation.world.get::<T>(entity).expect("a component").clone()
}
