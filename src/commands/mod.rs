//! The command line: `relief run, render, split, merge, replay, lights, gallery, compare, bench, map, check, info`. The
//! commands, what each takes, its help, and what it does with the library. The rest of the library knows nothing of it.
//!
//! Exit codes: 0 done, 2 bad input or usage, 3 no usable graphics adapter, 4 shards are missing, 1 anything else.
//!
//! ```text
//! run, render, replay, lights, shadows, gallery, compare, bench, map, check, info    a command each
//! split, shard, merge    a run in parts, and one of these
//! window     what `run` and `replay` show; without the feature `window`, a picture
//! view       what several commands take;  arguments: how their values are read
//! progress   bars on a terminal
//! failure    messages and exit codes
//! display    a command without a window asks no display for anything
//! log        warnings and errors on standard error
//! ```

mod arguments;
mod bench;
mod check;
mod compare;
mod display;
mod failure;
mod frame_error;
mod gallery;
mod info;
mod lights;
mod log;
mod map;
mod merge;
mod progress;
mod render;
mod replay;
mod run;
mod shadows;
mod shard;
mod split;
mod view;
mod window;

use bench::BenchArgs;
use check::CheckArgs;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use compare::CompareArgs;
use failure::Failure;
use frame_error::FrameErrorArgs;
use gallery::GalleryArgs;
use map::MapArgs;
use merge::MergeArgs;
use render::RenderArgs;
use replay::ReplayArgs;
use run::RunArgs;
use split::SplitArgs;
use std::ffi::OsString;
use std::time::Instant;

/// A simulation renderer for scenes of many bump-mapped objects, each lit by its most relevant lights.
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
  relief run scene.ron --record drive.rec         then: relief replay drive.rec
  relief lights scene.ron -o out                  error of the light policies against all lights
  relief shadows scene.ron -o out                 error of the shadows against traced ones
  relief gallery -o out                           every bump technique on four mesh variants
  relief compare -o out                           error of each against displaced geometry
  relief bench --objects 100000                   time and memory of many objects
  relief map normal height.png -o normal.png      a normal map from a height map
  relief check scene.ron model.glb                validate the files

Exit codes: 0 done, 2 bad input or usage, 3 no usable graphics adapter, 4 shards are missing, 1 anything else.";

/// The process that a command runs in.
pub struct Process {
    /// When it started.
    pub started: Instant,
    /// The command that starts it anew, before its arguments: a program, and what always follows it. Where it is empty,
    /// nothing is done in processes of its own.
    pub command: Vec<OsString>,
}

impl Process {
    /// The same again, without arguments.
    fn anew(&self) -> Option<std::process::Command> {
        let (program, more) = self.command.split_first()?;
        let mut command = std::process::Command::new(program);
        command.args(more);
        Some(command)
    }
}

/// Does what the command line says, and returns the exit code. `arguments` are without the program's name. What is wrong
/// is said on standard error. May take the process's place with one that knows of no display, before it does anything.
pub fn main(arguments: impl IntoIterator<Item = OsString>, process: &Process) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let command = match Cli::read(std::iter::once("relief".into()).chain(arguments.iter().cloned())) {
        Ok(cli) => cli.chosen(),
        Err(error) => {
            // As clap's own exit does; who reads it may be gone.
            _ = error.print();
            return u8::try_from(error.exit_code()).unwrap_or(failure::BAD_INPUT);
        }
    };
    log::to_stderr();
    if !command.shows_window() || !display::may_exist() {
        display::forget(process, &arguments);
    }
    command.run(process).map_or_else(Failure::exit, |()| 0)
}

impl Cli {
    /// What the command line says, its first argument the program's name. Errors are help and versions, too.
    fn read(arguments: impl IntoIterator<Item = OsString>) -> Result<Self, clap::Error> {
        let mut command = with_negative_numbers(Self::command());
        let matches = command.try_get_matches_from_mut(arguments)?;
        let mut cli = Self::from_arg_matches(&matches).map_err(|error| error.format(&mut command))?;
        if let (Some(Command::Split(args)), Some((name, matches))) = (&mut cli.command, matches.subcommand())
            && let Some(command) = command.find_subcommand(name)
        {
            args.keep_options(command, matches);
        }
        Ok(cli)
    }

    /// The command to run.
    fn chosen(self) -> Command {
        self.command.unwrap_or(Command::Run(self.run))
    }
}

/// Has a command and those below it take -1 for a value, so that it is refused for what it is, not for an unknown
/// option.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let names: Vec<String> = command.get_subcommands().map(|below| below.get_name().to_owned()).collect();
    let command = command.allow_negative_numbers(true);
    names.iter().fold(command, |command, name| command.mut_subcommand(name, with_negative_numbers))
}

#[derive(Subcommand)]
enum Command {
    /// Show a scene in a window; without a display, render pictures instead
    Run(RunArgs),
    /// Render frames to PNG files, without a window
    Render(RenderArgs),
    /// Simulate a run once and split its frames into shards, for many machines to render
    #[command(after_help = split::HELP)]
    Split(SplitArgs),
    /// Put rendered shards together to what one process would have written; exit code 4 where some are missing
    Merge(MergeArgs),
    /// Replay a recorded run, in a window or as pictures
    #[command(after_help = replay::HELP)]
    Replay(ReplayArgs),
    /// Compare a frame lit by each light policy with one lit by all lights: error figures and pictures
    #[command(after_help = lights::HELP)]
    Lights(FrameErrorArgs),
    /// Compare a frame's shadows with traced ones: error figures and pictures
    #[command(after_help = shadows::HELP)]
    Shadows(shadows::ShadowErrorArgs),
    /// Draw a scene once for each mesh variant, and all on one contact sheet [default scene: every bump technique]
    #[command(after_help = gallery::HELP)]
    Gallery(GalleryArgs),
    /// Compare bump techniques with displaced geometry: error, cost and pictures
    #[command(after_help = compare::HELP)]
    Compare(CompareArgs),
    /// Benchmark a grid of bump-mapped objects under many lights, or any scene
    #[command(after_help = bench::HELP)]
    Bench(BenchArgs),
    /// Make normal, height, horizon and other maps from images
    Map(MapArgs),
    /// Validate scenes, models and images; exit code 2 on errors
    Check(CheckArgs),
    /// Print the graphics adapter, its driver and limits
    Info,
}

impl Command {
    /// Whether it shows a window where there is a display.
    fn shows_window(&self) -> bool {
        match self {
            _ if !cfg!(feature = "window") => false,
            Self::Run(_) => true,
            Self::Replay(args) => args.output.is_none() && !args.check,
            _ => false,
        }
    }

    /// Does it.
    fn run(self, process: &Process) -> Result<(), Failure> {
        match self {
            Self::Run(args) => run::run(&args),
            Self::Render(args) => render::run(&args),
            Self::Split(args) => split::run(&args),
            Self::Merge(args) => merge::run(&args),
            Self::Replay(args) => replay::run(&args),
            Self::Lights(args) => lights::run(&args),
            Self::Shadows(args) => shadows::run(&args),
            Self::Gallery(args) => gallery::run(&args),
            Self::Compare(args) => compare::run(&args),
            Self::Bench(args) => bench::run(&args, process),
            Self::Map(args) => map::run(&args),
            Self::Check(args) => check::run(&args),
            Self::Info => info::run(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
