//! Folder of a run's data set, and the files that one form has written there.

use crate::frames::FrameError;
use crate::output::{self, OutputError};
use std::io;
use std::path::{Path, PathBuf};

/// A folder, and what was written into it.
pub(super) struct RunFolder {
    /// Path of the folder.
    pub path: PathBuf,
    /// Files, in the order in which they were written.
    pub written: Vec<PathBuf>,
}

impl RunFolder {
    /// A folder into which nothing was written yet.
    pub fn new(path: &Path) -> Self {
        Self { path: path.to_owned(), written: Vec::new() }
    }

    /// Writes a file by its name from the folder on.
    ///
    /// # Errors
    /// The error of its bytes, or a file that cannot be written.
    pub fn write(&mut self, name: &str, bytes: io::Result<Vec<u8>>) -> Result<(), FrameError> {
        let path = self.path.join(name);
        let bytes = bytes.map_err(|error| OutputError::io(&path, error))?;
        output::make_folder(path.parent().unwrap_or(Path::new("")))?;
        output::write_whole(&path, &bytes)?;
        self.written.push(path);
        Ok(())
    }
}
