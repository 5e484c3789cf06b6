//! From the indices of entities, which the GPU writes, to the numbers and the class that outputs have for them.

use bevy_ecs::entity::EntityIndex;
use bevy_ecs::prelude::*;
use systems::run::registry::{EntityRegistry, StateId};
use systems::sensors::{Class, Classes, Instance};

/// Numbers from here on are of entities that the registry does not know: 2³¹ and the entity's index, which is a place
/// in one world's memory.
const UNREGISTERED: u32 = 1 << 31;

/// Most parents above an entity that are asked: they may hang in a ring.
const MOST_ABOVE: usize = 1024;

/// Labels of a drawn entity in outputs.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Labels {
    /// Number of the entity: its [`StateId`] plus 1.
    pub part: u32,
    /// Number of the thing that it belongs to: of the nearest entity above it, or itself, with [`Instance`]; else its
    /// own.
    pub instance: u32,
    /// Its semantic class; 0 for none.
    pub class: u8,
    /// True where instances of its class are counted.
    pub is_thing: bool,
    /// The entity of the thing that it belongs to, if there are boxes of that: it has [`Instance`], or a class whose
    /// instances are counted.
    pub thing: Option<Entity>,
}

/// The labels of entities, found when they are asked for; each once in a capture.
#[derive(Debug, Default)]
pub struct LabelTable {
    /// By entity index: the capture in which it was found, and what.
    found: Vec<(u64, Labels)>,
    capture: u64,
}

impl LabelTable {
    /// Forgets what it has found: entities may be others.
    pub fn begin(&mut self) {
        self.capture += 1;
    }

    /// Labels of a picture's pixels, by their entities' indices plus 1.
    pub fn runs(&mut self, world: &World, ids: &[u32]) -> LabelRuns {
        let runs = ids.chunk_by(|a, b| a == b);
        LabelRuns(runs.map(|run| (self.labels(world, run[0]), run.len())).collect())
    }

    /// The labels of a drawn entity, by its index plus 1; none of 0.
    pub fn labels(&mut self, world: &World, id: u32) -> Labels {
        let Some(index) = id.checked_sub(1) else { return Labels::default() };
        let place = index as usize;
        if let Some((capture, labels)) = self.found.get(place)
            && *capture == self.capture
        {
            return *labels;
        }
        let labels = labels_of(world, index);
        if place >= self.found.len() {
            self.found.resize(place + 1, (0, Labels::default()));
        }
        self.found[place] = (self.capture, labels);
        labels
    }
}

/// Labels of a picture's pixels, each with a number of pixels one after another.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct LabelRuns(pub Vec<(Labels, usize)>);

impl LabelRuns {
    /// A value for each pixel.
    pub fn each<T: Clone>(&self, value: impl Fn(&Labels) -> T) -> Vec<T> {
        let mut values = Vec::with_capacity(self.0.iter().map(|(_, pixels)| pixels).sum());
        for (labels, pixels) in &self.0 {
            values.extend(std::iter::repeat_n(value(labels), *pixels));
        }
        values
    }
}

/// An entity and what it is below, upward.
pub(crate) fn own_and_above(world: &World, entity: Entity) -> impl Iterator<Item = Entity> + '_ {
    let parent = |&entity: &Entity| world.get::<ChildOf>(entity).map(ChildOf::parent);
    std::iter::successors(Some(entity), parent).take(MOST_ABOVE)
}

/// The thing that an entity is, or is part of.
pub(crate) fn thing_of(world: &World, entity: Entity) -> Option<Entity> {
    own_and_above(world, entity).find(|&above| world.get::<Instance>(above).is_some())
}

/// The thing that a sensor is on.
pub(crate) fn mounted_on(world: &World, sensor: Entity) -> Option<Entity> {
    world.get::<ChildOf>(sensor).and_then(|on| thing_of(world, on.parent()))
}

/// The number of an entity in outputs.
pub(crate) fn number(world: &World, entity: Entity) -> u32 {
    let id = world.get_resource::<EntityRegistry>().and_then(|registry| registry.id(entity));
    id.map_or(UNREGISTERED | entity.index_u32(), |StateId(id)| id + 1)
}

/// The entity that outputs have a number for, while it lives; `None` for 0.
pub fn entity_of_number(world: &World, number: u32) -> Option<Entity> {
    let entity = if number >= UNREGISTERED {
        world.entities().resolve_from_index(EntityIndex::from_raw_u32(number - UNREGISTERED)?)
    } else {
        world.get_resource::<EntityRegistry>()?.entity(StateId(number.checked_sub(1)?))?
    };
    world.get_entity(entity).is_ok().then_some(entity)
}

/// Found anew.
fn labels_of(world: &World, index: u32) -> Labels {
    let Some(index) = EntityIndex::from_raw_u32(index) else { return Labels::default() };
    let entity = world.entities().resolve_from_index(index);
    let instance = own_and_above(world, entity).find(|&above| world.get::<Instance>(above).is_some());
    let class = own_and_above(world, entity).find_map(|above| world.get::<Class>(above).copied());
    let class = class.unwrap_or_default();
    let info = world.get_resource::<Classes>().and_then(|classes| classes.get(class));
    let is_thing = info.is_some_and(|info| info.is_thing);
    Labels {
        part: number(world, entity),
        instance: number(world, instance.unwrap_or(entity)),
        class: class.0,
        is_thing,
        thing: instance.or(is_thing.then_some(entity)),
    }
}
