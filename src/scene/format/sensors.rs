//! Sensors: how they are written, and what they become; and the classes that outputs have for what is seen.

use super::lenses::{Lens, lens};
use super::motion_sensors::{CollisionSensor, GnssSensor, ImuSensor, LaneSensor};
use super::values::{Color, Named, names, one_of};
use serde::{Deserialize, Deserializer};
use systems::assets::color::srgb_from_linear;
use systems::sensors::{self, Beams, CameraOutput, ClassInfo, Classes, Exposure, ImageNoise, LidarNoise, SensorKind};

#[derive(Deserialize, Debug)]
#[serde(rename_all = "snake_case")]
pub enum Sensor {
    Camera(CameraSensor),
    Lidar(LidarSensor),
    Imu(ImuSensor),
    Gnss(GnssSensor),
    Collision(CollisionSensor),
    Lane(LaneSensor),
}

#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct CameraSensor {
    pub size: [u32; 2],
    pub lens: Lens,
    pub near: f32,
    pub far: Option<f32>,
    #[serde(deserialize_with = "outputs")]
    pub outputs: Vec<CameraOutput>,
    pub samples: u32,
    pub exposure: Exposure,
    pub noise: Option<ImageNoise>,
    pub every: u32,
    pub phase: u32,
}

impl Default for CameraSensor {
    fn default() -> Self {
        let camera = sensors::CameraSensor::default();
        Self {
            size: camera.size.into(),
            lens: Lens::default(),
            near: camera.near,
            far: None,
            outputs: camera.outputs.iter().map(|(_, output)| output).collect(),
            samples: camera.samples,
            exposure: camera.exposure,
            noise: camera.noise,
            every: 1,
            phase: 0,
        }
    }
}

impl CameraSensor {
    /// Without its rate.
    pub fn camera(&self) -> sensors::CameraSensor {
        let Self { near, samples, exposure, noise, .. } = *self;
        let size = self.size.into();
        let lens = lens(&self.lens, size);
        let far = self.far.unwrap_or(match lens {
            // A parallel projection has to end somewhere.
            sensors::Lens::Orthographic { .. } => near + 1000.0,
            _ => f32::INFINITY,
        });
        let outputs = self.outputs.iter().copied().collect();
        sensors::CameraSensor { size, lens, near, far, outputs, samples, exposure, noise }
    }
}

/// Its fields are those of [`sensors::LidarSensor`].
#[derive(Deserialize, Debug)]
#[serde(default, deny_unknown_fields)]
pub struct LidarSensor {
    pub beams: Beams,
    pub hz: f32,
    pub columns: u32,
    pub range: [f32; 2],
    pub attenuation: f32,
    pub sweep: bool,
    pub noise: LidarNoise,
    pub every: u32,
    pub phase: u32,
}

impl Default for LidarSensor {
    fn default() -> Self {
        let sensors::LidarSensor { beams, hz, columns, range, attenuation, sweep, noise } =
            sensors::LidarSensor::default();
        Self { beams, hz, columns, range: range.into(), attenuation, sweep, noise, every: 1, phase: 0 }
    }
}

impl LidarSensor {
    /// Without its rate.
    pub fn lidar(&self) -> sensors::LidarSensor {
        let Self { hz, columns, attenuation, sweep, noise, .. } = *self;
        let (beams, range) = (self.beams.clone(), self.range.into());
        sensors::LidarSensor { beams, hz, columns, range, attenuation, sweep, noise }
    }
}

/// A semantic class of a scene's own.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Class {
    pub id: u8,
    #[serde(default = "black")]
    pub color: Color,
    #[serde(default)]
    pub thing: bool,
    #[serde(default = "not_trained")]
    pub train_id: u8,
}

fn black() -> Color {
    Color::linear(glam::Vec3::ZERO)
}

fn not_trained() -> u8 {
    255
}

#[derive(Deserialize)]
#[serde(transparent)]
struct Output(#[serde(deserialize_with = "output")] CameraOutput);

fn output<'de, D: Deserializer<'de>>(deserializer: D) -> Result<CameraOutput, D::Error> {
    const NAMES: [&str; CameraOutput::ALL.len()] = names(&CameraOutput::ALL);
    one_of(&CameraOutput::ALL, &NAMES, deserializer)
}

fn outputs<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<CameraOutput>, D::Error> {
    Ok(Vec::<Output>::deserialize(deserializer)?.into_iter().map(|Output(output)| output).collect())
}

/// A sensor as a component.
pub fn sensor(source: &Sensor) -> sensors::Sensor {
    match source {
        Sensor::Camera(source) => {
            sensors::Sensor { kind: SensorKind::Camera(source.camera()), every: source.every, phase: source.phase }
        }
        Sensor::Lidar(source) => {
            sensors::Sensor { kind: SensorKind::Lidar(source.lidar()), every: source.every, phase: source.phase }
        }
        Sensor::Imu(source) => source.sensor(),
        Sensor::Gnss(source) => source.sensor(),
        Sensor::Collision(source) => source.sensor(),
        Sensor::Lane(source) => source.sensor(),
    }
}

/// A scene's classes; those of Cityscapes where it has none of its own.
pub fn classes(own: &Named<Class>) -> Classes {
    if own.entries().is_empty() {
        return Classes::cityscapes();
    }
    let unlabeled = Classes::cityscapes().0.into_iter().take(1);
    let class = |(name, class): &(String, Class)| ClassInfo {
        id: class.id,
        name: name.clone(),
        color: class.color.rgb().to_array().map(|linear| (srgb_from_linear(linear) * 255.0).round() as u8),
        is_thing: class.thing,
        train_id: class.train_id,
    };
    Classes(unlabeled.chain(own.entries().iter().map(class)).collect())
}
