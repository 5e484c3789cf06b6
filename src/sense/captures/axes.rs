//! The axes that outputs of sensors have. Matrices turn directions of one into those of another.

use glam::{DMat3, DVec3};

/// From a camera's outputs (X right, Y down, Z forward) to its entity (X right, Y up, −Z forward).
pub(crate) const ENTITY_FROM_CAMERA: DMat3 = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));

/// From a lidar's points, and what other sensors than cameras give (X forward, Y left, Z up), to the entity (X left, Y
/// up, Z forward).
pub(crate) const ENTITY_FROM_LIDAR: DMat3 = DMat3::from_cols(DVec3::Z, DVec3::X, DVec3::Y);

/// From the scene's coordinates (Y up) to a world of ROS (Z up; REP 103): (x, y, z) becomes (z, x, y).
pub(crate) const ROS_FROM_WORLD: DMat3 = DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X);
