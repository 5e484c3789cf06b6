//! Scenes to measure with, the same ones for benchmarks, tests and examples, and `relief bench`, which measures.
//!
//! ```text
//! job  → grid (with maps)        what is asked for becomes a world
//!        run → measurement       frames are drawn and timed; one line of figures
//!        floor                   the least that the same triangles can cost
//!            → trace             the same frames on a time line
//!        separate_process        a run in a process of its own; what an object adds to memory
//!        sweeps, suite → report, plot    many such runs; tables and charts of them
//! night_lights                   objects and lights for measuring the choice of lights alone
//! ```

mod floor;
mod frame_cost;
mod grid;
mod job;
mod machine;
mod maps;
mod measurement;
mod night_lights;
mod plot;
mod report;
mod run;
mod separate_process;
mod subject;
mod suite;
mod sweeps;
mod trace;

pub use grid::{Grid, GridKit, GridMesh, GridPlan, GridView};
pub use job::{BenchJob, SuiteJob};
pub use machine::{Build, memory_mb, peak_memory_mb};
pub use measurement::{Measurement, Spread};
pub use night_lights::{Movers, NightLights};
pub use run::run;
pub use separate_process::{Launch, bytes_per_object};
pub use suite::run_suite;
