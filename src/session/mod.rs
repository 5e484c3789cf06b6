//! A world and its run, for the window, the command line, Python and programs alike.
//!
//! ```text
//! session   the world of a scene, its steps, and what is kept of them: recordings, hashes, snapshots, forks
//! load      a scene as it is loaded: costly results from the cache, textures within a bound
//! warnings  faults of single vehicles in a step
//! ```
//!
//! There is one place where inputs, steps, hashes and recordings meet, so that all are in the same order everywhere.
//! Users add what is theirs: the window real time, the command line frames in files, Python locks and errors.

mod load;
#[expect(clippy::module_inception, reason = "the file is named after what the folder is about")]
mod session;
mod warnings;

pub use load::LoadOptions;
pub use session::Session;
