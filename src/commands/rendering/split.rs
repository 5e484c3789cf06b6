//! `relief split`.

use crate::commands::common::failure::{Failure, say};
use crate::commands::rendering::work::{WorkArgs, with_bar};
use crate::data::shards::{SplitJob, split};
use clap::Args;
use std::path::PathBuf;

pub const HELP: &str = "\
Examples:
  relief split town.ron --frames 36000 --shards 40 -o job --sensors all --format png,mcap
  relief render --shard job/shards.json:7         each of the shards 0 to 39, anywhere
  relief merge job -o dataset                     what one relief render writes, byte for byte

See docs/many_machines.md for Slurm and Ray.";

#[derive(Args)]
#[command(mut_args(|arg| if NOT_HERE.contains(&arg.get_id().as_str()) { arg.hide(true) } else { arg }))]
pub struct SplitArgs {
    /// Scene (.ron) or model (.gltf, .glb)
    pub scene: PathBuf,
    /// Directory of the job, created if missing: shards.json, a snapshot for each shard, and later the shards
    #[arg(short, long, value_name = "JOB")]
    pub output: PathBuf,
    /// Number of shards, of about as many frames each
    #[arg(long, value_name = "N", value_parser = crate::commands::common::arguments::whole(1usize..=1_000_000))]
    pub shards: usize,
    #[command(flatten)]
    pub work: WorkArgs,
}

/// Options of one process.
const NOT_HERE: [&str; 5] = ["video", "resume", "realtime", "hash", "record"];

/// The first of the given options that shards do not have.
fn refused_option(work: &WorkArgs) -> Option<&'static str> {
    let (pictures, files) = (&work.pictures, &work.files);
    let given =
        [pictures.video.is_some(), pictures.resume, pictures.realtime, files.hash.is_some(), files.record.is_some()];
    NOT_HERE.into_iter().zip(given).find(|(_, is_given)| *is_given).map(|(name, _)| name)
}

pub fn run(args: &SplitArgs) -> Result<(), Failure> {
    let work = &args.work;
    if let Some(option) = refused_option(work) {
        let instead =
            if option == "video" { "relief merge --video makes a film of the frames" } else { "not of shards" };
        return Err(Failure::bad_input(format!("--{option}: {instead}")));
    }
    work.view.set_threads();
    let job = SplitJob { work: work.job(&args.scene, &args.output), folder: args.output.clone(), shards: args.shards };
    let file = with_bar(|progress| split(&job, progress))?;
    Ok(say(&format!("{}: {} shards", file.display(), args.shards))?)
}
