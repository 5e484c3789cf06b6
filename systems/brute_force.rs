//! The plain search: every object against every light. It is the definition that [`crate::light_search`] must equal bit
//! for bit, and much slower.
//!
//! Sums need an order, because rounding depends on it: that of [`search_order`].

use crate::bounds::Sphere;
use crate::draw_list::NO_LIGHT;
use crate::light_tree::search_order;
use crate::lights::{LightPolicy, Selection};
use crate::relevance::{ScoredLight, at_center, score};

/// Chooses the lights of each sphere; `scored` is indexed by slot. A sphere that is not finite has none.
pub fn select(scored: &[ScoredLight], policy: LightPolicy, spheres: &[Sphere], out: &mut [Selection]) {
    let order = search_order(scored);
    let mut reaching = Vec::new();
    for (&sphere, out) in spheres.iter().zip(out) {
        let top = best(scored, &order, sphere, &mut reaching);
        *out = top.selection(policy);
        out.reaching = reaching.len() as u32;
        if policy != LightPolicy::Hard && top.scores[3] > 0.0 {
            add_remainder(scored, sphere, &reaching, out);
        }
    }
}

/// The best lights so far.
struct Top {
    /// Best first.
    scores: [f32; 4],
    slots: [u32; 3],
    /// Sum of the scores that are not among the first three.
    dropped: f32,
}

impl Top {
    /// Takes a light in; of equal scores the lower slot is ahead.
    fn offer(&mut self, score: f32, slot: u32) {
        let is_better = |(&other, &taken): (&f32, &u32)| score > other || score == other && slot < taken;
        if let Some(place) = self.scores.iter().zip(&self.slots).position(is_better) {
            self.dropped += self.scores[2];
            self.scores[place..].rotate_right(1);
            self.slots[place..].rotate_right(1);
            (self.scores[place], self.slots[place]) = (score, slot);
        } else {
            self.dropped += score;
            self.scores[3] = self.scores[3].max(score);
        }
    }

    /// The first three with their weights, no remainder yet.
    fn selection(&self, policy: LightPolicy) -> Selection {
        let [scores @ .., fourth] = self.scores;
        let weights = scores.map(|score| match policy {
            _ if score <= 0.0 => 0.0,
            LightPolicy::Hard => 1.0,
            LightPolicy::Three | LightPolicy::All => {
                let ratio = fourth / score;
                1.0 - (ratio * ratio) * (ratio * ratio)
            }
        });
        Selection { lights: self.slots, weights, dropped: self.dropped, ..Selection::default() }
    }
}

/// Scores every light; `reaching` receives the slots of those with a score above 0.
fn best(scored: &[ScoredLight], order: &[u32], sphere: Sphere, reaching: &mut Vec<u32>) -> Top {
    let mut top = Top { scores: [0.0; 4], slots: [NO_LIGHT; 3], dropped: 0.0 };
    reaching.clear();
    if !sphere.center.is_finite() || !sphere.radius.is_finite() {
        return top;
    }
    for &slot in order {
        let score = score(&scored[slot as usize], sphere);
        if score > 0.0 {
            top.offer(score, slot);
            reaching.push(slot);
        }
    }
    top
}

/// Adds up what the weights leave out of the lights that reach the object.
fn add_remainder(scored: &[ScoredLight], sphere: Sphere, reaching: &[u32], selection: &mut Selection) {
    for &slot in reaching {
        let light = &scored[slot as usize];
        let (irradiance, arriving) = at_center(light, sphere);
        let weight = selection.lights.iter().position(|&chosen| chosen == slot).map_or(0.0, |i| selection.weights[i]);
        let left_out = 1.0 - weight;
        selection.remainder_ambient += light.tint * (left_out * irradiance);
        selection.remainder_direction += arriving * (left_out * light.directed);
        let even = left_out * irradiance * light.even;
        selection.remainder_sides += arriving.abs() * (left_out * light.directed.abs()) + even;
    }
}
