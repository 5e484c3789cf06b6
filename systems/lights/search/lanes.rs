//! The arithmetic of the search with objects in the lanes of a vector: scores and the best four; the ambient cube is in
//! `residual.rs`.
//!
//! Each function is the twin of one in `relevance.rs` or [`crate::lights::brute_force`], operation by
//! operation: nothing is fused, approximated or reordered, so that every instruction set gives the same bits. Functions
//! and closures must be inlined into the one that was compiled for the instruction set, or each operation becomes a
//! call.

use crate::lights::record::{LightRecord, NO_LIGHT};
use crate::lights::relevance::{MIN_RADIUS, ROUNDING, ScoredLight, split_exponent};
use crate::lights::tree::Volume;
use crate::space::bounds::Sphere;
use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::{Vec3, Vec4};

/// Lanes of the widest vector.
pub(crate) const LANES: usize = 16;
/// A coordinate whose square is infinite.
const OUT_OF_REACH: f32 = 1e30;

/// The widest vector of the instruction set.
pub(crate) type Floats<S> = <S as Simd>::f32s;

#[inline(always)]
pub(crate) fn splat<S: Simd>(simd: S, value: f32) -> Floats<S> {
    Floats::<S>::splat(simd, value)
}

#[inline(always)]
pub(crate) fn splat3<S: Simd>(simd: S, value: Vec3) -> [Floats<S>; 3] {
    [splat(simd, value.x), splat(simd, value.y), splat(simd, value.z)]
}

#[inline(always)]
pub(crate) fn splat4<S: Simd>(simd: S, value: Vec4) -> [Floats<S>; 4] {
    [splat(simd, value.x), splat(simd, value.y), splat(simd, value.z), splat(simd, value.w)]
}

/// A group of objects, one per lane. Lanes without an object, or with one that is not finite, are out of reach: no
/// score of theirs is above 0.
pub(crate) struct Objects<S: Simd> {
    center: [Floats<S>; 3],
    pub radius: Floats<S>,
    /// 0.5 / radius.
    pub half_over_radius: Floats<S>,
    is_finite: S::mask32s,
}

impl<S: Simd> Objects<S> {
    /// At most as many spheres as a vector has lanes.
    #[inline(always)]
    pub fn load(simd: S, spheres: &[Sphere]) -> Self {
        let lanes = Floats::<S>::LEN;
        if spheres.len() == lanes {
            return Self::load_all(simd, bytemuck::cast_slice(spheres));
        }
        let mut padded = [Sphere { center: Vec3::NAN, radius: 0.0 }; LANES];
        padded[..spheres.len()].copy_from_slice(spheres);
        Self::load_all(simd, bytemuck::cast_slice(&padded[..lanes]))
    }

    /// The same finite sphere in all lanes.
    #[inline(always)]
    pub fn same(simd: S, sphere: Sphere) -> Self {
        let radius = sphere.radius.max(0.0);
        Self {
            center: splat3(simd, sphere.center),
            radius: splat(simd, radius),
            half_over_radius: splat(simd, 0.5 / radius.max(MIN_RADIUS)),
            is_finite: S::mask32s::splat(simd, true),
        }
    }

    /// From x, y, z, r, x, y, z, r, …
    #[inline(always)]
    fn load_all(simd: S, values: &[f32]) -> Self {
        let lanes = Floats::<S>::LEN;
        let a = Floats::<S>::from_slice(simd, &values[..lanes]);
        let b = Floats::<S>::from_slice(simd, &values[lanes..2 * lanes]);
        let c = Floats::<S>::from_slice(simd, &values[2 * lanes..3 * lanes]);
        let d = Floats::<S>::from_slice(simd, &values[3 * lanes..4 * lanes]);
        let (xz_low, yr_low) = (a.unzip_low(b), a.unzip_high(b));
        let (xz_high, yr_high) = (c.unzip_low(d), c.unzip_high(d));
        let (x, z) = (xz_low.unzip_low(xz_high), xz_low.unzip_high(xz_high));
        let (y, r) = (yr_low.unzip_low(yr_high), yr_low.unzip_high(yr_high));
        let is_finite = x.is_finite() & y.is_finite() & z.is_finite() & r.is_finite();
        let away = splat(simd, OUT_OF_REACH);
        let radius = is_finite.select(r.max(splat(simd, 0.0)), splat(simd, 0.0));
        Self {
            center: [is_finite.select(x, away), is_finite.select(y, away), is_finite.select(z, away)],
            radius,
            half_over_radius: splat(simd, 0.5) / radius.max(splat(simd, MIN_RADIUS)),
            is_finite,
        }
    }

    /// Around those that are finite; `None` where none is.
    #[inline(always)]
    pub fn volume(&self, simd: S) -> Option<Volume> {
        if !self.is_finite.any_true() {
            return None;
        }
        let [x, y, z] = self.center;
        let min = Vec3::new(x.reduce_min(), y.reduce_min(), z.reduce_min());
        let away = splat(simd, -OUT_OF_REACH);
        let max = Vec3::new(
            self.is_finite.select(x, away).reduce_max(),
            self.is_finite.select(y, away).reduce_max(),
            self.is_finite.select(z, away).reduce_max(),
        );
        Some(Volume::new(min, max, self.radius.reduce_max()))
    }

    /// The score of a directional light.
    #[inline(always)]
    pub fn everywhere(&self, simd: S, light: &ScoredLight) -> Floats<S> {
        self.is_finite.select(splat(simd, light.luminance), splat(simd, 0.0))
    }

    /// From lights to the objects.
    #[inline(always)]
    pub fn offset(&self, [x, y, z]: [Floats<S>; 3]) -> [Floats<S>; 3] {
        [self.center[0] - x, self.center[1] - y, self.center[2] - z]
    }

    /// [`crate::lights::score`], operation by operation; where that is 0 it may be less or not a number.
    #[inline(always)]
    pub fn score<const SPOT: bool>(&self, simd: S, light: &Shining<S>) -> (Floats<S>, Lengths<S>) {
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let v = self.offset(light.position);
        let distance = dot(v, v).sqrt();
        let d = (distance * splat(simd, 1.0 - ROUNDING) - self.radius).max(zero);
        let window = range_window(simd, d * d, light.inverse_range_squared);
        let denominator = denominator::<S>(d, light.denominator);
        if !SPOT {
            return (window / denominator, Lengths { distance, along: zero, off_axis: zero });
        }
        let r = self.radius + distance * splat(simd, ROUNDING);
        let axis = light.axis;
        let t = dot(v, axis);
        let off = [v[0] - axis[0] * t, v[1] - axis[1] * t, v[2] - axis[2] * t];
        let along = t + r;
        let behind = t.min(zero);
        let reach = (r * r - behind * behind).max(zero).sqrt();
        let off_axis = dot(off, off).sqrt();
        let off = (off_axis - reach).max(zero);
        let hypotenuse = (along * along + off * off).sqrt();
        let versine = off * off / (hypotenuse * (hypotenuse + along));
        let cos = one - versine;
        let cos_squared = cos * cos;
        let cone = window * (cone_step(simd, versine, light.versine_outer, light.inverse_cone) * cos_squared);
        let falloff = cos_squared + light.falloff * (versine * (splat(simd, 2.0) - versine));
        let score = cone / (denominator * falloff);
        (along.simd_gt(zero).select(score, zero), Lengths { distance, along: t, off_axis })
    }
}

/// Fields of lights for [`Objects::score`] and `residual.rs`: of one light for all lanes, or of one per lane. Unused
/// ones are not loaded.
pub(crate) struct Shining<S: Simd> {
    pub position: [Floats<S>; 3],
    pub inverse_range_squared: Floats<S>,
    pub denominator: [Floats<S>; 4],
    axis: [Floats<S>; 3],
    pub versine_outer: Floats<S>,
    pub inverse_cone: Floats<S>,
    falloff: Floats<S>,
    /// Whole part and rest of the exponent.
    pub exponent: (S::u32s, Floats<S>),
    pub edge: [Floats<S>; 2],
    /// Spots with inner and outer cone.
    pub has_cone: S::mask32s,
}

impl<S: Simd> Shining<S> {
    /// The same light in all lanes.
    #[inline(always)]
    pub fn of(simd: S, light: &ScoredLight) -> Self {
        let (whole, fraction) = split_exponent(light.exponent);
        Self {
            position: splat3(simd, light.position),
            inverse_range_squared: splat(simd, light.inverse_range_squared),
            denominator: splat4(simd, light.denominator),
            axis: splat3(simd, light.axis),
            versine_outer: splat(simd, light.versine_outer),
            inverse_cone: splat(simd, light.inverse_cone),
            falloff: splat(simd, light.falloff),
            exponent: (S::u32s::splat(simd, whole), splat(simd, fraction)),
            edge: [splat(simd, light.edge[0]), splat(simd, light.edge[1])],
            has_cone: S::mask32s::splat(simd, light.kind == LightRecord::SPOT_CONE),
        }
    }

    /// A light per lane, as many as there are.
    #[inline(always)]
    pub fn of_each<'a>(simd: S, lights: impl Iterator<Item = &'a ScoredLight>) -> Self {
        let mut rows = [[0.0f32; LANES]; 17];
        let mut whole_exponents = [0; LANES];
        let mut has_cone = 0;
        for (lane, light) in lights.enumerate() {
            let [a, b, c] = light.position.to_array();
            let [e, f, g, h] = light.denominator.to_array();
            let [i, j, k] = light.axis.to_array();
            let (d, l, m, n) = (light.inverse_range_squared, light.versine_outer, light.inverse_cone, light.falloff);
            let ((whole, o), [p, q]) = (split_exponent(light.exponent), light.edge);
            whole_exponents[lane] = whole;
            for (row, value) in rows.iter_mut().zip([a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q]) {
                row[lane] = value;
            }
            has_cone |= u64::from(light.kind == LightRecord::SPOT_CONE) << lane;
        }
        let rows = rows.each_ref().map(|row| &row[..Floats::<S>::LEN]);
        Self {
            position: [
                Floats::<S>::from_slice(simd, rows[0]),
                Floats::<S>::from_slice(simd, rows[1]),
                Floats::<S>::from_slice(simd, rows[2]),
            ],
            inverse_range_squared: Floats::<S>::from_slice(simd, rows[3]),
            denominator: [
                Floats::<S>::from_slice(simd, rows[4]),
                Floats::<S>::from_slice(simd, rows[5]),
                Floats::<S>::from_slice(simd, rows[6]),
                Floats::<S>::from_slice(simd, rows[7]),
            ],
            axis: [
                Floats::<S>::from_slice(simd, rows[8]),
                Floats::<S>::from_slice(simd, rows[9]),
                Floats::<S>::from_slice(simd, rows[10]),
            ],
            versine_outer: Floats::<S>::from_slice(simd, rows[11]),
            inverse_cone: Floats::<S>::from_slice(simd, rows[12]),
            falloff: Floats::<S>::from_slice(simd, rows[13]),
            exponent: (
                S::u32s::from_slice(simd, &whole_exponents[..Floats::<S>::LEN]),
                Floats::<S>::from_slice(simd, rows[14]),
            ),
            edge: [Floats::<S>::from_slice(simd, rows[15]), Floats::<S>::from_slice(simd, rows[16])],
            has_cone: S::mask32s::from_bitmask(simd, has_cone),
        }
    }
}

/// Distances of objects from a light; along and off the axis only for spots.
pub(crate) struct Lengths<S: Simd> {
    pub distance: Floats<S>,
    pub along: Floats<S>,
    pub off_axis: Floats<S>,
}

/// A light that reaches some object of a group, and what its score and its part of the ambient cube have in common.
#[derive(Clone, Copy, Default)]
#[repr(C, align(64))]
pub(crate) struct Met {
    /// 0 where it does not reach.
    score: [f32; LANES],
    distance: [f32; LANES],
    along: [f32; LANES],
    off_axis: [f32; LANES],
    /// In the tree; not for a directional light.
    pub place: u32,
    pub slot: u32,
    /// One for each object that it reaches.
    pub bits: u32,
}

impl Met {
    /// 0 where it does not reach.
    #[inline(always)]
    pub fn score<S: Simd>(&self, simd: S) -> Floats<S> {
        Floats::<S>::from_slice(simd, &self.score[..Floats::<S>::LEN])
    }

    /// Keeps the scores; tells if the light reaches any of the objects.
    #[inline(always)]
    pub fn set_score<S: Simd>(&mut self, simd: S, score: Floats<S>) -> bool {
        let zero = splat(simd, 0.0);
        let reaches = score.simd_gt(zero);
        reaches.select(score, zero).store_slice(&mut self.score[..Floats::<S>::LEN]);
        self.bits = reaches.to_bitmask() as u32;
        self.bits != 0
    }

    /// Distances that [`Self::set_lengths`] kept.
    #[inline(always)]
    pub fn lengths<S: Simd>(&self, simd: S) -> Lengths<S> {
        let lanes = Floats::<S>::LEN;
        Lengths {
            distance: Floats::<S>::from_slice(simd, &self.distance[..lanes]),
            along: Floats::<S>::from_slice(simd, &self.along[..lanes]),
            off_axis: Floats::<S>::from_slice(simd, &self.off_axis[..lanes]),
        }
    }

    #[inline(always)]
    pub fn set_lengths<S: Simd, const SPOT: bool>(&mut self, lengths: &Lengths<S>) {
        let lanes = Floats::<S>::LEN;
        lengths.distance.store_slice(&mut self.distance[..lanes]);
        if SPOT {
            lengths.along.store_slice(&mut self.along[..lanes]);
            lengths.off_axis.store_slice(&mut self.off_axis[..lanes]);
        }
    }
}

#[inline(always)]
pub(crate) fn dot<T: Copy + std::ops::Mul<Output = T> + std::ops::Add<Output = T>>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(crate) fn range_window<S: Simd>(
    simd: S,
    distance_squared: Floats<S>,
    inverse_range_squared: Floats<S>,
) -> Floats<S> {
    let x = distance_squared * inverse_range_squared;
    let window = (splat(simd, 1.0) - x * x).max(splat(simd, 0.0));
    window * window
}

#[inline(always)]
pub(crate) fn denominator<S: Simd>(d: Floats<S>, [constant, linear, quadratic, least]: [Floats<S>; 4]) -> Floats<S> {
    (constant + d * (linear + d * quadratic)).max(least)
}

#[inline(always)]
pub(crate) fn cone_step<S: Simd>(simd: S, versine: Floats<S>, edge: Floats<S>, inverse_cone: Floats<S>) -> Floats<S> {
    let step = (edge - versine) * inverse_cone;
    let step = step.max(splat(simd, 0.0)).min(splat(simd, 1.0));
    step * step
}

/// The four best scores of each lane.
pub(crate) struct Top<S: Simd> {
    scores: [Floats<S>; 4],
    pub slots: [S::u32s; 3],
    /// Sum of the scores that are not among the first three.
    pub dropped: Floats<S>,
    /// Number of scores above 0.
    pub reaching: S::u32s,
}

impl<S: Simd> Top<S> {
    #[inline(always)]
    pub fn new(simd: S) -> Self {
        Self {
            scores: [splat(simd, 0.0); 4],
            slots: [S::u32s::splat(simd, NO_LIGHT); 3],
            dropped: splat(simd, 0.0),
            reaching: S::u32s::splat(simd, 0),
        }
    }

    /// Takes a light in; of equal scores the lower slot is ahead.
    #[inline(always)]
    pub fn offer(&mut self, simd: S, met: &Met) {
        let score = met.score(simd);
        let reaches = score.simd_gt(0.0);
        let [s0, s1, s2, s3] = self.scores;
        let [i0, i1, i2] = self.slots;
        let slot = S::u32s::splat(simd, met.slot);
        let (mut b0, mut b1, mut b2) = (score.simd_gt(s0), score.simd_gt(s1), score.simd_gt(s2));
        // Ties are rare enough to be worth a branch.
        let (e0, e1, e2) = (score.simd_eq(s0), score.simd_eq(s1), score.simd_eq(s2));
        if ((e0 | e1 | e2) & reaches).any_true() {
            b0 |= e0 & slot.simd_lt(i0) & reaches;
            b1 |= e1 & slot.simd_lt(i1) & reaches;
            b2 |= e2 & slot.simd_lt(i2) & reaches;
        }
        self.dropped += b2.select(s2, score);
        self.reaching += reaches.select(S::u32s::splat(simd, 1), S::u32s::splat(simd, 0));
        self.slots = [b0.select(slot, i0), b0.select(i0, b1.select(slot, i1)), b1.select(i1, b2.select(slot, i2))];
        self.scores = [s0.max(score), s1.max(s0.min(score)), s2.max(s1.min(score)), s3.max(s2.min(score))];
    }

    /// The weights of the three that fade where the fourth comes near them.
    #[inline(always)]
    pub fn weights(&self, simd: S) -> [Floats<S>; 3] {
        let [first, second, third, fourth] = self.scores;
        [weight(simd, first, fourth), weight(simd, second, fourth), weight(simd, third, fourth)]
    }

    /// Full weights.
    #[inline(always)]
    pub fn full_weights(&self, simd: S) -> [Floats<S>; 3] {
        let [first, second, third, _] = self.scores;
        [full_weight(simd, first), full_weight(simd, second), full_weight(simd, third)]
    }

    /// The highest score.
    #[inline(always)]
    pub fn highest(&self) -> Floats<S> {
        self.scores[0]
    }

    /// Tells if more than three lights reach some object, so that there is an ambient cube.
    #[inline(always)]
    pub fn has_fourth(&self) -> bool {
        self.scores[3].simd_gt(0.0).any_true()
    }

    /// The weight of a light; 0 if it is not among the three.
    #[inline(always)]
    pub fn weight_of(&self, simd: S, weights: [Floats<S>; 3], slot: u32) -> Floats<S> {
        let slot = S::u32s::splat(simd, slot);
        let weight = splat(simd, 0.0);
        let weight = self.slots[2].simd_eq(slot).select(weights[2], weight);
        let weight = self.slots[1].simd_eq(slot).select(weights[1], weight);
        self.slots[0].simd_eq(slot).select(weights[0], weight)
    }

    /// 1 − the weight of a light.
    #[inline(always)]
    pub fn left_out(&self, simd: S, weights: [Floats<S>; 3], slot: u32) -> Floats<S> {
        splat(simd, 1.0) - self.weight_of(simd, weights, slot)
    }
}

#[inline(always)]
fn weight<S: Simd>(simd: S, score: Floats<S>, fourth: Floats<S>) -> Floats<S> {
    let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
    let ratio = fourth / score;
    let squared = ratio * ratio;
    score.simd_gt(zero).select(one - squared * squared, zero)
}

#[inline(always)]
fn full_weight<S: Simd>(simd: S, score: Floats<S>) -> Floats<S> {
    let zero = splat(simd, 0.0);
    score.simd_gt(zero).select(splat(simd, 1.0), zero)
}
