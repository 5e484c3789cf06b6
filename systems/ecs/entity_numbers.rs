//! A number for each of some entities: its index in a table of ours.
//!
//! A component would take 12 bytes, of which 8 say when it was added and when it changed, and nothing asks. A number
//! takes 4, for every entity up to the one with the largest index. It is found with one look in the order in which
//! entities were spawned. An index is used again when its entity is gone: the number has to be taken before that, in a
//! hook.

use bevy_ecs::entity::EntityIndex;
use bevy_ecs::prelude::*;

/// Numbers by [`EntityIndex`].
#[derive(Clone, Debug, Default)]
pub(crate) struct EntityNumbers(Vec<u32>);

impl EntityNumbers {
    /// Stands for none.
    pub const NONE: u32 = u32::MAX;

    /// The number of an entity, or [`Self::NONE`].
    #[inline(always)]
    pub fn get(&self, entity: Entity) -> u32 {
        self.of_index(entity.index())
    }

    /// The number of the entity with that index, or [`Self::NONE`].
    #[inline(always)]
    pub fn of_index(&self, entity: EntityIndex) -> u32 {
        self.0.get(entity.index() as usize).copied().unwrap_or(Self::NONE)
    }

    /// Gives an entity a number.
    #[inline]
    pub fn set(&mut self, entity: EntityIndex, number: u32) {
        let index = entity.index() as usize;
        if index >= self.0.len() {
            self.0.resize(index + 1, Self::NONE);
        }
        self.0[index] = number;
    }

    /// Makes room for the numbers of the entities of some tables at once, rather than little by little.
    pub fn reserve<'a, T: Iterator<Item = &'a [Entity]>>(&mut self, tables: impl Fn() -> T) {
        // Indices are different: one of so many is at least as large.
        if self.0.len() < tables().map(<[Entity]>::len).sum() {
            let needed = tables().flatten().map(|entity| entity.index_u32() as usize + 1).max().unwrap_or(0);
            self.0.reserve(needed.saturating_sub(self.0.len()));
        }
    }

    /// Takes the number of an entity away from it.
    pub fn take(&mut self, entity: Entity) -> Option<u32> {
        self.take_index(entity.index())
    }

    /// [`Self::take`] for the entity with that index.
    pub fn take_index(&mut self, entity: EntityIndex) -> Option<u32> {
        let number = self.0.get_mut(entity.index() as usize)?;
        Some(std::mem::replace(number, Self::NONE)).filter(|&number| number != Self::NONE)
    }
}
