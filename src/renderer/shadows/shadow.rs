//! The shadow of a sphere.

use glam::Vec3;
use systems::space::Sphere;

/// A sphere that moves along a light's rays, and grows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shadow {
    /// Around the caster, with room for filters and rounding.
    pub start: Sphere,
    /// Unit.
    pub along: Vec3,
    /// Growth of the radius, per metre.
    pub growth: f32,
    /// Metres, until the light's range ends.
    pub length: f32,
}
