//! The frames of a run, one after the other, as files.
//!
//! The range asked for is reached by stepping ([`super::run`]) and drawn frame by frame. Each picture is written whole,
//! so that an interrupted run can be resumed by what is there.

use super::FrameError;
use super::encoding::{OutputKind, is_written, names_of_ids, outputs_of, pictures};
use super::run::{FrameRun, Frames};
use super::run_job::RunJob;
use super::scene::{check_outputs, load_session};
use crate::animation::{self, Animation};
use crate::frame_time::FrameTime;
use crate::output;
use crate::recording::RecordingError;
use crate::renderer::{Gpu, Settings, SingleView};
use crate::video;
use serde::{Deserialize, Serialize};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use systems::ecs::clock::Clock;
use systems::lights::LightPolicies;

/// Job that renders the frames of a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameJob {
    /// The run.
    pub run: RunJob,
    /// Folder of the pictures; made if missing.
    pub folder: PathBuf,
    /// Pixels.
    pub size: (u32, u32),
    /// The name of the camera, or `chase NAME`, `driver NAME` of a vehicle; `None`: the scene's first camera.
    pub camera: Option<String>,
    /// Kinds of pictures.
    pub outputs: Vec<OutputKind>,
    /// Leaves frames alone whose pictures are all there.
    pub resume: bool,
    /// A film of the colour frames, made when they are all there; its rate is that of the scene's clock.
    pub video: Option<PathBuf>,
}

impl FrameJob {
    /// Pixels that a side of a picture has at most.
    pub const LARGEST_SIDE: u32 = 16384;

    fn picture(&self, kind: OutputKind, frame: u64) -> PathBuf {
        self.folder.join(format!("{}_{frame:05}.png", kind.name()))
    }

    fn names_of_ids(&self) -> Option<PathBuf> {
        self.outputs.contains(&OutputKind::Id).then(|| self.folder.join("ids.json"))
    }

    /// Tells if a file may be written beside those that the run is kept in.
    fn writes(&self, path: &Path) -> bool {
        // What is made where ffmpeg is missing, too.
        let instead = |film: &PathBuf| Animation::of(film).is_none().then(|| animation::instead_of(film));
        let films = self.video.iter().flat_map(|film| std::iter::once(film.clone()).chain(instead(film)));
        films.into_iter().any(|film| output::is_same(path, &film)) || self.writes_beside_film(path)
    }

    /// Tells if a file may be a picture of the run, or has the names of ids.
    fn writes_beside_film(&self, path: &Path) -> bool {
        let path = &output::real(path);
        let is_picture = |kind: &OutputKind| {
            let name = path.file_name().and_then(OsStr::to_str);
            let number = name.and_then(|name| name.strip_prefix(kind.name())?.strip_prefix('_')?.strip_suffix(".png"));
            let frame = number.and_then(|number| number.parse().ok()).filter(|&frame| self.may_draw(frame));
            frame.is_some_and(|frame| output::is_same(path, &self.picture(*kind, frame)))
        };
        self.names_of_ids().is_some_and(|names| output::is_same(path, &names)) || self.outputs.iter().any(is_picture)
    }

    /// Tells if a frame may be one of the run's, as far as that is known before its files are read.
    fn may_draw(&self, frame: u64) -> bool {
        let begins_at_0 = self.run.files.from_snapshot.is_none() && self.run.files.replay.is_none();
        match &self.run.frames {
            Frames::Range(range) => range.contains(&frame),
            Frames::First(count) => !begins_at_0 || frame < *count,
            Frames::All => !begins_at_0 || frame == 0,
        }
    }
}

/// Renders a job; `progress` is called after each frame with how many are done, and of how many. Returns the files
/// written.
///
/// # Errors
/// [`FrameError`]; pictures written before stay.
pub fn render_frames(job: &FrameJob, mut progress: impl FnMut(u64, u64)) -> Result<Vec<PathBuf>, FrameError> {
    if let Some(path) = job.run.files.written().find(|path| job.writes(path)) {
        return Err(RecordingError::taken(path).into());
    }
    if let Some(film) = &job.video {
        if job.writes_beside_film(film) {
            return Err(RecordingError::taken(film).into());
        }
        video::check(film)?;
    }
    let begun_from: Vec<PathBuf> = job.run.files.replay.iter().chain(&job.run.files.from_snapshot).cloned().collect();
    check_outputs(&begun_from, |path| job.writes(path))?;
    // The driver and its pipelines take their time; the scene loads meanwhile.
    let opening = std::thread::spawn(|| Gpu::headless().map(|gpu| SingleView::new(&gpu)));
    let session = load_session(&job.run.scene, job.camera.as_deref(), &job.run.load);
    let renderer = opening.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    let session = session?;
    let mut renderer = renderer?;
    check_outputs(&session.scene.files, |path| job.writes(path))?;
    let mut run = FrameRun::begin(session, &job.run.files, &job.run.frames, job.run.realtime)?;
    let (session, frames) = (&mut run.session, run.frames.clone());
    output::make_folder(&job.folder)?;
    let frame_time = FrameTime::of(session.simulation.world.resource::<Clock>().step_seconds);
    if let Some(film) = &job.video {
        video::warn_of_times(film, frames.clone(), frame_time);
    }
    session.simulation.world.resource_mut::<LightPolicies>().forced = job.run.lights;
    let settings = job.run.settings.for_files();
    let mut written = Vec::new();
    for frame in frames.clone() {
        while run.step() < frame {
            run.advance()?;
        }
        let session = &mut run.session;
        let is_missing = |kind: &OutputKind| !job.resume || !is_written(&job.picture(*kind, frame), job.size);
        let missing: Vec<_> = job.outputs.iter().copied().filter(is_missing).collect();
        if !missing.is_empty() {
            session.simulation.frame();
            let view = session.viewpoint.view(&session.simulation.world, job.size);
            // With one sample, others than those of a whole run would be drawn by other shaders.
            let drawn = if settings.samples == 1 { &job.outputs } else { &missing };
            let settings = Settings { outputs: outputs_of(drawn), ..settings };
            session.simulation.with_frame(|frame| renderer.prepare(frame, &view, &settings))?;
            let pictures = pictures(&mut renderer, &missing);
            renderer.gpu().check()?;
            for (kind, picture) in pictures {
                let path = job.picture(kind, frame);
                output::write_png(&path, &picture)?;
                written.push(path);
            }
        }
        progress(frame + 1 - frames.start, frames.end - frames.start);
    }
    written.extend(run.finish(&job.run.files)?);
    if let Some(names) = job.names_of_ids() {
        output::write_whole(&names, names_of_ids(&mut run.session.simulation.world).as_bytes())?;
        written.push(names);
    }
    if let Some(film) = &job.video {
        written.push(video::encode(film, &job.folder, frames, frame_time)?);
    }
    Ok(written)
}
