//! The forms of files that the library has; those of a run, checked, begun, and put together of those of its parts.

use super::coco::{INSTANCES, PANOPTIC};
use super::format::{FileFormat, Makes, RunInfo, RunWriter};
use super::nuscenes;
use super::parts::{Merge, append_all};
use crate::export::coco::{Instances, Panoptic};
use crate::frames::FrameError;

impl FileFormat {
    /// All of the library, with their names.
    pub const ALL: [(&'static str, Self); 9] = [
        (Self::PNG.name, Self::PNG),
        (Self::NPY.name, Self::NPY),
        (Self::NPZ.name, Self::NPZ),
        (Self::EXR.name, Self::EXR),
        (Self::MCAP.name, Self::MCAP),
        (Self::COCO.name, Self::COCO),
        (Self::KITTI.name, Self::KITTI),
        (Self::NUSCENES.name, Self::NUSCENES),
        (Self::VIDEO.name, Self::VIDEO),
    ];
}

/// Forms that were asked for, each once: those of the library in its order, then a program's own.
pub(crate) fn in_order(formats: &[FileFormat]) -> Vec<FileFormat> {
    let own = FileFormat::ALL.map(|(_, format)| format);
    let mut ordered: Vec<FileFormat> = Vec::new();
    for format in own.into_iter().filter(|format| formats.contains(format)).chain(formats.iter().copied()) {
        if !ordered.contains(&format) {
            ordered.push(format);
        }
    }
    ordered
}

/// Checks that the forms have something to hold, asked before anything is written.
///
/// # Errors
/// [`FrameError::NothingToHold`].
pub(crate) fn check_needs(run: &RunInfo) -> Result<(), FrameError> {
    for format in run.formats {
        if let Some(needs) = format.needs
            && !run.sensors.values().any(|sensor| format.holds_any(sensor))
        {
            return Err(FrameError::NothingToHold { format: format.name, needs });
        }
    }
    Ok(())
}

/// Begins what is made of a run as a whole; the folder is there.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn begin(run: &RunInfo) -> Result<Vec<Box<dyn RunWriter>>, FrameError> {
    let begins = run.formats.iter().filter_map(|format| match format.makes {
        Makes::Run(begin) => Some(begin(run)),
        Makes::Captures(_) => None,
    });
    begins.collect()
}

/// JSON files about a run as a whole, by their paths in a data set, with what puts together those of its parts.
pub(crate) fn merged_files() -> impl Iterator<Item = (&'static str, Merge)> {
    let coco: [(_, Merge); 2] = [
        (INSTANCES, |parts, path| append_all(parts, path, Instances::append)),
        (PANOPTIC, |parts, path| append_all(parts, path, Panoptic::append)),
    ];
    coco.into_iter().chain(nuscenes::merged_files())
}
