//! Faults of single vehicles in a step.

#[cfg(feature = "vehicles")]
use crate::name;
use systems::Simulation;
#[cfg(feature = "vehicles")]
use systems::vehicles::external::STALE;

/// Faults of single vehicles in a step, each once; everything else goes on.
#[cfg(feature = "vehicles")]
pub fn take(simulation: &mut Simulation) -> Vec<String> {
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
pub fn take(_: &mut Simulation) -> Vec<String> {
    Vec::new()
}
