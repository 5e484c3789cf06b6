//! The plain search: every object against every light. It is the definition that [`crate::lights::search`] must equal
//! bit for bit, and much slower.
//!
//! Sums need an order, because rounding depends on it: that of [`search_order`].

use super::enough::{inverse_threshold, weight};
use super::lists::ListedLights;
use super::policy::{LightPolicy, Policies};
use super::record::NO_LIGHT;
use super::relevance::{ScoredLight, at_center, score};
use super::selected::pack_light;
use super::table::Selection;
use super::tree::search_order;
use crate::space::bounds::Sphere;
use glam::Vec3;

/// Chooses the lights of each sphere; `scored` is indexed by slot. A sphere that is not finite has none. Returns what
/// they have beyond their three.
pub fn select(scored: &[ScoredLight], policies: Policies, spheres: &[Sphere], out: &mut [Selection]) -> ListedLights {
    select_shares(scored, policies, spheres, |_, _| 1.0, out)
}

/// [`select`] where an object gets a share of each light, 0 to 1: of the object with that index, and the light in that
/// slot ([`LightFloods::share`](super::floods::LightFloods::share)). For the object the light is so many times as bright.
pub fn select_shares(
    scored: &[ScoredLight],
    policies: Policies,
    spheres: &[Sphere],
    share: impl Fn(usize, u32) -> f32,
    out: &mut [Selection],
) -> ListedLights {
    let order = search_order(scored);
    let mut reached = Vec::new();
    let mut further = ListedLights::default();
    for (i, (&sphere, out)) in spheres.iter().zip(out).enumerate() {
        reached.clear();
        let is_finite = sphere.center.is_finite() && sphere.radius.is_finite();
        for &slot in order.iter().filter(|_| is_finite) {
            let light = &scored[slot as usize];
            let score = score(light, sphere);
            if score > 0.0 {
                reached.extend(Reaching::new(light, slot, score, sphere, share(i, slot)));
            }
        }
        let light = |slot: u32| &scored[slot as usize];
        *out = choose(&reached, light, sphere.radius.max(0.0), policies.of(i), &mut further);
        if policies.are_listed() {
            further.end_object();
        }
    }
    further
}

/// A light whose score for an object is above 0.
pub(crate) struct Reaching {
    /// Times the share.
    pub score: f32,
    pub slot: u32,
    /// Index of the light in the list that is searched.
    pub place: u32,
    /// Irradiance and vector of [`at_center`], times the share.
    pub irradiance: f32,
    pub arriving: Vec3,
    /// Share of the light that the object gets: less than 1 behind walls.
    pub share: f32,
}

impl Reaching {
    /// A light of which an object gets a share; `None` where that is nothing.
    #[inline]
    pub fn new(light: &ScoredLight, slot: u32, score: f32, sphere: Sphere, share: f32) -> Option<Self> {
        let score = score * share;
        (score > 0.0).then(|| {
            let (irradiance, arriving) = at_center(light, sphere);
            Self { score, slot, place: slot, irradiance: irradiance * share, arriving: arriving * share, share }
        })
    }
}

/// Chooses from the lights that reach an object of that radius, in the order in which they are added up; lists those
/// beyond the three.
#[inline(always)]
pub(crate) fn choose<'a>(
    lights: &[Reaching],
    light: impl Fn(u32) -> &'a ScoredLight,
    radius: f32,
    policy: LightPolicy,
    further: &mut ListedLights,
) -> Selection {
    let mut top = Top { scores: [0.0; 4], slots: [NO_LIGHT; 3], dropped: 0.0 };
    for reaching in lights {
        top.offer(reaching.score, reaching.slot);
    }
    let mut selection = top.selection(policy);
    selection.reaching = lights.len() as u32;
    let three = selection;
    let among_three = |slot: u32| three.lights.iter().position(|&chosen| chosen == slot);
    if let Some(tolerance) = policy.tolerance() {
        let inverse_threshold = inverse_threshold(lights, &light, radius, top.scores[0], tolerance);
        selection.dropped = 0.0;
        for reaching in lights {
            let number = among_three(reaching.slot);
            let least = number.map_or(0.0, |number| three.weights[number]);
            let weight = weight(reaching.score, inverse_threshold, least);
            match number {
                Some(number) => selection.weights[number] = weight * reaching.share,
                None if weight > 0.0 => further.push(pack_light(reaching.slot, weight * reaching.share)),
                None => {}
            }
            selection.dropped += reaching.score * (1.0 - weight);
            add_residual(reaching, light(reaching.place), 1.0 - weight, &mut selection);
        }
    } else {
        let has_residual = policy != LightPolicy::Hard && top.scores[3] > 0.0;
        for reaching in lights {
            let number = among_three(reaching.slot);
            number.into_iter().for_each(|number| selection.weights[number] *= reaching.share);
            if has_residual {
                let weight = number.map_or(0.0, |number| three.weights[number]);
                add_residual(reaching, light(reaching.place), 1.0 - weight, &mut selection);
            }
        }
    }
    selection
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
    #[inline(always)]
    fn offer(&mut self, mut score: f32, mut slot: u32) {
        for (other, taken) in self.scores.iter_mut().zip(&mut self.slots) {
            if score > *other || score == *other && slot < *taken {
                std::mem::swap(other, &mut score);
                std::mem::swap(taken, &mut slot);
            }
        }
        // What is left is out.
        self.dropped += score;
        self.scores[3] = self.scores[3].max(score);
    }

    /// The first three with their weights, no residual yet.
    fn selection(&self, policy: LightPolicy) -> Selection {
        let [scores @ .., fourth] = self.scores;
        let weights = scores.map(|score| match policy {
            _ if score <= 0.0 => 0.0,
            LightPolicy::Hard => 1.0,
            LightPolicy::Three | LightPolicy::Enough(_) | LightPolicy::All => {
                let ratio = fourth / score;
                1.0 - (ratio * ratio) * (ratio * ratio)
            }
        });
        Selection { lights: self.slots, weights, dropped: self.dropped, ..Selection::default() }
    }
}

/// Adds what its weight leaves out of a light that reaches the object.
#[inline(always)]
fn add_residual(reaching: &Reaching, light: &ScoredLight, left_out: f32, selection: &mut Selection) {
    let &Reaching { irradiance, arriving, .. } = reaching;
    selection.residual_ambient += light.tint * (left_out * irradiance);
    selection.residual_direction += arriving * (left_out * light.directed);
    let even = left_out * irradiance * light.even;
    selection.residual_sides += arriving.abs() * (left_out * light.directed.abs()) + even;
}
