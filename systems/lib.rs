//! The world of Relief: components, and the systems that turn them into a [`draw_list::DrawList`]. No GPU, no files,
//! no window.
//!
//! [`Simulation`] is the whole of it: a `bevy_ecs` world and two schedules. [`Simulation::step`] moves the world one
//! fixed time step on; [`Simulation::frame`] brings the draw list up to date with whatever changed since the last
//! frame, and with nothing else.

pub mod batches;
pub mod bounds;
pub mod clock;
pub mod components;
pub mod draw_list;
pub mod images;
pub mod instances;
pub mod library;
pub mod lights;
pub mod materials;
pub mod motion;
pub mod shapes;
pub mod stats;
pub mod tangents;
pub mod view;

use bevy_ecs::prelude::*;
use bevy_ecs::schedule::{ExecutorKind, LogLevel, ScheduleBuildSettings};
use bevy_tasks::{ComputeTaskPool, TaskPoolBuilder};
use bevy_transform::systems as transforms;

/// Sets the number of worker threads of this process; `None`: one per core. Only the first call counts, and a
/// [`Simulation`] made before makes it. Results are the same for any number.
pub fn set_threads(threads: Option<usize>) {
    ComputeTaskPool::get_or_init(|| {
        let builder = TaskPoolBuilder::new().thread_name("relief".into());
        match threads {
            Some(threads) => builder.num_threads(threads).build(),
            None => builder.build(),
        }
    });
}
