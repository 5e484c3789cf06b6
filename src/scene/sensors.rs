//! Sensors of scene files: how they are written, what is wrong with them, and what they become; and the classes that
//! outputs have for what is seen.

use super::check::{Check, SIZES};
use super::faults::unknown;
use super::lenses::{Lens, lens};
use super::motion_sensors::{CollisionSensor, GnssSensor, ImuSensor, LaneSensor};
use super::places::Step;
use super::values::{Color, Named, names, one_of};
use serde::{Deserialize, Deserializer};
use systems::assets::color::srgb_from_linear;
use systems::sensors::{self, Beams, CameraOutput, ClassInfo, Classes, Exposure, ImageNoise, LidarNoise, SensorKind};

/// Pixels along a side.
pub(super) const LARGEST_PICTURE: u32 = sensors::CameraSensor::LARGEST;
/// Steps.
const SLOWEST: u32 = sensors::Sensor::SLOWEST;

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
    fn camera(&self) -> sensors::CameraSensor {
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
    fn lidar(&self) -> sensors::LidarSensor {
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

impl Check<'_> {
    pub fn classes(&mut self, classes: &Named<Class>) {
        self.field("classes", |c| {
            c.entries(classes, |c, class| {
                let is_taken =
                    classes.entries().iter().any(|(name, own)| std::ptr::eq(own, class) && name == "unlabeled");
                if is_taken {
                    c.fault("reserved name: what has no class is called so, with id 0");
                }
                if class.id == 0 {
                    c.field("id", |c| c.fault("expected a number from 1 to 255: 0 is what has no class"));
                }
                let same = classes.entries().iter().take_while(|(_, other)| !std::ptr::eq(other, class));
                if let Some((name, _)) = same.into_iter().find(|(_, other)| other.id == class.id) {
                    c.field("id", |c| c.fault(format_args!("duplicate id {}: class {name:?} has it", class.id)));
                }
                c.color("color", class.color, 1.0);
            });
        });
    }

    /// The name of a class of the scene, or of Cityscapes where it has none of its own.
    pub fn known_class(&mut self, name: &str) {
        let classes = classes(&self.scene.classes);
        if classes.find(name).is_none() && !self.is_of_any_scene {
            let message = unknown("class", name, classes.0.iter().map(|class| class.name.as_str()));
            self.fault(message);
        }
    }

    pub fn sensor(&mut self, sensor: &Sensor, is_named: bool) {
        if !is_named {
            self.fault("expected the entity to have a name, by which outputs call the sensor");
        }
        match sensor {
            Sensor::Camera(camera) => self.camera_sensor(camera),
            Sensor::Lidar(lidar) => {
                self.rate(lidar.every, lidar.phase);
                let lidar_sensor = lidar.lidar();
                if let Err(message) = lidar_sensor.check() {
                    return self.fault(message);
                }
                let seconds = self.scene.clock.step_seconds * f64::from(lidar.every);
                if let Err(message) = lidar_sensor.check_beams(seconds) {
                    self.fault(message);
                }
            }
            other => self.motion_sensor(&self::sensor(other)),
        }
    }

    pub fn rate(&mut self, every: u32, phase: u32) {
        if !(1..=SLOWEST).contains(&every) {
            self.field("every", |c| c.fault(format_args!("expected steps from 1 to {SLOWEST}, found {every}")));
        } else if phase >= every {
            let message = format!("expected less than every, which is {every}, found {phase}");
            self.field("phase", |c| c.fault(message));
        }
    }

    fn camera_sensor(&mut self, camera: &CameraSensor) {
        self.field("size", |c| {
            for (i, side) in camera.size.into_iter().enumerate() {
                if !(1..=LARGEST_PICTURE).contains(&side) {
                    let message = format!("expected pixels from 1 to {LARGEST_PICTURE}, found {side}");
                    c.inside(Step::Index(i), "", |c| c.fault(message));
                }
            }
        });
        self.number("near", camera.near, SIZES.0, SIZES.1);
        if let Some(far) = camera.far
            && !(far > camera.near && far <= 1e9)
        {
            self.field("far", |c| c.fault(format_args!("expected more than near, at most 1e9, found {far}")));
        }
        self.field("lens", |c| c.lens(&camera.lens, camera.size));
        if camera.outputs.is_empty() {
            self.field("outputs", |c| c.fault("expected at least one output"));
        }
        if ![1, 4].contains(&camera.samples) {
            self.field("samples", |c| c.fault(format_args!("expected 1 or 4, found {}", camera.samples)));
        }
        if let Err(message) = camera.camera().check_light() {
            self.fault(message);
        }
        self.rate(camera.every, camera.phase);
    }
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
