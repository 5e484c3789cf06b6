//! Scenes that are drawn, and the files that they are made from.

use super::FrameError;
use crate::import;
use crate::session::{LoadOptions, Session};
use crate::viewpoint::Viewpoint;
use std::path::{Path, PathBuf};

/// Loads a scene, seen from the camera of a name, or from its first; warnings are logged.
///
/// # Errors
/// [`FrameError::Scene`], [`FrameError::NoCamera`].
pub fn load_session(path: &Path, camera: Option<&str>, options: &LoadOptions) -> Result<Session, FrameError> {
    let mut session = Session::load(path, options)?;
    if let Some(wanted) = camera {
        let cameras = &session.scene.cameras;
        session.viewpoint = Viewpoint::find(wanted, cameras, &mut session.simulation.world).ok_or_else(|| {
            let known = cameras.iter().map(|(name, _)| name.clone()).collect();
            FrameError::NoCamera { scene: path.to_owned(), wanted: wanted.to_owned(), known }
        })?;
    }
    Ok(session)
}

/// Makes sure that no output is one of the files that are read, or is named by one.
///
/// # Errors
/// [`FrameError::Overwrites`].
pub fn check_outputs(read: &[PathBuf], is_output: impl Fn(&Path) -> bool) -> Result<(), FrameError> {
    match import::with_files_named_by(read).find(|path| is_output(path)) {
        Some(path) => Err(FrameError::Overwrites { path }),
        None => Ok(()),
    }
}
