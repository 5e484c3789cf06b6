//! Names for entities that mean the same in every run: a [`StateId`] is a place in the order in which entities came to
//! be, where an `Entity` is a place in one world's memory.
//!
//! Loading a scene spawns the same entities in the same order each time; [`register_all`] numbers them when it is done.
//! Whatever comes later comes by [`spawn`], which numbers it and keeps the [`Spawn`] it came by, so that a snapshot can
//! bring it into being again. Hashes, recordings and snapshots know entities by these numbers only.

use super::spawn::Spawn;
use crate::draw::pieces::PieceOf;
use crate::draw::sky_light::drawn_sky::WeatherLight;
use bevy_ecs::entity::EntityMapper;
use bevy_ecs::prelude::*;
use bevy_ecs::resource::IsResource;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Number of an entity in a run: its place in the order in which entities came to be.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize)]
pub struct StateId(pub u32);

/// Number that no entity has.
const NO_ID: u32 = u32::MAX;

/// The entities of a run by [`StateId`].
#[derive(Resource, Default, Debug)]
pub struct EntityRegistry {
    /// Those that the scene began with, by id.
    scene: Vec<Entity>,
    /// Later entities, by the id of their family's first.
    later: BTreeMap<u32, Family>,
    /// Ids by the indices of entities; [`NO_ID`] for those that have none.
    ids: Vec<u32>,
    /// The id that comes next.
    next: u32,
}

/// Entities that one [`Spawn`] brought into being.
#[derive(Debug)]
pub(crate) struct Family {
    /// Spawn that it came from.
    pub spawn: Spawn,
    /// Its entities, roots before what is below them; some may be gone.
    pub members: Vec<Entity>,
}

impl EntityRegistry {
    /// The id of an entity; `None` for one that was not registered.
    pub fn id(&self, entity: Entity) -> Option<StateId> {
        let id = StateId(*self.ids.get(entity.index_u32() as usize)?);
        // The place of an entity that is gone may be another's now.
        (self.entity(id) == Some(entity)).then_some(id)
    }

    /// The entity of an id. It may be gone from the world.
    pub fn entity(&self, id: StateId) -> Option<Entity> {
        if let Some(&entity) = self.scene.get(id.0 as usize) {
            return Some(entity);
        }
        let (first, family) = self.later.range(..=id.0).next_back()?;
        family.members.get((id.0 - first) as usize).copied()
    }

    /// Number of entities that the scene began with.
    pub fn scene_len(&self) -> u32 {
        self.scene.len() as u32
    }

    /// The id that the next entity gets.
    pub fn next_id(&self) -> StateId {
        StateId(self.next)
    }

    /// The number of [`Self::next_id`].
    pub(crate) fn next(&self) -> u32 {
        self.next
    }

    /// Ids from here on go to what comes next.
    pub(crate) fn set_next(&mut self, next: u32) {
        self.next = self.next.max(next);
    }

    /// Families that came after the scene, by first id, in that order.
    pub(crate) fn later(&self) -> impl Iterator<Item = (u32, &Family)> {
        self.later.iter().map(|(first, family)| (*first, family))
    }

    /// Tells if a family begins with that id.
    pub(crate) fn has_family(&self, first: u32) -> bool {
        self.later.contains_key(&first)
    }

    /// All ids with their entities, ascending; some may be gone.
    pub fn iter(&self) -> impl Iterator<Item = (StateId, Entity)> {
        let numbered = |first: u32, entities: &[Entity]| {
            let entities: Vec<Entity> = entities.to_vec();
            entities.into_iter().enumerate().map(move |(i, entity)| (StateId(first + i as u32), entity))
        };
        numbered(0, &self.scene).chain(self.later().flat_map(move |(first, family)| numbered(first, &family.members)))
    }

    fn number(&mut self, entity: Entity, id: u32) {
        let index = entity.index_u32() as usize;
        if index >= self.ids.len() {
            self.ids.resize(index + 1, NO_ID);
        }
        self.ids[index] = id;
    }

    /// Forgets what has no entity left.
    fn sweep(&mut self, world: &World) {
        self.later.retain(|_, family| family.members.iter().any(|&entity| world.get_entity(entity).is_ok()));
    }
}

/// Numbers everything that is in the world, as the entities that the scene began with: when a scene is loaded, or what
/// stands for one is built. Pieces of objects and the lights of sun and moon follow
/// from these and have no number, nor have resources and observers.
pub fn register_all(world: &mut World) {
    let mut all = world
        .query_filtered::<Entity, (Without<IsResource>, Without<Observer>, Without<PieceOf>, Without<WeatherLight>)>();
    let mut scene: Vec<Entity> = all.iter(world).collect();
    // In a world that has only grown, the order of indices is that of spawning.
    scene.sort_unstable_by_key(|entity| entity.index_u32());
    let mut registry = EntityRegistry { next: scene.len() as u32, ..EntityRegistry::default() };
    scene.iter().enumerate().for_each(|(id, &entity)| registry.number(entity, id as u32));
    registry.scene = scene;
    world.insert_resource(registry);
}

/// Brings something into being while the simulation runs, and numbers it with all that is below it. Returns its roots.
///
/// Systems do this by a command: `commands.queue(move |world: &mut World| _ = registry::spawn(world, what))`.
pub fn spawn(world: &mut World, spawn: Spawn) -> Vec<Entity> {
    let roots = spawn.build(world);
    let mut members = Vec::new();
    let mut open: Vec<Entity> = roots.iter().rev().copied().collect();
    while let Some(entity) = open.pop() {
        members.push(entity);
        let below = world.get::<Children>(entity).into_iter().flat_map(|children| children.iter().rev());
        open.extend(below.filter(|&child| world.get::<PieceOf>(child).is_none()));
    }
    let mut registry = world.resource_mut::<EntityRegistry>();
    let first = registry.next;
    members.iter().zip(first..).for_each(|(&entity, id)| registry.number(entity, id));
    registry.next += members.len() as u32;
    registry.later.insert(first, Family { spawn, members });
    roots
}

/// Takes out what came after the scene, but for families that `is_kept`, by first id and number of members. Numbers of
/// ids begin after the last one that stays.
pub(crate) fn rewind(world: &mut World, is_kept: impl Fn(u32, &Family) -> bool) {
    world.resource_scope(|world, mut registry: Mut<EntityRegistry>| {
        let registry = &mut *registry;
        let is_whole = |family: &Family| family.members.iter().all(|&member| world.get_entity(member).is_ok());
        let mut kept = BTreeMap::new();
        let mut gone = Vec::new();
        for (first, family) in std::mem::take(&mut registry.later) {
            if is_whole(&family) && is_kept(first, &family) {
                kept.insert(first, family);
            } else {
                gone.extend(family.members);
            }
        }
        gone.into_iter().for_each(|member| _ = world.try_despawn(member));
        registry.later = kept;
        registry.next = registry.scene.len() as u32;
    });
}

/// Takes an entity out of the world, with all that is below it. Nothing happens where it is gone.
pub fn despawn(world: &mut World, id: StateId) {
    let Some(entity) = world.resource::<EntityRegistry>().entity(id) else { return };
    world.try_despawn(entity).ok();
    world.resource_scope(|world, mut registry: Mut<EntityRegistry>| registry.sweep(world));
}

/// From entities to what stands for them in hashes and files: an entity whose index is the id.
pub(crate) struct ToIds<'a>(pub &'a EntityRegistry);

/// And back.
pub(crate) struct FromIds<'a> {
    pub world: &'a World,
    /// Set if some id was that of no living entity.
    pub missed: bool,
}

impl EntityMapper for ToIds<'_> {
    fn get_mapped(&mut self, source: Entity) -> Entity {
        self.0.id(source).and_then(|id| Entity::from_raw_u32(id.0)).unwrap_or(Entity::PLACEHOLDER)
    }

    fn set_mapped(&mut self, _: Entity, _: Entity) {}
}

impl EntityMapper for FromIds<'_> {
    fn get_mapped(&mut self, source: Entity) -> Entity {
        let entity = self.world.resource::<EntityRegistry>().entity(StateId(source.index_u32()));
        let living = entity.filter(|&entity| self.world.get_entity(entity).is_ok());
        // What was named and had gone stays gone.
        self.missed |= living.is_none() && source != Entity::PLACEHOLDER;
        living.unwrap_or(Entity::PLACEHOLDER)
    }

    fn set_mapped(&mut self, _: Entity, _: Entity) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::Simulation;

    #[test]
    fn what_a_scene_begins_with_has_the_numbers_from_0_on_and_nothing_else_has() {
        let mut simulation = Simulation::new();
        let world = &mut simulation.world;
        world.add_observer(|_: On<Insert<ChildOf>>| ());
        let scene = [(); 3].map(|()| world.spawn_empty().id());
        register_all(world);
        let numbered: Vec<_> =
            world.resource::<EntityRegistry>().iter().map(|(StateId(id), entity)| (id, entity)).collect();
        assert_eq!(numbered, [(0, scene[0]), (1, scene[1]), (2, scene[2])]);
    }
}
