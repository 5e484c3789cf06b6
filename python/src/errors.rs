//! Errors as exceptions of `relief.errors`, with the messages of Rust.

use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use relief::frames::FrameError;
use relief::output::OutputError;
use relief::problem::Problem;
use relief::recording::RecordingError;
use relief::renderer::{GpuError, RenderError};
use relief::scene::SceneError;
use relief::video::VideoError;

/// Error of a call, without the interpreter.
#[derive(Debug)]
pub enum Failure {
    /// A scene.
    Scene(SceneError),
    /// The adapter, or what it draws.
    Gpu(String),
    /// A recording or snapshot.
    Recording(String),
    /// A file.
    Output(String),
    /// An entity that is gone: what it was called.
    Gone(String),
    /// A process without its threads and device.
    Forked,
    /// An argument: what was expected.
    Value(String),
    /// A name that nothing has.
    Name(String),
}

/// Result of a call.
pub type Outcome<T> = Result<T, Failure>;

impl Failure {
    /// An argument: what was expected.
    pub fn value(message: impl Into<String>) -> Self {
        Self::Value(message.into())
    }

    /// The same of one of several worlds.
    #[must_use]
    pub fn of_world(self, place: usize) -> Self {
        match self {
            Self::Value(message) => Self::Value(format!("world {place}: {message}")),
            Self::Name(message) => Self::Name(format!("world {place}: {message}")),
            other => other,
        }
    }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        Self::Scene(error)
    }
}

impl From<GpuError> for Failure {
    fn from(error: GpuError) -> Self {
        Self::Gpu(error.to_string())
    }
}

impl From<RenderError> for Failure {
    fn from(error: RenderError) -> Self {
        match error {
            RenderError::View { .. } => Self::Value(error.to_string()),
            _ => Self::Gpu(error.to_string()),
        }
    }
}

impl From<RecordingError> for Failure {
    fn from(error: RecordingError) -> Self {
        match error {
            RecordingError::Output(error) => error.into(),
            RecordingError::Scene(error) => error.into(),
            RecordingError::Misused(message) => Self::value(message),
            _ => Self::Recording(error.to_string()),
        }
    }
}

impl From<OutputError> for Failure {
    fn from(error: OutputError) -> Self {
        Self::Output(error.to_string())
    }
}

impl From<FrameError> for Failure {
    fn from(error: FrameError) -> Self {
        match error {
            FrameError::Scene(error) => error.into(),
            FrameError::Gpu(error) => error.into(),
            FrameError::Render(error) => error.into(),
            FrameError::Recording(error) => error.into(),
            FrameError::Output(error) | FrameError::Video(VideoError::Output(error)) => error.into(),
            FrameError::Video(error @ VideoError::Failed { .. }) => Self::Output(error.to_string()),
            other => Self::Value(other.to_string()),
        }
    }
}

const FORKED: &str = "this process was forked from one in which relief was in use: its threads and its graphics device \
                      are not here; use multiprocessing's \"spawn\" or \"forkserver\", or relief.capture for many worlds \
                      in one process";

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        Python::attach(|py| match failure {
            Failure::Scene(error) => scene_error(py, &error),
            Failure::Gpu(message) => raised(py, "GpuError", &message),
            Failure::Recording(message) => raised(py, "RecordingError", &message),
            Failure::Output(message) => raised(py, "OutputError", &message),
            Failure::Gone(name) => raised(py, "GoneError", &format!("{name} is gone from its world")),
            Failure::Forked => raised(py, "ForkedError", FORKED),
            Failure::Value(message) => PyValueError::new_err(message),
            Failure::Name(message) => PyKeyError::new_err(message),
        })
    }
}

fn class<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("relief.errors")?.getattr(name)
}

fn raised(py: Python<'_>, name: &str, message: &str) -> PyErr {
    let made = class(py, name).and_then(|class| class.call1((message,)));
    made.map_or_else(|error| error, PyErr::from_value)
}

fn scene_error(py: Python<'_>, error: &SceneError) -> PyErr {
    let made = class(py, "SceneError").and_then(|class| {
        let made = class.call1((error.to_string(),))?;
        if let Some(Problem { path, line_column, place, .. }) = error.problems.first() {
            made.setattr("path", path.display().to_string())?;
            made.setattr("line", line_column.map(|(line, _)| line))?;
            made.setattr("column", line_column.map(|(_, column)| column))?;
            made.setattr("field", place)?;
        }
        let problems: Vec<String> = error.problems.iter().map(ToString::to_string).collect();
        made.setattr("problems", problems)?;
        Ok(made)
    });
    made.map_or_else(|error| error, PyErr::from_value)
}
