//! What is written of a run as a whole: logs, films, and data sets whose files are about several captures or sensors.
//! Each is made anew where a run is resumed.

use super::capture::Capture;
use super::coco::CocoWriter;
use super::files::FileFormat;
use super::films::{FilmPictures, FilmWriter};
use super::kitti::KittiWriter;
use super::log::{SensorLog, check_names};
use crate::frames::FrameError;
use crate::video;
use glam::DAffine3;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use systems::sensors::{CameraOutput, Classes, Sensor, SensorKind};

/// The log of a data set.
pub(super) const LOG: &str = "sensors.mcap";

/// From the entities of all sensors, due or not, to the world, by their names.
pub(super) type Poses = BTreeMap<String, DAffine3>;

/// Takes the captures of a run in their order. What it writes of a capture depends on no capture more than an interval
/// before: the files of a run in parts are put together as if it were one ([`super::merge`]).
pub(super) trait RunWriter {
    /// A step has been taken, after which so many nanoseconds have passed.
    ///
    /// # Errors
    /// What cannot be written.
    fn tick(&mut self, _nanoseconds: u64) -> Result<(), FrameError> {
        Ok(())
    }

    /// All that was captured after a step, and where sensors were then.
    ///
    /// # Errors
    /// What cannot be written, or has no form.
    fn write(&mut self, capture: &Capture, poses: &Poses) -> Result<(), FrameError>;

    /// Ends what was begun. Returns the files.
    ///
    /// # Errors
    /// What cannot be written.
    fn finish(self: Box<Self>) -> Result<Vec<PathBuf>, FrameError>;
}

/// What writers know of a run before it begins.
pub(super) struct RunInfo<'a> {
    /// Of the whole data set.
    pub folder: &'a Path,
    pub formats: &'a [FileFormat],
    /// By their names.
    pub sensors: &'a BTreeMap<String, Sensor>,
    pub classes: &'a Classes,
    /// Length of a step.
    pub step_seconds: f64,
    /// The first frame whose captures are in the data set: of the whole, where the run is a part.
    pub first: u64,
    /// Where pictures of films are kept instead of films made of them.
    pub films: Option<&'a Path>,
}

impl RunInfo<'_> {
    /// Checks that the formats have something to hold, asked before anything is written.
    ///
    /// # Errors
    /// [`FrameError`]: a format has nothing to hold, or a name is in its way.
    pub fn check(&self) -> Result<(), FrameError> {
        for &(name, format) in FileFormat::ALL.iter().filter(|(_, format)| self.formats.contains(format)) {
            let needs = match format {
                FileFormat::Coco => "a camera with color, instance and class",
                FileFormat::Kitti => "a camera with color and the lens of a pinhole, or a lidar",
                FileFormat::Video => "a camera with an output that is a picture",
                _ => continue,
            };
            if !self.sensors.values().any(|sensor| format.holds_any(sensor)) {
                return Err(FrameError::NothingToHold { format: name, needs });
            }
        }
        if self.formats.contains(&FileFormat::Mcap) {
            check_names(self.sensors.keys())?;
        }
        Ok(())
    }

    /// Checks that the programs are there that write formats, asked once the formats have not been refused.
    ///
    /// # Errors
    /// [`FrameError::Video`].
    pub fn check_programs(&self) -> Result<(), FrameError> {
        // Of a part of a run there are pictures, which become films with those of the others.
        let makes_films = self.formats.contains(&FileFormat::Video) && self.films.is_none();
        if makes_films { Ok(video::check_encoder()?) } else { Ok(()) }
    }

    /// Begins what the formats ask for; the folder is there.
    ///
    /// # Errors
    /// What cannot be written.
    pub fn begin(&self) -> Result<Vec<Box<dyn RunWriter>>, FrameError> {
        let mut writers: Vec<Box<dyn RunWriter>> = Vec::new();
        for format in FileFormat::ALL.iter().map(|(_, format)| *format).filter(|format| self.formats.contains(format)) {
            match format {
                FileFormat::Mcap => writers.push(Box::new(SensorLog::begin(&self.folder.join(LOG), self)?)),
                FileFormat::Coco => writers.push(Box::new(CocoWriter::new(self))),
                FileFormat::Kitti => writers.push(Box::new(KittiWriter::new(self))),
                FileFormat::Video => writers.push(match self.films {
                    Some(films) => Box::new(FilmPictures::new(self, films)),
                    None => Box::new(FilmWriter::new(self)),
                }),
                FileFormat::Png | FileFormat::Npy | FileFormat::Npz | FileFormat::Exr => {}
            }
        }
        Ok(writers)
    }

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
