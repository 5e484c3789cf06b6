//! Choices of what is shown of a sensor.

use crate::data::pictures::PointValue;
use systems::sensors::{CameraOutput, Sensor, SensorKind};

/// What is shown of a sensor that has pictures.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Choice {
    /// Of a camera.
    Output(CameraOutput),
    /// Of a lidar: what the colours of its points stand for.
    Points(PointValue),
}

impl Choice {
    /// What can be shown of a sensor, with names, what is shown at first before all others. Empty for sensors without
    /// pictures: theirs are read as text.
    pub fn all_of(sensor: &Sensor) -> Vec<(&'static str, Self)> {
        match &sensor.kind {
            SensorKind::Camera(camera) => {
                camera.outputs.iter().map(|(name, output)| (name, Self::Output(output))).collect()
            }
            SensorKind::Lidar(_) => PointValue::ALL.map(|(name, value)| (name, Self::Points(value))).to_vec(),
            _ => Vec::new(),
        }
    }
}

/// A sensor's kind and size, in a few words.
pub fn description(sensor: &Sensor) -> String {
    match &sensor.kind {
        SensorKind::Camera(camera) => format!("camera {} × {}", camera.size.0, camera.size.1),
        SensorKind::Lidar(lidar) => format!("lidar {} × {}", lidar.beams.rings().len(), lidar.columns),
        SensorKind::Imu(_) => "IMU".to_owned(),
        SensorKind::Gnss(_) => "GNSS".to_owned(),
        SensorKind::Collision(_) => "collision".to_owned(),
        SensorKind::Lane(_) => "lane".to_owned(),
    }
}
