//! `relief run`, which `relief` alone means, too.

use crate::commands::common::arguments;
use crate::commands::common::failure::Failure;
use crate::commands::common::view::{FileArgs, PictureArgs, ViewArgs};
use crate::commands::window::{WindowJob, show};
use crate::demo;
use crate::frames::OutputKind;
use clap::Args;
use std::path::PathBuf;
use systems::ecs::clock::SPEEDS;

#[derive(Args)]
pub struct RunArgs {
    /// Scene (.ron) or model (.gltf, .glb) [default: the demo scene]
    pub scene: Option<PathBuf>,
    #[command(flatten)]
    pub view: ViewArgs,
    #[command(flatten)]
    pub files: FileArgs,
    /// Simulated seconds per real second, 0.1 to 100 [default: the scene's]
    #[arg(long, value_name = "X", value_parser = arguments::number(SPEEDS))]
    pub speed: Option<f64>,
    /// Start paused
    #[arg(long)]
    pub paused: bool,
    /// Start with the panel hidden (Tab shows it)
    #[arg(long)]
    pub no_panel: bool,
}

pub fn run(args: &RunArgs) -> Result<(), Failure> {
    let window = WindowJob {
        seed: None,
        scene: args.scene.clone().unwrap_or_else(demo::scene_path),
        files: args.files.run_files(),
        from: 0,
        speed: args.speed,
        paused: args.paused,
        panel: !args.no_panel,
        pictures: PictureArgs { outputs: vec![OutputKind::Color], resume: false, video: None, realtime: false },
    };
    show(&window, &args.view)
}
