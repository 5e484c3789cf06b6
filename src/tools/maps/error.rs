//! Errors of map tools.

use crate::frames::FrameError;
use crate::import::ImportError;
use crate::output::OutputError;
use std::fmt;
use std::path::{Path, PathBuf};

/// Errors of map tools.
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
        /// Message with what was expected.
        message: String,
    },
    /// A colour image where one value per texel is needed, and none of its channels was chosen.
    #[error(
        "{}: expected a grey image, one value per texel; at texel ({}, {}) red, green and blue differ",
        path.display(), texel.0, texel.1
    )]
    NotGrey {
        /// The image.
        path: PathBuf,
        /// The first coloured texel, from the left and from above.
        texel: (usize, usize),
    },
    /// A bake in which no ray met the fine mesh.
    #[error(
        "{}: none of {rays} rays met {} within {metres} m of the surface: expected meshes in the same place",
        path.display(), fine.display()
    )]
    NothingMet {
        /// The coarse mesh.
        path: PathBuf,
        /// Rays cast.
        rays: usize,
        /// The fine mesh.
        fine: PathBuf,
        /// The reach of a ray either way.
        metres: f32,
    },
    /// An option that makes no sense.
    #[error("{option}: {message}")]
    Option {
        /// The name of its field.
        option: &'static str,
        /// Message with what was expected.
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
        /// Cause.
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
}
