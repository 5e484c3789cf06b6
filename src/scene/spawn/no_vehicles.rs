//! In place of `vehicles` in a build without vehicles: the check has refused a scene with any.

use super::placement::{OnRoute, Placement};
use super::random::Random;
use super::spawner::Spawner;
use crate::scene::format::roads::{Along, SignalHead, Vehicle};
use crate::scene::format::scene::Scene;
use bevy_ecs::prelude::*;
use glam::Affine3A;
use systems::space::Transform;

#[derive(Default)]
pub struct Room {
    pub full: usize,
}

impl Room {
    pub fn take(&mut self, _: &Placement, _: &World) -> bool {
        true
    }
}

pub fn insert(_: &Scene, _: u64, _: &mut World) -> Vec<String> {
    Vec::new()
}

pub fn warnings(_: &mut World) -> Vec<String> {
    Vec::new()
}

pub fn along(_: &Along, _: &World, _: &mut Random) -> Vec<(Transform, OnRoute)> {
    Vec::new()
}

pub fn make_ground(_: &mut EntityWorldMut) {}

impl Spawner<'_> {
    pub(super) fn vehicle(&mut self, _: &str, _: Option<&Vehicle>, _: Option<OnRoute>, _: Entity, _: &Affine3A) {}

    pub(super) fn signal_head(&mut self, _: &SignalHead, _: Entity) {}
}
