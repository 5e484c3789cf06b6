//! Options of what is rendered of which frames.

use crate::commands::common::arguments;
use crate::commands::common::progress;
use crate::commands::common::view::{FileArgs, PictureArgs, ViewArgs, parse_frames};
use crate::data::{DatasetOptions, FileFormat, SensorJob};
use crate::frames::{FrameJob, Frames};
use crate::recording::RunFiles;
use clap::Args;
use clap::builder::TypedValueParser;
use std::path::Path;

/// Rendered outputs, and their frames.
#[derive(Args)]
pub struct WorkArgs {
    /// Capture sensors of the scene instead of its camera's pictures: all, or their names separated by commas; a
    /// folder for each
    #[arg(long, value_name = "all | NAME,…", value_delimiter = ',')]
    #[arg(conflicts_with_all = ["camera", "size", "outputs", "video", "samples"])]
    pub sensors: Vec<String>,
    /// Formats of the sensors' files, separated by commas. The last four are made of a run as a whole: with --resume,
    /// everything is captured anew for them
    #[arg(long, value_name = "FORMAT,…", value_delimiter = ',', requires = "sensors", default_value = "png")]
    #[arg(value_parser = file_format())]
    pub format: Vec<FileFormat>,
    /// Number of frames, or a range A..B of frame numbers, B excluded
    #[arg(long, default_value = "1", value_name = "N | A..B", value_parser = parse_frames)]
    pub frames: Frames,
    #[command(flatten)]
    pub pictures: PictureArgs,
    #[command(flatten)]
    pub files: FileArgs,
    #[command(flatten)]
    pub view: ViewArgs,
}

fn file_format() -> impl TypedValueParser<Value = FileFormat> {
    arguments::choice(&FileFormat::ALL, |format| format.help)
}

impl WorkArgs {
    pub fn frame_job(&self, scene: &Path, folder: &Path) -> FrameJob {
        FrameJob { frames: self.frames.clone(), ..self.pictures.job(scene, folder, &self.view) }
    }

    pub fn sensor_job(&self, scene: &Path, folder: &Path) -> SensorJob {
        let all = self.sensors == ["all"];
        SensorJob {
            scene: scene.to_owned(),
            frames: self.frames.clone(),
            dataset: DatasetOptions {
                folder: folder.to_owned(),
                sensors: (!all).then(|| self.sensors.clone()),
                formats: self.format.clone(),
                resume: self.pictures.resume,
                part: None,
            },
            settings: self.view.settings(),
            lights: self.view.lights,
            load: self.view.load(),
            run: RunFiles::default(),
            realtime: self.pictures.realtime,
        }
    }
}

const BAR: &str = "{bar:40} frame {pos}/{len}  {per_sec}  {eta} left";

/// Does what tells how far it is, under a bar.
pub fn with_bar<T, E>(work: impl FnOnce(&mut dyn FnMut(u64, u64)) -> Result<T, E>) -> Result<T, E> {
    let bar = progress::bar(BAR);
    let done = work(&mut |done, of| progress::show(&bar, done, of))?;
    bar.finish_and_clear();
    Ok(done)
}
