//! `relief render`.

use crate::commands::common::failure::{Failure, say};
use crate::commands::rendering::shard;
use crate::commands::rendering::work::{WorkArgs, with_bar};
use crate::data::Work;
use clap::Args;
use std::path::PathBuf;

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
    #[arg(long, value_name = "FILE:N", value_parser = parse_shard, conflicts_with_all = split_options())]
    pub shard: Option<(PathBuf, usize)>,
    #[command(flatten)]
    pub work: WorkArgs,
    /// Write a snapshot of the state after the last frame, for --from-snapshot
    #[arg(long, value_name = "FILE")]
    pub save_snapshot: Option<PathBuf>,
}

/// Options that relief split has fixed for its shards, or that make no sense for one.
fn split_options() -> Vec<clap::Id> {
    let work = WorkArgs::augment_args(clap::Command::new("work"));
    let ids = work.get_arguments().map(|option| option.get_id().clone()).filter(|id| id != "resume" && id != "threads");
    ids.chain(["output", "save_snapshot"].map(clap::Id::from)).collect()
}

pub fn run(args: &RenderArgs) -> Result<(), Failure> {
    let work = &args.work;
    work.view.set_threads();
    if let Some((file, number)) = &args.shard {
        return shard::render(file, *number, args.scene.clone(), work.pictures.resume);
    }
    // Without a shard there are both.
    let (Some(scene), Some(folder)) = (&args.scene, &args.output) else { return Ok(()) };
    let mut job = work.job(scene, folder);
    job.run_mut().files.save_snapshot.clone_from(&args.save_snapshot);
    render(&job)
}

/// A file, and after its last colon a number.
fn parse_shard(text: &str) -> Result<(PathBuf, usize), String> {
    let parts = text.rsplit_once(':').and_then(|(file, number)| Some((file, number.parse().ok()?)));
    let named = parts.filter(|(file, _)| !file.is_empty()).map(|(file, number)| (PathBuf::from(file), number));
    named.ok_or_else(|| "expected relief split's file and the number of a shard, like job/shards.json:7".to_owned())
}

/// Renders a job under a bar, and says what was written.
pub fn render(job: &Work) -> Result<(), Failure> {
    let written = with_bar(|progress| job.render(progress))?;
    match &written[..] {
        [] => say(&format!("nothing to do: all pictures are in {}", job.folder().display()))?,
        [one] => say(&one.display().to_string())?,
        [first, .., last] => say(&format!("{} files: {} … {}", written.len(), first.display(), last.display()))?,
    }
    Ok(())
}
