//! Faults of files: those that refuse a file, and those that do not.

use crate::problem::Problem;
use std::fmt;
use std::path::PathBuf;

/// Reasons for which a file is refused.
///
/// `place` is where in the file: a JSON path like `meshes[0].primitives[1].attributes.POSITION`, a line, or a byte
/// offset. `message` says what was expected there.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)]
pub enum ImportError {
    /// The file, or one that it names, cannot be read.
    #[error("{}: {place}: {message}", path.display())]
    Unreadable { path: PathBuf, place: String, message: String },
    /// The file breaks its format's rules in a way that touches what we read.
    #[error("{}: {place}: {message}", path.display())]
    Invalid { path: PathBuf, place: String, message: String },
    /// The file may be sound, but needs something that Relief does not have.
    #[error("{}: {place}: {message}", path.display())]
    Unsupported { path: PathBuf, place: String, message: String },
}

/// Something about a file that a person should know, though it loads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The file.
    pub path: PathBuf,
    /// Place in the file, as in [`ImportError`].
    pub place: String,
    /// Description of the fault.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: {}: {}", self.path.display(), self.place, self.message)
    }
}

impl From<ImportError> for Problem {
    fn from(error: ImportError) -> Self {
        let (ImportError::Unreadable { path, place, message }
        | ImportError::Invalid { path, place, message }
        | ImportError::Unsupported { path, place, message }) = error;
        Self { place, ..Self::error(&path, message) }
    }
}

impl From<Warning> for Problem {
    fn from(Warning { path, place, message }: Warning) -> Self {
        Self { place, ..Self::warning(&path, message) }
    }
}
