//! Problems with files: one form for scenes, models and images.

use std::fmt;
use std::path::{Path, PathBuf};

/// Severity of a [`Problem`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The file loads, and something in it is left out or corrected.
    Warning,
    /// The file is refused.
    Error,
}

/// One thing wrong with a file. Its text names the place: `path:line:column: place: what was expected`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// [`Severity::Error`] if the file is refused for it.
    pub severity: Severity,
    /// The file.
    pub path: PathBuf,
    /// Line and column, both from 1; `None` where the whole file is meant, or the file has no lines.
    pub line_column: Option<(usize, usize)>,
    /// The field (`entities[3].light.range`), JSON path or byte offset; empty where there is none.
    pub place: String,
    /// Description of the problem, and of what was expected.
    pub message: String,
}

impl Problem {
    /// The whole file is refused.
    pub fn error(path: &Path, message: impl fmt::Display) -> Self {
        let (severity, path) = (Severity::Error, path.to_owned());
        Self { severity, path, line_column: None, place: String::new(), message: message.to_string() }
    }

    /// Something to know about the whole file.
    pub fn warning(path: &Path, message: impl fmt::Display) -> Self {
        Self { severity: Severity::Warning, ..Self::error(path, message) }
    }

    /// Tells if the file is refused for it.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        if let Some((line, column)) = self.line_column {
            write!(f, ":{line}:{column}")?;
        }
        if !self.is_error() {
            write!(f, ": warning")?;
        }
        if !self.place.is_empty() {
            write!(f, ": {}", self.place)?;
        }
        write!(f, ": {}", self.message)
    }
}
