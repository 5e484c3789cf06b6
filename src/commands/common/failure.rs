//! Failures of commands: a message, with the options that help, and an exit code.

use crate::data::shards::ShardError;
use crate::frames::FrameError;
use crate::output::OutputError;
use crate::recording::RecordingError;
use crate::renderer::RenderError;
#[cfg(feature = "tools")]
use crate::tools::{ToolError, maps::MapError};
use crate::video::VideoError;
use std::io::{ErrorKind, Write};

/// Bad input or usage.
pub const BAD_INPUT: u8 = 2;
/// No usable graphics adapter.
const NO_ADAPTER: u8 = 3;
/// Shards are missing.
const INCOMPLETE: u8 = 4;
/// Anything else.
const OTHER: u8 = 1;

/// Hint for a colour image.
#[cfg(feature = "tools")]
const CHANNELS: &str =
    "--channel r, g, b, a or luminance takes one of them; relief map height guesses heights from colours";

/// Failure of a command.
pub struct Failure {
    /// For people; `None` where all has been said.
    message: Option<String>,
    code: u8,
}

impl Failure {
    /// Bad input.
    pub fn bad_input(message: String) -> Self {
        Self { message: Some(message), code: BAD_INPUT }
    }

    /// Bad input, of which all has been said.
    pub fn said() -> Self {
        Self { message: None, code: BAD_INPUT }
    }

    /// Says it, and gives the exit code.
    pub fn exit(self) -> u8 {
        if let Some(message) = self.message {
            eprintln!("error: {message}");
        }
        self.code
    }
}

impl<E: Into<FrameError>> From<E> for Failure {
    fn from(error: E) -> Self {
        let error = error.into();
        let mut message = error.to_string();
        if let FrameError::Render(RenderError::Refused { .. }) = &error {
            message += "\n--texture-memory and --compress make the scene smaller";
        }
        Self { message: Some(message), code: code_of_frame(&error) }
    }
}

impl From<ShardError> for Failure {
    fn from(error: ShardError) -> Self {
        let (message, code) = match error {
            ShardError::Frame(error) => return error.into(),
            ShardError::Refused { .. } => (error.to_string(), BAD_INPUT),
            ShardError::Mixed { .. } => (format!("{error}. --mixed takes them all the same"), BAD_INPUT),
            ShardError::Incomplete { ref job, ref missing, .. } => {
                let mut message = format!("{error}\nTo render them:");
                for (shard, _) in missing {
                    message += &format!("\n  relief render --resume --shard {}:{shard}", job.display());
                }
                (message, INCOMPLETE)
            }
        };
        Self { message: Some(message), code }
    }
}

#[cfg(feature = "tools")]
impl From<ToolError> for Failure {
    fn from(error: ToolError) -> Self {
        let code = match error {
            ToolError::Frame(error) => return error.into(),
            ToolError::SeparateProcess { code, .. } => code,
            ToolError::Plot { .. } => OTHER,
            ToolError::NoMeshVariants { .. }
            | ToolError::Compare(_)
            | ToolError::NoMesh(_)
            | ToolError::Surface(_)
            | ToolError::Results { .. } => BAD_INPUT,
        };
        Self { message: Some(error.to_string()), code }
    }
}

#[cfg(feature = "tools")]
impl From<MapError> for Failure {
    fn from(error: MapError) -> Self {
        let code = match &error {
            MapError::Import(_)
            | MapError::Refused { .. }
            | MapError::NotGrey { .. }
            | MapError::NothingMet { .. }
            | MapError::Option { .. } => BAD_INPUT,
            MapError::Preview { source: FrameError::Gpu(_), .. } => NO_ADAPTER,
            MapError::Output(error) | MapError::Preview { source: FrameError::Output(error), .. } => {
                code_of_output(error)
            }
            MapError::Preview { .. } => OTHER,
        };
        let message = match &error {
            MapError::NotGrey { .. } => format!("{error}. {CHANNELS}"),
            MapError::NothingMet { .. } => format!("{error}, or a larger --cage"),
            MapError::Option { option: "reach", message } => format!("--cage: {message}"),
            // Options are called as fields are.
            MapError::Option { option, message } => format!("--{}: {message}", option.replace('_', "-")),
            _ => error.to_string(),
        };
        Self { message: Some(message), code }
    }
}

fn code_of_frame(error: &FrameError) -> u8 {
    match error {
        FrameError::Gpu(_) | FrameError::Render(RenderError::NoGpu(_)) => NO_ADAPTER,
        FrameError::Render(RenderError::Lost { .. }) => OTHER,
        FrameError::Scene(_)
        | FrameError::NoCamera { .. }
        | FrameError::Render(_)
        | FrameError::Import(_)
        | FrameError::NoSensors { .. }
        | FrameError::NoSensor { .. }
        | FrameError::SharedSensorName { .. }
        | FrameError::SharedFrameName { .. }
        | FrameError::NoFormat { .. }
        | FrameError::NotBuiltIn { .. }
        | FrameError::NothingToHold { .. }
        | FrameError::BadSensorName { .. }
        | FrameError::NoPanoptic { .. }
        | FrameError::Overwrites { .. }
        | FrameError::NoFrames { .. }
        | FrameError::Video(VideoError::UnknownEnding { .. } | VideoError::NoEncoder { .. })
        | FrameError::Recording(
            RecordingError::Refused { .. }
            | RecordingError::Misused(_)
            | RecordingError::State(_)
            | RecordingError::Scene(_),
        ) => BAD_INPUT,
        FrameError::Output(error)
        | FrameError::Video(VideoError::Output(error))
        | FrameError::Recording(RecordingError::Output(error)) => code_of_output(error),
        FrameError::Video(VideoError::Failed { .. })
        | FrameError::Recording(
            RecordingError::Diverged { .. } | RecordingError::Parted { .. } | RecordingError::TooLong,
        ) => OTHER,
    }
}

fn code_of_output(error: &OutputError) -> u8 {
    if error.is_refusal() { BAD_INPUT } else { OTHER }
}

/// Prints a line. What reads standard output may have stopped reading; the work is done all the same.
pub fn say(text: &str) -> Result<(), OutputError> {
    match writeln!(std::io::stdout(), "{text}") {
        Err(source) if source.kind() != ErrorKind::BrokenPipe => {
            Err(OutputError::Io { path: "standard output".into(), source })
        }
        _ => Ok(()),
    }
}
