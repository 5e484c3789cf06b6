//! Components of sensors: kind, rate, lens and outputs.

use super::collision::CollisionSensor;
use super::exposure::{Exposure, ImageNoise};
use super::gnss::GnssSensor;
use super::imu::ImuSensor;
use super::lane::LaneSensor;
use super::lidar::LidarSensor;
use crate::draw::camera::{Camera, Projection};
use crate::draw::intrinsics::Intrinsics;
use crate::space::transform::Transform;
use bevy_ecs::prelude::*;
use serde::{Deserialize, Serialize};

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
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
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

    /// Checks that something can be measured by it: its rate, and the settings of its kind.
    ///
    /// # Errors
    /// The field, and what was expected.
    pub fn check(&self) -> Result<(), String> {
        let Self { kind, every, phase } = self;
        if !(1..=Self::SLOWEST).contains(every) {
            return Err(format!("every: expected steps from 1 to {}, found {every}", Self::SLOWEST));
        }
        if phase >= every {
            return Err(format!("phase: expected less than every, which is {every}, found {phase}"));
        }
        match kind {
            SensorKind::Camera(camera) => camera.check(),
            SensorKind::Lidar(lidar) => lidar.check(),
            SensorKind::Imu(imu) => imu.check(),
            SensorKind::Gnss(gnss) => gnss.check(),
            SensorKind::Collision(collision) => collision.check(),
            SensorKind::Lane(lane) => lane.check(),
        }
    }

    /// Tells if it is due after a step, counted from 0, the state that a run begins with.
    pub fn is_due(&self, step: u64) -> bool {
        step % u64::from(self.every.max(1)) == u64::from(self.phase)
    }
}

/// A camera as a sensor: it looks along its entity's −Z, with +Y up.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct CameraSensor {
    /// Width and height of its pictures, pixels.
    pub size: (u32, u32),
    /// Projection.
    pub lens: Lens,
    /// Distance of the near plane along the optical axis, metres.
    pub near: f32,
    /// Distance of the far plane, metres; may be infinite. Of what lies beyond there is nothing to see.
    pub far: f32,
    /// Pictures that it gives.
    pub outputs: CameraOutputs,
    /// Samples per pixel of colours: 1 or 4. All else has one, in the middle of the pixel.
    pub samples: u32,
    /// Exposure of its colours.
    pub exposure: Exposure,
    /// Image noise.
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

impl CameraSensor {
    /// Pixels along a side at the most.
    pub const LARGEST: u32 = 16384;

    /// Checks that pictures can be drawn by it.
    ///
    /// # Errors
    /// The field, and what was expected.
    pub fn check(&self) -> Result<(), String> {
        let Self { size, near, far, outputs, samples, .. } = self;
        for side in [size.0, size.1] {
            if !(1..=Self::LARGEST).contains(&side) {
                return Err(format!("size: expected pixels from 1 to {}, found {side}", Self::LARGEST));
            }
        }
        if !(1e-5..=1e6).contains(near) {
            return Err(format!("near: expected metres from 1e-5 to 1e6, found {near}"));
        }
        let is_parallel = matches!(self.lens, Lens::Orthographic { .. });
        if !(far > near && (*far <= 1e9 || (*far == f32::INFINITY && !is_parallel))) {
            return Err(format!("far: expected more than near, at most 1e9, found {far}"));
        }
        if *outputs == CameraOutputs::default() {
            return Err("outputs: expected at least one output".into());
        }
        if ![1, 4].contains(samples) {
            return Err(format!("samples: expected 1 or 4, found {samples}"));
        }
        match self.lens {
            Lens::FieldOfView { y } if !(1e-4..=3.13).contains(&y) => {
                return Err(format!("fov_y_degrees: expected a number from 0.01 to 179, found {}", y.to_degrees()));
            }
            Lens::Orthographic { half_height } if !(1e-5..=1e6).contains(&half_height) => {
                return Err(format!("half_height: expected metres from 1e-5 to 1e6, found {half_height}"));
            }
            _ => {}
        }
        self.check_light()?;
        self.check_lens().map_err(|fault| format!("lens: {fault}"))
    }

    /// The same camera with one output more.
    #[must_use]
    pub fn with(self, output: CameraOutput) -> Self {
        Self { outputs: self.outputs.with(output), ..self }
    }

    /// Camera that it is drawn with. For a lens that bends, it gives the picture without the bending.
    pub fn camera(&self) -> Camera {
        let projection = match self.lens {
            Lens::FieldOfView { y } => Projection::Perspective { fov_y: y, aspect: None },
            Lens::Pinhole(intrinsics)
            | Lens::BrownConrady { intrinsics, .. }
            | Lens::KannalaBrandt { intrinsics, .. } => Projection::Pinhole { intrinsics, size: self.size },
            Lens::Orthographic { half_height } => Projection::Orthographic { half_height, aspect: None },
        };
        Camera { projection, near: self.near, far: self.far }
    }

    /// Its intrinsics, for its size; `None` where the projection is parallel.
    pub fn intrinsics(&self) -> Option<Intrinsics> {
        match self.lens {
            Lens::FieldOfView { y } => Some(Intrinsics::from_fov_y(y.into(), self.size.0, self.size.1)),
            Lens::Pinhole(intrinsics)
            | Lens::BrownConrady { intrinsics, .. }
            | Lens::KannalaBrandt { intrinsics, .. } => Some(intrinsics),
            Lens::Orthographic { .. } => None,
        }
    }
}

/// Projection of a camera.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
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
}

impl Lens {
    /// Perspective of a horizontal field of view, radians, for pictures of a size, pixels.
    pub fn of_fov_x(x: f64, (width, height): (u32, u32)) -> Self {
        let half = (x / 2.0).tan() * (f64::from(height) / f64::from(width));
        Self::FieldOfView { y: (2.0 * half.atan()) as f32 }
    }
}

impl Default for Lens {
    fn default() -> Self {
        Self::FieldOfView { y: 60f32.to_radians() }
    }
}

/// Picture of a camera. Axes of a camera's outputs are X right, Y down, Z forward, as OpenCV and ROS have them for
/// optical frames.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize)]
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
