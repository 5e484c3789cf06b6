//! Writers of what is made of a run as a whole: logs, films, and data sets whose files are about several captures or
//! sensors. Each is made anew where a run is resumed.

use super::format::FileFormat;
use crate::frames::FrameError;
use crate::sense::captures::capture::Capture;
use glam::DAffine3;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use systems::sensors::{CameraOutput, Classes, Sensor, SensorKind};

/// From the entities of all sensors, due or not, to the world, by their names.
pub(crate) type Poses = BTreeMap<String, DAffine3>;

/// Takes the captures of a run in their order. What it writes of a capture depends on no capture more than an interval
/// before: the files of a run in parts are put together as if it were one ([`merge`](crate::data::dataset::merge)).
pub(crate) trait RunWriter {
    /// A step has been taken, after which so many nanoseconds have passed.
    ///
    /// # Errors
    /// A file that cannot be written.
    fn tick(&mut self, _nanoseconds: u64) -> Result<(), FrameError> {
        Ok(())
    }

    /// All that was captured after a step, and where sensors were then.
    ///
    /// # Errors
    /// A file that cannot be written, or an output without a format.
    fn write(&mut self, capture: &Capture, poses: &Poses) -> Result<(), FrameError>;

    /// Ends what was begun. Returns the files.
    ///
    /// # Errors
    /// A file that cannot be written.
    fn finish(self: Box<Self>) -> Result<Vec<PathBuf>, FrameError>;
}

/// A run, as writers know it before it begins.
pub(crate) struct RunInfo<'a> {
    /// Folder of the whole data set.
    pub folder: &'a Path,
    pub formats: &'a [FileFormat],
    /// By their names.
    pub sensors: &'a BTreeMap<String, Sensor>,
    pub classes: &'a Classes,
    /// Length of a step.
    pub step_seconds: f64,
    /// The first frame whose captures are in the data set: of the whole, where the run is a part.
    pub first: u64,
    /// Folder of films' pictures, where these are kept instead of films.
    pub films: Option<&'a Path>,
}

impl RunInfo<'_> {
    /// The names of cameras with boxes, of which there may be none in a picture.
    pub fn labelled(&self) -> BTreeSet<String> {
        let has_boxes = |sensor: &Sensor| match &sensor.kind {
            SensorKind::Camera(camera) => camera.outputs.has(CameraOutput::Boxes),
            _ => false,
        };
        self.sensors.iter().filter(|(_, sensor)| has_boxes(sensor)).map(|(name, _)| name.clone()).collect()
    }

    /// The names of cameras, or of lidars, that a format holds something of.
    pub fn held_by(&self, format: FileFormat, is_camera: bool) -> impl Iterator<Item = &str> {
        let is_kind = move |sensor: &Sensor| matches!(sensor.kind, SensorKind::Camera(_)) == is_camera;
        let held = self.sensors.iter().filter(move |(_, sensor)| is_kind(sensor) && format.holds_any(sensor));
        held.map(|(name, _)| name.as_str())
    }
}
