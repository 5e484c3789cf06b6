//! State of the simulation: one list, which hashing ([`crate::run::state_hash`]) and saving ([`crate::run::snapshot`])
//! both go by, so that nothing is in one and missing in the other.
//!
//! State is what steps change or read, and nothing that follows from it: not `GlobalTransform`, bounds, tangents,
//! selections of lights, slots; not how the world is looked at (cameras of the window, exposure, the clock's speed). A
//! component or resource becomes state by deriving serde's traits and a line in [`StateList::standard`]; one that a
//! program of yours adds, by [`StateList::add_component`] before the first step.

use super::inputs::MOST_SHOWN;
use super::registry::{EntityRegistry, FromIds, StateId, ToIds};
use super::state_hash::{self, Sum};
use crate::assets::mesh::{MeshId, MeshVariants};
use crate::cells::doors::{Door, Portal};
use crate::describe::check::check;
use crate::ecs::clock::{Clock, Seed};
use crate::lights::components::Light;
use crate::space::hidden::Hidden;
use crate::space::interpolation::Moved;
use crate::space::motion::Spin;
use crate::space::origin::Origin;
use crate::space::transform::Transform;
use crate::weather::timeline::WeatherTimeline;
use bevy_ecs::component::Mutable;
use bevy_ecs::prelude::*;
use bevy_ecs::query::ArchetypeFilter;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::marker::PhantomData;

/// Reason for which a saved state is refused.
#[derive(Debug, thiserror::Error)]
#[error("{kind}: {message}")]
pub struct StateError {
    /// The kind of state.
    pub kind: String,
    /// Expectation that was not met.
    pub message: String,
}

impl StateError {
    pub(crate) fn new(kind: &str, message: impl std::fmt::Display) -> Self {
        Self { kind: kind.to_owned(), message: message.to_string() }
    }
}

/// A kind of state: a component of all entities that have it, or a resource.
pub trait StateKind: Send + Sync + 'static {
    /// Its name in files.
    fn name(&self) -> &'static str;

    /// Tells if it may be missing in files, which means that nothing has it. So what came later leaves files without it
    /// as they were.
    fn is_optional(&self) -> bool {
        false
    }

    /// The sum of the hashes of all its values; its order does not matter.
    fn hash(&mut self, world: &mut World) -> Sum;

    /// All its values.
    fn save(&mut self, world: &mut World) -> Vec<u8>;

    /// Makes its values those of [`Self::save`] and no others.
    ///
    /// # Errors
    /// The bytes are none of `save`'s; the world may be changed in part.
    fn restore(&mut self, world: &mut World, bytes: &[u8]) -> Result<(), StateError>;
}

/// Whose place is state: not that of parts which frames turn.
#[cfg(feature = "vehicles")]
type Placed = Without<crate::vehicles::parts::FramePart>;
#[cfg(not(feature = "vehicles"))]
type Placed = ();

/// Everything that is state.
#[derive(Resource)]
pub struct StateList {
    pub(crate) kinds: Vec<Box<dyn StateKind>>,
}

impl StateList {
    /// State that every simulation has.
    pub fn standard() -> Self {
        let mut list = Self { kinds: Vec::new() };
        // Parents first: where things hang decides what is below a hidden entity.
        let hangs = |parent: &ChildOf| parent.parent() != Entity::PLACEHOLDER;
        list.add(Component::<ChildOf, ()>::checked("parent", hangs));
        list.add(Component::<Transform, Placed>::checked("transform", Transform::is_valid));
        list.add(Component::<Light>::checked("light", Light::is_valid));
        list.add(Component::<Spin>::checked("spin", Spin::is_valid));
        list.add(Component::<Portal>::checked("portal", |portal| check(portal).is_ok()));
        list.add(Component::<Door>::checked("door", Door::is_valid));
        list.add_component::<Hidden>("hidden");
        list.add(Component::<Moved>::new("moved").optional());
        let has_shown = |variants: &MeshVariants| variants.shown < variants.meshes.len().max(1);
        list.add_checked_component::<MeshVariants>("figure", has_shown);
        list.add(Component::<MeshId, With<MeshVariants>>::new("shape"));
        list.add(ResourceKind::<Clock> { take_over: Clock::take_over, ..ResourceKind::new("clock") });
        list.add_resource::<Seed>("seed");
        list.add(ResourceKind::<Origin> { take_over: Origin::take_over, ..ResourceKind::new("origin") });
        list.add(OptionalResource::<WeatherTimeline> { name: "weather", is_valid: WeatherTimeline::is_valid });
        #[cfg(feature = "vehicles")]
        list.add_vehicles();
        list
    }

    /// A component, all of whose values are state, and make sense. Entities within it are told apart by
    /// `Component::map_entities`.
    pub fn add_component<T: StateComponent>(&mut self, name: &'static str) {
        self.add(Component::<T, ()>::new(name));
    }

    /// Adds a component like [`Self::add_component`], for values of which not all make sense: a snapshot with one that
    /// is not sound is refused.
    pub fn add_checked_component<T: StateComponent>(&mut self, name: &'static str, is_valid: fn(&T) -> bool) {
        self.add(Component::<T, ()>::checked(name, is_valid));
    }

    /// A resource that is always there.
    pub fn add_resource<R: StateResource>(&mut self, name: &'static str) {
        self.add(ResourceKind::<R>::new(name));
    }

    /// The names of the kinds of state that every file has, in the order in which they were added.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.kinds.iter().filter(|kind| !kind.is_optional()).map(|kind| kind.name())
    }

    fn knows(&self, name: &str) -> bool {
        self.kinds.iter().any(|kind| kind.name() == name)
    }

    /// Difference of a file that holds kinds of state of these names, in any order; `None`: it has those of this list.
    pub fn difference<'a>(&self, names: impl Iterator<Item = &'a str> + Clone) -> Option<String> {
        if let Some(other) = names.clone().find(|name| !self.knows(name)) {
            let other: String = other.chars().take(MOST_SHOWN).collect();
            return Some(format!("made by a program with the state {other:?}, which this program does not have"));
        }
        for kind in &self.kinds {
            let known = kind.name();
            match names.clone().filter(|name| *name == known).count() {
                0 if kind.is_optional() => {}
                0 => return Some(format!("made by a program without the state {known:?}, which this program has")),
                1 => {}
                _ => return Some(format!("duplicate state {known:?}")),
            }
        }
        None
    }

    /// State that neither of the two fits.
    ///
    /// # Panics
    /// If there is a kind of that name: its values would be taken for the other's.
    pub fn add(&mut self, kind: impl StateKind) {
        assert!(!self.knows(kind.name()), "{} is state already", kind.name());
        self.kinds.push(Box::new(kind));
    }
}

/// Bounds of a component that is state.
pub trait StateComponent: bevy_ecs::component::Component + Clone + Serialize + DeserializeOwned {}
impl<T: bevy_ecs::component::Component + Clone + Serialize + DeserializeOwned> StateComponent for T {}

/// Bounds of a resource that is state.
pub trait StateResource:
    Resource + bevy_ecs::component::Component<Mutability = Mutable> + Serialize + DeserializeOwned
{
}
impl<R: Resource + bevy_ecs::component::Component<Mutability = Mutable> + Serialize + DeserializeOwned> StateResource
    for R
{
}

/// A component as state, of the entities that pass a filter.
pub(super) struct Component<T: StateComponent, F: ArchetypeFilter + 'static = ()> {
    name: &'static str,
    is_optional: bool,
    /// Tells if a value from a file can be what a world holds.
    is_valid: fn(&T) -> bool,
    /// Kept from step to step.
    query: Option<QueryState<(Entity, &'static T), F>>,
}

impl<T: StateComponent, F: ArchetypeFilter + 'static> Component<T, F> {
    pub fn new(name: &'static str) -> Self {
        Self::checked(name, |_| true)
    }

    pub fn checked(name: &'static str, is_valid: fn(&T) -> bool) -> Self {
        Self { name, is_optional: false, is_valid, query: None }
    }

    /// The same, missing in files where no entity has it.
    pub fn optional(self) -> Self {
        Self { is_optional: true, ..self }
    }

    /// The values of all registered entities by id, entities within them as ids.
    fn values(&mut self, world: &mut World) -> Vec<(u32, T)> {
        let query = self.query.get_or_insert_with(|| world.query_filtered());
        let registry = world.resource::<EntityRegistry>();
        let value = |(entity, value): (Entity, &T)| Some((registry.id(entity)?.0, with_ids(value, registry)));
        let mut values: Vec<(u32, T)> = query.iter(world).filter_map(value).collect();
        values.sort_unstable_by_key(|(id, _)| *id);
        values
    }
}

/// A value with ids for entities.
pub(crate) fn with_ids<T: StateComponent>(value: &T, registry: &EntityRegistry) -> T {
    let mut value = value.clone();
    T::map_entities(&mut value, &mut ToIds(registry));
    value
}

impl<T: StateComponent, F: ArchetypeFilter + 'static> StateKind for Component<T, F> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn is_optional(&self) -> bool {
        self.is_optional
    }

    fn hash(&mut self, world: &mut World) -> Sum {
        let query = self.query.get_or_insert_with(|| world.query_filtered());
        state_hash::of_component(self.name, query, world)
    }

    fn save(&mut self, world: &mut World) -> Vec<u8> {
        encode(&self.values(world))
    }

    fn restore(&mut self, world: &mut World, bytes: &[u8]) -> Result<(), StateError> {
        let wanted: Vec<(u32, T)> = decode(self.name, bytes)?;
        let mut present = self.values(world).into_iter().map(|(id, value)| (id, encode(&value))).peekable();
        let mut remove = Vec::new();
        let mut insert = Vec::new();
        let mut last = None;
        for (id, value) in wanted {
            let invalid = || Err(StateError::new(self.name, format_args!("entity {id}: invalid value")));
            if last.replace(id).is_some_and(|last| last >= id) {
                return invalid();
            }
            while let Some((gone, _)) = present.next_if(|(present, _)| *present < id) {
                remove.push(gone);
            }
            // What is as it was is left alone: nothing has to follow it.
            if present.next_if(|(present, _)| *present == id).is_none_or(|(_, bytes)| bytes != encode(&value)) {
                if !(self.is_valid)(&value) {
                    return invalid();
                }
                insert.push((id, value));
            }
        }
        remove.extend(present.map(|(id, _)| id));
        let find = |world: &World, id| world.resource::<EntityRegistry>().entity(StateId(id));
        for id in remove {
            let entity = find(world, id).and_then(|entity| world.get_entity_mut(entity).ok());
            entity.into_iter().for_each(|mut entity| _ = entity.remove::<T>());
        }
        for (id, mut value) in insert {
            let mut mapper = FromIds { world, missed: false };
            T::map_entities(&mut value, &mut mapper);
            let known = find(world, id).filter(|_| !mapper.missed);
            let Some(mut entity) = known.and_then(|entity| world.get_entity_mut(entity).ok()) else {
                return Err(StateError::new(
                    self.name,
                    format_args!("entity {id}, or an entity it refers to, does not exist"),
                ));
            };
            entity.insert(value);
        }
        Ok(())
    }
}

/// A resource as state.
struct ResourceKind<R: StateResource> {
    name: &'static str,
    /// Gives the world's resource the saved values, or says what was expected.
    take_over: fn(&mut R, R) -> Result<(), &'static str>,
    resource: PhantomData<R>,
}

impl<R: StateResource> ResourceKind<R> {
    fn new(name: &'static str) -> Self {
        Self { name, take_over: Self::replace, resource: PhantomData }
    }

    fn replace(own: &mut R, saved: R) -> Result<(), &'static str> {
        *own = saved;
        Ok(())
    }
}

impl<R: StateResource> StateKind for ResourceKind<R> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn hash(&mut self, world: &mut World) -> Sum {
        state_hash::of_bytes(self.name, &self.save(world))
    }

    fn save(&mut self, world: &mut World) -> Vec<u8> {
        encode(world.resource::<R>())
    }

    fn restore(&mut self, world: &mut World, bytes: &[u8]) -> Result<(), StateError> {
        let saved = decode(self.name, bytes)?;
        (self.take_over)(&mut world.resource_mut::<R>(), saved).map_err(|message| StateError::new(self.name, message))
    }
}

/// A resource as state that files and hashes leave out while it is as it is by default.
struct OptionalResource<R: StateResource + Default + PartialEq> {
    name: &'static str,
    /// Tells if a value from a file can be what a world holds.
    is_valid: fn(&R) -> bool,
}

impl<R: StateResource + Default + PartialEq> StateKind for OptionalResource<R> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn is_optional(&self) -> bool {
        true
    }

    fn hash(&mut self, world: &mut World) -> Sum {
        let own = world.resource::<R>();
        if *own == R::default() { Sum::default() } else { state_hash::of_bytes(self.name, &encode(own)) }
    }

    fn save(&mut self, world: &mut World) -> Vec<u8> {
        let own = world.resource::<R>();
        if *own == R::default() { NOTHING.into() } else { encode(own) }
    }

    fn restore(&mut self, world: &mut World, bytes: &[u8]) -> Result<(), StateError> {
        let saved = if bytes == NOTHING { R::default() } else { decode(self.name, bytes)? };
        if !(self.is_valid)(&saved) {
            return Err(StateError::new(self.name, "invalid value"));
        }
        *world.resource_mut::<R>() = saved;
        Ok(())
    }
}

/// A kind of state that nothing has: a list without entries.
pub(super) const NOTHING: [u8; 1] = [0];

/// Encodes a value as bytes. Each type that is state has a form in bytes.
pub(crate) fn encode<T: Serialize + ?Sized>(value: &T) -> Vec<u8> {
    let mut bytes = Vec::new();
    encode_onto(value, &mut bytes);
    bytes
}

/// Appends the bytes of a value to others.
pub(crate) fn encode_onto<T: Serialize + ?Sized>(value: &T, bytes: &mut Vec<u8>) {
    // Fails for sequences of unknown length only, which no vector, map or struct is.
    let written = postcard::to_extend(value, std::mem::take(bytes));
    debug_assert!(written.is_ok(), "no form in bytes");
    *bytes = written.unwrap_or_default();
}

pub(crate) fn decode<T: DeserializeOwned>(kind: &str, bytes: &[u8]) -> Result<T, StateError> {
    match postcard::take_from_bytes(bytes) {
        Ok((value, [])) => Ok(value),
        Ok(_) => Err(StateError::new(kind, "unexpected data after the end")),
        Err(error) => Err(StateError::new(kind, error)),
    }
}
