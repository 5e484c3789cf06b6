//! The bytes of files.

use std::path::Path;

/// Reads a regular file; a pipe or a device might never end.
pub fn read_file(path: &Path) -> std::io::Result<Vec<u8>> {
    if std::fs::metadata(path)?.is_file() {
        return std::fs::read(path);
    }
    Err(std::io::Error::other("not a regular file"))
}
