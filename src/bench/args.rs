//! The arguments of `relief bench`.

use super::yard::{YardMesh, YardPlan, YardView};
use crate::arguments;
use clap::Args;
use std::path::PathBuf;
use systems::library::Technique;
use systems::lights::LightPolicy;

/// What to measure.
#[derive(Args, Clone, Debug)]
pub struct BenchArgs {
    /// Objects on the grid
    #[arg(long, default_value_t = 10_000, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub objects: u32,
    /// Point lights above it, each of 10 m range
    #[arg(long, default_value_t = 1000, value_name = "M", value_parser = clap::value_parser!(u32).range(..=1_000_000))]
    pub lights: u32,
    /// What stands there: cube (12 triangles), sphere (1,024 triangles), or the largest mesh of a .glb or .gltf file
    #[arg(long, default_value = "cube", value_name = "cube|sphere|PATH")]
    pub mesh: YardMesh,
    /// The share of objects that gets a new transform before every frame, 0 to 1
    #[arg(long, default_value_t = 0.0, value_name = "FRACTION", value_parser = parse_fraction)]
    pub moving: f32,
    /// Pixels; 64x36 shows the engine's cost, as a rasteriser in software takes long over pixels
    #[arg(long, default_value = "1280x720", value_name = "WxH", value_parser = arguments::parse_size)]
    pub size: (u32, u32),
    /// Frames to measure
    #[arg(long, default_value_t = 120, value_name = "K", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub frames: u32,
    /// Frames before those, not measured; the first takes far longer than others
    #[arg(long, default_value_t = 10, value_name = "K", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub warm_up: u32,
    /// Stop measuring after so many seconds, once there are 5 frames; warming up ends after a quarter of that
    #[arg(long, default_value_t = 40, value_name = "S", value_parser = clap::value_parser!(u32).range(1..=86_400))]
    pub seconds: u32,
    /// Where the camera stands
    #[arg(long, value_enum, default_value = "wide")]
    pub view: YardView,
    /// Draw every material with this bump technique: off, normal, perturbed_normal
    #[arg(long, value_name = "NAME", value_parser = arguments::parse_technique)]
    pub technique: Option<Technique>,
    /// How objects are lit: three, hard or all; relief render --help tells them apart
    #[arg(long, value_name = "POLICY", default_value = "three", value_parser = arguments::parse_lights)]
    pub lights_policy: LightPolicy,
    /// Samples per pixel: 1, or 4 as elsewhere in Relief
    #[arg(long, default_value = "1", value_name = "1|4", value_parser = parse_samples)]
    pub samples: u32,
    /// Worker threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub threads: Option<u16>,
    /// Also write the last frame to this file, to see what was measured
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
    /// Print one line of JSON rather than a table
    #[arg(long)]
    pub json: bool,
}

impl BenchArgs {
    /// The scene they ask for.
    pub fn plan(&self) -> YardPlan {
        YardPlan {
            objects: self.objects,
            lights: self.lights,
            moving: self.moving,
            mesh: self.mesh.clone(),
            view: self.view,
        }
    }
}

fn parse_fraction(text: &str) -> Result<f32, String> {
    text.parse().ok().filter(|f| (0.0..=1.0).contains(f)).ok_or_else(|| "expected a number from 0 to 1".to_owned())
}

fn parse_samples(text: &str) -> Result<u32, String> {
    text.parse().ok().filter(|n| [1, 4].contains(n)).ok_or_else(|| "expected 1 or 4".to_owned())
}
