//! Outcome of a tool.

use std::path::PathBuf;

/// What a tool did.
pub struct Made {
    /// The files, in the order of writing.
    pub written: Vec<PathBuf>,
    /// What there is to know of it; ends with a line, if there is anything.
    pub report: String,
}

impl From<Vec<PathBuf>> for Made {
    fn from(written: Vec<PathBuf>) -> Self {
        Self { written, report: String::new() }
    }
}
