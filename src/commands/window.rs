//! The window of `relief run` and `relief replay`; where there is none, a picture.

#[cfg(feature = "window")]
use crate::app::{self, AppError};
use crate::commands::common::failure::Failure;
use crate::commands::common::view::{PictureArgs, ViewArgs};
use crate::commands::rendering::render::render;
use crate::data::Work;
#[cfg(feature = "window")]
use crate::frames;
use crate::frames::{Frames, RunJob};
use crate::recording::RunFiles;
#[cfg(feature = "window")]
use crate::session::LoadOptions;
use std::path::{Path, PathBuf};
#[cfg(feature = "window")]
use systems::ecs::clock::Clock;
#[cfg(feature = "window")]
use systems::lights::LightPolicies;

/// Contents of a window.
#[cfg_attr(not(feature = "window"), expect(dead_code, reason = "nothing is shown"))]
pub struct WindowJob {
    pub scene: PathBuf,
    pub files: RunFiles,
    /// In the place of the scene's own.
    pub seed: Option<u64>,
    /// The step that a replay begins after.
    pub from: u64,
    pub speed: Option<f64>,
    pub paused: bool,
    pub panel: bool,
    /// Outputs where there is no display.
    pub pictures: PictureArgs,
}

/// Renders a picture, as there is no window in this program.
#[cfg(not(feature = "window"))]
pub fn show(job: &WindowJob, view: &ViewArgs) -> Result<(), Failure> {
    view.set_threads();
    instead("the program was built without the feature \"window\"", job, view)
}

/// Shows it; without a display, renders a picture.
#[cfg(feature = "window")]
pub fn show(job: &WindowJob, view: &ViewArgs) -> Result<(), Failure> {
    view.set_threads();
    let load = LoadOptions { seed: job.seed, ..view.load() };
    let mut session = frames::load_session(&job.scene, view.camera.as_deref(), &load)?;
    session.begin(&job.files, job.from)?;
    while session.is_replay() && session.step_number() < job.from && session.play()? {}
    let world = &mut session.simulation.world;
    world.resource_mut::<LightPolicies>().forced = view.lights;
    if let Some(speed) = job.speed {
        world.resource_mut::<Clock>().speed = speed;
    }
    let options =
        app::Options { session, size: view.size, settings: view.settings(), paused: job.paused, panel: job.panel };
    match app::run(options) {
        Ok(()) => Ok(()),
        Err(AppError::NoDisplay(reason)) => instead(&reason, job, view),
        Err(AppError::Frame(error)) => Err(error.into()),
    }
}

/// Renders a picture in place of a window, and says why.
fn instead(reason: &str, job: &WindowJob, view: &ViewArgs) -> Result<(), Failure> {
    eprintln!("no window: {reason}\nrendering a picture instead");
    let frames = if job.files.replay.is_some() { Frames::Range(job.from..job.from + 1) } else { Frames::First(1) };
    let mut pictures = job.pictures.job(&job.scene, Path::new("relief-frames"), view);
    pictures.run = RunJob { frames, files: job.files.clone(), ..pictures.run };
    // A replay may have another seed than its scene.
    pictures.run.load.seed = job.seed;
    render(&Work::Frames(pictures))
}
