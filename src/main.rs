//! The program `relief`: [`relief::commands`] in a process of its own.

use relief::commands::{self, Process};
use std::process::ExitCode;
use std::time::Instant;

fn main() -> ExitCode {
    let command = std::env::current_exe().map(|program| program.into_os_string());
    let process = Process { started: Instant::now(), command: command.into_iter().collect() };
    ExitCode::from(commands::main(std::env::args_os().skip(1), &process))
}
