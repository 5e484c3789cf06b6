//! Frames into a film, by ffmpeg where it is installed; else, or where the name asks for it, into an animated picture.

use crate::animation::{self, Animation};
use crate::frame_time::FrameTime;
use crate::output::{self, OutputError};
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// A film that could not be made; the frames are there all the same.
#[derive(Debug, thiserror::Error)]
pub enum VideoError {
    /// ffmpeg fails.
    #[error("{}: ffmpeg failed: {message}", path.display())]
    Failed {
        /// The film.
        path: PathBuf,
        /// The last line it printed.
        message: String,
    },
    /// There is no ffmpeg, and nothing is made instead.
    #[error(
        "cannot run ffmpeg, which encodes videos ({reason}); to install it: apt-get install ffmpeg (Debian, Ubuntu)"
    )]
    NoEncoder {
        /// Error of the operating system.
        reason: std::io::Error,
    },
    /// ffmpeg does not know what to make of the name.
    #[error(
        "{}: unsupported video format; use .mp4, .mkv, .webm, .gif or .apng ({message})",
        path.display()
    )]
    UnknownEnding {
        /// The film.
        path: PathBuf,
        /// The last line it printed.
        message: String,
    },
    /// The film cannot be put in its place.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Checks, before hours of rendering, that the film can be written and that ffmpeg knows its format. If ffmpeg is
/// missing, it says what is made instead.
///
/// # Errors
/// [`VideoError`].
pub fn check(path: &Path) -> Result<(), VideoError> {
    output::check_file(path)?;
    if Animation::of(path).is_some() {
        return Ok(());
    }
    if let Err(reason) = ffmpeg() {
        if !has_known_ending(path) {
            let message = format!("cannot run ffmpeg, which may know it: {reason}");
            return Err(VideoError::UnknownEnding { path: path.to_owned(), message });
        }
        let instead = animation::instead_of(path);
        output::check_file(&instead)?;
        tracing::warn!(
            "{}: cannot run ffmpeg, which encodes such videos ({reason}); writing {} instead, an animated PNG. To \
             install ffmpeg: apt-get install ffmpeg (Debian, Ubuntu)",
            path.display(),
            instead.display()
        );
        return Ok(());
    }
    check_ending(path)
}

/// Checks that [`Film`]s can be made.
///
/// # Errors
/// [`VideoError::NoEncoder`].
pub fn check_encoder() -> Result<(), VideoError> {
    ffmpeg().map_err(|reason| VideoError::NoEncoder { reason })
}

/// Says how the film will differ from its frames' times, which its format cannot give.
pub fn warn_of_times(path: &Path, frames: Range<u64>, time: FrameTime) {
    let (path, kind) = made(path);
    let said = match kind {
        Some(kind) => kind.shortcomings(frames, time),
        None if counts_milliseconds(&path) && time.seconds() < 0.001 => {
            vec![format!("this format counts milliseconds: frames of {time} are merged; .mp4 keeps them separate")]
        }
        None => Vec::new(),
    };
    said.iter().for_each(|said| tracing::warn!("{}: {said}", path.display()));
}

/// Matroska's clock, as ffmpeg and most others set it.
fn counts_milliseconds(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ["mkv", "webm"].iter().any(|known| ending.eq_ignore_ascii_case(known)))
}

/// Endings of films that are known without ffmpeg, which knows more.
const ENDINGS: [&str; 8] = ["mp4", "m4v", "mkv", "webm", "mov", "avi", "ogv", "mpg"];

fn has_known_ending(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ENDINGS.iter().any(|known| ending.eq_ignore_ascii_case(known)))
}

/// Has ffmpeg make a film of two black pictures under a name with the same ending: of one it makes pictures, too.
fn check_ending(path: &Path) -> Result<(), VideoError> {
    let io = |source| OutputError::io(path, source);
    let temporary = temporary(path)?;
    let mut run = Command::new("ffmpeg")
        .args(["-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "gray", "-s", "16x16", "-i", "-"])
        .args(["-frames:v", "2", "-pix_fmt", "yuv420p"])
        .arg(&temporary)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(io)?;
    // It may have stopped reading; then it says why.
    let _ = run.stdin.take().map(|mut stdin| stdin.write_all(&[0; 2 * 16 * 16]));
    let output = run.wait_with_output().map_err(io)?;
    let _ = std::fs::remove_file(&temporary);
    if output.status.success() {
        return Ok(());
    }
    let message = last_line(&output.stderr).replace(&*temporary.to_string_lossy(), &path.to_string_lossy());
    let path = path.to_owned();
    // A full disk, say, is no matter of the name.
    let is_of_system = OF_SYSTEM.iter().any(|said| message.contains(said));
    Err(if is_of_system { VideoError::Failed { path, message } } else { VideoError::UnknownEnding { path, message } })
}

/// Messages of the operating system that ffmpeg passes on.
const OF_SYSTEM: [&str; 5] = [
    "No space left on device",
    "Disk quota exceeded",
    "Permission denied",
    "Read-only file system",
    "Input/output error",
];

/// Path that ffmpeg writes before it is renamed; absolute, for ffmpeg may run in another folder.
fn temporary(path: &Path) -> Result<PathBuf, OutputError> {
    let mut name = std::ffi::OsString::from(format!(".part-{}-", std::process::id()));
    name.push(path.file_name().unwrap_or_default());
    std::path::absolute(path.with_file_name(name)).map_err(|source| OutputError::io(path, source))
}

fn last_line(said: &[u8]) -> String {
    String::from_utf8_lossy(said).lines().last().unwrap_or("no message").to_owned()
}

/// Checks that it runs.
fn ffmpeg() -> std::io::Result<()> {
    let output = Command::new("ffmpeg").arg("-version").stdin(Stdio::null()).output()?;
    if output.status.success() { Ok(()) } else { Err(std::io::Error::other(last_line(&output.stderr))) }
}

/// Output for a name: an animated picture where it asks for one or ffmpeg is missing; else a film, by ffmpeg.
fn made(path: &Path) -> (PathBuf, Option<Animation>) {
    match Animation::of(path) {
        Some(kind) => (path.to_owned(), Some(kind)),
        None if ffmpeg().is_err() => (animation::instead_of(path), Some(Animation::Apng)),
        None => (path.to_owned(), None),
    }
}

/// Encodes `folder/color_NNNNN.png` of those frames: into an animated picture where the name asks for one or ffmpeg is
/// missing, else by ffmpeg. Returns what was written, whole or not at all.
///
/// # Errors
/// [`VideoError`].
pub fn encode(path: &Path, folder: &Path, frames: Range<u64>, time: FrameTime) -> Result<PathBuf, VideoError> {
    let (path, kind) = made(path);
    match kind {
        Some(kind) => animation::encode(&path, kind, folder, frames, time)?,
        None => encode_film(&path, folder, frames, time)?,
    }
    Ok(path)
}

/// The largest term of a rate that ffmpeg does not round (`av_parse_video_rate`).
const LARGEST_TERM: u64 = 1_001_000;

/// Most players want 4:2:0 with even sides; sRGB frames become Y′CbCr of ITU-R BT.709, 16 to 235.
const FILTER: &str = "pad=ceil(iw/2)*2:ceil(ih/2)*2,\
    scale=in_range=pc:out_range=tv:out_color_matrix=bt709:flags=accurate_rnd+full_chroma_int,format=yuv420p";

/// And the film says so: where nothing is said, players guess by its size.
const COLORS: [&str; 8] =
    ["-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"];

/// By ffmpeg; written under another name, then renamed.
fn encode_film(path: &Path, folder: &Path, frames: Range<u64>, time: FrameTime) -> Result<(), VideoError> {
    let FrameTime { numerator, denominator } = time.within(LARGEST_TERM);
    // ffmpeg runs in the frames' folder: a % in its name would count as a part of the pattern.
    let temporary = temporary(path)?;
    let output = Command::new("ffmpeg")
        .args(["-y", "-loglevel", "error", "-framerate", &format!("{denominator}/{numerator}")])
        .args(["-start_number", &frames.start.to_string(), "-i"])
        .arg("color_%05d.png")
        .args(["-frames:v", &(frames.end - frames.start).to_string()])
        .args(["-vf", FILTER])
        .args(COLORS)
        .arg(&temporary)
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .map_err(|source| OutputError::io(path, source))?;
    if !output.status.success() {
        let _ = std::fs::remove_file(&temporary);
        return Err(VideoError::Failed { path: path.to_owned(), message: last_line(&output.stderr) });
    }
    std::fs::rename(&temporary, path).map_err(|source| {
        let _ = std::fs::remove_file(&temporary);
        OutputError::io(path, source).into()
    })
}

/// A film that ffmpeg makes while its pictures are. One that is dropped before it is [finished](Self::finish) leaves
/// nothing.
pub struct Film {
    path: PathBuf,
    temporary: PathBuf,
    /// Until it ends.
    encoder: Option<Child>,
}

impl Film {
    /// Begins a film; `time`: how long each picture is shown; width and height in pixels.
    ///
    /// # Errors
    /// [`VideoError`].
    pub fn begin(path: &Path, (width, height): (u32, u32), time: FrameTime) -> Result<Self, VideoError> {
        output::check_file(path)?;
        let FrameTime { numerator, denominator } = time.within(LARGEST_TERM);
        let temporary = temporary(path)?;
        let encoder = Command::new("ffmpeg")
            .args(["-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"])
            .args(["-s", &format!("{width}x{height}"), "-framerate", &format!("{denominator}/{numerator}"), "-i", "-"])
            // The same bytes, however many there are; and there may be many films.
            .args(["-threads", "1", "-vf", FILTER])
            .args(COLORS)
            .arg(&temporary)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|source| OutputError::io(path, source))?;
        Ok(Self { path: path.to_owned(), temporary, encoder: Some(encoder) })
    }

    /// Adds a picture: red, green and blue of each pixel, rows from the top.
    ///
    /// # Errors
    /// [`VideoError`].
    pub fn add(&mut self, rgb: &[u8]) -> Result<(), VideoError> {
        let stdin = self.encoder.as_mut().and_then(|encoder| encoder.stdin.as_mut());
        // Where it has stopped reading, it says why.
        if stdin.is_none_or(|stdin| stdin.write_all(rgb).is_err()) { self.end() } else { Ok(()) }
    }

    /// Ends the film and gives it its name, which is returned.
    ///
    /// # Errors
    /// [`VideoError`].
    pub fn finish(mut self) -> Result<PathBuf, VideoError> {
        self.end()?;
        std::fs::rename(&self.temporary, &self.path).map_err(|source| OutputError::io(&self.path, source))?;
        Ok(self.path.clone())
    }

    fn end(&mut self) -> Result<(), VideoError> {
        let failed = |message| VideoError::Failed { path: self.path.clone(), message };
        let encoder = self.encoder.take().ok_or_else(|| failed("it has ended already".into()))?;
        let output = encoder.wait_with_output().map_err(|source| OutputError::io(&self.path, source))?;
        // What it could not write to the end it calls a success, but complains of.
        let is_whole = output.status.success() && output.stderr.is_empty();
        if is_whole { Ok(()) } else { Err(failed(last_line(&output.stderr))) }
    }
}

impl Drop for Film {
    fn drop(&mut self) {
        if let Some(mut encoder) = self.encoder.take() {
            let _ = encoder.kill();
            let _ = encoder.wait();
        }
        // There is none of that name where it was renamed.
        let _ = std::fs::remove_file(&self.temporary);
    }
}
