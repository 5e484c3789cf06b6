//! Warnings and errors of commands.

use std::io::IsTerminal;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::prelude::*;

/// Warnings and errors go to stderr; `RUST_LOG` says otherwise, as in `relief=debug,warn`. Where the process has a log
/// already, they go there.
pub fn to_stderr() {
    let wanted = std::env::var("RUST_LOG").ok().and_then(|text| text.parse().ok());
    let quiet = || Targets::new().with_default(LevelFilter::WARN).with_target("winit", LevelFilter::ERROR);
    let layer = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .without_time()
        .with_target(false);
    _ = tracing_subscriber::registry().with(layer).with(wanted.unwrap_or_else(quiet)).try_init();
}
