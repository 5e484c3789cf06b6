//! The command line: `relief run, render, split, merge, replay, lights, gallery, compare, bench, map, check, schema,
//! info`. The commands, what each takes, its help, and what it does with the library. The rest of the library knows
//! nothing of it.
//!
//! Exit codes: 0 done, 2 bad input or usage, 3 no usable graphics adapter, 4 shards are missing, 1 anything else.
//!
//! ```text
//! common/     what several commands take and say
//! rendering/  render, split, merge, and rendering a shard
//! window      what `run` and `replay` show; without the feature `window`, a picture
//! run, replay, check, schema, info    a command each
//! tools/      those of the feature `tools`: lights, shadows, sky, gallery, compare, bench, map. no_tools: without it
//! ```

mod check;
mod common;
mod info;
mod rendering;
mod replay;
mod run;
mod schema;
#[cfg(feature = "tools")]
mod tools;
#[cfg(not(feature = "tools"))]
#[path = "no_tools.rs"]
mod tools;
mod window;

pub use common::process::Process;

use check::CheckArgs;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use common::failure::Failure;
use common::{display, failure, log};
use rendering::merge::{self, MergeArgs};
use rendering::render::{self, RenderArgs};
use rendering::split::{self, SplitArgs};
use replay::ReplayArgs;
use run::RunArgs;
use schema::SchemaArgs;
use std::ffi::OsString;

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
  relief sky scene.ron -o out                     error of the sky's light against rays
  relief gallery -o out                           every bump technique on four mesh variants
  relief compare -o out                           error of each against displaced geometry
  relief bench --objects 100000                   time and memory of many objects
  relief map normal height.png -o normal.png      a normal map from a height map
  relief check scene.ron model.glb                validate the files
  relief schema > scene.schema.json               names, ranges and meanings of what scenes have

Exit codes: 0 done, 2 bad input or usage, 3 no usable graphics adapter, 4 shards are missing, 1 anything else.";

/// Does what the command line says, and returns the exit code. `arguments` are without the program's name. What is
/// wrong is said on standard error. May take the process's place with one that knows of no display, before it does
/// anything.
pub fn main(arguments: impl IntoIterator<Item = OsString>, process: &Process) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let command = match Cli::read(std::iter::once("relief".into()).chain(arguments.iter().cloned())) {
        Ok(cli) => cli.chosen(),
        Err(error) => {
            // As clap's own exit does; its reader may be gone.
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
    /// Arguments of the command line, the first of them the program's name. Errors are help and versions, too.
    fn read(arguments: impl IntoIterator<Item = OsString>) -> Result<Self, clap::Error> {
        let mut command = with_negative_numbers(Self::command());
        let matches = command.try_get_matches_from_mut(arguments)?;
        Self::from_arg_matches(&matches).map_err(|error| error.format(&mut command))
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
    #[command(flatten)]
    Tool(tools::Tool),
    /// Validate scenes, models and images; exit code 2 on errors
    Check(CheckArgs),
    /// Print the JSON schema of scene files, for editors and for programs that write scenes
    Schema(SchemaArgs),
    /// Print the graphics adapter, its driver and limits
    Info,
}

impl Command {
    /// Tells if it shows a window where there is a display.
    fn shows_window(&self) -> bool {
        let shows = match self {
            Self::Run(_) => true,
            Self::Replay(args) => args.output.is_none() && !args.check,
            _ => false,
        };
        shows && cfg!(feature = "window")
    }

    /// Does it.
    fn run(self, process: &Process) -> Result<(), Failure> {
        match self {
            Self::Run(args) => run::run(&args),
            Self::Render(args) => render::run(&args),
            Self::Split(args) => split::run(&args),
            Self::Merge(args) => merge::run(&args),
            Self::Replay(args) => replay::run(&args),
            Self::Tool(tool) => tool.run(process),
            Self::Check(args) => check::run(&args),
            Self::Schema(args) => schema::run(&args),
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
