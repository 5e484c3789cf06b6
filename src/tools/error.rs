//! Failures of the tools that draw scenes.

use crate::frames::FrameError;
use crate::tools::compare::CompareError;
use std::path::PathBuf;

/// Errors of tools.
#[derive(Debug, thiserror::Error)]
pub enum ToolError {
    /// An error in rendering frames.
    #[error(transparent)]
    Frame(FrameError),
    /// A gallery of a scene without mesh variants.
    #[error("{}: no entity has mesh variants, figure: [\"MESH\", …]", scene.display())]
    NoMeshVariants {
        /// The scene.
        scene: PathBuf,
    },
    /// Pictures that cannot be compared.
    #[error(transparent)]
    Compare(#[from] CompareError),
}

impl<E: Into<FrameError>> From<E> for ToolError {
    fn from(error: E) -> Self {
        Self::Frame(error.into())
    }
}
