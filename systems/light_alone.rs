//! The choice for objects that are too far from others to share vectors with: lights are in the lanes for their scores,
//! and the rest is the plain search's.
//!
//! A moving object among many that do not move is such a one, and most of a city's are when little moves.

use crate::bounds::Sphere;
use crate::brute_force::{Reaching, choose};
use crate::light_lanes::{Floats, LANES, Objects, Scoring};
use crate::light_search::Nearby;
use crate::light_tree::{LightTree, Volume};
use crate::lights::{LightPolicy, Selection};
use crate::relevance::ScoredLight;
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Chooses for an object by itself: scores with lights in the lanes of a vector, then the plain way.
#[inline(always)]
pub(crate) fn select_one<S: Simd>(
    simd: S,
    tree: &LightTree,
    scored: &[ScoredLight],
    policy: LightPolicy,
    sphere: Sphere,
    (points, spots): (&mut Nearby, &mut Nearby),
    reaching: &mut Vec<Reaching>,
) -> Selection {
    reaching.clear();
    if !sphere.center.is_finite() || !sphere.radius.is_finite() {
        return Selection::default();
    }
    let object = Objects::same(simd, sphere);
    let volume = Volume::new(sphere.center, sphere.center, sphere.radius.max(0.0));
    points.find::<S, false>(simd, &volume);
    spots.find::<S, true>(simd, &volume);
    for (&slot, place) in tree.everywhere.iter().zip(tree.lights.len() as u32..) {
        reaching.push(Reaching { score: scored[slot as usize].luminance, slot, place });
    }
    score_each::<S, false>(simd, tree, &object, points.near(), reaching);
    score_each::<S, true>(simd, tree, &object, spots.near(), reaching);
    // Directional lights come behind all places of the tree.
    let light = |place: u32| match (place as usize).checked_sub(tree.lights.len()) {
        Some(i) => &scored[tree.everywhere[i] as usize],
        None => &tree.lights[place as usize],
    };
    choose(reaching, light, policy, sphere)
}

/// Lists those of the lights at these places of the tree that reach the object.
#[inline(always)]
fn score_each<S: Simd, const SPOTS: bool>(
    simd: S,
    tree: &LightTree,
    object: &Objects<S>,
    places: &[u32],
    reaching: &mut Vec<Reaching>,
) {
    for places in places.chunks(Floats::<S>::LEN) {
        let lights = Scoring::of_each(simd, places.iter().map(|&place| &tree.lights[place as usize]));
        let (score, _) = object.score::<SPOTS>(simd, &lights);
        let mut scores = [0.0; LANES];
        score.store_slice(&mut scores[..Floats::<S>::LEN]);
        for (&place, score) in places.iter().zip(scores) {
            if score > 0.0 {
                reaching.push(Reaching { score, slot: tree.slots[place as usize], place });
            }
        }
    }
}
