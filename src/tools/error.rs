//! Failures of the tools that draw scenes, and of benchmarks.

use crate::frames::FrameError;
use crate::tools::compare::CompareError;
use crate::tools::maps::MapError;
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
    /// A model without any mesh for a benchmark.
    #[error("{}: no triangles", .0.display())]
    NoMesh(PathBuf),
    /// A displaced figure that rays cannot be cast at.
    #[error(transparent)]
    Surface(MapError),
    /// Earlier results of a benchmark that cannot be compared with.
    #[error("{}: {place}: {message}", path.display())]
    Results {
        /// The file.
        path: PathBuf,
        /// Place in the file.
        place: String,
        /// Description of the problem.
        message: String,
    },
    /// A scene could not be measured in a process of its own.
    #[error("{what}: {message}")]
    SeparateProcess {
        /// The scene.
        what: String,
        /// Message of the process that measured it.
        message: String,
        /// Its exit code.
        code: u8,
    },
    /// A chart could not be drawn.
    #[error("{file}: {message}")]
    Plot {
        /// Its file.
        file: &'static str,
        /// Description of the problem.
        message: String,
    },
}

impl<E: Into<FrameError>> From<E> for ToolError {
    fn from(error: E) -> Self {
        Self::Frame(error.into())
    }
}
