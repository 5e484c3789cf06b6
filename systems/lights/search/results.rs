//! Results of the search, from the lanes of vectors to one element per object: whole, as tests compare it with the
//! plain search, or packed, as objects keep it.

use super::lanes::{Floats, LANES, Top, splat};
use super::residual::Residual;
use crate::lights::selected::{LEAST, MOST_UNITS, MOST_WEIGHT, ROUNDER, SelectedLights, WEIGHT_BITS};
use crate::lights::table::Selection;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Result of a search for an object.
pub trait Found: Copy + Default {
    /// Makes the result of one object.
    fn new(selection: &Selection) -> Self;

    /// Stores the results of the objects in the lanes, as many as there is room for.
    #[doc(hidden)]
    fn store<S: Simd>(simd: S, lanes: &Lanes<S>, out: &mut [Self]);
}

/// Results of a group of objects, one per lane.
pub struct Lanes<'a, S: Simd> {
    pub(crate) top: &'a Top<S>,
    pub(crate) weights: [Floats<S>; 3],
    /// See [`Selection::dropped`].
    pub(crate) dropped: Floats<S>,
    pub(crate) residual: &'a Residual<S>,
}

impl Found for Selection {
    fn new(selection: &Selection) -> Self {
        *selection
    }

    #[inline(always)]
    fn store<S: Simd>(_: S, lanes: &Lanes<S>, out: &mut [Self]) {
        let Lanes { top, weights: [u, v, w], dropped, residual } = *lanes;
        let [i, j, k] = top.slots.each_ref().map(|slots| slots.bitcast::<Floats<S>>());
        let ([r, g, b], [x, y, z], [p, q, t]) = (residual.ambient, residual.direction, residual.sides);
        let mut quads = [[[0.0f32; 4]; LANES]; 4];
        interleave([i, j, k, u], &mut quads[0]);
        interleave([v, w, r, g], &mut quads[1]);
        interleave([b, x, y, z], &mut quads[2]);
        interleave([p, q, t, dropped], &mut quads[3]);
        let reaching = top.reaching.as_slice();
        for (lane, out) in out.iter_mut().enumerate().take(Floats::<S>::LEN) {
            let row: &mut [f32; 17] = bytemuck::cast_mut(out);
            row[0..4].copy_from_slice(&quads[0][lane]);
            row[4..8].copy_from_slice(&quads[1][lane]);
            row[8..12].copy_from_slice(&quads[2][lane]);
            row[12..16].copy_from_slice(&quads[3][lane]);
            row[16] = f32::from_bits(reaching[lane]);
        }
    }
}

impl Found for SelectedLights {
    fn new(selection: &Selection) -> Self {
        Self::pack(selection)
    }

    /// [`SelectedLights::pack`], to the bit.
    #[inline(always)]
    fn store<S: Simd>(simd: S, lanes: &Lanes<S>, out: &mut [Self]) {
        let Lanes { top, weights, dropped, residual } = *lanes;
        let ([a, b, c], [d, e, f], [g, h, last]) = (residual.ambient, residual.direction, residual.sides);
        let numbers = [a, b, c, d, e, f, g, h, last];
        let mut largest = splat(simd, 0.0);
        for number in numbers {
            // As `f32::max`, which passes over what is no number.
            largest = largest.max_precise(number.abs());
        }
        let largest = largest.min(splat(simd, f32::MAX));
        let units = splat(simd, MOST_UNITS) / largest;
        let units = largest.simd_gt(LEAST).select(units, splat(simd, 0.0));
        let residual = [
            two(simd, a * units, b * units),
            two(simd, c * units, d * units),
            two(simd, e * units, f * units),
            two(simd, g * units, h * units),
        ];
        let lights = [
            light(simd, top.slots[0], weights[0]),
            light(simd, top.slots[1], weights[1]),
            light(simd, top.slots[2], weights[2]),
        ];
        let dropped = dropped.bitcast::<S::u32s>() + S::u32s::splat(simd, 1 << 15);
        let last_side_and_dropped = whole(simd, last * units) | (dropped & S::u32s::splat(simd, 0xffff_0000));
        let mut quads = [[[0u32; 4]; LANES]; 2];
        interleave::<S, S::u32s>([lights[0], lights[1], lights[2], residual[0]], &mut quads[0]);
        interleave::<S, S::u32s>([residual[1], residual[2], residual[3], last_side_and_dropped], &mut quads[1]);
        let unit = largest / splat(simd, MOST_UNITS);
        let (unit, reaching) = (unit.as_slice(), top.reaching.as_slice());
        for (lane, out) in out.iter_mut().enumerate().take(Floats::<S>::LEN) {
            let row: &mut [u32; 10] = bytemuck::cast_mut(out);
            row[0..4].copy_from_slice(&quads[0][lane]);
            row[4..8].copy_from_slice(&quads[1][lane]);
            row[8..10].copy_from_slice(&[unit[lane].to_bits(), reaching[lane]]);
        }
    }
}

/// The nearest whole numbers, 16 bits of each.
#[inline(always)]
fn whole<S: Simd>(simd: S, v: Floats<S>) -> S::u32s {
    (v + splat(simd, ROUNDER)).bitcast::<S::u32s>() & S::u32s::splat(simd, 0xffff)
}

/// Two of them.
#[inline(always)]
fn two<S: Simd>(simd: S, low: Floats<S>, high: Floats<S>) -> S::u32s {
    whole(simd, low) | (whole(simd, high) << 16)
}

/// A light and its weight.
#[inline(always)]
fn light<S: Simd>(simd: S, slot: S::u32s, weight: Floats<S>) -> S::u32s {
    (slot << WEIGHT_BITS) | whole(simd, weight * splat(simd, MOST_WEIGHT))
}

/// a₀ b₀ c₀ d₀, a₁ b₁ c₁ d₁, …
#[inline(always)]
fn interleave<S: Simd, V: SimdBase<S>>([a, b, c, d]: [V; 4], out: &mut [[V::Element; 4]; LANES]) {
    let out: &mut [V::Element] = out.as_flattened_mut();
    let lanes = V::LEN;
    let (ac_low, ac_high) = (a.zip_low(c), a.zip_high(c));
    let (bd_low, bd_high) = (b.zip_low(d), b.zip_high(d));
    ac_low.zip_low(bd_low).store_slice(&mut out[..lanes]);
    ac_low.zip_high(bd_low).store_slice(&mut out[lanes..2 * lanes]);
    ac_high.zip_low(bd_high).store_slice(&mut out[2 * lanes..3 * lanes]);
    ac_high.zip_high(bd_high).store_slice(&mut out[3 * lanes..4 * lanes]);
}
