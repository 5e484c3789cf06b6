//! Components of sensors: kind, rate, lens and outputs.

use super::barometer::BarometerSensor;
use super::collision::CollisionSensor;
use super::exposure::{Exposure, ImageNoise};
use super::gnss::GnssSensor;
use super::imu::ImuSensor;
use super::lane::LaneSensor;
use super::lidar::LidarSensor;
use crate::describe::check::{Described, faults};
use crate::describe::fault::{Fault, Trail};
use crate::describe::infinite;
use crate::draw::camera::{Camera, Projection};
use crate::draw::intrinsics::Intrinsics;
use crate::space::transform::Transform;
use bevy_ecs::prelude::*;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;

/// Makes an entity a sensor. Its place is the entity's; what it is mounted on is above it.
///
/// ```
/// use bevy_ecs::prelude::*;
/// use systems::Simulation;
/// use systems::sensors::{CameraOutput, CameraSensor, Sensor};
/// use systems::space::Transform;
/// let mut simulation = Simulation::new();
/// let car = simulation.world.spawn(Transform::IDENTITY).id();
/// let camera = CameraSensor { size: (128, 96), ..CameraSensor::default() }.with(CameraOutput::Depth);
/// simulation.world.spawn((Sensor::camera(camera).every(6), Name::new("front"), ChildOf(car)));
/// ```
#[derive(Component, Clone, PartialEq, Debug, Serialize, Deserialize)]
#[require(Transform)]
pub struct Sensor {
    /// Measurement, by the kind of sensor.
    pub kind: SensorKind,
    /// It is due once in so many steps of the clock, at least 1.
    pub every: u32,
    /// It is due after step s where s mod `every` is this; less than `every`.
    pub phase: u32,
}

/// Kinds of sensors.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SensorKind {
    /// Pictures, and what is known of each pixel.
    Camera(CameraSensor),
    /// Distances along beams.
    Lidar(LidarSensor),
    /// Specific force and angular rate.
    Imu(ImuSensor),
    /// Place on Earth and velocity.
    Gnss(GnssSensor),
    /// Contacts.
    Collision(CollisionSensor),
    /// Place in a lane.
    Lane(LaneSensor),
    /// Pressure of the air.
    Barometer(BarometerSensor),
    /// Measurement of a kind that a program adds; its settings are a component of the entity.
    #[schemars(skip)]
    Custom {
        /// Name of the kind.
        name: String,
        /// True if logs of ROS 2 have messages of it.
        has_messages: bool,
    },
}

/// Steps after which a sensor is due.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Rate {
    /// Steps of the clock from one capture to the next.
    #[schemars(range(min = 1, max = Sensor::SLOWEST), extend("unit" = "steps"))]
    pub every: u32,
    /// Remainder of the steps' number by `every` at which it is due; less than that.
    #[schemars(extend("unit" = "steps"))]
    pub phase: u32,
}

impl Default for Rate {
    fn default() -> Self {
        Self { every: 1, phase: 0 }
    }
}

impl Described for Rate {
    fn check_whole(&self) -> Vec<Fault> {
        let Self { every, phase } = self;
        let expected = || format!("expected less than every, which is {every}, found {phase}");
        let is_late = phase >= every && *every > 0;
        is_late.then(|| Trail::default().field("phase").fault(expected())).into_iter().collect()
    }
}

impl Described for SensorKind {
    fn check_whole(&self) -> Vec<Fault> {
        match self {
            Self::Camera(camera) => camera.check_whole(),
            Self::Lidar(lidar) => lidar.check_whole(),
            _ => Vec::new(),
        }
    }
}

impl Sensor {
    /// Steps from one measurement to the next at the most.
    pub const SLOWEST: u32 = 1_000_000;

    /// A sensor that is due after every step.
    pub fn new(kind: SensorKind) -> Self {
        Self { kind, every: 1, phase: 0 }
    }

    /// A camera that is due after every step.
    pub fn camera(camera: CameraSensor) -> Self {
        Self::new(SensorKind::Camera(camera))
    }

    /// A lidar that is due after every step: what it fires in one.
    pub fn lidar(lidar: LidarSensor) -> Self {
        Self::new(SensorKind::Lidar(lidar))
    }

    /// The same sensor, due once in so many steps.
    #[must_use]
    pub fn every(self, steps: u32) -> Self {
        Self { every: steps.max(1), ..self }
    }

    /// The same sensor as worlds have it: see [`CameraSensor::resolved`].
    #[must_use]
    pub fn resolved(self) -> Self {
        match self.kind {
            SensorKind::Camera(camera) => Self { kind: SensorKind::Camera(camera.resolved()), ..self },
            _ => self,
        }
    }

    /// Faults of its rate, and of the settings of its kind. Something can be measured by it where there are none.
    pub fn faults(&self) -> Vec<Fault> {
        let Self { kind, every, phase } = self;
        let rate = Rate { every: *every, phase: *phase };
        faults(&rate).into_iter().chain(faults(kind)).collect()
    }

    /// Checks that it measures something in a world: of steps so long, with or without a place on Earth.
    ///
    /// # Errors
    /// A line that says what was expected.
    pub fn check_in(&self, step_seconds: f64, has_geo_origin: bool) -> Result<(), String> {
        match &self.kind {
            SensorKind::Lidar(lidar) if self.faults().is_empty() => {
                lidar.check_beams(step_seconds * f64::from(self.every))
            }
            SensorKind::Gnss(_) if !has_geo_origin => {
                Err("expected the scene to have a geo_origin: where on Earth it is".to_owned())
            }
            SensorKind::Collision(_) | SensorKind::Lane(_) if !cfg!(feature = "vehicles") => {
                Err("this build has no vehicles (feature `vehicles`)".to_owned())
            }
            _ => Ok(()),
        }
    }

    /// Tells if it is due after a step, counted from 0, the state that a run begins with.
    pub fn is_due(&self, step: u64) -> bool {
        step % u64::from(self.every.max(1)) == u64::from(self.phase)
    }
}

/// A camera as a sensor: it looks along its entity's −Z, with +Y up.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CameraSensor {
    /// Width and height of its pictures.
    #[schemars(extend("minimum" = 1, "maximum" = Self::LARGEST, "unit" = "px"))]
    #[schemars(extend("expected" = "(width, height) in whole pixels"))]
    pub size: (u32, u32),
    /// Projection.
    #[schemars(extend("see" = "[lens](#lenses)"))]
    pub lens: Lens,
    /// Distance of the near plane along the optical axis.
    #[schemars(range(min = 1e-5, max = 1e6), extend("unit" = "m"))]
    pub near: f32,
    /// Distance of the far plane, beyond which nothing is seen; of an orthographic lens 1,000 m beyond `near` by
    /// default.
    #[serde(with = "infinite")]
    #[schemars(with = "Option<f32>", extend("maximum" = 1_000_000_000, "infinite" = true, "unit" = "m"))]
    pub far: f32,
    /// Pictures that it gives.
    #[schemars(extend("see" = "list of [outputs](#outputs)"))]
    pub outputs: CameraOutputs,
    /// Samples per pixel of colours. All else has one, in the middle of the pixel.
    #[schemars(extend("enum" = [1, 4]))]
    pub samples: u32,
    /// Exposure of its colours.
    #[schemars(extend("see" = "[exposure](#exposure)"))]
    #[schemars(extend("expected" = "a number, \"scene\", \"metered\" or {\"metered\": {…}}"))]
    pub exposure: Exposure,
    /// Noise of its colours.
    #[schemars(extend("see" = "[noise](#image-noise)"))]
    pub noise: Option<ImageNoise>,
}

impl Default for CameraSensor {
    fn default() -> Self {
        Self {
            size: (640, 480),
            lens: Lens::default(),
            near: 0.1,
            far: f32::INFINITY,
            outputs: CameraOutputs::default().with(CameraOutput::Color),
            samples: 4,
            exposure: Exposure::Scene,
            noise: None,
        }
    }
}

impl Described for CameraSensor {
    fn check_whole(&self) -> Vec<Fault> {
        let at = Trail::default();
        let (near, far) = (self.near, self.far);
        let mut faults = Vec::new();
        if far <= near {
            faults.push(at.field("far").fault(format!("expected more than near, which is {near}, found {far}")));
        }
        if self.outputs == CameraOutputs::default() {
            faults.push(at.field("outputs").fault("expected at least one output"));
        }
        let noise = self.noise.iter().flat_map(Described::check_whole);
        faults.extend(noise.map(|fault| at.field("noise").around(&fault)));
        faults.extend(self.check_lens().err().map(|fault| at.field("lens").around(&fault)));
        faults
    }
}

impl CameraSensor {
    /// Pixels along a side at the most.
    pub const LARGEST: u32 = 16384;

    /// The same camera with one output more.
    #[must_use]
    pub fn with(self, output: CameraOutput) -> Self {
        Self { outputs: self.outputs.with(output), ..self }
    }

    /// Camera that it is drawn with. For a lens that bends, it gives the picture without the bending.
    pub fn camera(&self) -> Camera {
        let near = self.near;
        let projection = match self.lens {
            Lens::FieldOfViewX { x } => Projection::Perspective { fov_y: fov_y(x, self.size), aspect: None },
            Lens::FieldOfView { y } => Projection::Perspective { fov_y: y, aspect: None },
            Lens::Pinhole(intrinsics)
            | Lens::BrownConrady { intrinsics, .. }
            | Lens::KannalaBrandt { intrinsics, .. } => Projection::Pinhole { intrinsics, size: self.size },
            Lens::Orthographic { half_height } => Projection::Orthographic { half_height, aspect: None },
        };
        Camera { projection, near, far: self.clone().resolved().far }
    }

    /// The same camera by its vertical field of view, and with an end where a parallel projection has none.
    #[must_use]
    pub fn resolved(self) -> Self {
        match self.lens {
            Lens::FieldOfViewX { x } => Self { lens: Lens::of_fov_x(x, self.size), ..self },
            // A parallel projection has to end somewhere.
            Lens::Orthographic { .. } if self.far == f32::INFINITY => Self { far: self.near + 1000.0, ..self },
            _ => self,
        }
    }

    /// Its intrinsics, for its size; `None` where the projection is parallel.
    pub fn intrinsics(&self) -> Option<Intrinsics> {
        match self.lens {
            Lens::FieldOfView { y } => Some(Intrinsics::from_fov_y(y.into(), self.size.0, self.size.1)),
            Lens::FieldOfViewX { x } => {
                Some(Intrinsics::from_fov_y(fov_y(x, self.size).into(), self.size.0, self.size.1))
            }
            Lens::Pinhole(intrinsics)
            | Lens::BrownConrady { intrinsics, .. }
            | Lens::KannalaBrandt { intrinsics, .. } => Some(intrinsics),
            Lens::Orthographic { .. } => None,
        }
    }
}

/// Projection of a camera.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(remote = "Self")]
pub enum Lens {
    /// Perspective with square pixels and the principal point in the middle.
    FieldOfView {
        /// Vertical, radians.
        y: f32,
    },
    /// Perspective with any focal lengths and principal point.
    Pinhole(Intrinsics),
    /// Perspective bent by the lens of Brown and Conrady, with OpenCV's coefficients.
    BrownConrady {
        /// Intrinsics of the picture before it is bent.
        intrinsics: Intrinsics,
        /// k1, k2, p1, p2, k3, k4, k5, k6.
        coefficients: [f64; 8],
    },
    /// A fisheye of Kannala and Brandt, with OpenCV's coefficients.
    KannalaBrandt {
        /// Focal lengths in pixels a radian near the axis.
        intrinsics: Intrinsics,
        /// k1, k2, k3, k4.
        coefficients: [f64; 4],
        /// From the axis, radians, at most π: what is beyond is not seen.
        largest_angle: f64,
    },
    /// Parallel.
    Orthographic {
        /// Half the height of the visible box, metres.
        half_height: f32,
    },
    /// The same by the other angle. No sensor of a world has it: see [`CameraSensor::resolved`].
    FieldOfViewX {
        /// Horizontal, radians.
        x: f64,
    },
}

impl Lens {
    /// Perspective of a horizontal field of view, radians, for pictures of a size, pixels.
    pub fn of_fov_x(x: f64, size: (u32, u32)) -> Self {
        Self::FieldOfView { y: fov_y(x, size) }
    }
}

/// Vertical field of view of a horizontal one, radians.
fn fov_y(x: f64, (width, height): (u32, u32)) -> f32 {
    let half = (x / 2.0).tan() * (f64::from(height) / f64::from(width));
    (2.0 * half.atan()) as f32
}

impl Default for Lens {
    fn default() -> Self {
        Self::FieldOfView { y: 60f32.to_radians() }
    }
}

/// Picture of a camera. Axes of a camera's outputs are X right, Y down, Z forward, as OpenCV and ROS have them for
/// optical frames.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CameraOutput {
    /// Tone-mapped, 8-bit sRGB.
    Color,
    /// Linear colours, exposed, before the tone map, half floats.
    Linear,
    /// Metres along the optical axis, 32-bit.
    Depth,
    /// Metres from the optical centre, 32-bit.
    Range,
    /// Unit shading normals, camera axes.
    Normal,
    /// Number of the instance, 32-bit.
    Instance,
    /// Number of the drawn entity, 32-bit.
    Part,
    /// Semantic class, 8-bit.
    Class,
    /// Class and instance in one number, 32-bit.
    Panoptic,
    /// A record for each thing in the picture: its boxes, and how much of it is seen.
    Boxes,
    /// Optical flow forward: place at the next capture of what a pixel shows, pixels.
    Flow,
    /// Optical flow back: place at the capture before of what a pixel shows, pixels.
    FlowBack,
}

impl CameraOutput {
    /// All, with their names.
    pub const ALL: [(&'static str, Self); 12] = [
        ("color", Self::Color),
        ("linear", Self::Linear),
        ("depth", Self::Depth),
        ("range", Self::Range),
        ("normal", Self::Normal),
        ("instance", Self::Instance),
        ("part", Self::Part),
        ("class", Self::Class),
        ("panoptic", Self::Panoptic),
        ("boxes", Self::Boxes),
        ("flow", Self::Flow),
        ("flow_back", Self::FlowBack),
    ];
}

/// A set of outputs.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default, Serialize, Deserialize)]
#[serde(remote = "Self")]
pub struct CameraOutputs(u32);

impl CameraOutputs {
    /// With one more.
    #[must_use]
    pub fn with(self, output: CameraOutput) -> Self {
        Self(self.0 | 1 << output as u32)
    }

    /// Tells if it is one of these.
    pub fn has(self, output: CameraOutput) -> bool {
        self.0 >> output as u32 & 1 == 1
    }

    /// Tells if one of several is one of these.
    pub fn has_any(self, outputs: &[CameraOutput]) -> bool {
        outputs.iter().any(|&output| self.has(output))
    }

    /// These, with their names, in the order of [`CameraOutput::ALL`].
    pub fn iter(self) -> impl Iterator<Item = (&'static str, CameraOutput)> {
        CameraOutput::ALL.into_iter().filter(move |(_, output)| self.has(*output))
    }
}

/// A list of names for people, and a number for programs.
impl Serialize for CameraOutputs {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            serializer.collect_seq(self.iter().map(|(_, output)| output))
        } else {
            Self::serialize(self, serializer)
        }
    }
}

impl<'de> Deserialize<'de> for CameraOutputs {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if deserializer.is_human_readable() {
            Ok(Vec::<CameraOutput>::deserialize(deserializer)?.into_iter().collect())
        } else {
            Self::deserialize(deserializer)
        }
    }
}

impl JsonSchema for CameraOutputs {
    fn schema_name() -> Cow<'static, str> {
        "CameraOutputs".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        Vec::<CameraOutput>::json_schema(generator)
    }
}

impl FromIterator<CameraOutput> for CameraOutputs {
    fn from_iter<I: IntoIterator<Item = CameraOutput>>(outputs: I) -> Self {
        outputs.into_iter().fold(Self::default(), Self::with)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sensor_is_due_in_its_phase() {
        let sensor = Sensor { phase: 2, ..Sensor::camera(CameraSensor::default()).every(3) };
        let due: Vec<u64> = (0..12).filter(|&step| sensor.is_due(step)).collect();
        assert_eq!(due, [2, 5, 8, 11]);
        let every_step = Sensor::camera(CameraSensor::default());
        assert!((0..4).all(|step| every_step.is_due(step)));
    }

    #[test]
    fn a_set_has_what_was_put_into_it() {
        for (_, output) in CameraOutput::ALL {
            let set = CameraOutputs::default().with(output);
            assert_eq!(set.iter().map(|(_, output)| output).collect::<Vec<_>>(), [output]);
        }
        let all: CameraOutputs = CameraOutput::ALL.into_iter().map(|(_, output)| output).collect();
        assert!(all.iter().eq(CameraOutput::ALL));
    }
}
