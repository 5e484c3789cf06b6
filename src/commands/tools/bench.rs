//! `relief bench`.

use crate::commands::common::arguments::{self, ON_OFF, ThreadsArgs};
use crate::commands::common::failure::{Failure, say};
use crate::commands::common::process::Process;
use crate::commands::common::progress;
use crate::renderer::{Occlusion, Settings};
use crate::session::LoadOptions;
use crate::tools::bench::{self, BenchJob, GridMesh, GridPlan, GridView, SuiteJob};
use crate::tools::json_line;
use clap::{ArgAction, Args};
use std::io;
use std::path::PathBuf;
use std::process::Command;
use systems::assets::Technique;
use systems::assets::levels::LevelOfDetail;
use systems::lights::LightPolicy;

pub const HELP: &str = "\
The scene: equal objects 3 m apart on a square grid, with 16 materials, each with base, normal and
specular maps, under coloured point lights; deterministic for given arguments. No shadows
unless --shadows asks for them; colours are clamped at 1. Each frame waits until the GPU is idle.
  frame   from the first change of an object until the GPU is idle
  engine  CPU time of simulation, uploads and command encoding, without the driver and the moving
  GPU     from submission until the GPU is idle, and each pass by GPU timestamps

Examples:
  relief bench --objects 100000 --size 64x36             CPU cost of many objects
  relief bench --objects 100000 --moving 1 --json        all objects moving, as one line of JSON
  relief bench --view inside --picture yard.png          write a picture of the scene
  relief bench --scene town.ron --camera \"chase car 7\"   your own scene, one step per frame
  relief bench --trace frames.json                       open it in chrome://tracing
  relief bench --suite -o before                         all sweeps, with a report (minutes)
  relief bench --suite -o after --compare before/results.jsonl

See docs/benchmarks.md for results of other engines on the same scenes.";

#[derive(Args)]
pub struct BenchArgs {
    /// Measure this scene (.ron, .gltf, .glb) instead of a grid, with one step before every frame
    #[arg(long, value_name = "FILE")]
    #[arg(conflicts_with_all = ["objects", "lights", "mesh", "moving", "view", "floor", "suite"])]
    pub scene: Option<PathBuf>,
    /// Name of the camera, or "chase NAME" or "driver NAME" of a vehicle [default: the first camera]
    #[arg(long, value_name = "NAME", requires = "scene")]
    pub camera: Option<String>,
    /// Objects on the grid; in a suite, the maximum [default: 10000; in a suite 100000, if quick 1000]
    #[arg(long, value_name = "N", value_parser = arguments::whole(1u32..=10_000_000))]
    pub objects: Option<u32>,
    /// Point lights above the grid, with a range of 10 m; in a suite, the maximum [default: 1000, if quick 100]
    #[arg(long, value_name = "M", value_parser = arguments::whole(0..=1_000_000u32))]
    pub lights: Option<u32>,
    /// Mesh of the objects: cube (12 triangles), sphere (1,024 triangles), or the largest mesh of a .glb or .gltf file
    #[arg(long, default_value = "cube", value_name = "cube|sphere|PATH")]
    pub mesh: GridMesh,
    /// Fraction of the objects that get a new transform before every frame, 0 to 1
    #[arg(long, default_value_t = 0.0, value_name = "FRACTION", value_parser = arguments::number(0.0f32..=1.0))]
    #[arg(conflicts_with = "suite")]
    pub moving: f32,
    /// Size in pixels; 64x36 shows the CPU cost where a software rasterizer draws [default: 1280x720, in a quick suite
    /// 64x36]
    #[arg(long, value_name = "WxH", value_parser = arguments::parse_size)]
    pub size: Option<(u32, u32)>,
    /// Frames to measure [default: 120, in a quick suite 5]
    #[arg(long, value_name = "K", value_parser = arguments::whole(1u32..=1_000_000))]
    pub frames: Option<u32>,
    /// Warm-up frames, not measured [default: 10, in a quick suite 2]
    #[arg(long, value_name = "K", value_parser = arguments::whole(1u32..=100_000))]
    pub warm_up: Option<u32>,
    /// Time limit of the measurement, applied after 5 frames; warm-up ends after a quarter of it [default: 40, in a
    /// suite 10 for each scene]
    #[arg(long, value_name = "S", value_parser = arguments::whole(1u32..=86_400))]
    pub seconds: Option<u32>,
    /// Camera position
    #[arg(long, default_value = "wide", conflicts_with = "suite")]
    #[arg(value_parser = arguments::choice(&GridView::ALL, GridView::help))]
    pub view: GridView,
    /// Override the bump technique of all materials: off, normal, relief, … (docs/techniques.md)
    #[arg(long, value_name = "NAME", value_parser = arguments::named("technique", &Technique::ALL))]
    pub technique: Option<Technique>,
    /// Light policy of objects: three, enough, all or hard; see relief render --help [default: three, of a scene its
    /// own]
    #[arg(long, value_name = "POLICY", value_parser = arguments::named("light policy", &LightPolicy::ALL))]
    pub lights_policy: Option<LightPolicy>,
    /// Levels of detail: on or off
    #[arg(long, default_value = "on", value_name = "on|off", value_parser = arguments::parse_levels)]
    pub levels: LevelOfDetail,
    /// Occlusion culling: on, off, or auto (on with many objects)
    #[arg(long, default_value = "auto", value_name = "auto|on|off")]
    #[arg(value_parser = arguments::named("value", &Occlusion::ALL))]
    pub occlusion: Occlusion,
    /// Lights that may have a shadow map at once; all lights of a grid cast shadows then [default: 0, of a scene 32]
    #[arg(long, value_name = "K", value_parser = arguments::whole(0u32..=Settings::MOST_SHADOW_MAPS))]
    pub shadows: Option<u32>,
    /// Compress textures to BC7, a quarter of the memory, where no loss is visible; not cached
    #[arg(long, value_name = "on|off", default_value = "off", action = ArgAction::Set)]
    #[arg(value_parser = arguments::named("value", &ON_OFF))]
    pub compress: bool,
    /// Samples per pixel: 4 as in other commands, or 1
    #[arg(long, default_value = "4", value_name = "1|4", value_parser = arguments::parse_samples)]
    pub samples: u32,
    #[command(flatten)]
    pub threads: ThreadsArgs,
    /// Also measure the visible triangles with a minimal shader, without levels of detail: a lower bound
    #[arg(long)]
    pub floor: bool,
    /// Also write the last frame to this file
    #[arg(long, value_name = "FILE.png", conflicts_with = "suite", value_parser = arguments::png())]
    pub picture: Option<PathBuf>,
    /// Also write a trace of the measured frames for chrome://tracing or ui.perfetto.dev
    #[arg(long, value_name = "FILE.json", conflicts_with = "suite")]
    pub trace: Option<PathBuf>,
    /// Print one line of JSON instead of a table
    #[arg(long, conflicts_with = "suite")]
    pub json: bool,
    /// Measure sweeps over objects, lights and moving objects, each scene in its own process
    #[arg(long, requires = "output")]
    pub suite: bool,
    /// Suite: output directory for results.jsonl, report.md and plots, created if missing
    #[arg(short, long, value_name = "DIR", requires = "suite")]
    pub output: Option<PathBuf>,
    /// Suite: results.jsonl of an earlier one; the report has ratios and marks what is slower by more than 10 %
    #[arg(long, value_name = "FILE", requires = "suite")]
    pub compare: Option<PathBuf>,
    /// Suite: few small scenes and frames, as a smoke test
    #[arg(long, requires = "suite")]
    pub quick: bool,
    /// Job of a process of its own
    #[arg(long, hide = true, value_parser = |job: &str| serde_json::from_slice::<Box<BenchJob>>(job.as_bytes()))]
    #[arg(conflicts_with_all = ["scene", "camera", "objects", "lights", "mesh", "moving", "size", "frames", "warm_up"])]
    #[arg(conflicts_with_all = ["seconds", "view", "technique", "lights_policy", "levels", "occlusion", "shadows"])]
    #[arg(conflicts_with_all = ["compress", "samples", "threads", "floor", "picture", "trace", "suite"])]
    job: Option<Box<BenchJob>>,
}

impl BenchArgs {
    fn job(&self) -> BenchJob {
        let by = |usual: u32, suite: u32, quick: u32| match (self.suite, self.quick) {
            (_, true) => quick,
            (true, _) => suite,
            _ => usual,
        };
        BenchJob {
            scene: self.scene.clone(),
            camera: self.camera.clone(),
            plan: GridPlan {
                objects: self.objects.unwrap_or(by(10_000, 100_000, 1000)),
                lights: self.lights.unwrap_or(by(1000, 1000, 100)),
                moving: self.moving,
                mesh: self.mesh.clone(),
                view: self.view,
                shadows: self.shadows.is_some_and(|most| most > 0),
            },
            size: self.size.unwrap_or(if self.quick { (64, 36) } else { (1280, 720) }),
            frames: self.frames.unwrap_or(by(120, 120, 5)),
            warm_up: self.warm_up.unwrap_or(by(10, 10, 2)),
            seconds: self.seconds.unwrap_or(by(40, 10, 10)),
            technique: self.technique,
            lights_policy: self.lights_policy,
            levels: self.levels,
            occlusion: self.occlusion,
            shadows: self.shadows,
            load: LoadOptions { compress: self.compress, watch: Some(progress::of_loading), ..LoadOptions::default() },
            samples: self.samples,
            threads: self.threads.count(),
            floor: self.floor,
            picture: self.picture.clone(),
            trace: self.trace.clone(),
        }
    }
}

pub fn run(args: &BenchArgs, process: &Process) -> Result<(), Failure> {
    let bar = progress::bar("{bar:40} {pos}/{len}  {msg}  {eta} left");
    let job = args.job.as_deref().cloned().unwrap_or_else(|| args.job());
    let said = if let (true, Some(folder)) = (args.suite, &args.output) {
        let (earlier, quick) = (args.compare.clone(), args.quick);
        let suite = SuiteJob { most: job, folder: folder.clone(), earlier, quick };
        let slower = bench::run_suite(&suite, &|job| apart(job, process), |done, of, scene| {
            progress::show(&bar, done as u64, of as u64);
            bar.set_message(scene.to_owned());
        })?;
        slower.iter().for_each(|what| eprintln!("slower: {what}"));
        folder.join("report.md").display().to_string()
    } else {
        let mut figures = bench::run(&job, process.started, |done, of| progress::show(&bar, done.into(), of.into()))?;
        figures.bytes_per_object =
            bench::bytes_per_object(&job, &figures, &|job| apart(job, process)).unwrap_or_else(|error| {
                tracing::warn!("memory per object was not measured: {error}");
                None
            });
        if args.json { json_line(&figures) } else { figures.to_string() }
    };
    bar.finish_and_clear();
    Ok(say(said.trim_end())?)
}

/// This program again, to measure a grid in a process of its own.
fn apart(job: &BenchJob, process: &Process) -> io::Result<Command> {
    let mut command = process.anew().ok_or_else(|| io::Error::other("no path of this program"))?;
    command.args(["bench", "--json", "--job", &serde_json::to_string(job)?]);
    Ok(command)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Program {
        #[command(flatten)]
        bench: BenchArgs,
    }

    #[test]
    fn a_job_of_its_own_takes_no_options_that_it_has_already() {
        let parse = |args: &[&str]| Program::try_parse_from([&["bench"], args].concat()).map(|program| program.bench);
        let job = parse(&[]).expect("defaults").job();
        let job = serde_json::to_string(&job).expect("JSON");
        let job = ["--json", "--job", &job];
        assert!(parse(&job).is_ok());
        for more in
            ["--objects=3", "--mesh=cube", "--size=8x8", "--levels=on", "--threads=2", "--compress=on", "--floor"]
        {
            assert!(parse(&[&job[..], &[more]].concat()).is_err(), "{more}");
        }
    }
}
