//! In place of `physical.rs` in a build without physics: nothing is in the way of vehicles, of which none is physical.

use crate::scene::format::entities::Obstacle;
use crate::scene::format::roads::Physical;
use bevy_ecs::prelude::*;

pub fn warnings(_: &mut World) -> Vec<String> {
    Vec::new()
}

pub fn make_physical(_: &mut EntityWorldMut, _: Physical) {}

pub fn make_obstacle(_: &mut EntityWorldMut, _: Obstacle) {}
