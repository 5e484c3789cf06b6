//! Errors of outputs, and of the folders that they go to.

use super::names::named_folder;
use std::path::{Path, PathBuf};

/// An output that could not be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// Reading or writing the directory or the file failed.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// The output.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The parent directory does not exist.
    #[error("{}: no such directory: {}", path.display(), folder.display())]
    NoFolder {
        /// The output.
        path: PathBuf,
        /// The missing directory.
        folder: PathBuf,
    },
    /// A directory was expected, found something else.
    #[error("{}{}: not a directory", of(path, taken), taken.display())]
    NotAFolder {
        /// The output.
        path: PathBuf,
        /// The path that is not a directory.
        taken: PathBuf,
    },
    /// The output, or a directory of its path, is a broken symbolic link.
    #[error("{}{}: broken symbolic link: {} does not exist", of(path, link), link.display(), target.display())]
    DanglingLink {
        /// The output.
        path: PathBuf,
        /// The link.
        link: PathBuf,
        /// Its target.
        target: PathBuf,
    },
    /// The output, or a directory of its path, is a circular symbolic link.
    #[error("{}{}: circular symbolic link", of(path, link), link.display())]
    LinkLoop {
        /// The output.
        path: PathBuf,
        /// The link.
        link: PathBuf,
    },
    /// A file name was expected, found a directory.
    #[error("{}: is a directory; expected a file name", path.display())]
    IsAFolder {
        /// The output.
        path: PathBuf,
    },
    /// The output is a device or a pipe, over which no file is renamed.
    #[error("{}: not a regular file", path.display())]
    NotAFile {
        /// The output.
        path: PathBuf,
    },
    /// The directory exists, but files cannot be created in it, as in `/proc`.
    #[error("{}: files cannot be created in this directory", path.display())]
    TakesNoFiles {
        /// The output.
        path: PathBuf,
    },
    /// The picture could not be encoded.
    #[error("cannot encode {}: {source}", path.display())]
    Encode {
        /// The output.
        path: PathBuf,
        /// Error of the encoder.
        source: image::ImageError,
    },
}

/// A path and a colon, unless what follows is the path.
fn of(path: &Path, what: &Path) -> String {
    if path == what { String::new() } else { format!("{}: ", path.display()) }
}

impl OutputError {
    /// Error of a file that was to be written, by that of the system.
    pub fn io(path: &Path, source: std::io::Error) -> Self {
        check_folder(path).err().unwrap_or_else(|| Self::of_system(path, source))
    }

    /// The same where the folder is known to be there: one that nothing is found in even as it is made takes no files.
    pub(super) fn of_system(path: &Path, source: std::io::Error) -> Self {
        let path = path.to_owned();
        match source.kind() {
            std::io::ErrorKind::NotFound => Self::TakesNoFiles { path },
            _ => Self::Io { path, source },
        }
    }

    /// Tells if the name was refused before writing; else writing failed.
    pub fn is_refusal(&self) -> bool {
        !matches!(self, Self::Io { .. } | Self::Encode { .. })
    }
}

/// Checks that the folder of a file is there; one that cannot be reached counts as there.
///
/// # Errors
/// [`OutputError::NoFolder`], [`OutputError::NotAFolder`], [`OutputError::DanglingLink`], [`OutputError::LinkLoop`].
pub fn check_folder(path: &Path) -> Result<(), OutputError> {
    check_links(path)?;
    let Some(folder) = path.parent().map(named_folder) else { return Ok(()) };
    if let Some(taken) = in_the_way(folder) {
        return Err(OutputError::NotAFolder { path: path.to_owned(), taken: taken.to_owned() });
    }
    match folder.try_exists() {
        Ok(false) => Err(OutputError::NoFolder { path: path.to_owned(), folder: folder.to_owned() }),
        _ => Ok(()),
    }
}

/// Checks that a file that is renamed to that name takes the place of nothing else.
pub(super) fn check_ordinary(path: &Path) -> Result<(), OutputError> {
    let is_other = path.metadata().is_ok_and(|found| !found.is_file() && !found.is_dir());
    if is_other { Err(OutputError::NotAFile { path: path.to_owned() }) } else { Ok(()) }
}

/// Checks that neither a path nor a folder of it is a link that leads nowhere: such a path is neither there nor free.
///
/// # Errors
/// [`OutputError::DanglingLink`], [`OutputError::LinkLoop`].
pub(super) fn check_links(path: &Path) -> Result<(), OutputError> {
    use std::io::ErrorKind::{NotADirectory, NotFound, PermissionDenied};
    let Some(link) = path.ancestors().find(|above| above.symlink_metadata().is_ok()) else { return Ok(()) };
    let (Ok(target), Err(error)) = (link.read_link(), link.metadata()) else { return Ok(()) };
    let (path, link) = (path.to_owned(), link.to_owned());
    match error.kind() {
        // Where it leads cannot be seen; what cannot be written is told when it is tried.
        PermissionDenied => Ok(()),
        NotFound | NotADirectory => Err(OutputError::DanglingLink { path, link, target }),
        _ => Err(OutputError::LinkLoop { path, link }),
    }
}

/// Path that is there in place of a folder, or of one of its parents.
pub(super) fn in_the_way(folder: &Path) -> Option<&Path> {
    folder.ancestors().find(|above| above.exists()).filter(|above| !above.is_dir())
}
