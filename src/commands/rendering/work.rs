//! Options of what is rendered of which frames.

use crate::commands::common::arguments;
use crate::commands::common::progress;
use crate::commands::common::view::{FileArgs, PictureArgs, ViewArgs, parse_frames};
use crate::data::{FileFormat, SensorJob};
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
    /// Formats of the sensors' files, separated by commas
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
    arguments::choice(&FileFormat::ALL, |format| match format {
        FileFormat::Png => {
            "A picture per output: 8 bits, 16 bits of 1/256 m, or ids as 24-bit colour; not linear colours"
        }
        FileFormat::Npy => "An array of numpy per output; of sensors that are no cameras one of records",
        FileFormat::Npz => "The arrays of a capture in one file",
        FileFormat::Exr => "A picture per capture with named channels: R G B (linear), Z, N.X N.Y N.Z, range, ids",
        FileFormat::Mcap => {
            "sensors.mcap, one log of ROS 2 for the run: image_raw, depth, class, instance and camera_info of cameras, \
             points of lidars, imu, fix of GNSS, /tf, /clock; --resume captures everything anew, as it does for the \
             next three"
        }
        FileFormat::Coco => {
            "coco/instances.json and panoptic.json for the run, of cameras with color, instance and class; with the \
             color pictures"
        }
        FileFormat::Kitti => {
            "NAME/kitti for each camera with color: image_2, label_2 (boxes), calib, depth, semantic (class), flow, and \
             velodyne and labels of the lidar beside it"
        }
        FileFormat::Video => "NAME/OUTPUT.mp4 for each output of cameras, to look at; needs ffmpeg",
    })
}

impl WorkArgs {
    pub fn frame_job(&self, scene: &Path, folder: &Path) -> FrameJob {
        FrameJob { frames: self.frames.clone(), ..self.pictures.job(scene, folder, &self.view) }
    }

    pub fn sensor_job(&self, scene: &Path, folder: &Path) -> SensorJob {
        let all = self.sensors == ["all"];
        SensorJob {
            scene: scene.to_owned(),
            folder: folder.to_owned(),
            frames: self.frames.clone(),
            sensors: (!all).then(|| self.sensors.clone()),
            formats: self.format.clone(),
            settings: self.view.settings(),
            lights: self.view.lights,
            resume: self.pictures.resume,
            load: self.view.load(),
            run: RunFiles::default(),
            realtime: self.pictures.realtime,
            part: None,
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
