//! `relief merge`.

use crate::commands::common::failure::{Failure, say};
use crate::data::shards::{MergeOptions, merge};
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
pub struct MergeArgs {
    /// Directory of the job that relief split has made
    pub job: PathBuf,
    /// Directory of what is put together, new or empty [default: merged, in the job's]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Put shards together, too, that different machines or drivers have rendered: their pictures may differ
    #[arg(long)]
    pub mixed: bool,
    /// Also encode the colour frames as a video, as relief render does
    #[arg(long, value_name = "FILE.mp4")]
    pub video: Option<PathBuf>,
}

pub fn run(args: &MergeArgs) -> Result<(), Failure> {
    let folder = args.output.clone().unwrap_or_else(|| args.job.join("merged"));
    let options = MergeOptions { folder, mixed: args.mixed, video: args.video.clone() };
    let film = merge(&args.job.join("shards.json"), &options)?;
    say(&options.folder.display().to_string())?;
    Ok(film.map_or(Ok(()), |film| say(&film.display().to_string()))?)
}
