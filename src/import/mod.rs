//! Files into library items: images ([`image`]) and glTF models ([`gltf`]).
//!
//! Everything is checked here, strictly, so that a frame has nothing left to refuse. A fault that touches what we
//! read is an [`ImportError`] that names the file, the place in it and what was expected; one that does not is a
//! [`Warning`] beside the model.

mod gltf;
mod image;
mod model;

pub use model::{Model, Node};

use bevy_tasks::ComputeTaskPool;
use std::fmt;
use std::path::{Path, PathBuf};
use systems::images::{Image, ImageKind};
use systems::library::Library;

/// Why a file is refused.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The file, or one that it names, cannot be read.
    #[error("{}: {place}: {source}", path.display())]
    Unreadable {
        /// The file that was being imported.
        path: PathBuf,
        /// Where in it the unreadable file is named; the unreadable path itself where it is the same.
        place: String,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// An image that is no image of a known kind, is damaged, or is too large.
    #[error("{}: {place}: {message}", path.display())]
    Image {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: String,
        /// What was expected.
        message: String,
    },
    /// The file breaks its format's rules in a way that touches what we read.
    #[error("{}: {place}: {message}", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Where in it: a JSON path like `meshes[0].primitives[1].attributes.POSITION`, a line, or a byte offset.
        place: String,
        /// What was expected.
        message: String,
    },
    /// The file is sound but needs something that Relief does not have.
    #[error("{}: {place}: {message}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: String,
        /// What it needs.
        message: String,
    },
}

/// Something about a file that a person should know, though it loads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The file.
    pub path: PathBuf,
    /// Where in it, as in [`ImportError`].
    pub place: String,
    /// What is the matter.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: {}: {}", self.path.display(), self.place, self.message)
    }
}

/// How bad a [`Problem`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The file loads, and something in it is left out or corrected.
    Warning,
    /// The file is refused.
    Error,
}

/// One thing wrong with a file, as `relief check` lists it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Whether the file is refused for it.
    pub severity: Severity,
    /// The file.
    pub path: PathBuf,
    /// Where in it, as in [`ImportError`].
    pub place: String,
    /// What was expected, or what is the matter.
    pub message: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let severity = match self.severity {
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        write!(f, "{severity}: {}: {}: {}", self.path.display(), self.place, self.message)
    }
}

/// Reads an image file with its mip levels.
pub fn load_image(path: &Path, kind: ImageKind) -> Result<Image, ImportError> {
    image::load(path, kind)
}

/// Reads image files in parallel; the results are in the order of the requests.
pub fn load_images(requests: &[(PathBuf, ImageKind)]) -> Vec<Result<Image, ImportError>> {
    systems::set_threads(None);
    ComputeTaskPool::get().scope(|scope| {
        for (path, kind) in requests {
            scope.spawn(async move { image::load(path, *kind) });
        }
    })
}

/// Reads a glTF file; its meshes, materials and images join the library.
pub fn load_model(path: &Path, library: &mut Library) -> Result<Model, ImportError> {
    gltf::load(path, library)
}
