//! The arguments of `relief bench`.

use super::yard::{YardMesh, YardPlan, YardView};
use crate::arguments;
use crate::renderer::Occlusion;
use clap::{ArgAction, Args};
use std::path::PathBuf;
use systems::assets::Technique;
use systems::assets::levels::LevelOfDetail;
use systems::lights::LightPolicy;

/// What to measure.
#[derive(Args, Clone, Debug)]
pub struct BenchArgs {
    /// Measure this scene (.ron, .gltf, .glb) rather than a grid: its clock makes a step before every frame
    #[arg(long, value_name = "FILE")]
    #[arg(conflicts_with_all = ["objects", "lights", "mesh", "moving", "view", "floor", "suite"])]
    pub scene: Option<PathBuf>,
    /// The scene's camera by name, or "chase NAME" or "driver NAME" of a vehicle [default: the first]
    #[arg(long, value_name = "NAME", requires = "scene")]
    pub camera: Option<String>,
    /// Objects on the grid; in a suite, the most [default: 10000; in a suite 100000, if quick 1000]
    #[arg(long, value_name = "N", value_parser = arguments::whole(1u32..=10_000_000))]
    pub objects: Option<u32>,
    /// Point lights above it, each of 10 m range; in a suite, the most [default: 1000, if quick 100]
    #[arg(long, value_name = "M", value_parser = arguments::whole(0..=1_000_000u32))]
    pub lights: Option<u32>,
    /// What stands there: cube (12 triangles), sphere (1,024 triangles), or the largest mesh of a .glb or .gltf file
    #[arg(long, default_value = "cube", value_name = "cube|sphere|PATH")]
    pub mesh: YardMesh,
    /// The share of objects that gets a new transform before every frame, 0 to 1
    #[arg(long, default_value_t = 0.0, value_name = "FRACTION", value_parser = parse_fraction)]
    #[arg(conflicts_with = "suite")]
    pub moving: f32,
    /// Pixels; 64x36 shows the engine's cost, as a rasteriser in software takes long over pixels [default: 1280x720, in
    /// a quick suite 64x36]
    #[arg(long, value_name = "WxH", value_parser = arguments::parse_size)]
    pub size: Option<(u32, u32)>,
    /// Frames to measure [default: 120, in a quick suite 5]
    #[arg(long, value_name = "K", value_parser = arguments::whole(1u32..=1_000_000))]
    pub frames: Option<u32>,
    /// Frames before those, not measured; the first takes far longer than others [default: 10, in a quick suite 2]
    #[arg(long, value_name = "K", value_parser = arguments::whole(1u32..=100_000))]
    pub warm_up: Option<u32>,
    /// Stop measuring after so many seconds, once there are 5 frames; warming up ends after a quarter of that [default:
    /// 40, in a suite 10 for each scene]
    #[arg(long, value_name = "S", value_parser = arguments::whole(1u32..=86_400))]
    pub seconds: Option<u32>,
    /// Where the camera stands
    #[arg(long, value_enum, default_value = "wide", conflicts_with = "suite")]
    pub view: YardView,
    /// Draw every material with this bump technique: off, normal, relief, … (docs/techniques.md)
    #[arg(long, value_name = "NAME", value_parser = arguments::parse_technique)]
    pub technique: Option<Technique>,
    /// How objects are lit: three, hard or all; relief render --help tells them apart
    #[arg(long, value_name = "POLICY", default_value = "three", value_parser = arguments::parse_lights)]
    pub lights_policy: LightPolicy,
    /// Draw meshes with fewer triangles where they are small: on or off
    #[arg(long, default_value = "on", value_name = "on|off", value_parser = arguments::parse_levels)]
    pub levels: LevelOfDetail,
    /// Leave out objects that others hide: on, off, or auto, where there are many
    #[arg(long, default_value = "auto", value_name = "auto|on|off", value_parser = arguments::parse_occlusion)]
    pub occlusion: Occlusion,
    /// Textures in blocks (BC7), a quarter of the memory, where that does not show; made anew each time
    #[arg(long, value_name = "on|off", default_value = "off", action = ArgAction::Set)]
    #[arg(value_parser = arguments::parse_on_off)]
    pub compress: bool,
    /// Samples per pixel: 1, or 4 as elsewhere in Relief
    #[arg(long, default_value = "1", value_name = "1|4", value_parser = parse_samples)]
    pub samples: u32,
    /// Keep colours linear until a pass of its own tone-maps them, as relief render does and several samples, blended
    /// objects or emboss_multipass need; off: else objects are tone-mapped as they are drawn
    #[arg(long, value_name = "on|off", default_value = "off", action = ArgAction::Set)]
    #[arg(value_parser = arguments::parse_on_off)]
    pub hdr: bool,
    /// Worker threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = arguments::whole(1u16..=256))]
    pub threads: Option<u16>,
    /// Then also draw all objects in view with the plainest shader, meshes whole: what their triangles cost by
    /// themselves
    #[arg(long)]
    pub floor: bool,
    /// Also write the last frame to this file, to see what was measured
    #[arg(long, value_name = "FILE.png", conflicts_with = "suite", value_parser = arguments::png())]
    pub picture: Option<PathBuf>,
    /// Also write the measured frames as a time line for chrome://tracing or ui.perfetto.dev
    #[arg(long, value_name = "FILE.json", conflicts_with = "suite")]
    pub trace: Option<PathBuf>,
    /// Print one line of JSON rather than a table
    #[arg(long, conflicts_with = "suite")]
    pub json: bool,
    /// Measure many scenes, each in a process of its own: how cost grows with objects, lights and what moves
    #[arg(long, requires = "output")]
    pub suite: bool,
    /// Suite: folder for results.jsonl, report.md and plots; made if missing
    #[arg(short, long, value_name = "DIR", requires = "suite")]
    pub output: Option<PathBuf>,
    /// Suite: the results.jsonl of an earlier one; the report has ratios, and says what got slower by more than 10 %
    #[arg(long, value_name = "FILE", requires = "suite")]
    pub compare: Option<PathBuf>,
    /// Suite: few small scenes and few frames, to see that it works
    #[arg(long, requires = "suite")]
    pub quick: bool,
}

impl BenchArgs {
    /// Objects on the grid.
    pub fn objects(&self) -> u32 {
        self.objects.unwrap_or(match (self.suite, self.quick) {
            (_, true) => 1000,
            (true, _) => 100_000,
            _ => 10_000,
        })
    }

    /// Lights above it.
    pub fn lights(&self) -> u32 {
        self.lights.unwrap_or(if self.quick { 100 } else { 1000 })
    }

    /// Pixels.
    pub fn size(&self) -> (u32, u32) {
        self.size.unwrap_or(if self.quick { (64, 36) } else { (1280, 720) })
    }

    /// Frames to measure, at the most.
    pub fn frames(&self) -> u32 {
        self.frames.unwrap_or(if self.quick { 5 } else { 120 })
    }

    /// Frames before those, at the most.
    pub fn warm_up(&self) -> u32 {
        self.warm_up.unwrap_or(if self.quick { 2 } else { 10 })
    }

    /// Seconds after which measuring stops.
    pub fn seconds(&self) -> u32 {
        self.seconds.unwrap_or(if self.suite { 10 } else { 40 })
    }

    /// The scene they ask for.
    pub fn plan(&self) -> YardPlan {
        YardPlan {
            objects: self.objects(),
            lights: self.lights(),
            moving: self.moving,
            mesh: self.mesh.clone(),
            view: self.view,
        }
    }
}

fn parse_fraction(text: &str) -> Result<f32, String> {
    let fraction = text.parse().ok().filter(|f| (0.0..=1.0).contains(f));
    fraction.ok_or_else(|| format!("expected a number from 0 to 1{}", arguments::pointed(text)))
}

fn parse_samples(text: &str) -> Result<u32, String> {
    text.parse().ok().filter(|n| [1, 4].contains(n)).ok_or_else(|| "expected 1 or 4".to_owned())
}
