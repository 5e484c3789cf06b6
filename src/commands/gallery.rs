//! `relief gallery`.

use super::arguments::{self, MOST_FRAMES};
use super::failure::{Failure, say};
use super::{progress, view};
use clap::Args;
use relief::demo;
use relief::gallery::{self, GalleryJob};
use std::path::PathBuf;

pub const HELP: &str = "\
An entity of a scene may have a figure, a list of meshes of which it shows one; key F of the window
shows the next of every figure. Here each gets a picture of its own, as the scene's first camera
sees it: torus.png, sphere.png, cube.png and quad.png of the scene that comes with Relief, named by
the meshes' names in the scene. gallery.png has them all, side by side.

Examples:
  relief gallery -o pictures                        every bump technique on four shapes
  relief gallery -o pictures --frame 300            five seconds later: its light goes round
  relief gallery -o pictures --scene my.ron --size 800x600

docs/techniques.md tells what each technique does, docs/scenes.md how a scene gets figures.";

#[derive(Args)]
pub struct GalleryArgs {
    /// Folder for the pictures; made if missing
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// A scene with figures [default: every bump technique on one figure, assets/scenes/techniques.ron]
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
    /// Pixels of each picture; the sheet has 2560 at the most along its longer side
    #[arg(long, default_value = "1600x900", value_name = "WxH", value_parser = arguments::parse_size)]
    pub size: (u32, u32),
    /// Which frame: steps of the scene's clock before the pictures
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = arguments::whole(0..=MOST_FRAMES - 1))]
    pub frame: u64,
}

pub fn run(args: &GalleryArgs) -> Result<(), Failure> {
    let bar = progress::bar("{bar:40} figure {pos}/{len}");
    let job = GalleryJob {
        scene: args.scene.clone().unwrap_or_else(demo::techniques_path),
        load: view::loading(),
        folder: args.output.clone(),
        size: args.size,
        frame: args.frame,
    };
    let written = gallery::render(&job, |done, of| progress::show(&bar, done, of))?;
    bar.finish_and_clear();
    Ok(written.iter().try_for_each(|path| say(&path.display().to_string()))?)
}
