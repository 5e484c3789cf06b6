//! Readings of sensors other than cameras as files: records, or an array for each of their fields.

use crate::export::array::{Array, Column};
use crate::export::{npy, npz};
use crate::sense::captures::capture::SensorData;
use crate::sense::captures::lidar::LidarCapture;
use crate::sense::captures::reading::OwnedColumn;
use std::io::Result;

/// Named files in one.
///
/// # Errors
/// A value that does not fit into the format.
pub(super) fn archive<'a>(arrays: impl Iterator<Item = Result<(&'a str, Vec<u8>)>>) -> Result<Vec<u8>> {
    let arrays: Vec<(&str, Vec<u8>)> = arrays.collect::<Result<_>>()?;
    let arrays: Vec<(&str, &[u8])> = arrays.iter().map(|(name, bytes)| (*name, &bytes[..])).collect();
    let mut bytes = Vec::new();
    npz::write(&mut bytes, &arrays)?;
    Ok(bytes)
}

/// The bytes of a file of so many records.
type Records = fn(usize, &[Column]) -> Result<Vec<u8>>;

/// Fields of so many records, each a file of its own in one.
///
/// # Errors
/// A value that does not fit into the format.
pub(super) fn archive_of(rows: usize, columns: &[Column]) -> Result<Vec<u8>> {
    archive(columns.iter().map(|column| {
        let shape: Vec<usize> = std::iter::once(rows).chain(column.shape.iter().copied()).collect();
        Ok((column.name, npy::encode(&Array::new(&shape, column.values))?))
    }))
}

/// The bytes of a file of one capture; `None` of a camera, which has no records.
///
/// # Errors
/// A value that does not fit into the format.
pub(super) fn encode(data: &SensorData, records: Records) -> Result<Option<Vec<u8>>> {
    match data {
        SensorData::Camera(_) => Ok(None),
        SensorData::Lidar(lidar) => of_lidar(lidar, records).map(Some),
        SensorData::Reading(reading) => {
            let columns = reading.columns()?;
            let columns: Vec<Column> = columns.iter().map(OwnedColumn::column).collect();
            records(reading.rows(), &columns).map(Some)
        }
    }
}

fn of_lidar(LidarCapture { scan, instance, class, .. }: &LidarCapture, records: Records) -> Result<Vec<u8>> {
    let columns = [
        Column::new("xyz", &[3], scan.xyz.as_flattened()),
        Column::new("range", &[], &scan.range[..]),
        Column::new("intensity", &[], &scan.intensity[..]),
        Column::new("ring", &[], &scan.ring[..]),
        Column::new("time", &[], &scan.time[..]),
        Column::new("instance", &[], &instance[..]),
        Column::new("class", &[], &class[..]),
        Column::new("hit", &[], &scan.hit[..]),
    ];
    records(scan.len(), &columns)
}
