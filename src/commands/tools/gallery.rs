//! `relief gallery`.

use crate::commands::common::arguments::{self, MOST_FRAMES};
use crate::commands::common::failure::{Failure, say};
use crate::commands::common::progress;
use crate::commands::common::view;
use crate::demo;
use crate::tools::gallery::{self, GalleryJob};
use clap::Args;
use std::path::PathBuf;

pub const HELP: &str = "\
An entity of a scene may have mesh variants (field `figure`): a list of meshes of which it shows
one; key F in the window switches all of them to the next. This command draws one picture per
variant from the scene's first camera, named after the mesh: torus.png, sphere.png, cube.png and
quad.png of the default scene. gallery.png is a contact sheet of all.

Examples:
  relief gallery -o pictures                        every bump technique on four mesh variants
  relief gallery -o pictures --frame 300            five seconds later, with the light moved
  relief gallery -o pictures --scene my.ron --size 800x600

See docs/techniques.md for the techniques, docs/scenes.md for mesh variants.";

#[derive(Args)]
pub struct GalleryArgs {
    /// Output directory, created if missing
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Scene with mesh variants [default: every bump technique, assets/scenes/techniques.ron]
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
    /// Size of each picture in pixels; the contact sheet is at most 2560 wide or high
    #[arg(long, default_value = "1600x900", value_name = "WxH", value_parser = arguments::parse_size)]
    pub size: (u32, u32),
    /// Frame number: simulation steps before the pictures
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = arguments::whole(0..=MOST_FRAMES - 1))]
    pub frame: u64,
}

pub fn run(args: &GalleryArgs) -> Result<(), Failure> {
    let bar = progress::bar("{bar:40} variant {pos}/{len}");
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
