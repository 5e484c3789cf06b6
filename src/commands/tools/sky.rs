//! `relief sky`.

use crate::commands::common::failure::Failure;
use crate::commands::tools::frame_error::FrameErrorArgs;
use crate::tools::sky_error;

pub const HELP: &str = "\
The reference is the light of the sky's upper half on each pixel's surface, by 512 rays about its shading
normal. Compared with it are:
  none      the same light as if nothing hid the sky
  openness  the same by the openness that pictures are drawn with
  perfect   what rays find, times the light of an open place by harmonics
L: illuminance by the sky, without sun and moon and what surfaces throw back.
  mean   over pixels that show objects, the mean of |L - L_truth|, over the mean of L_truth there
  p99    99th percentile of |L - L_truth| / mean L_truth over those pixels
  FLIP   perceived difference when alternating between the pictures, 0 none to 1

Files: truth.png, none.png, openness.png, perfect.png, in which white is a level surface under an open sky.
And the last three with _error.png. See docs/weather.md for the full definitions.";

pub fn run(args: &FrameErrorArgs) -> Result<(), Failure> {
    args.tell(&sky_error::measure(&args.job())?)
}
