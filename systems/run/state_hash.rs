//! One number for all of the simulation's state: 128 bits that are equal after each step of two runs as long as the
//! runs are equal, whatever the number of threads, in a window or without one, continued from a snapshot or not.
//!
//! Each value is hashed by itself, with its kind and the id of its entity, and the hashes are added. Sums do not depend
//! on an order, so neither tables nor entities need one, and parts of a table are added up in parallel. Values are
//! hashed as their bytes: 0 and −0 are two numbers, and a NaN is the NaN that it is.

use super::registry::EntityRegistry;
use super::state::{StateComponent, StateList, encode_onto, with_ids};
use crate::ecs::parallel::in_parallel;
use bevy_ecs::prelude::*;
use bevy_ecs::query::ArchetypeFilter;
use std::fmt;
use std::sync::Mutex;
use xxhash_rust::xxh3::{xxh3_64, xxh3_128};

/// A hash of the whole state.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, serde::Serialize, serde::Deserialize)]
pub struct StateHash(pub u128);

impl fmt::Display for StateHash {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{:032x}", self.0)
    }
}

/// A sum of hashes, modulo 2^128.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Sum(u128);

impl std::ops::AddAssign for Sum {
    fn add_assign(&mut self, other: Self) {
        self.0 = self.0.wrapping_add(other.0);
    }
}

impl std::iter::Sum for Sum {
    fn sum<I: Iterator<Item = Self>>(parts: I) -> Self {
        parts.fold(Self::default(), |mut sum, part| {
            sum += part;
            sum
        })
    }
}

/// The hash of a world's state as it is now. Of entities, those count that are registered
/// ([`crate::run::registry::register_all`]).
pub fn hash(world: &mut World) -> StateHash {
    let sum: Sum = world
        .resource_scope(|world, mut list: Mut<StateList>| list.kinds.iter_mut().map(|kind| kind.hash(world)).sum());
    StateHash(xxh3_128(&sum.0.to_le_bytes()))
}

/// The hash of a value that is there once.
pub fn of_bytes(kind: &str, value: &[u8]) -> Sum {
    let mut bytes = xxh3_64(kind.as_bytes()).to_le_bytes().to_vec();
    bytes.extend(value);
    Sum(xxh3_128(&bytes))
}

/// Values per task.
const TOGETHER: usize = 1 << 11;

/// The sum of the hashes of a component's values.
pub(crate) fn of_component<T: StateComponent, F: ArchetypeFilter>(
    kind: &str,
    query: &mut QueryState<(Entity, &'static T), F>,
    world: &World,
) -> Sum {
    let registry = world.resource::<EntityRegistry>();
    let kind = xxh3_64(kind.as_bytes());
    let Ok(tables) = query.contiguous_iter(world) else {
        let mut one = Hasher { kind, registry, bytes: Vec::new() };
        return query.iter(world).map(|(entity, value)| one.value(entity, value)).sum();
    };
    let parts: Vec<(&[Entity], &[T])> =
        tables.flat_map(|(entities, values)| entities.chunks(TOGETHER).zip(values.chunks(TOGETHER))).collect();
    let sum = Mutex::new(Sum::default());
    in_parallel(parts.into_iter(), |(entities, values)| {
        let mut hasher = Hasher { kind, registry, bytes: Vec::new() };
        let part = entities.iter().zip(values).map(|(&entity, value)| hasher.value(entity, value)).sum();
        *sum.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) += part;
    });
    sum.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner())
}

struct Hasher<'a> {
    kind: u64,
    registry: &'a EntityRegistry,
    /// Kept from value to value, lest it be allocated for each.
    bytes: Vec<u8>,
}

impl Hasher<'_> {
    fn value<T: StateComponent>(&mut self, entity: Entity, value: &T) -> Sum {
        let Some(id) = self.registry.id(entity) else { return Sum::default() };
        self.bytes.clear();
        self.bytes.extend(self.kind.to_le_bytes());
        self.bytes.extend(id.0.to_le_bytes());
        encode_onto(&with_ids(value, self.registry), &mut self.bytes);
        Sum(xxh3_128(&self.bytes))
    }
}
