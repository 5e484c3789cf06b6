//! Names of files.

use std::path::{Path, PathBuf};

/// Path that stands for all names of a file, whether it is there or not.
pub fn real(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| match (path.parent(), path.file_name()) {
        (Some(folder), Some(name)) => real(named_folder(folder)).join(name),
        _ => path.to_owned(),
    })
}

/// Tells if two names are those of one file.
pub fn is_same(a: &Path, b: &Path) -> bool {
    real(a) == real(b)
}

/// Folder of a file, by its parent, which is empty of a bare name.
pub(super) fn named_folder(parent: &Path) -> &Path {
    if parent.as_os_str().is_empty() { Path::new(".") } else { parent }
}
