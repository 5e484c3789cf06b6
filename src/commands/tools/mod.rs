//! The commands that measure and compare, and make maps: those of the feature `tools`.

mod bench;
mod compare;
mod frame_error;
mod gallery;
mod lights;
mod map;
mod shadows;
mod sky;

use crate::commands::common::failure::Failure;
use crate::commands::common::process::Process;
use bench::BenchArgs;
use clap::Subcommand;
use compare::CompareArgs;
use frame_error::FrameErrorArgs;
use gallery::GalleryArgs;
use map::MapArgs;
use shadows::ShadowErrorArgs;

#[derive(Subcommand)]
pub enum Tool {
    /// Compare a frame lit by each light policy with one lit by all lights: error figures and pictures
    #[command(after_help = lights::HELP)]
    Lights(FrameErrorArgs),
    /// Compare a frame's shadows with traced ones: error figures and pictures
    #[command(after_help = shadows::HELP)]
    Shadows(ShadowErrorArgs),
    /// Compare the light of a frame's sky with what rays find: error figures and pictures
    #[command(after_help = sky::HELP)]
    Sky(FrameErrorArgs),
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
            Self::Sky(args) => sky::run(&args),
            Self::Gallery(args) => gallery::run(&args),
            Self::Compare(args) => compare::run(&args),
            Self::Bench(args) => bench::run(&args, process),
            Self::Map(args) => map::run(&args),
        }
    }
}
