//! The writers of a run by its formats.

use super::coco::CocoWriter;
use super::films::{FilmPictures, FilmWriter};
use super::format::FileFormat;
use super::kitti::KittiWriter;
use super::log::{LOG, SensorLog, check_names};
use super::run_writer::{RunInfo, RunWriter};
use crate::frames::FrameError;
use crate::video;

/// Checks that the formats have something to hold, asked before anything is written.
///
/// # Errors
/// [`FrameError`]: a format has nothing to hold or is not built in, or a name is in its way.
pub(crate) fn check(run: &RunInfo) -> Result<(), FrameError> {
    for &(name, format) in FileFormat::ALL.iter().filter(|(_, format)| run.formats.contains(format)) {
        let needs = match format {
            FileFormat::Coco => "a camera with color, instance and class",
            FileFormat::Kitti => "a camera with color and the lens of a pinhole, or a lidar",
            FileFormat::Video => "a camera with an output that is a picture",
            _ => continue,
        };
        if !run.sensors.values().any(|sensor| format.holds_any(sensor)) {
            return Err(FrameError::NothingToHold { format: name, needs });
        }
    }
    if run.formats.contains(&FileFormat::Mcap) {
        if !cfg!(feature = "mcap") {
            return Err(FrameError::NotBuiltIn { format: "mcap" });
        }
        check_names(run.sensors.keys())?;
    }
    Ok(())
}

/// Checks that the programs are there that write formats, asked once the formats have not been refused.
///
/// # Errors
/// [`FrameError::Video`].
pub(crate) fn check_programs(run: &RunInfo) -> Result<(), FrameError> {
    // Of a part of a run there are pictures, which become films with those of the others.
    let makes_films = run.formats.contains(&FileFormat::Video) && run.films.is_none();
    if makes_films { Ok(video::check_encoder()?) } else { Ok(()) }
}

/// Begins what the formats ask for; the folder is there.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn begin(run: &RunInfo) -> Result<Vec<Box<dyn RunWriter>>, FrameError> {
    let mut writers: Vec<Box<dyn RunWriter>> = Vec::new();
    for format in FileFormat::ALL.iter().map(|(_, format)| *format).filter(|format| run.formats.contains(format)) {
        match format {
            FileFormat::Mcap => writers.push(Box::new(SensorLog::begin(&run.folder.join(LOG), run)?)),
            FileFormat::Coco => writers.push(Box::new(CocoWriter::new(run))),
            FileFormat::Kitti => writers.push(Box::new(KittiWriter::new(run))),
            FileFormat::Video => writers.push(match run.films {
                Some(films) => Box::new(FilmPictures::new(run, films)),
                None => Box::new(FilmWriter::new(run)),
            }),
            FileFormat::Png | FileFormat::Npy | FileFormat::Npz | FileFormat::Exr => {}
        }
    }
    Ok(writers)
}
