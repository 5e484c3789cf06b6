//! `relief shadows`.

use super::failure::Failure;
use super::frame_error::FrameErrorArgs;
use relief::shadow_error;

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

pub fn run(args: &FrameErrorArgs) -> Result<(), Failure> {
    let report = shadow_error::measure(&args.job())?;
    args.tell(&report.json(), &report)
}
