//! Renderings of a run as data: of its frames as pictures, or of its sensors as a data set.

use crate::data::dataset::job::{SensorJob, render_sensors};
use crate::frames::{FrameError, FrameJob, Frames, RunJob, render_frames};
use crate::renderer::Settings;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Rendering of a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Work {
    /// Pictures of a camera.
    Frames(FrameJob),
    /// Captures of sensors.
    Sensors(SensorJob),
}

impl Work {
    /// Renders it; `progress` is called after each frame with how many are done, and of how many. Returns the files
    /// written.
    ///
    /// # Errors
    /// [`FrameError`]; files written before stay.
    pub fn render(&self, progress: impl FnMut(u64, u64)) -> Result<Vec<PathBuf>, FrameError> {
        match self {
            Self::Frames(job) => render_frames(job, progress),
            Self::Sensors(job) => render_sensors(job, progress),
        }
    }

    /// The run.
    pub fn run(&self) -> &RunJob {
        match self {
            Self::Frames(job) => &job.run,
            Self::Sensors(job) => &job.run,
        }
    }

    /// The run, to be changed.
    pub fn run_mut(&mut self) -> &mut RunJob {
        match self {
            Self::Frames(job) => &mut job.run,
            Self::Sensors(job) => &mut job.run,
        }
    }

    /// Folder of the files.
    pub fn folder(&self) -> &Path {
        match self {
            Self::Frames(job) => &job.folder,
            Self::Sensors(job) => &job.dataset.folder,
        }
    }

    /// The same in a folder, all of it anew, and without a film.
    #[must_use]
    pub(super) fn anew_in(mut self, folder: PathBuf) -> Self {
        match &mut self {
            Self::Frames(job) => (job.folder, job.resume, job.video) = (folder, false, None),
            Self::Sensors(job) => (job.dataset.folder, job.dataset.resume) = (folder, false),
        }
        self
    }

    /// Fault of a work that was read from a file.
    pub(super) fn fault(&self) -> Option<String> {
        let Settings { samples, shadow_maps, .. } = self.run().settings;
        let most = Settings::MOST_SHADOW_MAPS;
        if ![1, 4].contains(&samples) {
            return Some(format!("samples: expected 1 or 4, found {samples}"));
        }
        if shadow_maps > most {
            return Some(format!("shadow_maps: expected 0 to {most}, found {shadow_maps}"));
        }
        let last = match &self.run().frames {
            Frames::First(count) => *count,
            Frames::Range(range) => range.end,
            Frames::All => 0,
        };
        if last > RunJob::MOST_FRAMES {
            return Some(format!("frames: expected numbers below {}, found {last}", RunJob::MOST_FRAMES));
        }
        match self {
            Self::Sensors(job) if job.dataset.sensors.as_ref().is_some_and(Vec::is_empty) => {
                Some("sensors: expected at least one".to_owned())
            }
            Self::Frames(FrameJob { size: (width, height), .. })
                if ![width, height].iter().all(|side| (1..=FrameJob::LARGEST_SIDE).contains(*side)) =>
            {
                Some(format!("size: expected 1 to {} each, found {width}x{height}", FrameJob::LARGEST_SIDE))
            }
            Self::Frames(job) if job.outputs.is_empty() => Some("outputs: expected at least one".to_owned()),
            Self::Sensors(job) if job.dataset.formats.is_empty() => Some("formats: expected at least one".to_owned()),
            _ => None,
        }
    }
}
