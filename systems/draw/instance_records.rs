//! The records of drawn objects, one per slot, made of the objects' components by what reads them.
//!
//! The world keeps no copy: what it knows of a slot is what is in it and whether its record changed. The renderer reads
//! the records of those that changed, and all of them when it knows none, on their way to the GPU, which is the only
//! place where they lie together.

use super::list::PAGE_SLOTS;
use super::materials::MaterialTable;
use super::pieces::PieceOf;
use super::records::InstanceRecord;
use crate::assets::material::MaterialId;
use crate::ecs::changes::{LIGHT_ROWS, rows_per_task};
use crate::ecs::parallel::in_parallel;
use crate::ecs::tables::{DirtySlots, Records};
use crate::lights::selected::SelectedLights;
use crate::space::transform::GlobalTransform;
use bevy_ecs::entity::EntityIndex;
use bevy_ecs::prelude::*;
use glam::{Affine3A, Vec3A};
use std::ops::Range;
use std::sync::OnceLock;

/// Objects by slot, and the slots whose records changed.
#[derive(Clone, Debug, Default)]
pub struct InstanceSlots {
    /// By slot; `None` where there is none.
    pub objects: Vec<Option<EntityIndex>>,
    /// Slots whose records may differ from those of the frame before this one.
    pub dirty: DirtySlots,
}

impl InstanceSlots {
    /// Makes room for so many objects, and for pages that are not full.
    pub(crate) fn reserve(&mut self, objects: usize) {
        self.objects.reserve((objects + objects / PAGE_SLOTS as usize).saturating_sub(self.objects.len()));
    }

    /// Says what is in a slot from now on.
    pub(crate) fn put(&mut self, slot: u32, object: Option<EntityIndex>) {
        let index = slot as usize;
        if index >= self.objects.len() {
            self.objects.resize(index + 1, None);
        }
        self.objects[index] = object;
        self.dirty.mark(slot);
    }
}

/// The records of a world's drawn objects as its components are now.
pub struct InstanceRecords<'w> {
    world: &'w World,
    slots: &'w InstanceSlots,
    /// `None`: a world that never had such components has no objects. Made once: it looks at all archetypes.
    parts: OnceLock<Option<QueryState<Parts>>>,
}

impl<'w> InstanceRecords<'w> {
    /// Those of the objects in some slots. The world must know of [`PieceOf`].
    pub(crate) fn new(world: &'w World, slots: &'w InstanceSlots) -> Self {
        Self { world, slots, parts: OnceLock::new() }
    }

    /// The record in a slot, all zero where there is none.
    pub fn get(&self, slot: u32) -> InstanceRecord {
        let mut room = Vec::new();
        self.read(std::slice::from_ref(&(slot..slot + 1)), &mut room)[0]
    }

    /// The records of drawn objects, blended ones among them, in the order of their slots.
    pub fn drawn(&self) -> impl Iterator<Item = InstanceRecord> + use<> {
        let mut records = Vec::new();
        self.read(std::slice::from_ref(&(0..self.slot_count())), &mut records);
        records.into_iter().filter(|record| *record != InstanceRecord::default())
    }
}

/// Components that a record is made of.
type Parts = (Option<&'static PieceOf>, &'static GlobalTransform, &'static MaterialId, &'static SelectedLights);

impl Records for InstanceRecords<'_> {
    type Record = InstanceRecord;

    fn slot_count(&self) -> u32 {
        self.slots.objects.len() as u32
    }

    fn dirty(&self) -> &DirtySlots {
        &self.slots.dirty
    }

    fn read<'a>(&'a self, ranges: &[Range<u32>], room: &'a mut Vec<InstanceRecord>) -> &'a [InstanceRecord] {
        let slots: Vec<u32> = ranges.iter().cloned().flatten().collect();
        if room.len() < slots.len() {
            room.resize(slots.len(), InstanceRecord::default());
        }
        let records = &mut room[..slots.len()];
        let parts = self.parts.get_or_init(|| self.world.try_query());
        let Some((parts, materials)) = parts.as_ref().zip(self.world.get_resource::<MaterialTable>()) else {
            records.fill(InstanceRecord::default());
            return records;
        };
        let task = rows_per_task(slots.len(), LIGHT_ROWS / 4).max(1);
        in_parallel(records.chunks_mut(task).zip(slots.chunks(task)), |(records, slots)| {
            let parts = parts.query_manual(self.world);
            let entities = self.world.entities();
            let objects = slots.iter().map(|&slot| {
                let object = self.slots.objects[slot as usize];
                object.map_or(Entity::PLACEHOLDER, |object| entities.resolve_from_index(object))
            });
            for ((record, object), parts) in records.iter_mut().zip(objects.clone()).zip(parts.iter_many(objects)) {
                *record = parts.map_or_else(
                    |_| InstanceRecord::default(),
                    |(piece, place, &material, lights)| {
                        let named = piece.map_or(object, |piece| piece.0);
                        // Others may have come to the library after the frame.
                        InstanceRecord::new(named, &place.affine(), materials.known(material), lights)
                    },
                );
            }
        });
        records
    }
}

impl InstanceRecord {
    /// The record of an object.
    #[inline]
    pub fn new(entity: Entity, world_from_object: &Affine3A, material: MaterialId, selected: &SelectedLights) -> Self {
        let (m, t) = (world_from_object.matrix3.transpose(), world_from_object.translation);
        let row = |axis: Vec3A, translation: f32| [axis.x, axis.y, axis.z, translation];
        let SelectedLights { lights, residual, last_side_and_dropped, residual_unit, reaching_or_list } = *selected;
        Self {
            world_from_object: [row(m.x_axis, t.x), row(m.y_axis, t.y), row(m.z_axis, t.z)],
            lights,
            material: material.slot(),
            residual,
            last_side_and_dropped,
            residual_unit,
            reaching_or_list,
            entity: entity.index_u32(),
        }
    }
}
