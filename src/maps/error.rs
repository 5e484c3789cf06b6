//! What stops a map tool.

use crate::frames::FrameError;
use crate::import::ImportError;
use crate::output::OutputError;
use std::fmt;
use std::path::{Path, PathBuf};

/// What stops a map tool.
#[derive(Debug, thiserror::Error)]
pub enum MapError {
    /// A file that is no image, or no model.
    #[error(transparent)]
    Import(#[from] ImportError),
    /// A file that is sound, and not what the tool needs.
    #[error("{}: {message}", path.display())]
    Refused {
        /// The file.
        path: PathBuf,
        /// What was expected.
        message: String,
    },
    /// An option that makes no sense.
    #[error("{option}: {message}")]
    Option {
        /// As it is typed.
        option: &'static str,
        /// What was expected.
        message: String,
    },
    /// A map or picture that could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The map is there, the picture of it is not.
    #[error("{}: the preview could not be drawn: {source}", path.display())]
    Preview {
        /// The picture.
        path: PathBuf,
        /// Why.
        source: FrameError,
    },
}

impl MapError {
    /// A file that is not what the tool needs.
    pub fn refused(path: &Path, message: impl fmt::Display) -> Self {
        Self::Refused { path: path.to_owned(), message: message.to_string() }
    }

    /// An option that makes no sense.
    pub fn option(option: &'static str, message: impl fmt::Display) -> Self {
        Self::Option { option, message: message.to_string() }
    }

    /// The exit code that says so.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Import(_) | Self::Refused { .. } | Self::Option { .. } => 2,
            Self::Preview { source: FrameError::Gpu(_), .. } => 3,
            Self::Output(error) | Self::Preview { source: FrameError::Output(error), .. } => error.exit_code(),
            Self::Preview { .. } => 1,
        }
    }
}
