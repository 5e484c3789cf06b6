//! Runs that can be had again: recordings of inputs, snapshots of the state, hashes of every step.
//!
//! ```text
//! recorder   writes a recording as the run goes on
//! player     reads one: what comes at which step, and the nearest snapshot to begin from
//! records    the file's form: blocks with checksums, one after another
//! error      why a run cannot be recorded, replayed or continued
//! identity   which program and which scene, with every file it names, a file belongs to
//! snapshots  one snapshot: its file, and the bytes of that
//! run_files  files that a run is kept in and begins from
//! ```
//!
//! A run follows from its scene and its inputs. So a recording holds no frames and no movements but what is asked for
//! at the start, and what came from outside at which step; snapshots in between are there to begin in the middle.

mod error;
mod identity;
mod player;
mod recorder;
mod records;
mod run_files;
mod snapshots;

pub use error::RecordingError;
pub use identity::Identity;
pub(crate) use identity::PROGRAM;
pub use player::{Recording, identity_of};
pub use recorder::Recorder;
pub use run_files::RunFiles;
pub use snapshots::Snapshot;
