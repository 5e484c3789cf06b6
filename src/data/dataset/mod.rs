//! Data sets: the sensors of a run as files (writer; of a whole run, job), what they are and where they were
//! (description), a hash of each file (manifest), and those of the parts of a run put together (merge). Uses formats.

mod description;
pub(crate) mod job;
mod manifest;
pub(crate) mod merge;
mod names;
mod numbers;
pub(crate) mod writer;
