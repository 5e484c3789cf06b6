//! Faults that a step or a frame has found, of which the run goes on.

#[cfg(feature = "vehicles")]
use crate::name;
use bevy_ecs::change_detection::DetectChangesMut;
use systems::Simulation;
use systems::draw::sky_light::OpennessState;
#[cfg(feature = "vehicles")]
use systems::vehicles::external::STALE;

/// Faults since the last call, each once; everything else goes on.
pub fn take(simulation: &mut Simulation) -> Vec<String> {
    let mut found = of_vehicles(simulation);
    let mut openness = simulation.world.resource_mut::<OpennessState>();
    found.extend(openness.bypass_change_detection().take_warning().map(str::to_owned));
    found
}

/// Faults of single vehicles.
#[cfg(feature = "vehicles")]
fn of_vehicles(simulation: &mut Simulation) -> Vec<String> {
    let world = &mut simulation.world;
    #[cfg(feature = "physics")]
    let mut found = world.resource_mut::<systems::physics::Physics>().take_warnings();
    #[cfg(not(feature = "physics"))]
    let mut found = Vec::new();
    let mut traffic = world.resource_mut::<systems::vehicles::traffic::Traffic>();
    let (faults, stale) = (std::mem::take(&mut traffic.faults), std::mem::take(&mut traffic.stale));
    let told = |vehicle, fault: &str| format!("{}: {fault}", name::of_entity(world, vehicle));
    let broken = "its position or speed is no longer finite; it stays at its last position";
    found.extend(faults.into_iter().map(|vehicle| told(vehicle, broken)));
    let old = format!("no pose has come from outside for {STALE} s; it brakes to a standstill");
    found.extend(stale.into_iter().map(|vehicle| told(vehicle, &old)));
    found
}

/// A build without vehicles has no such faults.
#[cfg(not(feature = "vehicles"))]
fn of_vehicles(_: &mut Simulation) -> Vec<String> {
    Vec::new()
}
