//! A light as shaders read it. `shaders/types.wgsl` mirrors the struct; `tests/shaders.rs` compares every offset of the
//! two.

use bytemuck::{Pod, Zeroable};

/// Most slots of the light table: what fits beside a weight.
pub const MOST_LIGHTS: usize = 1 << 21;

/// An unused light slot of an instance.
pub const NO_LIGHT: u32 = u32::MAX;

/// One light. Mirrors `Light`.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug, Default, Pod, Zeroable)]
pub struct LightRecord {
    /// World space, metres; of a directional light the unit vector towards it.
    pub position: [f32; 3],
    /// One of [`LightRecord::KINDS`]; [`LightRecord::OFF`] for an empty slot.
    pub kind: u32,
    /// Colour times intensity, linear RGB.
    pub color: [f32; 3],
    /// 1 / range², 0 where the light has no range.
    pub inverse_range_squared: f32,
    /// Constant, linear, quadratic.
    pub attenuation: [f32; 3],
    /// Of a spot its exponent, or 1 / (`versine_outer` − versine of its inner half angle).
    pub exponent_or_cone_slope: f32,
    /// World space, unit: the way the light shines. Shaders read it of spots.
    pub direction: [f32; 3],
    /// Versine (1 − cosine) of the outer half angle.
    pub versine_outer: f32,
    /// Ambient colour, linear RGB.
    pub ambient: [f32; 3],
    /// Room for 16-byte alignment.
    pub pad0: u32,
}

impl LightRecord {
    /// Kind of a point light.
    pub const POINT: u32 = 0;
    /// Kind of a spot with the classic exponent.
    pub const SPOT_EXPONENT: u32 = 1;
    /// Kind of a spot with inner and outer cone.
    pub const SPOT_CONE: u32 = 2;
    /// Kind of a directional light.
    pub const DIRECTIONAL: u32 = 3;
    /// Kind of an empty slot.
    pub const OFF: u32 = 4;
    /// All kinds with their names.
    pub const KINDS: [(&'static str, u32); 5] = [
        ("point", Self::POINT),
        ("spot_exponent", Self::SPOT_EXPONENT),
        ("spot_cone", Self::SPOT_CONE),
        ("directional", Self::DIRECTIONAL),
        ("off", Self::OFF),
    ];
}
