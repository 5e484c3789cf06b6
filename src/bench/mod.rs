//! Scenes to measure with, the same ones for benchmarks, tests and examples.

mod night;

pub use night::{Movers, Night};
