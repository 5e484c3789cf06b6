//! In place of `obstacles.rs` in a build without physics: nothing stands in the way, and there are no bodies.

use super::bodies::solid;
use bevy_ecs::prelude::*;
use glam::DVec3;
use systems::sensors::collision::Convex;

pub(super) fn obstacles(_: &World) -> Vec<Entity> {
    Vec::new()
}

pub(super) fn solid_or_obstacle(world: &World, entity: Entity, _: impl Fn((DVec3, f64)) -> bool) -> Vec<Convex> {
    solid(world, entity)
}

pub(super) fn of_body(_: &World, _: Entity) -> Option<DVec3> {
    None
}
