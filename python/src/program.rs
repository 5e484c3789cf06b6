//! The command line, in a process of Python.

use pyo3::prelude::*;
use relief::commands::{self, Process};
use relief::demo;
use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Instant;

/// Does what the program ``relief`` does with ``arguments``, and returns its exit code. ``command`` starts the program
/// anew; ``package`` is the folder with the assets. May take the process's place.
#[pyfunction]
pub fn run_program(py: Python<'_>, command: Vec<OsString>, arguments: Vec<OsString>, package: PathBuf) -> u8 {
    let process = Process { started: Instant::now(), command };
    demo::install_folder(package);
    py.detach(|| commands::main(arguments, &process))
}
