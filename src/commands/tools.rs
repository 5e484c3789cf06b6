//! The commands that measure and compare, and make maps: those of the feature `tools`.

use super::Process;
use super::bench::{self, BenchArgs};
use super::compare::{self, CompareArgs};
use super::failure::Failure;
use super::frame_error::FrameErrorArgs;
use super::gallery::{self, GalleryArgs};
use super::lights;
use super::map::{self, MapArgs};
use super::shadows::{self, ShadowErrorArgs};
use clap::Subcommand;

#[derive(Subcommand)]
pub enum Tool {
    /// Compare a frame lit by each light policy with one lit by all lights: error figures and pictures
    #[command(after_help = lights::HELP)]
    Lights(FrameErrorArgs),
    /// Compare a frame's shadows with traced ones: error figures and pictures
    #[command(after_help = shadows::HELP)]
    Shadows(ShadowErrorArgs),
    /// Draw a scene once for each mesh variant, and all on one contact sheet [default scene: every bump technique]
    #[command(after_help = gallery::HELP)]
    Gallery(GalleryArgs),
    /// Compare bump techniques with displaced geometry: error, cost and pictures
    #[command(after_help = compare::HELP)]
    Compare(CompareArgs),
    /// Benchmark a grid of bump-mapped objects under many lights, or any scene
    #[command(after_help = bench::HELP)]
    Bench(BenchArgs),
    /// Make normal, height, horizon and other maps from images
    Map(MapArgs),
}

impl Tool {
    /// Does it.
    pub fn run(self, process: &Process) -> Result<(), Failure> {
        match self {
            Self::Lights(args) => lights::run(&args),
            Self::Shadows(args) => shadows::run(&args),
            Self::Gallery(args) => gallery::run(&args),
            Self::Compare(args) => compare::run(&args),
            Self::Bench(args) => bench::run(&args, process),
            Self::Map(args) => map::run(&args),
        }
    }
}
