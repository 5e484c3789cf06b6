//! `relief render`.

use super::arguments;
use super::failure::{Failure, say};
use super::view::{FileArgs, PictureArgs, ViewArgs, parse_frames};
use super::{progress, shard};
use crate::data::{FileFormat, SensorJob, render_sensors};
use crate::frames::{FrameJob, Frames, render_frames};
use crate::recording::RunFiles;
use clap::Args;
use clap::builder::TypedValueParser;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct RenderArgs {
    /// Scene (.ron) or model (.gltf, .glb); with --shard: where the scene is, if it has moved since it was split
    #[arg(required_unless_present = "shard")]
    pub scene: Option<PathBuf>,
    /// Output directory, created if missing
    #[arg(short, long, value_name = "DIR", required_unless_present = "shard")]
    pub output: Option<PathBuf>,
    /// Render one of the shards that relief split has made, into a folder beside that file; with --resume not if it is
    /// there and whole
    #[arg(long, value_name = "FILE:N", value_parser = parse_shard, conflicts_with_all = OF_SPLIT)]
    pub shard: Option<(PathBuf, usize)>,
    #[command(flatten)]
    pub work: WorkArgs,
    /// Write a snapshot of the state after the last frame, for --from-snapshot
    #[arg(long, value_name = "FILE")]
    pub save_snapshot: Option<PathBuf>,
}

/// What relief split has said of its shards, or makes no sense of one.
const OF_SPLIT: [&str; 24] = [
    "output",
    "sensors",
    "format",
    "frames",
    "outputs",
    "video",
    "realtime",
    "hash",
    "record",
    "from_snapshot",
    "save_snapshot",
    "size",
    "camera",
    "lights",
    "technique",
    "debug",
    "levels",
    "occlusion",
    "samples",
    "specular_aa",
    "shadows",
    "compress",
    "texture_memory",
    "no_cache",
];

/// What is rendered of which frames.
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

pub fn run(args: &RenderArgs) -> Result<(), Failure> {
    let work = &args.work;
    work.view.set_threads();
    if let Some((file, number)) = &args.shard {
        return shard::render(file, *number, args);
    }
    // Without a shard there are both.
    let (Some(scene), Some(folder)) = (&args.scene, &args.output) else { return Ok(()) };
    let files = RunFiles { save_snapshot: args.save_snapshot.clone(), ..work.files.run_files() };
    if work.sensors.is_empty() {
        return render(&FrameJob { run: files, ..work.frame_job(scene, folder) });
    }
    render_captures(&SensorJob { run: files, ..work.sensor_job(scene, folder) })
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

/// A file, and after its last colon a number.
fn parse_shard(text: &str) -> Result<(PathBuf, usize), String> {
    let parts = text.rsplit_once(':').and_then(|(file, number)| Some((file, number.parse().ok()?)));
    let named = parts.filter(|(file, _)| !file.is_empty()).map(|(file, number)| (PathBuf::from(file), number));
    named.ok_or_else(|| "expected relief split's file and the number of a shard, like job/shards.json:7".to_owned())
}

/// Renders a job under a bar, and says what was written.
pub fn render(job: &FrameJob) -> Result<(), Failure> {
    let written = with_bar(|progress| render_frames(job, progress))?;
    say_written(&written, &job.folder)
}

const BAR: &str = "{bar:40} frame {pos}/{len}  {per_sec}  {eta} left";

fn render_captures(job: &SensorJob) -> Result<(), Failure> {
    let written = with_bar(|progress| render_sensors(job, progress))?;
    say_written(&written, &job.folder)
}

/// Does what tells how far it is, under a bar.
pub fn with_bar<T, E>(work: impl FnOnce(&mut dyn FnMut(u64, u64)) -> Result<T, E>) -> Result<T, E> {
    let bar = progress::bar(BAR);
    let done = work(&mut |done, of| progress::show(&bar, done, of))?;
    bar.finish_and_clear();
    Ok(done)
}

fn say_written(written: &[PathBuf], folder: &Path) -> Result<(), Failure> {
    match written {
        [] => say(&format!("nothing to do: all pictures are in {}", folder.display()))?,
        [one] => say(&one.display().to_string())?,
        [first, .., last] => say(&format!("{} files: {} … {}", written.len(), first.display(), last.display()))?,
    }
    Ok(())
}
