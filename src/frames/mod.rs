//! Scenes to pictures.
//!
//! ```text
//! stage     a scene as it is loaded, its camera, and the run that begins with it
//! headless  pictures of a world in hand
//! job       the frames of a run as files: `relief render`
//! encoding  colour, depth, normals and ids in these files
//! ```

mod encoding;
mod error;
mod headless;
mod job;
mod stage;

pub use encoding::OutputKind;
pub use error::FrameError;
pub use headless::Headless;
pub use job::{FrameJob, Frames, render_frames};
pub use stage::{LoadOptions, Stage, begin_run, check_outputs, load_stage, restore_texels};
