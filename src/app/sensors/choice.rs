//! Choices of what is shown of a sensor.

use crate::data::pictures::PointValue;
use crate::sense::kind_name;
use systems::sensors::{CameraOutput, Sensor, SensorKind};

/// Picture that is shown of a sensor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Choice {
    /// Output of a camera.
    Output(CameraOutput),
    /// Value of a lidar's points that their colours stand for.
    Points(PointValue),
}

impl Choice {
    /// All pictures of a sensor with their names, the default one first. Empty for sensors without pictures: theirs are
    /// read as text.
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
        kind => kind_name(kind).to_owned(),
    }
}
