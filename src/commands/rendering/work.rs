//! Options of what is rendered of which frames.

use crate::commands::common::arguments;
use crate::commands::common::progress;
use crate::commands::common::view::{FileArgs, PictureArgs, ViewArgs, parse_frames};
use crate::data::{DatasetOptions, FileFormat, SensorJob, Work};
use crate::frames::{Frames, RunJob};
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
    pub fn job(&self, scene: &Path, folder: &Path) -> Work {
        let mut job = self.pictures.job(scene, folder, &self.view);
        job.run = RunJob { frames: self.frames.clone(), files: self.files.run_files(), ..job.run };
        if self.sensors.is_empty() {
            return Work::Frames(job);
        }
        let dataset = DatasetOptions {
            sensors: (self.sensors != ["all"]).then(|| self.sensors.clone()),
            formats: self.format.clone(),
            resume: self.pictures.resume,
            ..DatasetOptions::new(folder)
        };
        Work::Sensors(SensorJob { run: job.run, dataset })
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
