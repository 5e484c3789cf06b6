//! Captures as files: the forms of files, the data sets of runs, and runs in parts that many machines render.
//!
//! ```text
//! shards     a run in parts: split, a shard by itself, merge
//! work       a rendering of a run as data
//! dataset    the sensors of a run as files: `relief render --sensors`; data sets of its parts, put together
//! formats    forms of files: of single captures, and of a run as a whole
//! pictures   values of outputs as colours, for those who look at them
//! ```
//!
//! Each of these uses those below it. What captures are made of is in [`crate::sense`]; encoders, which know arrays
//! alone, are in [`crate::export`].

pub(crate) mod dataset;
pub(crate) mod formats;
pub mod pictures;
pub mod shards;
mod work;

pub use dataset::job::{SensorJob, render_sensors};
pub use dataset::writer::{DatasetOptions, DatasetWriter, LastState, PartOfRun};
pub use formats::box_records::encode as boxes_as_npy;
pub use formats::format::{CaptureFile, Encode, FileFormat, Makes, Poses, RunInfo, RunWriter};
pub use work::Work;
