//! Common parts of `relief lights`, `relief shadows` and `relief sky`: the frame, and the report of its error.

use crate::commands::common::arguments::{self, MOST_FRAMES, ThreadsArgs};
use crate::commands::common::failure::{Failure, say};
use crate::commands::common::view;
use crate::scene::weather_preset;
use crate::session::LoadOptions;
use crate::tools::frame_error::FrameErrorJob;
use crate::tools::json_line;
use clap::Args;
use serde::Serialize;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use systems::assets::Technique;
use systems::weather::{PRESETS, Weather};

#[derive(Args)]
pub struct FrameErrorArgs {
    /// Scene (.ron) or model (.gltf, .glb)
    pub scene: PathBuf,
    /// Output directory, created if missing
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Frame number: simulation steps before the picture
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = arguments::whole(0..=MOST_FRAMES - 1))]
    pub frame: u64,
    /// Size in pixels, at most 16 million
    #[arg(long, default_value = "1280x720", value_name = "WxH", value_parser = arguments::parse_size)]
    pub size: (u32, u32),
    /// Name of the camera, or "chase NAME" or "driver NAME" of a vehicle [default: the first camera]
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Override the bump technique of all materials: off, normal, relief, … (docs/techniques.md)
    #[arg(long, value_name = "NAME", value_parser = arguments::named("technique", &Technique::ALL))]
    pub technique: Option<Technique>,
    #[arg(long, value_name = "NAME", value_parser = weather_preset)]
    #[arg(help = arguments::one_of("Weather in place of the scene's: ", PRESETS.map(|preset| preset.name)))]
    pub weather: Option<Weather>,
    #[command(flatten)]
    pub threads: ThreadsArgs,
    /// Print one line of JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

impl FrameErrorArgs {
    pub fn job(&self) -> FrameErrorJob {
        self.threads.set();
        FrameErrorJob {
            scene: self.scene.clone(),
            load: LoadOptions { weather: self.weather.clone(), ..view::loading() },
            folder: self.output.clone(),
            frame: self.frame,
            size: self.size,
            camera: self.camera.clone(),
            technique: self.technique,
        }
    }

    /// Prints what was found.
    pub fn tell(&self, report: &(impl Serialize + Display)) -> Result<(), Failure> {
        tell(report, self.json, &self.output)
    }
}

/// Prints figures as a line of JSON, or as a table and where the pictures are.
pub fn tell(report: &(impl Serialize + Display), json: bool, pictures: &Path) -> Result<(), Failure> {
    let told = if json { json_line(report) } else { format!("{report}pictures: {}", pictures.display()) };
    Ok(say(&told)?)
}
