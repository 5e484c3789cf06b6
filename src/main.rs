//! The command line: `relief run, render, lights, bench, check, info`.
//!
//! Exit codes: 0 done, 2 bad input or usage, 3 no usable graphics adapter, 1 anything else.

use clap::{ArgAction, Args, Parser, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};
use relief::app::{self, AppError};
use relief::arguments::{parse_levels, parse_lights, parse_occlusion, parse_size, parse_technique};
use relief::bench::{self, BenchArgs};
use relief::frames::{self, FrameError, FrameJob, LoadOptions, OutputKind};
use relief::light_error::{self, LightErrorJob};
use relief::renderer::{DebugView, Gpu, Occlusion, Settings};
use relief::{check, demo};
use std::io::{IsTerminal, Write};
use std::ops::Range;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;
use systems::levels::LevelOfDetail;
use systems::library::Technique;
use systems::lights::LightPolicy;
use systems::texture_memory::DEFAULT_MEGABYTES;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::prelude::*;

/// A simulation renderer for scenes of many bump-mapped objects, each lit by its three most relevant lights.
///
/// Without a subcommand: `relief run`.
#[derive(Parser)]
#[command(version, args_conflicts_with_subcommands = true, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: RunArgs,
}

const EXAMPLES: &str = "\
Examples:
  relief                                          the demo, in a window
  relief model.glb                                a model, with its own lights and cameras
  relief render scene.ron -o frames --frames 60   frames/color_00000.png … color_00059.png
  relief lights scene.ron -o out                  how far three lights per object are from all lights
  relief bench --objects 100000                   what many objects cost
  relief check scene.ron model.glb                everything that is wrong with the files

Exit codes: 0 done, 2 bad input or usage, 3 no usable graphics adapter, 1 anything else.";

#[derive(Subcommand)]
enum Command {
    /// Show a scene in a window; without a display, render pictures instead
    Run(RunArgs),
    /// Render frames to PNG files, without a window
    Render(RenderArgs),
    /// Say how far a frame lit by three lights per object is from one lit by all, in figures and pictures
    #[command(after_help = LIGHTS_HELP)]
    Lights(LightsArgs),
    /// Measure a grid of many bump-mapped objects under many lights, or any scene
    #[command(after_help = BENCH_HELP)]
    Bench(BenchArgs),
    /// Say everything that is wrong with scenes, models and images; exit code 2 if anything is
    Check {
        /// Scenes (.ron), models (.gltf, .glb), images
        #[arg(required = true, value_name = "FILE")]
        files: Vec<PathBuf>,
    },
    /// Print the graphics adapter, its driver and limits
    Info,
}

#[derive(Args)]
struct RunArgs {
    /// Scene (.ron) or model (.gltf, .glb); the demo scene if left out
    scene: Option<PathBuf>,
    #[command(flatten)]
    view: ViewArgs,
    /// Start with the clock stopped
    #[arg(long)]
    paused: bool,
    /// Start with the panel hidden (Tab shows it)
    #[arg(long)]
    no_panel: bool,
}

#[derive(Args)]
struct RenderArgs {
    /// Scene (.ron) or model (.gltf, .glb)
    scene: PathBuf,
    /// Folder for the pictures; made if missing
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// How many frames, or a range of frame numbers A..B (B not included)
    #[arg(long, default_value = "1", value_name = "N | A..B", value_parser = parse_frames)]
    frames: Range<u64>,
    /// Kinds of pictures, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_value = "color")]
    outputs: Vec<OutputKind>,
    /// Also make a film of the colour frames, with ffmpeg; one frame per step of the scene's clock
    #[arg(long, value_name = "FILE.mp4")]
    video: Option<PathBuf>,
    /// Go on after an interruption: leave frames alone whose pictures are there
    #[arg(long)]
    resume: bool,
    #[command(flatten)]
    view: ViewArgs,
}

#[derive(Args)]
struct LightsArgs {
    /// Scene (.ron) or model (.gltf, .glb)
    scene: PathBuf,
    /// Folder for the pictures; made if missing
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Which frame: steps of the scene's clock before the picture
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = clap::value_parser!(u64).range(..MOST_FRAMES))]
    frame: u64,
    /// Pixels; 16 million at the most
    #[arg(long, default_value = "1280x720", value_name = "WxH", value_parser = parse_size)]
    size: (u32, u32),
    /// Camera of the scene, by name; its first if left out
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Draw every material with this bump technique: off, normal, perturbed_normal
    #[arg(long, value_name = "NAME", value_parser = parse_technique)]
    technique: Option<Technique>,
    /// Worker threads; pictures are the same for any number [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// Print one line of JSON rather than a table
    #[arg(long)]
    json: bool,
}

const LIGHTS_HELP: &str = "\
The frame is drawn with --lights all (the reference), three and hard. L: linear luminance.
  mean   over pixels that show objects, the mean of |L - L_all|, over the mean of L_all there
  p99    99 % of those pixels have |L - L_all| / mean L_all of at most this
  FLIP   what a viewer notices who flips between the pictures: 0 nothing to 1

Files: all.png, three.png, hard.png as relief render writes them; three_error.png, hard_error.png:
|L - L_all| / mean L_all of each pixel, from 0 black over violet and orange to 1 and more pale
yellow, the same scale in both. docs/lights.md has the definitions in full.";

const BENCH_HELP: &str = "\
The scene: equal objects 3 m apart on a square grid, in 16 materials with base, normal and specular
maps of their own, under coloured point lights; the same for the same arguments. No shadows, no
tone mapping. Each frame is drawn until the GPU is idle.
  frame   from the first change of an object until the GPU is idle
  engine  the CPU's work on that: simulation, uploads, recording; not the driver's, nor the moving
  GPU     from handing the commands in until it is idle, and for each pass by its own clock

Examples:
  relief bench --objects 100000 --size 64x36             the engine's cost of many objects
  relief bench --objects 100000 --moving 1 --json        all of them moving, as one line of JSON
  relief bench --view inside --picture yard.png          what it looks like
  relief bench --scene town.ron --camera \"chase car 7\"   a scene of yours, a step of its clock per frame
  relief bench --trace frames.json                       open it in chrome://tracing
  relief bench --suite -o before                         everything, with a report (minutes)
  relief bench --suite -o after --compare before/results.jsonl

docs/benchmarks.md says what other engines take for the same scenes.";

#[derive(Args, Clone)]
struct ViewArgs {
    /// Pixels
    #[arg(long, default_value = "1280x720", value_name = "WxH", value_parser = parse_size)]
    size: (u32, u32),
    /// Camera of the scene, by name; its first if left out
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// How objects are lit. three: by their three most relevant lights, which fade as they change, and a remainder
    /// for the others; hard: by the three alone; all: by every light that reaches them, slow, the reference
    #[arg(long, value_name = "POLICY", default_value = "three", value_parser = parse_lights)]
    lights: LightPolicy,
    /// Draw every material with this bump technique: off, normal, perturbed_normal
    #[arg(long, value_name = "NAME", value_parser = parse_technique)]
    technique: Option<Technique>,
    /// Show something else than light: base, normal, tangent; light_count: how many lights reach each object, 1 blue to
    /// 64 red, none grey; three_lights: what an object's three give, as red, green and blue; error_bound: brightness that
    /// an object lit by three lights alone may miss, 0.001 blue to 10 red, nothing grey
    #[arg(long, value_name = "VIEW", default_value = "off", value_parser = parse_debug)]
    debug: DebugView,
    /// Levels of detail: on, meshes far away have fewer triangles where the difference is less than a pixel; off, every
    /// mesh as it is
    #[arg(long, value_name = "on | off", default_value = "on", value_parser = parse_levels)]
    levels: LevelOfDetail,
    /// Leave out objects that others hide: on, off, or auto: in a window, where there are many. The picture is the same, but
    /// which of two faces in one plane is in front may depend on the frames before
    #[arg(long, value_name = "auto | on | off", default_value = "auto", value_parser = parse_occlusion)]
    occlusion: Occlusion,
    /// Textures in blocks (BC7), a quarter of the memory, where that does not show; made once and kept in a cache
    #[arg(long, value_name = "on | off", default_value = "off", action = ArgAction::Set, value_parser = parse_on_off)]
    compress: bool,
    /// Neither read nor write the cache (RELIEF_CACHE_DIR, else the platform's folder for caches)
    #[arg(long)]
    no_cache: bool,
    /// Most memory that textures take on the GPU; where they are larger, the largest are drawn at half their size and less
    #[arg(long, value_name = "MB", default_value_t = DEFAULT_MEGABYTES, value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    texture_memory: u64,
    /// Worker threads; pictures are the same for any number [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
}

impl ViewArgs {
    fn load(&self) -> LoadOptions {
        LoadOptions { compress: self.compress, cache: !self.no_cache, texture_bytes: self.texture_memory << 20 }
    }

    fn settings(&self) -> Settings {
        Settings {
            technique: self.technique,
            debug: self.debug,
            levels: self.levels,
            occlusion: self.occlusion,
            ..Settings::default()
        }
    }
}

/// Frame numbers stay below this.
const MOST_FRAMES: u64 = 1_000_000_000;

fn parse_frames(text: &str) -> Result<Range<u64>, String> {
    let range = match text.split_once("..") {
        Some((first, end)) => first.parse().ok().zip(end.parse().ok()).map(|(first, end)| first..end),
        None => text.parse().ok().map(|count| 0..count),
    };
    range
        .filter(|r| r.start < r.end && r.end <= MOST_FRAMES)
        .ok_or_else(|| format!("expected a count like 60, or a range like 30..60, ending at {MOST_FRAMES} at the most"))
}

fn parse_on_off(text: &str) -> Result<bool, String> {
    relief::name::find("choice", &[("on", true), ("off", false)], text)
}

fn parse_debug(text: &str) -> Result<DebugView, String> {
    relief::name::find("debug view", &DebugView::ALL, text)
}

/// Warnings and errors go to stderr; `RUST_LOG` says otherwise, as in `relief=debug,warn`.
fn log_to_stderr() {
    let wanted = std::env::var("RUST_LOG").ok().and_then(|text| text.parse().ok());
    let quiet = || Targets::new().with_default(LevelFilter::WARN).with_target("winit", LevelFilter::ERROR);
    let layer = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .without_time()
        .with_target(false);
    tracing_subscriber::registry().with(layer).with(wanted.unwrap_or_else(quiet)).init();
}

fn main() -> ExitCode {
    let started = Instant::now();
    let cli = Cli::parse();
    log_to_stderr();
    let done = match cli.command.unwrap_or(Command::Run(cli.run)) {
        Command::Run(args) => run(&args),
        Command::Render(args) => {
            systems::set_threads(args.view.threads.map(usize::from));
            render(&job(&args))
        }
        Command::Lights(args) => lights(&args),
        Command::Bench(args) => return measure(&args, started),
        Command::Check { files } => return check_files(&files),
        Command::Info => Gpu::headless().map(|gpu| say(gpu.describe().trim_end())).map_err(FrameError::from),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(exit_code(&error))
        }
    }
}

/// Prints a line. Whoever reads standard output may have stopped reading; the work is done all the same.
fn say(text: &str) {
    let _ = writeln!(std::io::stdout(), "{text}");
}

fn exit_code(error: &FrameError) -> u8 {
    match error {
        FrameError::Scene(_) | FrameError::NoCamera { .. } | FrameError::Render(_) | FrameError::Compare(_) => 2,
        FrameError::Gpu(_) => 3,
        FrameError::Output(_) | FrameError::Video(_) => 1,
    }
}

fn job(args: &RenderArgs) -> FrameJob {
    let mut outputs = args.outputs.clone();
    if args.video.is_some() && !outputs.contains(&OutputKind::Color) {
        outputs.push(OutputKind::Color);
    }
    FrameJob {
        scene: args.scene.clone(),
        folder: args.output.clone(),
        frames: args.frames.clone(),
        size: args.view.size,
        camera: args.view.camera.clone(),
        outputs,
        settings: args.view.settings(),
        lights: args.view.lights,
        resume: args.resume,
        load: args.view.load(),
        video: args.video.clone(),
    }
}

/// A bar on a terminal, nothing elsewhere.
fn progress_bar(template: &str) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template(template);
    ProgressBar::new(0).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

fn render(job: &FrameJob) -> Result<(), FrameError> {
    let bar = progress_bar("{bar:40} frame {pos}/{len}  {per_sec}  {eta} left");
    bar.set_length(job.frames.end - job.frames.start);
    let written = frames::render_frames(job, |_| bar.inc(1))?;
    bar.finish_and_clear();
    match written.as_slice() {
        [] => say(&format!("nothing to do: all pictures are in {}", job.folder.display())),
        [one] => say(&one.display().to_string()),
        [first, .., last] => say(&format!("{} files: {} … {}", written.len(), first.display(), last.display())),
    }
    Ok(())
}

fn lights(args: &LightsArgs) -> Result<(), FrameError> {
    systems::set_threads(args.threads.map(usize::from));
    let report = light_error::measure(&LightErrorJob {
        scene: args.scene.clone(),
        folder: args.output.clone(),
        frame: args.frame,
        size: args.size,
        camera: args.camera.clone(),
        technique: args.technique,
    })?;
    if args.json {
        say(&report.json());
    } else {
        say(&format!("{report}pictures: {}", args.output.display()));
    }
    Ok(())
}

fn measure(args: &BenchArgs, started: Instant) -> ExitCode {
    let bar = progress_bar("{bar:40} {pos}/{len}  {msg}  {eta} left");
    let advance = |done: u64, of: u64| {
        bar.set_length(of);
        bar.set_position(done);
    };
    let done = if let (true, Some(folder)) = (args.suite, &args.output) {
        let slower = bench::run_suite(args, folder, |done, of, scene| {
            advance(done as u64, of as u64);
            bar.set_message(scene.to_owned());
        });
        slower.map(|slower| {
            slower.iter().for_each(|what| eprintln!("slower: {what}"));
            folder.join("report.md").display().to_string()
        })
    } else {
        let figures = bench::run(args, started, |done, of| advance(done.into(), of.into()));
        figures.map(|figures| if args.json { figures.json() } else { figures.to_string() })
    };
    bar.finish_and_clear();
    match done {
        Ok(text) => {
            say(text.trim_end());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

fn run(args: &RunArgs) -> Result<(), FrameError> {
    systems::set_threads(args.view.threads.map(usize::from));
    let scene = args.scene.clone().unwrap_or_else(demo::scene_path);
    let mut stage = frames::load_stage(&scene, args.view.camera.as_deref(), &args.view.load())?;
    stage.simulation.world.insert_resource(args.view.lights);
    let options = app::Options {
        simulation: stage.simulation,
        title: stage.scene.name,
        cameras: stage.scene.cameras,
        viewpoint: stage.viewpoint,
        size: args.view.size,
        settings: args.view.settings(),
        paused: args.paused,
        panel: !args.no_panel,
    };
    match app::run(options) {
        Ok(()) => Ok(()),
        Err(AppError::NoDisplay(reason)) => {
            eprintln!("no window: {reason}\nrendering a picture instead");
            let args = RenderArgs {
                scene,
                output: PathBuf::from("relief-frames"),
                frames: 0..1,
                outputs: vec![OutputKind::Color],
                resume: false,
                video: None,
                view: args.view.clone(),
            };
            render(&job(&args))
        }
        Err(AppError::Gpu(error)) => Err(error.into()),
        Err(AppError::Render(error)) => Err(error.into()),
    }
}

fn check_files(files: &[PathBuf]) -> ExitCode {
    let mut errors = 0;
    let mut out = std::io::stdout().lock();
    for file in files {
        let problems = check::check(file);
        errors += problems.iter().filter(|p| p.is_error()).count();
        for problem in &problems {
            let _ = writeln!(out, "{problem}");
        }
        if problems.is_empty() {
            let _ = writeln!(out, "{}: ok", file.display());
        }
    }
    if errors == 0 { ExitCode::SUCCESS } else { ExitCode::from(2) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }

    #[test]
    fn frames_are_read_strictly() {
        assert_eq!(parse_frames("60"), Ok(0..60));
        assert_eq!(parse_frames("30..60"), Ok(30..60));
        for bad in ["", "0", "5..5", "6..5", "-1", "a..b", "99999999999"] {
            assert!(parse_frames(bad).is_err(), "{bad}");
        }
    }
}
