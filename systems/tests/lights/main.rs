//! Lights: what one gives, which are chosen for objects, through portals and for shadow maps, and what a world keeps.

#[path = "../common/mod.rs"]
mod common;
mod light_components;
mod light_search;
mod portals;
mod relevance;
mod shadow_lights;
mod world;

use crate::common::{
    LUMINANCE, any_direction, any_light, any_odd_light, any_place, any_policy, cases, placed, true_falloff,
};
use bevy_ecs::prelude::*;
use glam::{Quat, Vec3};
use proptest::prelude::*;
use proptest::sample::Index;
use systems::Simulation;
use systems::assets::{Library, MeshId, shapes, world_bounds};
use systems::ecs::stats::FrameStats;
use systems::lights::{
    Light, LightKind, LightLists, LightPolicies, LightPolicy, LightRecord, LightSlot, LightTable, NO_LIGHT, Policies,
    ScoredLight, SelectedLights, Selection, brute_force, irradiance, light_record, score,
};
use systems::space::{GlobalTransform, Sphere, Transform};

/// Asserts that an object keeps what the plain search finds: three lights, and the words of its list.
#[track_caller]
fn assert_kept(lists: &LightLists, kept: &SelectedLights, expected: &Selection, further: &[u32]) {
    assert_eq!(kept.unpack(lists), SelectedLights::pack(expected).unpack(&LightLists::default()));
    let words = lists.of(kept).0.into_iter().map(|(slot, weight)| slot << 10 | (weight * 1023.0).round() as u32);
    assert_eq!(words.collect::<Vec<_>>(), further, "{expected:?}");
}
