//! Outcome of a tool.

use std::path::PathBuf;

/// Result of a tool.
pub struct Made {
    /// The files, in the order of writing.
    pub written: Vec<PathBuf>,
    /// Report for people; ends with a line, if there is anything.
    pub report: String,
}

impl From<Vec<PathBuf>> for Made {
    fn from(written: Vec<PathBuf>) -> Self {
        Self { written, report: String::new() }
    }
}
