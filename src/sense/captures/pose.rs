//! Places of sensors and things, and how they are turned.

use glam::{DAffine3, DQuat, DVec3, Quat};
use systems::draw::rigid;
use systems::sensors::{Columns, LidarSensor};
use systems::space::GlobalTransform;

/// Place of a sensor's entity, and how it is turned: `world_from_sensor`, with Y up and Z forward.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Pose {
    /// World space, metres.
    pub translation: DVec3,
    /// Quaternion of unit length.
    pub rotation: DQuat,
}

impl Pose {
    /// Pose of an entity, without scale, mirror and shear, as cameras are placed.
    pub fn of(place: &GlobalTransform) -> Self {
        let upright = rigid(&place.affine());
        let rotation = Quat::from_mat3a(&upright.matrix3).as_dquat().normalize();
        Self { translation: upright.translation.as_dvec3(), rotation }
    }

    /// The same pose in coordinates that count from so much further back.
    #[must_use]
    pub fn moved(self, origin: DVec3) -> Self {
        Self { translation: self.translation + origin, ..self }
    }

    /// Between this one (0) and another (1): straight ahead, and turned evenly by the shorter way.
    #[must_use]
    pub fn toward(&self, other: &Self, fraction: f64) -> Self {
        Self {
            translation: self.translation.lerp(other.translation, fraction),
            rotation: self.rotation.slerp(other.rotation, fraction),
        }
    }

    /// Pose from which a column is fired, of a lidar that is at the two poses when its columns' interval begins and
    /// ends.
    #[must_use]
    pub fn of_column(poses: &[Self; 2], lidar: &LidarSensor, columns: &Columns, i: u64) -> Self {
        if lidar.sweep { poses[0].toward(&poses[1], columns.fraction(i)) } else { poses[1] }
    }

    /// From the entity's axes to places in the world.
    pub fn world_from_entity(&self) -> DAffine3 {
        DAffine3::from_rotation_translation(self.rotation, self.translation)
    }

    /// From a lidar's points (x forward, y left, z up) to places in the world.
    pub fn world_from_points(&self) -> DAffine3 {
        let axes = [DVec3::Z, DVec3::X, DVec3::Y].map(|axis| self.rotation * axis);
        DAffine3::from_cols(axes[0], axes[1], axes[2], self.translation)
    }
}
