//! Readings of sensors other than cameras as files: records, or an array for each of their fields.

use crate::export::array::{Array, Column};
use crate::export::{npy, npz};
use crate::sense::captures::capture::SensorData;
use crate::sense::captures::lidar::LidarCapture;
use crate::sense::captures::motion::{GnssCapture, ImuCapture};
use std::io::Result;
use systems::sensors::collision::Collision;
use systems::sensors::{LaneReading, SensorKind};

/// The records of a sensor in names of files. A camera has none: its outputs have names of their own.
pub(super) fn name(kind: &SensorKind) -> &'static str {
    match kind {
        SensorKind::Camera(_) => "",
        SensorKind::Lidar(_) => "points",
        SensorKind::Imu(_) => "imu",
        SensorKind::Gnss(_) => "gnss",
        SensorKind::Collision(_) => "collisions",
        SensorKind::Lane(_) => "lane",
    }
}

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
        SensorData::Imu(imu) => of_imu(imu, records).map(Some),
        SensorData::Gnss(gnss) => of_gnss(gnss, records).map(Some),
        SensorData::Collision(collisions) => of_collisions(collisions, records).map(Some),
        SensorData::Lane(lane) => of_lane(lane, records).map(Some),
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

fn of_imu(ImuCapture { valid, nanoseconds, reading, .. }: &ImuCapture, records: Records) -> Result<Vec<u8>> {
    let (valid, time) = ([u8::from(*valid)], [*nanoseconds as f64 * 1e-9]);
    let columns = [
        Column::new("valid", &[], &valid[..]),
        Column::new("time", &[], &time[..]),
        Column::new("specific_force", &[3], reading.specific_force.as_ref().as_slice()),
        Column::new("angular_velocity", &[3], reading.angular_velocity.as_ref().as_slice()),
    ];
    records(1, &columns)
}

fn of_gnss(GnssCapture { valid, has_velocity, reading, .. }: &GnssCapture, records: Records) -> Result<Vec<u8>> {
    let flags = [u8::from(*valid), u8::from(*has_velocity)];
    let place = [reading.place.latitude_degrees, reading.place.longitude_degrees, reading.place.altitude];
    let columns = [
        Column::new("valid", &[], &flags[..1]),
        Column::new("latitude", &[], &place[..1]),
        Column::new("longitude", &[], &place[1..2]),
        Column::new("altitude", &[], &place[2..]),
        Column::new("has_velocity", &[], &flags[1..]),
        Column::new("velocity", &[3], reading.velocity.as_ref().as_slice()),
    ];
    records(1, &columns)
}

fn of_collisions(collisions: &[Collision], records: Records) -> Result<Vec<u8>> {
    let instance: Vec<u32> = collisions.iter().map(|collision| collision.instance).collect();
    let class: Vec<u8> = collisions.iter().map(|collision| collision.class).collect();
    let depth: Vec<f64> = collisions.iter().map(|collision| collision.depth).collect();
    let normal: Vec<f64> = collisions.iter().flat_map(|collision| collision.normal.to_array()).collect();
    let speed: Vec<f64> = collisions.iter().map(|collision| collision.speed).collect();
    let columns = [
        Column::new("instance", &[], &instance[..]),
        Column::new("class", &[], &class[..]),
        Column::new("depth", &[], &depth[..]),
        Column::new("normal", &[3], &normal[..]),
        Column::new("speed", &[], &speed[..]),
    ];
    records(collisions.len(), &columns)
}

fn of_lane(reading: &LaneReading, records: Records) -> Result<Vec<u8>> {
    let LaneReading { valid, route, lane, offset, heading_error, curvature, width, along, speed } = *reading;
    let (valid, numbers) = ([u8::from(valid)], [route, lane]);
    let values = [offset, heading_error, curvature, width, along, speed];
    let names = ["offset", "heading_error", "curvature", "width", "along", "speed"];
    let mut columns = vec![
        Column::new("valid", &[], &valid[..]),
        Column::new("route", &[], &numbers[..1]),
        Column::new("lane", &[], &numbers[1..]),
    ];
    columns.extend(names.iter().zip(values.chunks(1)).map(|(name, value)| Column::new(name, &[], value)));
    records(1, &columns)
}
