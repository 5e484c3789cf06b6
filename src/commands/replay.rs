//! `relief replay`.

use crate::commands::common::arguments::{self, MOST_FRAMES};
use crate::commands::common::failure::{Failure, say};
use crate::commands::common::progress;
use crate::commands::common::view::{PictureArgs, ViewArgs, parse_frames};
use crate::commands::rendering::render::render;
use crate::commands::window::{WindowJob, show};
use crate::data::Work;
use crate::frames::{Frames, RunJob};
use crate::recording::{self, Recording, RunFiles};
use crate::session::{LoadOptions, Session};
use clap::Args;
use std::path::{Path, PathBuf};

pub const HELP: &str = "\
Examples:
  relief replay drive.rec                               in a window
  relief replay drive.rec --from 3600                   from step 3600 on
  relief replay drive.rec -o frames --frames 600..660   ten seconds in, a second of pictures
  relief replay drive.rec --check                       no pictures: compare every step

See docs/simulation.md for the contents of a recording.";

#[derive(Args)]
pub struct ReplayArgs {
    /// Recording made by relief run --record or relief render --record
    pub recording: PathBuf,
    /// Output directory for pictures, created if missing [default: replay in a window]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Number of frames, or a range A..B of frame numbers, B excluded [default: all]
    #[arg(long, value_name = "N | A..B", value_parser = parse_frames, requires = "output")]
    pub frames: Option<Frames>,
    #[command(flatten)]
    pub pictures: PictureArgs,
    /// Simulate without drawing and compare every step with the recording
    #[arg(long, conflicts_with = "output")]
    pub check: bool,
    /// Start after this step, in the window or in the check
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = arguments::whole(0..=MOST_FRAMES))]
    #[arg(conflicts_with = "output")]
    pub from: u64,
    /// Scene file, if it has moved since the recording
    #[arg(long, value_name = "FILE")]
    pub scene: Option<PathBuf>,
    /// Write the step number and a hash of the whole state after each step, one line per step
    #[arg(long, value_name = "FILE")]
    pub hash: Option<PathBuf>,
    /// Start paused
    #[arg(long)]
    pub paused: bool,
    /// Start with the panel hidden (Tab shows it)
    #[arg(long)]
    pub no_panel: bool,
    #[command(flatten)]
    pub view: ViewArgs,
}

pub fn run(args: &ReplayArgs) -> Result<(), Failure> {
    if args.view.weather.is_some() {
        return Err(Failure::bad_input("--weather: a replay has the weather of its recording".into()));
    }
    let recorded = recording::identity_of(&args.recording)?;
    let scene = args.scene.clone().unwrap_or_else(|| recorded.scene.into());
    // A run may have another than its scene.
    let seed = Some(recorded.seed);
    let (hash, recording) = (args.hash.clone(), args.recording.clone());
    let files = RunFiles { hash, replay: Some(recording), ..RunFiles::default() };
    if let Some(folder) = &args.output {
        args.view.set_threads();
        let frames = args.frames.clone().unwrap_or(Frames::All);
        let mut job = args.pictures.job(&scene, folder, &args.view);
        job.run = RunJob { frames, files, ..job.run };
        job.run.load.seed = seed;
        return render(&Work::Frames(job));
    }
    if args.check {
        return check_steps(&scene, &files, seed, args);
    }
    let (pictures, paused, panel) = (args.pictures.clone(), args.paused, !args.no_panel);
    show(&WindowJob { scene, files, seed, from: args.from, speed: None, paused, panel, pictures }, &args.view)
}

/// Takes the steps of a recording, which compares them, and draws nothing.
fn check_steps(scene: &Path, files: &RunFiles, seed: Option<u64>, args: &ReplayArgs) -> Result<(), Failure> {
    args.view.set_threads();
    let mut session = Session::load(scene, &LoadOptions { seed, ..args.view.load() })?;
    session.begin(files, args.from)?;
    if let Some((_, last)) = session.recording().map(Recording::steps).filter(|&(_, last)| args.from >= last) {
        let from = args.from;
        let message = format!("--from {from}: there are no steps after it, the recording ends with step {last}");
        return Err(Failure::bad_input(message));
    }
    let begun = session.step_number();
    let bar = progress::bar("{bar:40} step {pos}/{len}  {per_sec}  {eta} left");
    while session.play()? {
        bar.inc(1);
    }
    session.finish()?;
    bar.finish_and_clear();
    let step = session.step_number();
    Ok(say(&format!("{}: steps {begun} to {step} come out as recorded", args.recording.display()))?)
}
