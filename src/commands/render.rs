//! `relief render`.

use super::failure::{Failure, say};
use super::progress;
use super::view::{FileArgs, PictureArgs, ViewArgs, parse_frames};
use clap::Args;
use relief::frames::{FrameJob, Frames, render_frames};
use relief::recording::RunFiles;
use std::path::PathBuf;

#[derive(Args)]
pub struct RenderArgs {
    /// Scene (.ron) or model (.gltf, .glb)
    pub scene: PathBuf,
    /// Output directory, created if missing
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
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

pub fn run(args: &RenderArgs) -> Result<(), Failure> {
    args.view.set_threads();
    render(&FrameJob {
        frames: args.frames.clone(),
        run: RunFiles { save_snapshot: args.save_snapshot.clone(), ..args.files.run_files() },
        ..args.pictures.job(&args.scene, &args.output, &args.view)
    })
}

/// Renders a job under a bar, and says what was written.
pub fn render(job: &FrameJob) -> Result<(), Failure> {
    let bar = progress::bar("{bar:40} frame {pos}/{len}  {per_sec}  {eta} left");
    let written = render_frames(job, |done, of| progress::show(&bar, done, of))?;
    bar.finish_and_clear();
    match written.as_slice() {
        [] => say(&format!("nothing to do: all pictures are in {}", job.folder.display()))?,
        [one] => say(&one.display().to_string())?,
        [first, .., last] => say(&format!("{} files: {} … {}", written.len(), first.display(), last.display()))?,
    }
    Ok(())
}
