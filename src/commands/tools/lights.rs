//! `relief lights`.

use crate::commands::common::failure::Failure;
use crate::commands::tools::frame_error::FrameErrorArgs;
use crate::tools::light_error;

pub const HELP: &str = "\
The frame is drawn without shadows, with all lights (the reference) and by each policy: default (as
the scene and its entities say), three, enough (tolerance 0.001) and hard. L: linear luminance.
  mean   over pixels that show objects, the mean of |L - L_all|, over the mean of L_all there
  p99    99th percentile of |L - L_all| / mean L_all over those pixels
  FLIP   perceived difference when alternating between the pictures, 0 none to 1
  seams  99.9th percentile of the steps of (L - L_all) / mean L_all between neighbouring pixels that
         show two pieces of one object

Files: all.png, default.png, three.png, enough.png, hard.png. And
default_error.png, three_error.png, enough_error.png, hard_error.png: |L - L_all| / mean L_all of each
pixel, from 0 (black) over violet and orange to 1 and more (pale yellow), the same scale in all. See
docs/lights.md for the full definitions.";

pub fn run(args: &FrameErrorArgs) -> Result<(), Failure> {
    let report = light_error::measure(&args.job())?;
    args.tell(&report)
}
