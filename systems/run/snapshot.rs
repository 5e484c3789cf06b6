//! The whole state of a simulation as bytes, and back.
//!
//! A snapshot belongs to a scene: it is restored into a world that has loaded that scene, just now or some time ago.
//! Loading spawns the same entities in the same order, so a number names each of them ([`crate::run::registry`]); those
//! that are gone by the time of the snapshot are named and taken out again; what came later is built again from what it
//! came by and numbered as it was. In a world whose run went on meanwhile, what has come since is taken out first; what
//! came by the same and is whole stays. Then every kind of state ([`crate::run::state`]) gets its values. What follows
//! from the state is worked out by the next frame, as ever.

use super::registry::{self, EntityRegistry, Family, StateId};
use super::spawn::Spawn;
use super::state::{NOTHING, StateError, StateList, decode, encode};
use bevy_ecs::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;

/// Entities that a snapshot may bring into being; more is a file that is broken.
const MOST_SPAWNED: usize = 1 << 24;
/// Numbers of entities in a file leave room for as many more.
const MOST_NUMBER: u32 = u32::MAX - MOST_SPAWNED as u32;

/// Number of times that the world took the state of a snapshot. Systems that measure from state to state begin anew
/// where it has changed: places of before are those of another state. It is no state itself.
#[derive(Resource, Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Restored(pub u64);

#[derive(Serialize, Deserialize)]
struct Saved {
    /// Number of entities that the scene began with.
    scene: u32,
    /// The id that comes next.
    next: u32,
    /// Ids of those that are gone, ascending; families that are gone as wholes are not among them.
    gone: Vec<u32>,
    /// Families that came later: the id of the first entity, the number of entities, their spawn.
    later: Vec<(u32, u32, Spawn)>,
    /// Kinds of state by name.
    kinds: Vec<(String, Vec<u8>)>,
}

/// The state of a world whose scene's entities are registered.
pub fn save(world: &mut World) -> Vec<u8> {
    let kinds = world.resource_scope(|world, mut list: Mut<StateList>| {
        let saved = list.kinds.iter_mut().map(|kind| (kind.is_optional(), kind.name().to_owned(), kind.save(world)));
        let is_there = |(is_optional, _, bytes): &(bool, String, Vec<u8>)| !is_optional || **bytes != NOTHING;
        saved.filter(is_there).map(|(_, name, bytes)| (name, bytes)).collect()
    });
    let registry = world.resource::<EntityRegistry>();
    let is_gone = |entity: Entity| world.get_entity(entity).is_err();
    let living = registry.later().filter(|(_, family)| !family.members.iter().all(|&member| is_gone(member)));
    let later: Vec<_> =
        living.map(|(first, family)| (first, family.members.len() as u32, family.spawn.clone())).collect();
    let is_listed = |id: StateId| {
        id.0 < registry.scene_len() || later.iter().any(|(first, count, _)| (*first..first + count).contains(&id.0))
    };
    let gone = registry.iter().filter(|(id, entity)| is_gone(*entity) && is_listed(*id)).map(|(id, _)| id.0).collect();
    encode(&Saved { scene: registry.scene_len(), next: registry.next(), gone, later, kinds })
}

/// Makes the state of a world that has loaded the scene that of [`save`].
///
/// # Errors
/// The bytes are no snapshot of that scene, or an entity that the scene began with is gone and is not in the snapshot.
/// The world is of no use then.
pub fn restore(world: &mut World, bytes: &[u8]) -> Result<(), StateError> {
    let saved: Saved = decode("snapshot", bytes)?;
    let refused = |message: String| Err(StateError::new("snapshot", message));
    let (scene, own) = (saved.scene, world.resource::<EntityRegistry>().scene_len());
    if own != scene {
        return refused(format!("expected a scene with {scene} entities, found {own}"));
    }
    if let Some(lost) = lost(world, &saved.gone) {
        return refused(format!("entity {lost} of the scene is gone; expected a world in which it is there"));
    }
    let is_saved = |first: u32, family: &Family| {
        let count = family.members.len() as u32;
        saved.later.iter().any(|(id, members, spawn)| (*id, *members) == (first, count) && *spawn == family.spawn)
    };
    world.resource_mut::<Restored>().0 += 1;
    registry::rewind(world, is_saved);
    let spawned: u64 = saved.later.iter().map(|(_, count, _)| u64::from(*count)).sum();
    if spawned > MOST_SPAWNED as u64 {
        return refused(format!("expected at most {MOST_SPAWNED} spawned entities, found {spawned}"));
    }
    for (first, count, spawn) in saved.later {
        if world.resource::<EntityRegistry>().has_family(first) {
            world.resource_mut::<EntityRegistry>().set_next(first + count);
            continue;
        }
        if !spawn.is_valid() || first < world.resource::<EntityRegistry>().next() || first > MOST_NUMBER {
            return refused(format!("entity {first}: invalid spawn"));
        }
        world.resource_mut::<EntityRegistry>().set_next(first);
        registry::spawn(world, spawn);
        if world.resource::<EntityRegistry>().next().checked_sub(first) != Some(count) {
            return refused(format!("entity {first}: expected {count} spawned entities, found another number"));
        }
    }
    if saved.next < world.resource::<EntityRegistry>().next() {
        return refused(format!("next entity number {} already exists", saved.next));
    }
    if saved.next > MOST_NUMBER {
        return refused(format!("next entity number {}; expected at most {MOST_NUMBER}", saved.next));
    }
    world.resource_mut::<EntityRegistry>().set_next(saved.next);
    take_out(world, &saved.gone)?;
    restore_kinds(world, saved.kinds)?;
    if has_ring(world) {
        return refused("an entity is its own ancestor".into());
    }
    #[cfg(feature = "vehicles")]
    crate::vehicles::signals::tick_signals_now(world);
    Ok(())
}

/// The first entity of the scene that is gone and is to be there.
fn lost(world: &World, gone: &[u32]) -> Option<u32> {
    let registry = world.resource::<EntityRegistry>();
    let is_lost = |&(StateId(id), entity): &(StateId, Entity)| {
        world.get_entity(entity).is_err() && gone.binary_search(&id).is_err()
    };
    registry.iter().take(registry.scene_len() as usize).find(is_lost).map(|(StateId(id), _)| id)
}

/// Takes entities out. What is below them and lives has come to hang elsewhere since: it gets its parent later.
fn take_out(world: &mut World, gone: &[u32]) -> Result<(), StateError> {
    let known: HashSet<u32> = gone.iter().copied().collect();
    for &id in gone {
        let registry = world.resource::<EntityRegistry>();
        let Some(entity) = registry.entity(StateId(id)) else {
            return Err(StateError::new("snapshot", format_args!("despawned entity {id} never existed")));
        };
        let children = world.get::<Children>(entity).into_iter().flat_map(|children| children.iter());
        let lives = |child: &Entity| registry.id(*child).is_some_and(|id| !known.contains(&id.0));
        let moved: Vec<Entity> = children.filter(lives).collect();
        moved.into_iter().for_each(|child| _ = world.entity_mut(child).remove::<ChildOf>());
        // With its pieces, if it is drawn in some.
        world.try_despawn(entity).ok();
    }
    Ok(())
}

fn restore_kinds(world: &mut World, saved: Vec<(String, Vec<u8>)>) -> Result<(), StateError> {
    world.resource_scope(|world, mut list: Mut<StateList>| {
        if let Some(difference) = list.difference(saved.iter().map(|(name, _)| name.as_str())) {
            return Err(StateError::new("snapshot", difference));
        }
        // In this program's order.
        list.kinds.iter_mut().try_for_each(|kind| {
            let bytes = saved.iter().find(|(name, _)| name == kind.name()).map(|(_, bytes)| &**bytes);
            kind.restore(world, bytes.unwrap_or(&NOTHING))
        })
    })
}

/// Tells if anything is above itself: no simulation does that, but a broken file may.
fn has_ring(world: &mut World) -> bool {
    let mut hung = world.query::<(Entity, &ChildOf)>();
    let mut ends = HashSet::new();
    for (entity, parent) in hung.iter(world) {
        let (mut way, mut next) = (HashSet::from([entity]), Some(parent.parent()));
        while let Some(above) = next.filter(|above| !ends.contains(above)) {
            if !way.insert(above) {
                return true;
            }
            next = world.get::<ChildOf>(above).map(ChildOf::parent);
        }
        ends.extend(way);
    }
    false
}
