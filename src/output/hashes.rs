//! Hashes of files (BLAKE3), by which damage is found.

use super::error::OutputError;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};

/// The hash of a file that need not fit into memory, in hexadecimal digits.
///
/// # Errors
/// Errors of the operating system.
pub fn hash_of(path: &Path) -> std::io::Result<String> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(File::open(path)?)?;
    Ok(hasher.finalize().to_string())
}

/// The hash of each file below a folder, by its path in it with `/` between the names.
///
/// # Errors
/// [`OutputError::Io`]: a file cannot be read back.
pub fn hashes_of<'a>(
    folder: &Path,
    files: impl IntoIterator<Item = &'a PathBuf>,
) -> Result<BTreeMap<String, String>, OutputError> {
    let hashed = |path: &PathBuf| {
        let hash = hash_of(path).map_err(|error| OutputError::io(path, error))?;
        let name = path.strip_prefix(folder).unwrap_or(path).to_string_lossy().replace('\\', "/");
        Ok((name, hash))
    };
    files.into_iter().map(hashed).collect()
}
