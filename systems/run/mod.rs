//! A run of the simulation: what it begins with, what changes it from outside, and what is kept of it.
//!
//! [`inputs`] are the one place where anything from outside changes a running world: types of them are registered,
//! [`standard_inputs`] and those of a program. What they bring into being is a [`spawn::Spawn`], which is data. The
//! [`registry`] gives entities numbers that mean the same in every run. [`state`] lists what is state; by that list
//! [`state_hash`] makes one number of a world, and [`snapshot`] saves it and brings it back. `vehicle_state` adds
//! vehicles to the list, and `physics_state` what the physics hold beside components.

pub mod inputs;
#[cfg(feature = "physics")]
pub(crate) mod physics_state;
pub mod registry;
pub mod snapshot;
pub mod spawn;
pub mod standard_inputs;
pub mod state;
pub mod state_hash;
#[cfg(feature = "vehicles")]
pub(crate) mod vehicle_inputs;
#[cfg(feature = "vehicles")]
pub(crate) mod vehicle_state;
