//! The command line: `relief run, render, split, merge, replay, lights, gallery, compare, bench, map, check, info`.
//!
//! Exit codes: 0 done, 2 bad input or usage, 3 no usable graphics adapter, 4 shards are missing, 1 anything else.

mod commands;

use commands::{Cli, display};
use std::io::IsTerminal;
use std::process::ExitCode;
use std::time::Instant;
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
    let command = Cli::read().chosen();
    log_to_stderr();
    if !command.shows_window() || !display::may_exist() {
        display::forget();
    }
    match command.run(started) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.exit(),
    }
}
