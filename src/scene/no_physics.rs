//! In place of `physical.rs` in a build without physics: physical vehicles are refused, and nothing is in their way.

use super::check::Check;
use super::format::Obstacle;
use bevy_ecs::prelude::*;

/// Read over; the check refuses it.
pub type Physical = serde::de::IgnoredAny;

impl Check<'_> {
    pub(super) fn physical(&mut self, _: &Physical) {
        self.fault("this build has no physics (feature `physics`)");
    }
}

pub fn warnings(_: &mut World) -> Vec<String> {
    Vec::new()
}

pub fn make_physical(_: &mut EntityWorldMut, _: Physical) {}

pub fn make_obstacle(_: &mut EntityWorldMut, _: Obstacle) {}
