//! `relief shadows`.

use crate::commands::common::arguments;
use crate::commands::common::failure::Failure;
use crate::commands::tools::frame_error::FrameErrorArgs;
use crate::renderer::Settings;
use crate::tools::shadow_error;
use clap::Args;

pub const HELP: &str = "\
The reference has all lights, each where a ray from the surface reaches it. Compared with it are:
  unshadowed  the frame without shadows
  maps        the frame with shadow maps
  perfect     the scene's light policies, with traced shadows of each light in an object's list: what
              perfect shadow maps for these lights would give
and, in scenes with cells:
  no cells    the frame without shadows, as if there were no cells
Such scenes are also told how many lights reach an object.
L: linear luminance.
  mean   over pixels that show objects, the mean of |L - L_truth|, over the mean of L_truth there
  p99    99th percentile of |L - L_truth| / mean L_truth over those pixels
  FLIP   perceived difference when alternating between the pictures, 0 none to 1

Files: truth.png, unshadowed.png, maps.png, perfect.png. And the same three with _error.png:
|L - L_truth| / mean L_truth of each pixel, from 0 (black) over violet and orange to 1 and more (pale
yellow), the same scale in all. See docs/shadows.md for the full definitions.";

#[derive(Args)]
pub struct ShadowErrorArgs {
    #[command(flatten)]
    frame: FrameErrorArgs,
    /// Lights that may have a shadow map at once, as `relief render --shadows`
    #[arg(long, value_name = "K", default_value_t = Settings::default().shadow_maps)]
    #[arg(value_parser = arguments::whole(0u32..=Settings::MOST_SHADOW_MAPS))]
    maps: u32,
}

pub fn run(args: &ShadowErrorArgs) -> Result<(), Failure> {
    let report = shadow_error::measure(&args.frame.job(), args.maps)?;
    args.frame.tell(&report)
}
