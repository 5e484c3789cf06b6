//! Turns about the axes, and directions on the ground.

use glam::{Quat, Vec2};

/// The direction 90° to the left of (x, z), seen from above.
pub(super) fn left_of(forward: Vec2) -> Vec2 {
    Vec2::new(forward.y, -forward.x)
}

/// A turn about +X. Every wheel takes one in every step: glam's, which the physics' determinism makes it compute
/// without the platform's library, takes several times as long.
pub(super) fn about_x(angle: f32) -> Quat {
    let (sin, cos) = (0.5 * angle).sin_cos();
    Quat::from_xyzw(sin, 0.0, 0.0, cos)
}

/// A turn about +Y.
pub(super) fn about_y(angle: f32) -> Quat {
    let (sin, cos) = (0.5 * angle).sin_cos();
    Quat::from_xyzw(0.0, sin, 0.0, cos)
}
