//! Weights for objects with as many lights as leave out no more than a share, in the lanes of a vector. It is the twin
//! of [`enough`](crate::lights::enough), operation by operation.

use super::lanes::{Floats, LANES, Met, Top, denominator, splat, splat4};
use crate::lights::enough::{ALL, HALVINGS};
use crate::lights::policy::{LightPolicy, Policies};
use crate::lights::selected::{LEAST, MOST_WEIGHT};
use crate::lights::tree::LightTree;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Light that the objects of a group may leave out, one per lane.
pub(crate) struct Shares<S: Simd> {
    /// Share of the sum of scores.
    tolerance: Floats<S>,
    /// Objects that may have more than three lights.
    pub listed: S::mask32s,
    /// Objects that have three at full weight and nothing else.
    pub hard: S::mask32s,
    /// Filled in by [`Self::find_thresholds`]: 1 / τ.
    inverse_threshold: Floats<S>,
}

impl<S: Simd> Shares<S> {
    /// Those of as many objects.
    #[inline(always)]
    pub fn new(simd: S, policies: &Policies, objects: usize) -> Self {
        let mut tolerances = [0.0; LANES];
        let (mut listed, mut hard) = (0, 0);
        for (lane, tolerance) in tolerances.iter_mut().enumerate().take(objects) {
            let policy = policies.of(lane);
            listed |= u64::from(policy.tolerance().is_some()) << lane;
            hard |= u64::from(policy == LightPolicy::Hard) << lane;
            *tolerance = policy.tolerance().unwrap_or(0.0);
        }
        Self {
            tolerance: Floats::<S>::from_slice(simd, &tolerances[..Floats::<S>::LEN]),
            listed: S::mask32s::from_bitmask(simd, listed),
            hard: S::mask32s::from_bitmask(simd, hard),
            inverse_threshold: splat(simd, 0.0),
        }
    }

    /// `inverse_threshold` of the plain search, for objects of those radii. Lights are listed as those everywhere, points
    /// and spots of the tree.
    #[inline(always)]
    pub fn find_thresholds(&mut self, simd: S, tree: &LightTree, radius: Floats<S>, lists: [&[Met]; 3], top: &Top<S>) {
        let zero = splat(simd, 0.0);
        let half_radius = splat(simd, 0.5) * radius;
        let mut total = zero;
        let [everywhere, points, spots] = lists;
        for met in everywhere {
            total += met.score(simd);
        }
        for met in points.iter().chain(spots) {
            let light = &tree.lights[met.place as usize];
            let denominator = denominator::<S>(half_radius, splat4(simd, light.denominator));
            total += met.score(simd).min(splat(simd, 1.0) / denominator);
        }
        let allowed = self.tolerance * total;
        let may_leave_out = allowed.simd_gt(LEAST);
        self.inverse_threshold = splat(simd, ALL);
        // Up to three lights weigh 1 in any case.
        if !may_leave_out.any_true() || !top.has_fourth() {
            return;
        }
        let lights = top.reaching.to_float::<Floats<S>>().max(splat(simd, 1.0));
        // Where nothing may be left out, any numbers do that nothing comes to be no number by.
        let one = splat(simd, 1.0);
        let low = may_leave_out.select(splat(simd, 0.5) * (allowed / lights), one);
        let high = may_leave_out.select(splat(simd, 2.0) * top.highest(), one);
        let (mut low, mut high) = (low.bitcast::<S::u32s>(), high.bitcast::<S::u32s>());
        for _ in 0..HALVINGS {
            let middle = low + ((high - low) >> 1);
            let inverse = splat(simd, 1.0) / middle.bitcast::<Floats<S>>();
            let mut left_out = zero;
            for met in lists.into_iter().flatten() {
                let score = met.score(simd);
                left_out += score * (splat(simd, 1.0) - step(simd, score * inverse));
            }
            let fits = left_out.simd_le(allowed);
            low = fits.select(middle, low);
            high = fits.select(high, middle);
        }
        let inverse = splat(simd, 1.0) / low.bitcast::<Floats<S>>();
        self.inverse_threshold = may_leave_out.select(inverse, splat(simd, ALL));
    }

    /// `weight` of the plain search, where objects are listed; the least weight for the others.
    #[inline(always)]
    pub fn weight(&self, simd: S, score: Floats<S>, least: Floats<S>) -> Floats<S> {
        let one = splat(simd, 1.0);
        let weight = step(simd, score * self.inverse_threshold);
        let weight = self.inverse_threshold.simd_lt(ALL).select(weight, one);
        let weight = (weight.max(least) * splat(simd, MOST_WEIGHT)).ceil() / splat(simd, MOST_WEIGHT);
        self.listed.select(weight, least)
    }
}

#[inline(always)]
fn step<S: Simd>(simd: S, x: Floats<S>) -> Floats<S> {
    let t = (splat(simd, 2.0) * x - splat(simd, 1.0)).max(splat(simd, 0.0)).min(splat(simd, 1.0));
    (t * t) * (splat(simd, 3.0) - splat(simd, 2.0) * t)
}
