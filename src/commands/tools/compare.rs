//! `relief compare`.

use crate::commands::common::arguments;
use crate::commands::common::failure::Failure;
use crate::commands::common::progress;
use crate::commands::tools::frame_error::tell;
use crate::tools::technique_error::{self, BaseMesh, CompareJob, MOST_DEGREES, MOST_PIXELS};
use clap::Args;
use std::path::PathBuf;
use systems::assets::Technique;

pub const HELP: &str = "\
The ground truth is the same height map as real triangles, drawn by the same renderer under the same
three lights (directional, point, spot), one at a time, with ray-traced shadows.
  shadowed    error against the ground truth
  unshadowed  error against it without shadows: the bound for techniques without shadows
  mean        over pixels where both show the surface: mean of |L - L_truth| / mean L_truth
  p99         99th percentile of |L - L_truth| / mean L_truth over those pixels
  FLIP        perceived difference when alternating between the pictures, 0 none to 1
  shadows     share of the pixels facing the directional light with a different shadow
  ms, × off   time of a draw, by GPU timestamps if available, and relative to off

Files: compare.csv, compare.svg (error against cost), truth.png, truth_unshadowed.png, NAME.png and
NAME_error.png of each technique (|L - L_truth| / mean, 0 black to 1 and more pale yellow), and
compare.png, a contact sheet: the ground truth first, then the techniques in table order.

Examples:
  relief compare -o out                                all techniques on a plane, seen at 45°
  relief compare -o out --angle 0                      viewed head-on
  relief compare -o out --figure torus --technique normal,parallax,relief
  relief compare -o out --height wall.png --base wall.jpg --height-scale 0.03";

#[derive(Args)]
pub struct CompareArgs {
    /// Output directory for figures and pictures, created if missing
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Base mesh: plane (one quad, 2 m), sphere or torus (the map repeats four times around)
    #[arg(long, default_value = "plane", value_parser = arguments::choice(&BaseMesh::ALL, BaseMesh::help))]
    pub figure: BaseMesh,
    /// Height map, 0 deepest; normal and horizon maps are derived from it [default: the maps of the techniques scene,
    /// assets/textures/techniques_height.png]
    #[arg(long, value_name = "FILE")]
    pub height: Option<PathBuf>,
    /// Normal map, green up, instead of the one derived from the height map
    #[arg(long, value_name = "FILE")]
    pub normal: Option<PathBuf>,
    /// Base colour map
    #[arg(long, value_name = "FILE")]
    pub base: Option<PathBuf>,
    /// Depth of the height map from black to white, as a fraction of the image width, 0 to 1 [default: 0.06]
    #[arg(long, value_name = "X", value_parser = arguments::number(0.0f32..=1.0))]
    pub height_scale: Option<f32>,
    /// Angle between viewing direction and surface normal, 0 to 85: 0 is head-on
    #[arg(long, value_name = "DEGREES", default_value_t = 45.0, value_parser = parse_angle)]
    pub angle: f32,
    /// Size in pixels, at most 4 million
    #[arg(long, value_name = "WxH", default_value = "640x480", value_parser = parse_size)]
    pub size: (u32, u32),
    /// Techniques, separated by commas [default: all]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    #[arg(value_parser = arguments::named("technique", &Technique::ALL))]
    pub technique: Vec<Technique>,
    /// Print one line of JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &CompareArgs) -> Result<(), Failure> {
    let bar = progress::bar("{bar:40} {pos}/{len}  {msg}");
    let job = CompareJob {
        folder: args.output.clone(),
        figure: args.figure,
        height: args.height.clone(),
        normal: args.normal.clone(),
        base: args.base.clone(),
        height_scale: args.height_scale,
        angle: args.angle,
        size: args.size,
        techniques: args.technique.clone(),
    };
    let report = technique_error::measure(&job, |begun, done, of| {
        progress::show(&bar, done, of);
        bar.set_message(begun.to_owned());
    })?;
    bar.finish_and_clear();
    tell(&report, args.json, &args.output)
}

fn parse_angle(text: &str) -> Result<f32, String> {
    let angle = text.parse().ok().filter(|angle| (0.0..=MOST_DEGREES).contains(angle));
    angle.ok_or_else(|| format!("expected degrees from 0 to {MOST_DEGREES}{}", arguments::pointed(text)))
}

fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let (width, height) = arguments::parse_size(text)?;
    let fits = width.saturating_mul(height) <= MOST_PIXELS;
    fits.then_some((width, height)).ok_or_else(|| format!("expected at most {MOST_PIXELS} pixels"))
}
