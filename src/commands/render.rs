//! `relief render`.

use super::arguments;
use super::failure::{Failure, say};
use super::progress;
use super::view::{FileArgs, PictureArgs, ViewArgs, parse_frames};
use clap::Args;
use clap::builder::TypedValueParser;
use relief::frames::{FrameJob, Frames, render_frames};
use relief::recording::RunFiles;
use relief::sensors::{FileFormat, SensorJob, render_sensors};
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct RenderArgs {
    /// Scene (.ron) or model (.gltf, .glb)
    pub scene: PathBuf,
    /// Output directory, created if missing
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
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
    /// Write a snapshot of the state after the last frame, for --from-snapshot
    #[arg(long, value_name = "FILE")]
    pub save_snapshot: Option<PathBuf>,
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

pub fn run(args: &RenderArgs) -> Result<(), Failure> {
    args.view.set_threads();
    if !args.sensors.is_empty() {
        return render_sensors_of(args);
    }
    render(&FrameJob {
        frames: args.frames.clone(),
        run: RunFiles { save_snapshot: args.save_snapshot.clone(), ..args.files.run_files() },
        ..args.pictures.job(&args.scene, &args.output, &args.view)
    })
}

/// Renders a job under a bar, and says what was written.
pub fn render(job: &FrameJob) -> Result<(), Failure> {
    let bar = progress::bar(BAR);
    let written = render_frames(job, |done, of| progress::show(&bar, done, of))?;
    bar.finish_and_clear();
    say_written(&written, &job.folder)
}

const BAR: &str = "{bar:40} frame {pos}/{len}  {per_sec}  {eta} left";

fn render_sensors_of(args: &RenderArgs) -> Result<(), Failure> {
    let all = args.sensors == ["all"];
    let job = SensorJob {
        scene: args.scene.clone(),
        folder: args.output.clone(),
        frames: args.frames.clone(),
        sensors: (!all).then(|| args.sensors.clone()),
        formats: args.format.clone(),
        settings: args.view.settings(),
        lights: args.view.lights,
        resume: args.pictures.resume,
        load: args.view.load(),
        run: RunFiles { save_snapshot: args.save_snapshot.clone(), ..args.files.run_files() },
        realtime: args.pictures.realtime,
    };
    let bar = progress::bar(BAR);
    let written = render_sensors(&job, |done, of| progress::show(&bar, done, of))?;
    bar.finish_and_clear();
    say_written(&written, &job.folder)
}

fn say_written(written: &[PathBuf], folder: &Path) -> Result<(), Failure> {
    match written {
        [] => say(&format!("nothing to do: all pictures are in {}", folder.display()))?,
        [one] => say(&one.display().to_string())?,
        [first, .., last] => say(&format!("{} files: {} … {}", written.len(), first.display(), last.display()))?,
    }
    Ok(())
}
