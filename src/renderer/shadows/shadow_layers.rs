//! The layers of the shadow maps: their size, their faces, and the numbers that shaders read of them.
//!
//! A layer is a square, as fine as the views that read it can show (`sides.rs`). A point light or a spot has one
//! (`lamp_layers.rs`), a directional light one for each level around an eye (`sun_levels.rs`). What can be seen of a
//! layer depends on that and on the casters before it, and on no frame before (`layer_casters.rs`).
//! `shaders/shadows.wgsl` has the twins of the formulas.

use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3, DVec4, Quat, Vec3, Vec4Swizzles};

/// Most layers of a side: what a texture array has on every device, less some. Lamps' numbers, counted from 1, have
/// eight bits in a light's record, in which numbers above are left for directional lights.
pub(crate) const MOST_LAYERS: usize = 240;

/// A projection into a part of a layer.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Face {
    /// Rows of the projection. Their dot products with a position relative to the light's origin are its clip x, y and
    /// w. For a parallel projection they are x, y, and the depth less a half.
    pub right: Vec3,
    pub up: Vec3,
    pub toward: Vec3,
    /// The upper left texel, and texels along a side.
    pub corner: [u32; 2],
    pub size: u32,
}

/// Record of a face, as shaders/shadow_pass.wgsl reads it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ShadowFaceRecord {
    /// The light's place, or the middle of a level of a directional light; world space.
    pub origin: [f32; 3],
    /// Metres; 0: the projection is parallel.
    pub near: f32,
    /// World space, scaled: what goes out from the origin times this is x of the clip position.
    pub right: [f32; 3],
    /// Room for 16-byte alignment.
    pub pad0: u32,
    /// The same for y.
    pub up: [f32; 3],
    /// Room for 16-byte alignment.
    pub pad1: u32,
    /// The same for w: the face's axis, unit; of a parallel projection for the depth less a half.
    pub toward: [f32; 3],
    /// Room for 16-byte alignment.
    pub pad2: u32,
}

/// Texels from a place to the farthest one that a filter reads, of a light with a size.
pub(crate) const WIDEST_FILTER: f32 = 6.0;

/// Texels around a caster that a look-up may read it from: for levels of detail and rounding, and by filters.
pub(crate) fn filter_of(size: f32) -> f32 {
    3.0 + if size > 0.0 { WIDEST_FILTER } else { 1.0 }
}

/// A float without the lower half of its bits, which records have no room for.
pub(crate) fn upper_half(value: f32) -> f32 {
    f32::from_bits(value.to_bits() & !u32::from(u16::MAX))
}

/// The share of a light's shadow that is seen, as records have it in the lower half of a word: in parts of 65,535.
pub(crate) fn fade_bits(fade: f32) -> u32 {
    (fade.clamp(0.0, 1.0) * f32::from(u16::MAX)).round() as u32
}

/// Room for rounding of a distance between two points, metres: it grows with their distance from the origin.
pub(crate) fn rounding(a: Vec3, b: Vec3) -> f32 {
    1e-6 * (a.length() + b.length())
}

/// Turns the world so that a light shines along −Z: a quaternion in parts of 32,767, as shaders read it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct Turn([i16; 4]);

impl Turn {
    /// Makes the turn of a light that shines in a direction, world space. Its axis is at a right angle to Z.
    pub fn new(direction: Vec3) -> Self {
        let turn = Quat::from_rotation_arc(direction.normalize_or(Vec3::NEG_Z), Vec3::NEG_Z);
        let [x, y, _, w] = turn.to_array().map(|part| (part * f32::from(i16::MAX)).round() as i16);
        Self([x, y, 0, w])
    }

    /// Packs it for shaders; the lower half of the second word is free.
    pub fn words(self) -> [u32; 2] {
        let [x, y, _, w] = self.0.map(|part| u32::from(part as u16));
        [x | y << 16, w << 16]
    }

    /// Matrix of the shaders' `turned`, from world axes to the light's frame. It is nearly a rotation: layers are drawn
    /// by the same numbers.
    pub fn matrix(self) -> DMat3 {
        let q = DVec4::from(self.0.map(|part| f64::from(part) / f64::from(i16::MAX)));
        let turned = |v: DVec3| {
            let t = 2.0 * q.xyz().cross(v);
            v + q.w * t + q.xyz().cross(t)
        };
        DMat3::from_cols(turned(DVec3::X), turned(DVec3::Y), turned(DVec3::Z))
    }

    /// The rows of that.
    pub fn rows(self) -> [Vec3; 3] {
        let rows = self.matrix().transpose();
        [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| row.as_vec3())
    }
}
