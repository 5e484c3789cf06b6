//! Scenes to measure with, the same ones for benchmarks, tests and examples, and `relief bench`, which measures.
//!
//! ```text
//! job  → yard (with maps)        what is asked for becomes a world
//!        run → measurement       frames are drawn and timed; one line of figures
//!        floor                   the least that the same triangles can cost
//!            → trace             the same frames on a time line
//!        apart                   a run in a process of its own; what an object adds to memory
//!        suite → report, plot    many such runs; tables and charts of them
//! night                          objects and lights for measuring the choice of lights alone
//! ```

mod apart;
mod floor;
mod job;
mod machine;
mod maps;
mod measurement;
mod night;
mod plot;
mod report;
mod run;
mod subject;
mod suite;
mod trace;
mod yard;

pub use apart::{Launch, bytes_per_object};
pub use job::{BenchJob, SuiteJob};
pub use machine::{Build, peak_memory_mb};
pub use measurement::{Measurement, Spread};
pub use night::{Movers, Night};
pub use run::{BenchError, run};
pub use suite::run_suite;
pub use yard::{Yard, YardError, YardKit, YardMesh, YardPlan, YardView};
