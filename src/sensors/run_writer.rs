//! What is written of a run as a whole: logs, films, and data sets whose files are about several captures or sensors.
//! Each is made anew where a run is resumed.

use super::capture::Capture;
use super::coco::CocoWriter;
use super::files::FileFormat;
use super::films::FilmWriter;
use super::kitti::KittiWriter;
use super::log::{SensorLog, check_names};
use crate::frames::FrameError;
use crate::video;
use glam::DAffine3;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use systems::sensors::{Classes, Sensor, SensorKind};

/// Takes the captures of a run in their order.
pub(super) trait RunWriter {
    /// A step has been taken, after which so many nanoseconds have passed.
    ///
    /// # Errors
    /// What cannot be written.
    fn tick(&mut self, _nanoseconds: u64) -> Result<(), FrameError> {
        Ok(())
    }

    /// All that was captured after a step.
    ///
    /// # Errors
    /// What cannot be written, or has no form.
    fn write(&mut self, capture: &Capture) -> Result<(), FrameError>;

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
    /// From the entities of sensors to the world when the run begins, by their names.
    pub poses: BTreeMap<String, DAffine3>,
}

impl RunInfo<'_> {
    /// Whether the formats can be written, asked before anything is.
    ///
    /// # Errors
    /// [`FrameError`]: a format has nothing to hold, or a name or program is in its way.
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
        if self.formats.contains(&FileFormat::Video) {
            video::check_encoder()?;
        }
        Ok(())
    }

    /// Begins what the formats ask for; the folder is there.
    ///
    /// # Errors
    /// What cannot be written.
    pub fn begin(&self) -> Result<Vec<Box<dyn RunWriter>>, FrameError> {
        let mut writers: Vec<Box<dyn RunWriter>> = Vec::new();
        for format in FileFormat::ALL.iter().map(|(_, format)| *format).filter(|format| self.formats.contains(format)) {
            match format {
                FileFormat::Mcap => {
                    writers.push(Box::new(SensorLog::begin(&self.folder.join("sensors.mcap"), self.classes.clone())?))
                }
                FileFormat::Coco => writers.push(Box::new(CocoWriter::new(self))),
                FileFormat::Kitti => writers.push(Box::new(KittiWriter::new(self))),
                FileFormat::Video => writers.push(Box::new(FilmWriter::new(self))),
                FileFormat::Png | FileFormat::Npy | FileFormat::Npz | FileFormat::Exr => {}
            }
        }
        Ok(writers)
    }

    /// The names of cameras, or of lidars, that a format holds something of.
    pub fn held_by(&self, format: FileFormat, is_camera: bool) -> impl Iterator<Item = &str> {
        let is_kind = move |sensor: &Sensor| matches!(sensor.kind, SensorKind::Camera(_)) == is_camera;
        let held = self.sensors.iter().filter(move |(_, sensor)| is_kind(sensor) && format.holds_any(sensor));
        held.map(|(name, _)| name.as_str())
    }
}
