//! Scenes to pictures.
//!
//! ```text
//! scene     a scene as it is loaded, seen from a camera; files that outputs must leave alone
//! headless  pictures of a world in hand
//! run       a run, taken from frame to frame
//! run_job   a run that is to be rendered, as data
//! job       the frames of a run as files: `relief render`
//! encoding  colour, depth, normals and ids in these files
//! slot_ids  a frame whose ids are slots
//! ```

mod encoding;
mod error;
mod headless;
mod job;
mod run;
mod run_job;
mod scene;
#[cfg(feature = "tools")]
mod slot_ids;

pub use encoding::OutputKind;
pub(crate) use encoding::is_written;
pub use error::FrameError;
pub use headless::Headless;
pub use job::{FrameJob, render_frames};
pub(crate) use run::FrameRun;
pub use run::Frames;
pub use run_job::RunJob;
pub use scene::{check_outputs, load_session};
#[cfg(feature = "tools")]
pub(crate) use slot_ids::with_slot_ids;
