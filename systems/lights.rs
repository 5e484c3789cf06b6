//! The light table, and the three most relevant lights of each object.
//! SKELETON: types and signatures the others rely on; to be filled in.
use crate::bounds::Sphere;
use crate::draw_list::LightRecord;
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;
use glam::Vec3;

/// The slot of a light in the light table; stable while the light lives. Derived.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug)]
pub struct LightSlot(pub u32);
impl Default for LightSlot { fn default() -> Self { Self(u32::MAX) } }

/// The lights of an object. Derived; written by [`select_lights`].
#[derive(Component, Clone, Copy, PartialEq, Debug)]
pub struct Selection {
    /// Slots in the light table, most relevant first; [`crate::draw_list::NO_LIGHT`] where there are fewer.
    pub lights: [u32; 3],
    /// Selection weights, 0..1.
    pub weights: [f32; 3],
    /// Irradiance of what the three leave out, linear RGB.
    pub remainder_ambient: Vec3,
    /// The same, times its luminance-weighted direction (world space).
    pub remainder_direction: Vec3,
}
impl Default for Selection { fn default() -> Self { Self { lights: [u32::MAX; 3], weights: [0.0; 3], remainder_ambient: Vec3::ZERO, remainder_direction: Vec3::ZERO } } }

pub(crate) fn free_slot(_world: DeferredWorld, _context: HookContext) {}
