//! The world of Relief: components, and the systems that turn them into a [`draw::DrawList`]. No GPU, no files, no
//! window.
//!
//! [`Simulation`] is the whole of it: a `bevy_ecs` world and two schedules. [`Simulation::step`] moves the world one
//! fixed time step on; [`Simulation::frame`] brings the draw list up to date with whatever changed since the last
//! frame, and with nothing else. `schedules.rs` has the systems of both in order, with a reason beside each.
//!
//! A world that is not made by [`Simulation::new`] gets what it needs by the functions of [`install`], before its first
//! entity.
//!
//! Each folder is a layer that uses those before it, and none after:
//!
//! ```text
//! ecs, describe ← space ← assets ← cells ← lights ← weather ← draw ← sensors ← vehicles, physics ← run
//! ```
//!
//! Within the crate a `use` names the file that has an item, `crate::lights::table::LightTable`; what a folder's
//! `mod.rs` hands on is for others, `systems::lights::LightTable`. `tests/layers.rs` reads all of them.

pub mod assets;
pub mod cells;
pub mod describe;
pub mod draw;
pub mod ecs;
pub mod install;
pub mod lights;
#[cfg(feature = "physics")]
pub mod physics;
pub mod run;
mod schedules;
pub mod sensors;
mod simulation;
pub mod space;
#[cfg(feature = "vehicles")]
pub mod vehicles;
pub mod weather;

pub use ecs::parallel::set_threads;
pub use schedules::{FrameSet, StepSet, frame_schedule, step_schedule, sub_step_schedule};
pub use simulation::Simulation;
