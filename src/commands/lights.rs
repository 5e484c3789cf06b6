//! `relief lights`.

use super::arguments::{self, MOST_FRAMES};
use super::failure::{Failure, say};
use super::view;
use clap::Args;
use relief::light_error::{self, LightErrorJob};
use std::path::PathBuf;
use systems::assets::Technique;

pub const HELP: &str = "\
The frame is drawn with all lights (the reference), and by each policy: default (as the scene and its
entities say), three, enough (tolerance 0.001) and hard. L: linear luminance.
  mean   over pixels that show objects, the mean of |L - L_all|, over the mean of L_all there
  p99    99th percentile of |L - L_all| / mean L_all over those pixels
  FLIP   perceived difference when alternating between the pictures, 0 none to 1
  seams  99.9th percentile of the steps of (L - L_all) / mean L_all between neighbouring pixels that
         show two pieces of one object

Files: all.png, default.png, three.png, enough.png, hard.png as relief render writes them. And
default_error.png, three_error.png, enough_error.png, hard_error.png: |L - L_all| / mean L_all of each
pixel, from 0 (black) over violet and orange to 1 and more (pale yellow), the same scale in all. See
docs/lights.md for the full definitions.";

#[derive(Args)]
pub struct LightsArgs {
    /// Scene (.ron) or model (.gltf, .glb)
    pub scene: PathBuf,
    /// Output directory, created if missing
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Frame number: simulation steps before the picture
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = arguments::whole(0..=MOST_FRAMES - 1))]
    pub frame: u64,
    /// Size in pixels, at most 16 million
    #[arg(long, default_value = "1280x720", value_name = "WxH", value_parser = arguments::parse_size)]
    pub size: (u32, u32),
    /// Name of the camera, or "chase NAME" or "driver NAME" of a vehicle [default: the first camera]
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Override the bump technique of all materials: off, normal, relief, … (docs/techniques.md)
    #[arg(long, value_name = "NAME", value_parser = arguments::named("technique", &Technique::ALL))]
    pub technique: Option<Technique>,
    /// Worker threads; the number does not change pictures [default: one per core]
    #[arg(long, value_name = "N", value_parser = arguments::whole(1u16..=256))]
    pub threads: Option<u16>,
    /// Print one line of JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &LightsArgs) -> Result<(), Failure> {
    systems::set_threads(args.threads.map(usize::from));
    let report = light_error::measure(&LightErrorJob {
        scene: args.scene.clone(),
        load: view::loading(),
        folder: args.output.clone(),
        frame: args.frame,
        size: args.size,
        camera: args.camera.clone(),
        technique: args.technique,
    })?;
    if args.json {
        say(&report.json())?;
    } else {
        say(&format!("{report}pictures: {}", args.output.display()))?;
    }
    Ok(())
}
