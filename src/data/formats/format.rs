//! Forms of files: what each holds, and how its files are made. A program may have forms of its own.

use crate::frames::FrameError;
use crate::name;
use crate::sense::captures::capture::{Capture, SensorCapture};
use glam::DAffine3;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use systems::sensors::{CameraOutput, Classes, Sensor, SensorKind};

/// A form of files. Two of one name are the same.
#[derive(Clone, Copy, Debug)]
pub struct FileFormat {
    /// Name by which it is asked for.
    pub name: &'static str,
    /// Description in a sentence.
    pub help: &'static str,
    /// Endings of its files' names. Files of single captures have the first.
    pub endings: &'static [&'static str],
    /// Sensor without which it has no file at all, in words; `None`: any that it holds something of.
    pub needs: Option<&'static str>,
    /// Tells if it holds an output of a camera, or the records of another sensor.
    pub accepts: fn(&SensorKind, Option<CameraOutput>) -> bool,
    /// Refusal of a run for a reason of its own, before anything is written.
    pub check: fn(&RunInfo) -> Result<(), FrameError>,
    /// Files that it makes.
    pub makes: Makes,
}

/// Files of a form.
#[derive(Clone, Copy, Debug)]
pub enum Makes {
    /// Files of each capture, which depend on nothing else: those of a sensor. They can be left alone where they are
    /// there.
    Captures(fn(&Sensor) -> Vec<CaptureFile>),
    /// Files of a run as a whole, begun when its folder is there.
    Run(fn(&RunInfo) -> Result<Box<dyn RunWriter>, FrameError>),
}

/// A file of each capture of a sensor.
#[derive(Clone, Debug)]
pub struct CaptureFile {
    /// Beginning of its name, before the step; empty: that alone.
    pub name: String,
    /// Output of a camera that is in it alone. Forward flow has the step of the capture before, where it begins.
    pub output: Option<CameraOutput>,
    /// Bytes of a capture; `None`: this one has no such file.
    pub encode: Encode,
}

/// Bytes of a capture in a file with some output of a camera, or with all that there is.
pub type Encode = fn(&SensorCapture, Option<CameraOutput>) -> io::Result<Option<Vec<u8>>>;

/// Poses of all sensors, due or not, by their names: from the entities to the world.
pub type Poses = BTreeMap<String, DAffine3>;

/// Taker of the captures of a run in their order: of logs, films, and data sets whose files are about several captures
/// or sensors. What it writes of a capture depends on no capture more than an interval before: the files of a run in
/// parts are put together as if it were one. It begins anew where a run is resumed.
pub trait RunWriter: Send {
    /// Notes that a step has been taken, after which so many nanoseconds have passed.
    ///
    /// # Errors
    /// A file that cannot be written.
    fn tick(&mut self, _nanoseconds: u64) -> Result<(), FrameError> {
        Ok(())
    }

    /// Takes all that was captured after a step, and where sensors were then.
    ///
    /// # Errors
    /// A file that cannot be written, or an output without a form.
    fn write(&mut self, capture: &Capture, poses: &Poses) -> Result<(), FrameError>;

    /// Ends what was begun. Returns the files.
    ///
    /// # Errors
    /// A file that cannot be written.
    fn finish(self: Box<Self>) -> Result<Vec<PathBuf>, FrameError>;
}

/// A run, as it is known before it begins.
#[derive(Clone, Copy, Debug)]
pub struct RunInfo<'a> {
    /// Folder of the whole data set.
    pub folder: &'a Path,
    /// Forms of all its files.
    pub formats: &'a [FileFormat],
    /// Its sensors, by their names.
    pub sensors: &'a BTreeMap<String, Sensor>,
    /// Classes of the scene.
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
    pub(super) fn labelled(&self) -> BTreeSet<String> {
        let has_boxes = |sensor: &Sensor| match &sensor.kind {
            SensorKind::Camera(camera) => camera.outputs.has(CameraOutput::Boxes),
            _ => false,
        };
        self.sensors.iter().filter(|(_, sensor)| has_boxes(sensor)).map(|(name, _)| name.clone()).collect()
    }

    /// The names of cameras, or of other sensors, that a form holds something of.
    pub(super) fn held_by(&self, format: FileFormat, is_camera: bool) -> impl Iterator<Item = &str> {
        let is_kind = move |sensor: &Sensor| matches!(sensor.kind, SensorKind::Camera(_)) == is_camera;
        let held = self.sensors.iter().filter(move |(_, sensor)| is_kind(sensor) && format.holds_any(sensor));
        held.map(|(name, _)| name.as_str())
    }
}

impl FileFormat {
    /// Check of a form that refuses nothing.
    pub const fn accept_all(_: &RunInfo) -> Result<(), FrameError> {
        Ok(())
    }

    /// Tells if it has files of their own for each sensor's captures; else it is made of a run as a whole.
    pub(crate) fn is_per_capture(self) -> bool {
        matches!(self.makes, Makes::Captures(_))
    }

    /// Tells if it holds something of a sensor.
    pub(crate) fn holds_any(self, sensor: &Sensor) -> bool {
        match &sensor.kind {
            SensorKind::Camera(camera) => {
                camera.outputs.iter().any(|(_, output)| (self.accepts)(&sensor.kind, Some(output)))
            }
            kind => (self.accepts)(kind, None),
        }
    }
}

impl PartialEq for FileFormat {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for FileFormat {}

impl Serialize for FileFormat {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.name.serialize(serializer)
    }
}

/// By its name, one of those of the library.
impl<'de> Deserialize<'de> for FileFormat {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let wanted = String::deserialize(deserializer)?;
        name::find("format", &Self::ALL, &wanted).map_err(serde::de::Error::custom)
    }
}
