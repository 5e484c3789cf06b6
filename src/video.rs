//! Frames into a film, by ffmpeg where it is installed.

use crate::output::OutputError;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A film that could not be made; the frames are there all the same.
#[derive(Debug, thiserror::Error)]
pub enum VideoError {
    /// ffmpeg cannot be run.
    #[error("{}: cannot run ffmpeg, which makes the video ({reason}); install it (Debian, Ubuntu: apt-get install ffmpeg), the frames are in {}", path.display(), frames.display())]
    NoEncoder {
        /// The film.
        path: PathBuf,
        /// The folder of its frames.
        frames: PathBuf,
        /// What the operating system says.
        reason: std::io::Error,
    },
    /// ffmpeg fails.
    #[error("{}: ffmpeg failed: {message}", path.display())]
    Failed {
        /// The film.
        path: PathBuf,
        /// The last line it printed.
        message: String,
    },
    /// The film cannot be put in its place.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Whether ffmpeg can be run and the film's folder is there, asked before hours of rendering.
///
/// # Errors
/// [`VideoError::NoEncoder`], [`VideoError::Output`].
pub fn check(path: &Path, frames: &Path) -> Result<(), VideoError> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    folder.metadata().map_err(|source| OutputError::Io { path: path.to_owned(), source })?;
    let asked = Command::new("ffmpeg").arg("-version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    let no_encoder = |reason| VideoError::NoEncoder { path: path.to_owned(), frames: frames.to_owned(), reason };
    asked.map(drop).map_err(no_encoder)
}

/// Encodes `folder/color_NNNNN.png` of those frames; written under another name, then renamed.
///
/// # Errors
/// [`VideoError`].
pub fn encode(path: &Path, folder: &Path, frames: Range<u64>, frames_per_second: f64) -> Result<(), VideoError> {
    let mut name = std::ffi::OsString::from(format!(".part-{}-", std::process::id()));
    name.push(path.file_name().unwrap_or_default());
    // ffmpeg runs in the frames' folder: a % in its name would count as a part of the pattern.
    let temporary = std::path::absolute(path.with_file_name(name));
    let temporary = temporary.map_err(|source| OutputError::Io { path: path.to_owned(), source })?;
    let output = Command::new("ffmpeg")
        .args(["-y", "-loglevel", "error", "-framerate", &frames_per_second.to_string()])
        .args(["-start_number", &frames.start.to_string(), "-i"])
        .arg("color_%05d.png")
        .args(["-frames:v", &(frames.end - frames.start).to_string()])
        // Most players want 4:2:0 with even sides.
        .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"])
        .arg(&temporary)
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .map_err(|reason| VideoError::NoEncoder { path: path.to_owned(), frames: folder.to_owned(), reason })?;
    if !output.status.success() {
        let _ = std::fs::remove_file(&temporary);
        let said = String::from_utf8_lossy(&output.stderr);
        let message = said.lines().last().unwrap_or("it said nothing").to_owned();
        return Err(VideoError::Failed { path: path.to_owned(), message });
    }
    std::fs::rename(&temporary, path).map_err(|source| {
        let _ = std::fs::remove_file(&temporary);
        OutputError::Io { path: path.to_owned(), source }.into()
    })
}
