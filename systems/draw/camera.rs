//! Cameras as components.

use super::intrinsics::Intrinsics;
use crate::space::transform::Transform;
use bevy_ecs::prelude::*;

/// Projection of a [`Camera`]. A shape that it asks for is seen whole in a target of another: more is seen to the
/// sides, or above and below.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Projection {
    /// Vertical field of view in radians.
    Perspective {
        /// Vertical field of view in radians.
        fov_y: f32,
        /// Width over height; `None`: that of the target.
        aspect: Option<f32>,
    },
    /// Any focal lengths and principal point.
    Pinhole {
        /// For pictures of `size`.
        intrinsics: Intrinsics,
        /// Width and height, pixels; a target of another size shows that picture whole.
        size: (u32, u32),
    },
    /// Parallel projection; half the height of the visible box in metres.
    Orthographic {
        /// Half the height of the visible box in metres.
        half_height: f32,
        /// Width over height of that box; `None`: that of the target.
        aspect: Option<f32>,
    },
}

/// A camera; looks down its entity's local −Z.
#[derive(Component, Clone, PartialEq, Debug)]
#[require(Transform)]
pub struct Camera {
    /// Perspective or orthographic.
    pub projection: Projection,
    /// Distance of the near plane, metres.
    pub near: f32,
    /// Distance of the far plane, metres; perspective cameras may have none (infinite).
    pub far: f32,
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            projection: Projection::Perspective { fov_y: 45f32.to_radians(), aspect: None },
            near: 0.1,
            far: f32::INFINITY,
        }
    }
}
