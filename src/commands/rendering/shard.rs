//! `relief render --shard`: a shard with the options that its run was split with.

use crate::commands::common::failure::{Failure, say};
use crate::commands::rendering::split::refused_option;
use crate::commands::rendering::work::{WorkArgs, with_bar};
use crate::data::shards::{Job, ShardRun, render_shard};
use crate::data::{SensorJob, render_sensors};
use crate::frames::{FrameJob, render_frames};
use clap::Parser;
use std::path::Path;

/// Options as relief split has kept them.
#[derive(Parser)]
struct KeptOptions {
    #[command(flatten)]
    work: WorkArgs,
}

/// Renders one; `scene`: where the scene is, if it has moved.
pub fn render(file: &Path, number: usize, scene: Option<&Path>, resume: bool) -> Result<(), Failure> {
    let (job, _) = Job::read(file)?;
    let options = std::iter::once("relief").chain(job.options.iter().map(String::as_str));
    let kept = KeptOptions::try_parse_from(options).map_err(|error| {
        let first = error.to_string().lines().next().unwrap_or_default().to_owned();
        Failure::bad_input(format!("{}: options: {first}", file.display()))
    })?;
    let work = kept.work;
    if let Some(option) = refused_option(&work) {
        return Err(Failure::bad_input(format!("{}: options: --{option} is not of shards", file.display())));
    }
    let rendered = render_shard(file, number, resume, |job, ShardRun { folder, frames, part, run }| {
        let scene = scene.unwrap_or(&job.scene);
        with_bar(|progress| match work.sensors.is_empty() {
            true => render_frames(&FrameJob { frames, run, ..work.frame_job(scene, &folder) }, progress),
            false => {
                let mut job = SensorJob { frames, run, ..work.sensor_job(scene, &folder) };
                job.dataset.part = Some(part);
                render_sensors(&job, progress)
            }
        })
    })?;
    match rendered {
        Some(folder) => say(&folder.display().to_string())?,
        None => say(&format!("nothing to do: {} is whole", job.folder_of(file, number).display()))?,
    }
    Ok(())
}
