//! Errors of rendering frames, and of everything built on it.

use crate::import::ImportError;
use crate::output::OutputError;
use crate::recording::RecordingError;
use crate::renderer::{GpuError, RenderError};
use crate::scene::SceneError;
use crate::video::VideoError;
use std::ops::Range;
use std::path::PathBuf;

/// Error of a job.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    /// The scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// No camera of that name.
    #[error(
        "{}: unknown camera \"{wanted}\"; expected one of: {}; or \"chase NAME\" or \"driver NAME\" of a vehicle",
        scene.display(), known.join(", ")
    )]
    NoCamera {
        /// The scene.
        scene: PathBuf,
        /// The name asked for.
        wanted: String,
        /// The names there are.
        known: Vec<String>,
    },
    /// A scene without sensors.
    #[error("{}: no entity has a sensor, sensor: camera(…) or sensor: lidar(…)", scene.display())]
    NoSensors {
        /// The scene.
        scene: PathBuf,
    },
    /// No sensor of that name.
    #[error(
        "{}: unknown sensor \"{wanted}\"{}; expected one of: {}", scene.display(),
        nearest.as_ref().map_or(String::new(), |name| format!(" (did you mean \"{name}\"?)")), known.join(", ")
    )]
    NoSensor {
        /// The scene.
        scene: PathBuf,
        /// The name asked for.
        wanted: String,
        /// The name most like it.
        nearest: Option<String>,
        /// The names there are.
        known: Vec<String>,
    },
    /// Two sensors would write the same files.
    #[error("{}: duplicate sensor name \"{name}\": both would write the same files", scene.display())]
    SharedSensorName {
        /// The scene.
        scene: PathBuf,
        /// The name.
        name: String,
    },
    /// Two frames of a log would have one name.
    #[error("sensor \"{sensor}\": its name in MCAP, \"{name}\", is that of {other} already; expected one of its own")]
    SharedFrameName {
        /// The sensor.
        sensor: String,
        /// Its name as a frame and within topics.
        name: String,
        /// Sensor that has the name already.
        other: String,
    },
    /// A name that is no folder's.
    #[error("{}: invalid sensor name {name:?}: it {fault}; folders are named after sensors", scene.display())]
    BadSensorName {
        /// The scene.
        scene: PathBuf,
        /// The name.
        name: String,
        /// Fault of the name.
        fault: &'static str,
    },
    /// Numbers that pictures of 16 bits do not hold.
    #[error(
        "sensor \"{sensor}\": panoptic pictures hold things of classes up to 64, and the scene has one with id {id}; \
         npy and npz hold all"
    )]
    NoPanoptic {
        /// The sensor.
        sensor: String,
        /// A class.
        id: u8,
    },
    /// Outputs without a form.
    #[error("sensor \"{sensor}\": none of the formats asked for holds {outputs}; npy and npz hold everything")]
    NoFormat {
        /// The sensor.
        sensor: String,
        /// Its outputs.
        outputs: String,
    },
    /// A format that the program was built without.
    #[error("format {format}: not built in, as this program was built without the feature \"{format}\"")]
    NotBuiltIn {
        /// Its name, which is that of the feature.
        format: &'static str,
    },
    /// A format of which there would be no file.
    #[error("format {format}: expected {needs}; no sensor asked for is one")]
    NothingToHold {
        /// Its name.
        format: &'static str,
        /// Sensor that it needs.
        needs: &'static str,
    },
    /// No adapter.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Too large for the adapter.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A picture could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The film could not be made.
    #[error(transparent)]
    Video(#[from] VideoError),
    /// An output would take the place of an input.
    #[error(
        "{}: an output would overwrite this input file; expected another name or directory",
        path.display()
    )]
    Overwrites {
        /// The file.
        path: PathBuf,
    },
    /// Frames that a run does not have.
    #[error("frames {}..{}: the run {known}", wanted.start, wanted.end)]
    NoFrames {
        /// The frames asked for.
        wanted: Range<u64>,
        /// First or last frame of the run, in words.
        known: String,
    },
    /// A run that cannot be recorded, replayed or continued.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A map that could not be read.
    #[error(transparent)]
    Import(#[from] ImportError),
}
