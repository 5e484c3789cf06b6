//! Weights for an object with as many lights as leave out no more than a share ε of what reaches it. Objects are taken
//! one after another. `search/enough.rs` has the same for the lanes of vectors, operation by operation.
//!
//! The scores of the lights that reach an object are sᵢ. S is the sum of what they give as if none were nearer than half
//! the object's radius ([`at_half_radius`]): a lamp within the bounding sphere would otherwise count as if all of the
//! object touched it, and a share of that is more than other lamps give. With w the smooth step from 0 at ½ to 1 at 1, the
//! threshold τ is the number for which Σ sᵢ (1 − w(sᵢ/τ)) = ε S. S is at most the sum of the scores. The left side never falls with τ and is continuous: τ
//! exists, and where several will do, no score lies between them and all give the same weights, which move continuously
//! with the scores. A light weighs w(s/τ), comes and goes at weight 0, and what is left out is at most ε S. The three
//! most relevant weigh no less than without any others.
//!
//! τ is found by halving the interval in which it lies, on the bits of the numbers, so that steps are factors. The
//! end below τ counts: it leaves out no more than ε S. Weights are rounded up to what shaders read of them
//! ([`SelectedLights`](super::selected::SelectedLights)), which leaves out less still.

use super::brute_force::Reaching;
use super::record::LightRecord;
use super::relevance::ScoredLight;
use super::selected::{LEAST, MOST_WEIGHT};

/// Halvings: from a factor of 2³² between the ends to one of less than 1 + 2⁻¹⁵.
pub(crate) const HALVINGS: u32 = 20;

/// In place of 1 / τ where nothing is left out.
pub(crate) const ALL: f32 = f32::MAX;

/// Score of a light as if it were no nearer than half the object's radius, metres: `score`, or less. `share`: part of
/// the light that the object gets.
#[inline(always)]
fn at_half_radius(score: f32, share: f32, light: &ScoredLight, half_radius: f32) -> f32 {
    if light.kind == LightRecord::DIRECTIONAL {
        return score;
    }
    let [constant, linear, quadratic, least] = light.denominator.to_array();
    score.min(share / (constant + half_radius * (linear + half_radius * quadratic)).max(least))
}

/// 1 / τ for the lights that reach an object of that radius in metres, the first of whose scores is `highest`; [`ALL`]
/// where nothing may be left out, or next to nothing.
#[inline(always)]
pub(crate) fn inverse_threshold<'a>(
    lights: &[Reaching],
    light: impl Fn(u32) -> &'a ScoredLight,
    radius: f32,
    highest: f32,
    tolerance: f32,
) -> f32 {
    let half_radius = 0.5 * radius;
    let mut total = 0.0f32;
    for reaching in lights {
        total += at_half_radius(reaching.score, reaching.share, light(reaching.place), half_radius);
    }
    let allowed = tolerance * total;
    if allowed <= LEAST {
        return ALL;
    }
    // Each of them leaves out less than the threshold. Twice the highest leaves out all.
    let mut low = (0.5 * (allowed / lights.len() as f32)).to_bits();
    let mut high = (2.0 * highest).to_bits();
    for _ in 0..HALVINGS {
        let middle = low + ((high - low) >> 1);
        let inverse = 1.0 / f32::from_bits(middle);
        let mut left_out = 0.0f32;
        for light in lights {
            left_out += light.score * (1.0 - step(light.score * inverse));
        }
        if left_out <= allowed {
            low = middle;
        } else {
            high = middle;
        }
    }
    1.0 / f32::from_bits(low)
}

/// w: 0 up to ½, 1 from 1 on.
#[inline(always)]
fn step(x: f32) -> f32 {
    let t = (2.0 * x - 1.0).clamp(0.0, 1.0);
    (t * t) * (3.0 - 2.0 * t)
}

/// The weight of a light, in the steps that shaders read.
#[inline(always)]
pub(crate) fn weight(score: f32, inverse_threshold: f32, least: f32) -> f32 {
    let weight = if inverse_threshold < ALL { step(score * inverse_threshold) } else { 1.0 };
    (weight.max(least) * MOST_WEIGHT).ceil() / MOST_WEIGHT
}
