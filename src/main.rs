//! The command line: `relief run, render, replay, lights, gallery, compare, bench, map, check, info`.
//!
//! Exit codes: 0 done, 2 bad input or usage, 3 no usable graphics adapter, 1 anything else.

mod cli;
mod headless;

use clap::{CommandFactory, FromArgMatches};
use cli::{Cli, Command, LightsArgs, PictureArgs, RenderArgs, ReplayArgs, RunArgs, ViewArgs};
use indicatif::{ProgressBar, ProgressStyle};
use relief::app::{self, AppError};
use relief::bench::{self, BenchArgs};
use relief::frames::{self, FrameError, FrameJob, Frames, OutputKind};
use relief::gallery::{self, GalleryArgs};
use relief::light_error::{self, LightErrorJob};
use relief::maps::command::{self as map_tools, MapArgs};
use relief::output::OutputError;
use relief::recording::{self, Recording, RecordingError, RunFiles};
use relief::renderer::{Gpu, RenderError};
use relief::technique_error::{self, CompareArgs};
use relief::video::VideoError;
use relief::{check, demo};
use std::io::{ErrorKind, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;
use systems::ecs::clock::Clock;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::prelude::*;

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
    let matches = with_negative_numbers(Cli::command()).get_matches();
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    log_to_stderr();
    let command = cli.command.unwrap_or(Command::Run(cli.run));
    let shows_window = match &command {
        Command::Run(_) => true,
        Command::Replay(args) => args.output.is_none() && !args.check,
        _ => false,
    };
    if !shows_window || !headless::may_have_display() {
        headless::forget_display();
    }
    let done = match command {
        Command::Run(args) => run(&args),
        Command::Render(args) => {
            systems::set_threads(args.view.threads.map(usize::from));
            render(&job(&args))
        }
        Command::Replay(args) => replay(&args),
        Command::Lights(args) => lights(&args),
        Command::Gallery(args) => draw_gallery(&args),
        Command::Compare(args) => compare(&args),
        Command::Bench(args) => return measure(&args, started),
        Command::Map(args) => return make_map(&args),
        Command::Check { files } => return check_files(&files),
        Command::Info => Gpu::headless().map_err(FrameError::from).and_then(|gpu| Ok(say(gpu.describe().trim_end())?)),
    };
    exit(done)
}

fn exit(done: Result<(), FrameError>) -> ExitCode {
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(exit_code(&error))
        }
    }
}

/// Has a command and those below it take -1 for a value, so that it is refused for what it is, not for an unknown
/// option.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let names: Vec<String> = command.get_subcommands().map(|below| below.get_name().to_owned()).collect();
    let command = command.allow_negative_numbers(true);
    names.iter().fold(command, |command, name| command.mut_subcommand(name, with_negative_numbers))
}

/// Prints a line. What reads standard output may have stopped reading; the work is done all the same.
fn say(text: &str) -> Result<(), OutputError> {
    match writeln!(std::io::stdout(), "{text}") {
        Err(source) if source.kind() != ErrorKind::BrokenPipe => {
            Err(OutputError::Io { path: "standard output".into(), source })
        }
        _ => Ok(()),
    }
}

fn exit_code(error: &FrameError) -> u8 {
    match error {
        FrameError::Render(RenderError::Lost { .. }) => 1,
        FrameError::Scene(_) | FrameError::NoCamera { .. } | FrameError::Render(_) | FrameError::Compare(_) => 2,
        FrameError::Import(_)
        | FrameError::NoFigure { .. }
        | FrameError::Overwrites { .. }
        | FrameError::NoFrames { .. }
        | FrameError::NoSteps { .. }
        | FrameError::Video(VideoError::UnknownEnding { .. })
        | FrameError::Recording(RecordingError::Refused { .. }) => 2,
        FrameError::Gpu(_) => 3,
        FrameError::Output(error)
        | FrameError::Video(VideoError::Output(error))
        | FrameError::Recording(RecordingError::Output(error)) => error.exit_code(),
        FrameError::Video(VideoError::Failed { .. }) | FrameError::Recording(RecordingError::Diverged { .. }) => 1,
    }
}

fn job(args: &RenderArgs) -> FrameJob {
    FrameJob {
        frames: args.frames.clone(),
        run: RunFiles { save_snapshot: args.save_snapshot.clone(), ..args.files.run_files() },
        ..picture_job(&args.scene, &args.output, &args.pictures, &args.view)
    }
}

/// The first frame of a scene.
fn picture_job(scene: &Path, folder: &Path, pictures: &PictureArgs, view: &ViewArgs) -> FrameJob {
    let mut outputs = pictures.outputs.clone();
    if pictures.video.is_some() && !outputs.contains(&OutputKind::Color) {
        outputs.push(OutputKind::Color);
    }
    FrameJob {
        scene: scene.to_owned(),
        folder: folder.to_owned(),
        frames: Frames::All,
        size: view.size,
        camera: view.camera.clone(),
        outputs,
        settings: view.settings(),
        lights: view.lights,
        resume: pictures.resume,
        load: view.load(),
        video: pictures.video.clone(),
        run: RunFiles::default(),
        realtime: pictures.realtime,
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
    let written = frames::render_frames(job, |done, of| {
        bar.set_length(of);
        bar.set_position(done);
    })?;
    bar.finish_and_clear();
    match written.as_slice() {
        [] => say(&format!("nothing to do: all pictures are in {}", job.folder.display()))?,
        [one] => say(&one.display().to_string())?,
        [first, .., last] => say(&format!("{} files: {} … {}", written.len(), first.display(), last.display()))?,
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
        say(&report.json())?;
    } else {
        say(&format!("{report}pictures: {}", args.output.display()))?;
    }
    Ok(())
}

fn draw_gallery(args: &GalleryArgs) -> Result<(), FrameError> {
    let bar = progress_bar("{bar:40} figure {pos}/{len}");
    let written = gallery::render(args, |done, of| {
        bar.set_length(of);
        bar.set_position(done);
    })?;
    bar.finish_and_clear();
    Ok(written.iter().try_for_each(|path| say(&path.display().to_string()))?)
}

fn compare(args: &CompareArgs) -> Result<(), FrameError> {
    let bar = progress_bar("{bar:40} {pos}/{len}  {msg}");
    let report = technique_error::measure(args, |begun, done, of| {
        bar.set_length(of);
        bar.set_position(done);
        bar.set_message(begun.to_owned());
    })?;
    bar.finish_and_clear();
    if args.json {
        say(&report.json())?;
    } else {
        say(&format!("{report}pictures: {}", args.output.display()))?;
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
        bench::run(args, started, |done, of| advance(done.into(), of.into())).map(|mut figures| {
            figures.bytes_per_object = bench::bytes_per_object(args, &figures).unwrap_or_else(|error| {
                tracing::warn!("memory per object was not measured: {error}");
                None
            });
            if args.json { figures.json() } else { figures.to_string() }
        })
    };
    bar.finish_and_clear();
    match done {
        Ok(text) => exit(say(text.trim_end()).map_err(FrameError::from)),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

fn make_map(args: &MapArgs) -> ExitCode {
    let bar = progress_bar("{bar:40} {percent} %  {eta} left");
    let done = map_tools::run(args, &|done, of| {
        bar.set_length(of as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    match done {
        Ok(made) => {
            let report = made.report.lines().map(str::to_owned);
            let mut lines = report.chain(made.written.iter().map(|path| path.display().to_string()));
            exit(lines.try_for_each(|line| say(&line)).map_err(FrameError::from))
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

fn run(args: &RunArgs) -> Result<(), FrameError> {
    let window = WindowJob {
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

fn replay(args: &ReplayArgs) -> Result<(), FrameError> {
    let scene = match &args.scene {
        Some(scene) => scene.clone(),
        None => recording::scene_of(&args.recording)?,
    };
    let (hash, recording) = (args.hash.clone(), args.recording.clone());
    let files = RunFiles { hash, replay: Some(recording), ..RunFiles::default() };
    if let Some(folder) = &args.output {
        systems::set_threads(args.view.threads.map(usize::from));
        let frames = args.frames.clone().unwrap_or(Frames::All);
        return render(&FrameJob { frames, run: files, ..picture_job(&scene, folder, &args.pictures, &args.view) });
    }
    if args.check {
        return check_steps(&scene, &files, args);
    }
    let (pictures, paused, panel) = (args.pictures.clone(), args.paused, !args.no_panel);
    show(&WindowJob { scene, files, from: args.from, speed: None, paused, panel, pictures }, &args.view)
}

/// Takes the steps of a recording, which compares them, and draws nothing.
fn check_steps(scene: &Path, files: &RunFiles, args: &ReplayArgs) -> Result<(), FrameError> {
    systems::set_threads(args.view.threads.map(usize::from));
    let mut stage = frames::load_stage(scene, None, &args.view.load())?;
    let mut stepper = frames::begin_run(&mut stage, scene, files, args.from)?;
    if let Some((_, last)) = stepper.recording().map(Recording::steps).filter(|&(_, last)| args.from >= last) {
        return Err(FrameError::NoSteps { from: args.from, last });
    }
    let begun = stage.simulation.world.resource::<Clock>().step;
    let bar = progress_bar("{bar:40} step {pos}/{len}  {per_sec}  {eta} left");
    while !stepper.is_at_end(&stage.simulation) {
        stepper.step(&mut stage.simulation)?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    let step = stage.simulation.world.resource::<Clock>().step;
    Ok(say(&format!("{}: steps {begun} to {step} come out as recorded", args.recording.display()))?)
}

/// What is shown in a window.
struct WindowJob {
    scene: PathBuf,
    files: RunFiles,
    /// The step that a replay begins after.
    from: u64,
    speed: Option<f64>,
    paused: bool,
    panel: bool,
    /// What is made where there is no display.
    pictures: PictureArgs,
}

fn show(job: &WindowJob, view: &ViewArgs) -> Result<(), FrameError> {
    systems::set_threads(view.threads.map(usize::from));
    let mut stage = frames::load_stage(&job.scene, view.camera.as_deref(), &view.load())?;
    let mut stepper = frames::begin_run(&mut stage, &job.scene, &job.files, job.from)?;
    while stepper.is_replay() && stage.simulation.world.resource::<Clock>().step < job.from {
        if stepper.is_at_end(&stage.simulation) {
            break;
        }
        stepper.step(&mut stage.simulation)?;
    }
    stage.simulation.world.insert_resource(view.lights);
    if let Some(speed) = job.speed {
        stage.simulation.world.resource_mut::<Clock>().speed = speed;
    }
    let options = app::Options {
        simulation: stage.simulation,
        scene: job.scene.clone(),
        load: view.load(),
        stepper,
        title: stage.scene.name,
        cameras: stage.scene.cameras,
        viewpoint: stage.viewpoint,
        size: view.size,
        settings: view.settings(),
        paused: job.paused,
        panel: job.panel,
    };
    match app::run(options) {
        Ok(()) => Ok(()),
        Err(AppError::NoDisplay(reason)) => {
            eprintln!("no window: {reason}\nrendering a picture instead");
            let folder = Path::new("relief-frames");
            let frames =
                if job.files.replay.is_some() { Frames::Range(job.from..job.from + 1) } else { Frames::First(1) };
            let pictures = picture_job(&job.scene, folder, &job.pictures, view);
            render(&FrameJob { frames, run: job.files.clone(), ..pictures })
        }
        Err(AppError::Gpu(error)) => Err(error.into()),
        Err(AppError::Render(error)) => Err(error.into()),
        Err(AppError::Texels(error)) => Err(error),
    }
}

fn check_files(files: &[PathBuf]) -> ExitCode {
    let mut errors = 0;
    let said = files.iter().try_for_each(|file| {
        let problems = check::check(file);
        errors += problems.iter().filter(|p| p.is_error()).count();
        problems.iter().try_for_each(|problem| say(&problem.to_string()))?;
        if problems.is_empty() { say(&format!("{}: ok", file.display())) } else { Ok(()) }
    });
    if said.is_ok() && errors > 0 { ExitCode::from(2) } else { exit(said.map_err(FrameError::from)) }
}
