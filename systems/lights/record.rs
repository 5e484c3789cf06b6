//! A light as shading computes with it, and packed, as it lies in the table that shaders read. Every pixel reads every
//! light of its object, so a point light or a spot with the usual attenuation is two texels:
//!
//! ```text
//! position               three floats
//! inverse_range_squared  a float, its lowest 8 bits the light's shadow layer, counted from 1; 0: none
//! words                  from the lowest bit of the first word up: red 14 bits, green 14, kind 4; blue 14,
//!                        exponent 8, the upper 10 of direction's y; direction's x 21, the lower 11 of its y;
//!                        versine_outer 16, exponent_or_cone_slope 16
//! attenuation, ambient   three floats each, in texels that are read only where some light needs them; behind the first
//!                        the size, which no shader reads: shadow records have it
//! ```
//!
//! - A channel of the colour is its bits, in two's complement, times 2^(exponent − 127).
//! - The direction is on an octahedron (Cigolle et al., "A Survey of Efficient Representations for Independent Unit
//!   Vectors", JCGT 2014), its x and y as parts of 2²⁰ − 1.
//! - `versine_outer` is a float with 5 bits of exponent and 11 of mantissa, from 2⁻³⁰ to 4; `exponent_or_cone_slope`
//!   one with 6 and 10, from 2⁻²⁰ to 2⁴⁴, rounded up. The least of either stands for 0.
//!
//!
//! So colours are at most 1/8,191 of their largest channel off, directions two millionths of a radian, outer angles of
//! cones a part in 7,000, exponents a part in 1,000 and ranges a part in 130,000. From the outer to the inner cone
//! light rises up to a part in 1,000 faster. The search scores what comes out, [`PackedLight::unpacked`], not what went
//! in.
//!
//! `shaders/types.wgsl` mirrors the structs; `tests/scenes/shaders.rs` compares offsets and what comes out.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3, Vec3Swizzles};

/// Most slots of the light table: what fits beside a weight.
pub const MOST_LIGHTS: usize = 1 << 21;

/// An unused light slot of an instance.
pub const NO_LIGHT: u32 = u32::MAX;

/// Bits of a channel of a colour, and the largest value that they hold.
const CHANNEL_BITS: u32 = 14;
const MOST_CHANNEL: f32 = ((1 << (CHANNEL_BITS - 1)) - 1) as f32;
const KIND_SHIFT: u32 = 2 * CHANNEL_BITS;
/// Bits of x and y of a direction, and the largest value that they hold; y has some in one word and some in another.
const DIRECTION_BITS: u32 = 21;
const MOST_DIRECTION: f32 = ((1 << (DIRECTION_BITS - 1)) - 1) as f32;
const LOWER_BITS: u32 = 32 - DIRECTION_BITS;
const UPPER_BITS: u32 = DIRECTION_BITS - LOWER_BITS;
/// Bits of `inverse_range_squared` that hold the shadow layer.
const LAYER_BITS: u32 = 255;
const VERSINE: ShortFloat = ShortFloat { mantissa_bits: 11, least_exponent: 97 };
const SLOPE: ShortFloat = ShortFloat { mantissa_bits: 10, least_exponent: 107 };

/// One light, as `load_light` of the shaders gives it.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
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
    /// Exponent of a spot, or 1 / (`versine_outer` − versine of its inner half angle).
    pub exponent_or_cone_slope: f32,
    /// World space, unit: the way the light shines. 0 for points that come out of a [`PackedLight`].
    pub direction: [f32; 3],
    /// Versine (1 − cosine) of the outer half angle.
    pub versine_outer: f32,
    /// Ambient colour, linear RGB.
    pub ambient: [f32; 3],
    /// Radius, metres; of a directional light the tangent of half its angular diameter.
    pub size: f32,
}

/// One light in the table. Mirrors `PackedLight`; this file's head says how its words are made.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
pub struct PackedLight {
    /// The same as in [`LightRecord`].
    pub position: [f32; 3],
    /// Field of [`LightRecord`] of this name, but for its lowest bits: [`Self::with_shadow_layer`].
    pub inverse_range_squared: f32,
    /// Colour, kind, direction and cone.
    pub words: [u32; 4],
    /// The same as in [`LightRecord`].
    pub attenuation: [f32; 3],
    /// The same as in [`LightRecord`].
    pub size: f32,
    /// The same as in [`LightRecord`].
    pub ambient: [f32; 3],
    /// Room for 16-byte alignment.
    pub pad0: u32,
}

/// An empty slot.
impl Default for PackedLight {
    fn default() -> Self {
        LightRecord { kind: LightRecord::OFF, ..LightRecord::default() }.packed()
    }
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

    /// Packs.
    pub fn packed(&self) -> PackedLight {
        let largest = Vec3::from(self.color).abs().max_element();
        // The power of two that gives the largest channel as many of its bits as it can.
        let all_bits = (largest.to_bits() >> 23).saturating_sub(CHANNEL_BITS - 2).max(1);
        let exponent = all_bits + u32::from(largest > MOST_CHANNEL * power_of_two(all_bits));
        let channel = |c: f32| ((c / power_of_two(exponent)).round() as i32 as u32) & ((1 << CHANNEL_BITS) - 1);
        let [red, green, blue] = self.color.map(channel);
        let [x, y] = on_octahedron(self.direction.into())
            .map(|v| (v * MOST_DIRECTION).round() as i32 as u32 & ((1 << DIRECTION_BITS) - 1));
        let versine = VERSINE.nearest(self.versine_outer);
        // Not flatter than from the edge to the axis, which is full light however the edge is rounded.
        let full = if self.kind == Self::SPOT_CONE { VERSINE.value(versine).recip() } else { 0.0 };
        let slope = SLOPE.above(self.exponent_or_cone_slope.max(full));
        PackedLight {
            position: self.position,
            inverse_range_squared: without_layer(
                self.inverse_range_squared.to_bits().saturating_add(LAYER_BITS / 2 + 1),
            ),
            words: [
                red | green << CHANNEL_BITS | self.kind << KIND_SHIFT,
                blue | exponent << CHANNEL_BITS | y >> LOWER_BITS << (32 - UPPER_BITS),
                x | y << DIRECTION_BITS,
                u32::from(versine) | u32::from(slope) << 16,
            ],
            attenuation: self.attenuation,
            size: self.size,
            ambient: self.ambient,
            pad0: 0,
        }
    }
}

impl PackedLight {
    /// One of [`LightRecord::KINDS`].
    pub fn kind(&self) -> u32 {
        self.words[0] >> KIND_SHIFT
    }

    /// The same light with a shadow layer, counted from 1; 0: none.
    pub fn with_shadow_layer(self, layer: u8) -> Self {
        let bits = without_layer(self.inverse_range_squared.to_bits()).to_bits() | u32::from(layer);
        Self { inverse_range_squared: f32::from_bits(bits), ..self }
    }

    /// The light that shaders and the search compute with.
    pub fn unpacked(&self) -> LightRecord {
        let [first, second, third, cone] = self.words;
        let scale = power_of_two(second >> CHANNEL_BITS & 255);
        let unused = 32 - CHANNEL_BITS;
        let channel = |word: u32| ((word << unused) as i32 >> unused) as f32 * scale;
        let kind = self.kind();
        let direction = match kind {
            LightRecord::DIRECTIONAL => -Vec3::from(self.position),
            LightRecord::SPOT_CONE | LightRecord::SPOT_EXPONENT => {
                let y = second >> (32 - UPPER_BITS) << LOWER_BITS | third >> DIRECTION_BITS;
                let unused = 32 - DIRECTION_BITS;
                from_octahedron([third, y].map(|bits| ((bits << unused) as i32 >> unused) as f32 / MOST_DIRECTION))
            }
            _ => Vec3::ZERO,
        };
        LightRecord {
            position: self.position,
            kind,
            color: [channel(first), channel(first >> CHANNEL_BITS), channel(second)],
            inverse_range_squared: without_layer(self.inverse_range_squared.to_bits()),
            attenuation: self.attenuation,
            exponent_or_cone_slope: SLOPE.value((cone >> 16) as u16),
            direction: direction.into(),
            versine_outer: VERSINE.value(cone as u16),
            ambient: self.ambient,
            size: self.size,
        }
    }
}

/// Format of a number in 16 bits: the float's, but with fewer bits of mantissa, and the exponent counted from another
/// one. The least number stands for 0 and all that is less.
struct ShortFloat {
    mantissa_bits: u32,
    least_exponent: u32,
}

impl ShortFloat {
    fn value(&self, bits: u16) -> f32 {
        if bits == 0 {
            return 0.0;
        }
        f32::from_bits((u32::from(bits) << (23 - self.mantissa_bits)) + (self.least_exponent << 23))
    }

    fn nearest(&self, value: f32) -> u16 {
        self.rounded(value, 1 << (22 - self.mantissa_bits))
    }

    /// The least number that is no less than `value`.
    fn above(&self, value: f32) -> u16 {
        self.rounded(value, (1 << (23 - self.mantissa_bits)) - 1)
    }

    fn rounded(&self, value: f32, step: u32) -> u16 {
        if value <= 0.0 {
            return 0;
        }
        let bits = value.to_bits().saturating_sub(self.least_exponent << 23) + step;
        (bits >> (23 - self.mantissa_bits)).min(u32::from(u16::MAX)) as u16
    }
}

/// The float of some bits, without a shadow layer.
fn without_layer(bits: u32) -> f32 {
    f32::from_bits(bits & !LAYER_BITS)
}

/// 2^(exponent − 127).
fn power_of_two(exponent: u32) -> f32 {
    f32::from_bits(exponent << 23)
}

/// A unit vector on the octahedron |x| + |y| + |z| = 1, its lower half turned out over the edges of the upper one.
fn on_octahedron(direction: Vec3) -> [f32; 2] {
    let v = direction / direction.abs().element_sum().max(f32::MIN_POSITIVE);
    let folded = if v.z < 0.0 { (1.0 - v.yx().abs()) * Vec2::ONE.copysign(v.xy()) } else { v.xy() };
    folded.into()
}

fn from_octahedron([x, y]: [f32; 2]) -> Vec3 {
    let z = 1.0 - x.abs() - y.abs();
    let beyond = (-z).max(0.0);
    Vec3::new(x - beyond.copysign(x), y - beyond.copysign(y), z).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spot(direction: Vec3) -> LightRecord {
        LightRecord {
            position: [1.5, -2.0, 1e6],
            kind: LightRecord::SPOT_CONE,
            color: [3.0, 0.75, -0.5],
            inverse_range_squared: 1.0 / 128.0,
            attenuation: [1.0, 0.5, 0.25],
            exponent_or_cone_slope: 4.0,
            direction: direction.into(),
            versine_outer: 0.25,
            ambient: [0.1, 0.2, 0.3],
            size: 0.25,
        }
    }

    #[test]
    fn words_are_those_of_the_table_above_and_come_out_again() {
        let light = spot(Vec3::NEG_Y);
        let packed = light.packed();
        // 2⁻¹¹ is the least power of two of which 3 is no more than 8191.
        let [red, green, blue] = [3 << 11, 3 << 9, (-1i32 << 10) as u32 & 0x3fff];
        assert_eq!(packed.words[0], red | green << 14 | 2 << 28);
        // y is −(2²⁰ − 1): ten bits are 10 0000 0000, eleven 1.
        assert_eq!(packed.words[1..3], [blue | (127 - 11) << 14 | 0x200 << 22, 1 << 21]);
        // 2⁻² is 28 exponents above the least, 4 is 22.
        assert_eq!(packed.words[3], 22 << 26 | 28 << 11);
        assert_eq!(packed.unpacked(), light);
        assert_eq!(packed.unpacked().packed(), packed);
        let layered = packed.with_shadow_layer(200);
        assert_eq!(layered.inverse_range_squared.to_bits() & 255, 200);
        assert_eq!((layered.unpacked(), layered.with_shadow_layer(0)), (light, packed));
        assert_eq!(PackedLight::default().unpacked().kind, LightRecord::OFF);
    }

    #[test]
    fn colors_of_any_size_keep_their_channels() {
        for largest in [1e-30, 0.003, 0.999_99, 1.0, 8191.0, 8191.5, 65_504.0, 1e27] {
            let light = LightRecord { color: [largest, 0.3 * largest, -0.001 * largest], ..LightRecord::default() };
            for (found, color) in light.packed().unpacked().color.iter().zip(light.color) {
                // Half a step, where the largest channel is more than 4095 of them.
                assert!((found - color).abs() <= largest / 8190.0, "{found} for {color} of {largest}");
            }
        }
    }

    #[test]
    fn directions_come_out_within_a_step() {
        let mut worst = 0.0f32;
        for i in 0..10_000 {
            // A spiral over the sphere, and its six corners.
            let z = 1.0 - 2.0 * i as f32 / 9_999.0;
            let (sin, cos) = (i as f32 * 2.4).sin_cos();
            let round = (1.0 - z * z).max(0.0).sqrt();
            let mut direction = Vec3::new(cos * round, sin * round, z);
            if let Some(axis) = Vec3::AXES.get(i) {
                direction = -*axis;
            }
            let found = Vec3::from(spot(direction).packed().unpacked().direction);
            worst = worst.max(found.distance(direction));
        }
        // Half a step in x and y is √2 halves in the plane; in space z changes by as much as both, together √6 halves.
        // The octahedron lies up to √3 nearer than the sphere. Some roundings of single precision.
        assert!(worst < 0.5 / MOST_DIRECTION * 6f32.sqrt() * 3f32.sqrt() + 5e-7, "{worst}");
    }

    #[test]
    fn versines_of_cones_come_out_within_a_four_thousandth() {
        for versine in [5e-7f32, 1e-3, 0.06, 0.5, 0.91] {
            for part in [1.0, 0.3, 1e-3, 1e-6] {
                let exponent_or_cone_slope = 1.0 / (versine * part);
                let light = LightRecord { versine_outer: versine, exponent_or_cone_slope, ..spot(Vec3::X) };
                let found = light.packed().unpacked();
                // Half a step of 2⁻¹¹ of the versine, which goes with the angle's square.
                assert!((found.versine_outer / versine - 1.0).abs() <= 1.0 / 4096.0, "{found:?}");
                // A step of 2⁻¹⁰, and where the cone goes to full light on its axis as much as the versine is off.
                let slope = found.exponent_or_cone_slope / exponent_or_cone_slope;
                assert!((1.0 - 1.0 / 4096.0..=1.0 + 1.0 / 1024.0 + 1.0 / 4096.0).contains(&slope), "{slope} of {part}");
                assert!(found.versine_outer * found.exponent_or_cone_slope >= 1.0, "its axis is full light");
            }
        }
        let none = LightRecord { kind: LightRecord::SPOT_EXPONENT, exponent_or_cone_slope: 0.0, ..spot(Vec3::X) };
        assert_eq!(none.packed().unpacked().exponent_or_cone_slope, 0.0);
        let negative = LightRecord { exponent_or_cone_slope: -0.0, ..none };
        assert_eq!(negative.packed(), none.packed());
    }
}
