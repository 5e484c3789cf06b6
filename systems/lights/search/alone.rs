//! The choice for objects that are too far from others to share vectors with: lights are in the lanes for their scores
//! and for what arrives from them, and the rest is the plain search's.
//!
//! A moving object among many that do not move is such a one, and most of a city's are when little moves.

use super::clusters::Nearby;
use super::lanes::{Floats, LANES, Objects, Shining};
use super::residual::{POINT, SPOT, at_center};
use crate::lights::brute_force::{Reaching, choose};
use crate::lights::lists::ListedLights;
use crate::lights::policy::LightPolicy;
use crate::lights::relevance::{self, ScoredLight};
use crate::lights::table::Selection;
use crate::lights::tree::{LightTree, Volume};
use crate::space::bounds::Sphere;
use fearless_simd::Simd;
use fearless_simd::prelude::*;
use glam::Vec3;

/// Chooses for an object by itself: what lights give with lights in the lanes of a vector, then the plain way.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
pub(crate) fn select_one<S: Simd>(
    simd: S,
    tree: &LightTree,
    scored: &[ScoredLight],
    policy: LightPolicy,
    sphere: Sphere,
    (points, spots): (&mut Nearby, &mut Nearby),
    reaching: &mut Vec<Reaching>,
    further: &mut ListedLights,
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
        let (irradiance, arriving) = relevance::at_center(&scored[slot as usize], sphere);
        reaching.push(Reaching {
            score: scored[slot as usize].luminance,
            slot,
            place,
            irradiance,
            arriving,
            share: 1.0,
        });
    }
    meet::<S, POINT>(simd, tree, &object, points.near(), reaching);
    meet::<S, SPOT>(simd, tree, &object, spots.near(), reaching);
    // Directional lights come behind all places of the tree.
    let light = |place: u32| match (place as usize).checked_sub(tree.lights.len()) {
        Some(i) => &scored[tree.everywhere[i] as usize],
        None => &tree.lights[place as usize],
    };
    choose(reaching, light, sphere.radius.max(0.0), policy, further)
}

/// Lists those of the lights at these places of the tree that reach the object.
#[inline(always)]
fn meet<S: Simd, const KIND: u32>(
    simd: S,
    tree: &LightTree,
    object: &Objects<S>,
    places: &[u32],
    reaching: &mut Vec<Reaching>,
) {
    let lanes = Floats::<S>::LEN;
    for places in places.chunks(lanes) {
        let lights = Shining::of_each(simd, places.iter().map(|&place| &tree.lights[place as usize]));
        let (score, lengths) = match KIND {
            POINT => object.score::<false>(simd, &lights),
            _ => object.score::<true>(simd, &lights),
        };
        let (irradiance, [x, y, z]) = at_center::<S, KIND>(simd, object, &lights, &lengths);
        let mut rows = [[0.0; LANES]; 5];
        score.store_slice(&mut rows[0][..lanes]);
        irradiance.store_slice(&mut rows[1][..lanes]);
        x.store_slice(&mut rows[2][..lanes]);
        y.store_slice(&mut rows[3][..lanes]);
        z.store_slice(&mut rows[4][..lanes]);
        for (lane, &place) in places.iter().enumerate() {
            let [score, irradiance, x, y, z] = rows.each_ref().map(|row| row[lane]);
            if score > 0.0 {
                let (slot, arriving) = (tree.slots[place as usize], Vec3::new(x, y, z));
                reaching.push(Reaching { score, slot, place, irradiance, arriving, share: 1.0 });
            }
        }
    }
}
