//! Scenes to measure with, the same ones for benchmarks, tests and examples, and `relief bench`, which measures.
//!
//! ```text
//! args → yard (with maps)    what is asked for becomes a world
//!        run → measurement   frames are drawn and timed; one line of figures
//! night                      objects and lights for measuring the choice of lights alone
//! ```

mod args;
mod machine;
mod maps;
mod measurement;
mod night;
mod run;
mod yard;

pub use args::BenchArgs;
pub use machine::{Build, Memory};
pub use measurement::{Measurement, Spread};
pub use night::Night;
pub use run::{BenchError, run};
pub use yard::{Yard, YardError, YardKit, YardMesh, YardPlan, YardView};
