//! Residual light beyond the weights, with objects in the lanes of a vector. It is the last part of `lanes.rs`: all
//! that is said there is true of these functions.

use super::lanes::{Floats, Lengths, Met, Objects, Shining, cone_step, denominator, dot, range_window, splat, splat3};
use crate::lights::record::LightRecord;
use crate::lights::relevance::{EXPONENT_SCALE, MIN_RADIUS, SQUARINGS, ScoredLight};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

pub(crate) const DIRECTIONAL: u32 = LightRecord::DIRECTIONAL;
pub(crate) const POINT: u32 = LightRecord::POINT;
/// Either kind of spot.
pub(crate) const SPOT: u32 = LightRecord::SPOT_CONE;

/// Ambient cube of the light that the weights leave out, summed per lane.
pub(crate) struct Residual<S: Simd> {
    pub ambient: [Floats<S>; 3],
    pub direction: [Floats<S>; 3],
    pub sides: [Floats<S>; 3],
}

impl<S: Simd> Residual<S> {
    #[inline(always)]
    pub fn new(simd: S) -> Self {
        let zero = [splat(simd, 0.0); 3];
        Self { ambient: zero, direction: zero, sides: zero }
    }

    /// Adds a light.
    #[inline(always)]
    pub fn add<const KIND: u32>(
        &mut self,
        simd: S,
        objects: &Objects<S>,
        light: &ScoredLight,
        met: &Met,
        left_out: Floats<S>,
    ) {
        let zero = splat(simd, 0.0);
        let (irradiance, arriving) = if KIND == DIRECTIONAL {
            (splat(simd, light.luminance), splat3(simd, light.axis * -light.luminance))
        } else {
            at_center::<S, KIND>(simd, objects, &Shining::of(simd, light), &met.lengths(simd))
        };
        // Where it does not reach, these may be no numbers.
        let reaches = S::mask32s::from_bitmask(simd, met.bits.into());
        let directed = left_out * splat(simd, light.directed);
        let part = reaches.select(left_out * irradiance, zero);
        self.ambient[0] += splat(simd, light.tint.x) * part;
        self.ambient[1] += splat(simd, light.tint.y) * part;
        self.ambient[2] += splat(simd, light.tint.z) * part;
        self.direction[0] += reaches.select(arriving[0] * directed, zero);
        self.direction[1] += reaches.select(arriving[1] * directed, zero);
        self.direction[2] += reaches.select(arriving[2] * directed, zero);
        let sided = left_out * splat(simd, light.directed.abs());
        let even = part * splat(simd, light.even);
        self.sides[0] += reaches.select(arriving[0].abs() * sided + even, zero);
        self.sides[1] += reaches.select(arriving[1].abs() * sided + even, zero);
        self.sides[2] += reaches.select(arriving[2].abs() * sided + even, zero);
    }
}

/// `at_center` of `relevance.rs`, operation by operation.
#[inline(always)]
pub(crate) fn at_center<S: Simd, const KIND: u32>(
    simd: S,
    objects: &Objects<S>,
    light: &Shining<S>,
    lengths: &Lengths<S>,
) -> (Floats<S>, [Floats<S>; 3]) {
    let v = objects.offset(light.position);
    let distance = lengths.distance;
    let d = distance.max(splat(simd, MIN_RADIUS));
    let window = range_window(simd, dot(v, v), light.inverse_range_squared);
    let mut over_distance = window / (denominator::<S>(distance, light.denominator) * d);
    if KIND == SPOT {
        over_distance *= in_cone(simd, objects, light, lengths, d);
    }
    let toward = -over_distance;
    (over_distance * d, [v[0] * toward, v[1] * toward, v[2] * toward])
}

/// Falloff of spots: their light at an angle from the axis, as a part of that along it.
#[inline(always)]
fn in_cone<S: Simd>(
    simd: S,
    objects: &Objects<S>,
    light: &Shining<S>,
    lengths: &Lengths<S>,
    d: Floats<S>,
) -> Floats<S> {
    let zero = splat(simd, 0.0);
    let (along, off) = (lengths.along, lengths.off_axis);
    let step = cone_step(simd, off * off / (d * (d + along)), light.versine_outer, light.inverse_cone);
    let inner_and_outer = along.simd_gt(zero).select(step, zero);
    if light.has_cone.all_true() {
        return inner_and_outer;
    }
    let cos = along / d;
    let [cos_edge, sin_edge] = light.edge;
    let inside = along * sin_edge - off * cos_edge;
    let part = splat(simd, 0.5) + inside * objects.half_over_radius;
    let part = part.max(zero).min(splat(simd, 1.0));
    let step = part * part * (splat(simd, 3.0) - splat(simd, 2.0) * part);
    light.has_cone.select(inner_and_outer, power(simd, cos.max(zero), light.exponent) * step)
}

/// Exponents below 2 to this many bits are raised without a branch.
const SMALL_EXPONENT_BITS: u32 = 3;

/// A factor where the lowest bit is set, otherwise 1.
#[inline(always)]
fn where_set<S: Simd>(simd: S, bits: S::u32s, factor: Floats<S>) -> Floats<S> {
    let is_set = (bits & S::u32s::splat(simd, 1)).simd_gt(S::u32s::splat(simd, 0));
    is_set.select(factor, splat(simd, 1.0))
}

/// The power of `relevance.rs`.
#[inline(always)]
fn power<S: Simd>(simd: S, x: Floats<S>, (whole, fraction): (S::u32s, Floats<S>)) -> Floats<S> {
    let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
    let (mut result, mut square, mut bits) = (one, x, whole);
    // Lights differ in their exponents, and branches would be mispredicted: small ones go without.
    for _ in 0..SMALL_EXPONENT_BITS {
        result *= where_set(simd, bits, square);
        square *= square;
        bits >>= 1;
    }
    while bits.simd_gt(S::u32s::splat(simd, 0)).any_true() {
        result *= where_set(simd, bits, square);
        square *= square;
        bits >>= 1;
    }
    let has_fraction = fraction.simd_gt(zero);
    if has_fraction.any_true() {
        let root = x.sqrt().sqrt();
        let z = (root - one) / (root + one);
        let z2 = z * z;
        let tail = splat(simd, 1.0 / 7.0) + z2 * splat(simd, 1.0 / 9.0);
        let series = one + z2 * (splat(simd, 1.0 / 3.0) + z2 * (splat(simd, 1.0 / 5.0) + z2 * tail));
        let y = fraction * splat(simd, EXPONENT_SCALE) * (z * series);
        let tail = splat(simd, 1.0 / 6.0) + y * splat(simd, 1.0 / 24.0);
        let mut power = one + y * (one + y * (splat(simd, 0.5) + y * tail));
        for _ in 0..SQUARINGS {
            power *= power;
        }
        let power = x.simd_gt(zero).select(power, zero);
        result = has_fraction.select(result * power, result);
    }
    result
}
