//! `relief shadows`.

use super::arguments::{self, MOST_FRAMES};
use super::failure::{Failure, say};
use super::view;
use clap::Args;
use relief::shadow_error::{self, ShadowErrorJob};
use std::path::PathBuf;
use systems::assets::Technique;

pub const HELP: &str = "\
The reference has all lights, each where a ray from the surface reaches it. Compared with it are:
  unshadowed  the frame as it is: nothing casts a shadow yet
  perfect     the scene's light policies, with traced shadows of each light in an object's list: what
              perfect shadow maps for these lights would give
L: linear luminance.
  mean   over pixels that show objects, the mean of |L - L_truth|, over the mean of L_truth there
  p99    99th percentile of |L - L_truth| / mean L_truth over those pixels
  FLIP   perceived difference when alternating between the pictures, 0 none to 1

Files: truth.png, unshadowed.png, perfect.png. And unshadowed_error.png, perfect_error.png:
|L - L_truth| / mean L_truth of each pixel, from 0 (black) over violet and orange to 1 and more (pale
yellow), the same scale in both. See docs/shadows.md for the full definitions.";

#[derive(Args)]
pub struct ShadowsArgs {
    /// Scene (.ron) or model (.gltf, .glb)
    pub scene: PathBuf,
    /// Output directory, created if missing
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Frame number: simulation steps before the picture
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = arguments::whole(0..=MOST_FRAMES - 1))]
    pub frame: u64,
    /// Size in pixels of four samples each, at most 16 million
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

pub fn run(args: &ShadowsArgs) -> Result<(), Failure> {
    systems::set_threads(args.threads.map(usize::from));
    let report = shadow_error::measure(&ShadowErrorJob {
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
