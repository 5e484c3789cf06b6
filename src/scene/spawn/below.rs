//! Entities below another.

use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use systems::draw::Camera;

/// Everything below an entity, each parent before its children.
pub fn descendants(world: &World, root: Entity) -> Vec<Entity> {
    let (mut open, mut found) = (vec![root], Vec::new());
    while let Some(entity) = open.pop() {
        if let Some(children) = world.get::<Children>(entity) {
            found.extend(children.iter());
            open.extend(children.iter().rev());
        }
    }
    found
}

/// Names and entities of the cameras below an entity.
pub fn cameras_below(world: &World, root: Entity) -> Vec<(String, Entity)> {
    let name = |entity| world.get::<Name>(entity).map_or_else(String::new, ToString::to_string);
    let below = descendants(world, root).into_iter();
    below.filter(|&entity| world.get::<Camera>(entity).is_some()).map(|entity| (name(entity), entity)).collect()
}
