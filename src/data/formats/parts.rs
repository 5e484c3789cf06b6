//! JSON files about a run as a whole, put together of those of its parts.

use crate::export::coco;
use crate::frames::FrameError;
use crate::output::OutputError;
use crate::problem::Problem;
use crate::scene::SceneError;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// Bytes of a whole file, of the files of the parts in their order, and its path for messages.
pub(crate) type Merge = fn(&[PathBuf], &Path) -> Result<Vec<u8>, FrameError>;

/// Appends the contents of all parts to those of the first.
///
/// # Errors
/// [`FrameError`]: a part that cannot be read.
pub(super) fn append_all<T: Serialize + DeserializeOwned>(
    parts: &[PathBuf],
    path: &Path,
    append: fn(&mut T, T),
) -> Result<Vec<u8>, FrameError> {
    let mut whole: Option<T> = None;
    for part in parts {
        let more = read_json(part)?;
        match &mut whole {
            None => whole = Some(more),
            Some(whole) => append(whole, more),
        }
    }
    let mut bytes = Vec::new();
    coco::write(&mut bytes, &whole).map_err(|error| OutputError::io(path, error))?;
    Ok(bytes)
}

/// Reads a JSON file of a part.
///
/// # Errors
/// [`FrameError`]: it is not there, or something else.
pub(crate) fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T, FrameError> {
    let file = File::open(path).map_err(|error| refused(path, error))?;
    serde_json::from_reader(BufReader::new(file)).map_err(|error| refused(path, error))
}

/// Refusal of a part's file.
pub(crate) fn refused(path: &Path, message: impl std::fmt::Display) -> FrameError {
    SceneError::from(Problem::error(path, message)).into()
}
