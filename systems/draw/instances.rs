//! The instance table: one stable slot per drawn object.
//!
//! A slot is taken when an object first appears in a frame and kept while it lives and is drawn with the same mesh,
//! pipeline and class (`pages.rs` gives slots out). So an object that moves has its own record rewritten and nothing
//! else. What is in which slot, and which records changed, is in the [`DrawList`]; `instance_records.rs` makes the
//! records.

use super::batches::{self, BlendedChanges};
use super::incomplete::Incomplete;
use super::list::{BatchKey, DrawList, Transparent};
use super::materials::MaterialTable;
use super::pages::SlotPages;
use crate::assets::library::Library;
use crate::assets::material::{AlphaMode, MaterialId};
use crate::assets::mesh::MeshId;
use crate::assets::object_bounds::world_bounds;
use crate::ecs::changes::{LIGHT_ROWS, Since, all_rows, first_changed, rows_per_task};
use crate::ecs::entity_numbers::EntityNumbers;
use crate::ecs::parallel::in_parallel;
use crate::lights::selected::SelectedLights;
use crate::space::hidden::InheritedHidden;
use crate::space::transform::GlobalTransform;
use bevy_ecs::change_detection::{ContiguousRef, Tick};
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;
use std::ops::Range;

/// Slots of drawn objects, by batch.
#[derive(Resource, Debug, Default)]
pub struct InstanceTable {
    pub(crate) pages: SlotPages,
    /// Slot of each drawn object.
    slots: EntityNumbers,
    /// Given back since the last frame.
    freed: Vec<u32>,
    /// Changes of blended objects in this frame.
    blended: BlendedChanges,
    /// Objects met in this frame whose mesh the library does not have.
    meshless: Vec<Entity>,
    /// Rows that changed, and their slots; its contents are of no meaning between frames.
    found: Vec<(u32, u32)>,
}

impl InstanceTable {
    /// The slot of a drawn object, which lives; `None` before its first frame.
    pub fn slot(&self, object: Entity) -> Option<u32> {
        Some(self.slots.get(object)).filter(|&slot| slot != EntityNumbers::NONE)
    }

    /// Empties a slot: its record draws nothing from now on.
    fn release(&mut self, slot: u32, list: &mut DrawList) {
        if self.pages.key(slot).pipeline.alpha == AlphaMode::Blend {
            self.blended.insert(slot, None);
        }
        self.pages.release(slot);
        list.instances.put(slot, None);
    }

    /// The slot of an object of that batch: the one that it has, unless its batch is another now.
    fn settle(&mut self, object: Entity, key: BatchKey, list: &mut DrawList) -> u32 {
        if let Some(taken) = self.slot(object) {
            if self.pages.key(taken) == key {
                return taken;
            }
            self.release(taken, list);
        }
        let taken = self.pages.take(key);
        self.slots.set(object.index(), taken);
        list.instances.put(taken, Some(object.index()));
        taken
    }
}

/// Runs when an entity loses its mesh, by itself or with its life, is hidden or disabled.
pub(crate) fn free_slot(mut world: DeferredWorld, context: HookContext) {
    let Some(mut table) = world.get_resource_mut::<InstanceTable>() else { return };
    if let Some(slot) = table.slots.take(context.entity) {
        table.freed.push(slot);
    }
}

type DrawnObject<'a> =
    (Entity, Ref<'a, GlobalTransform>, Ref<'a, MeshId>, Ref<'a, MaterialId>, Ref<'a, SelectedLights>);

/// Gives slots to objects that are new or whose batch is another, and marks the records of those that moved or changed
/// their mesh, material or lights.
pub fn update_instances(
    drawn: Query<DrawnObject, Without<InheritedHidden>>,
    library: Res<Library>,
    materials: Res<MaterialTable>,
    mut table: ResMut<InstanceTable>,
    mut list: ResMut<DrawList>,
    mut incomplete: ResMut<Incomplete>,
) {
    let (table, list) = (table.bypass_change_detection(), list.bypass_change_detection());
    for slot in std::mem::take(&mut table.freed) {
        table.release(slot, list);
    }
    let tables = || drawn.contiguous_iter().into_iter().flatten().map(|(entities, ..)| entities);
    for (entities, transforms, meshes, chosen, selections) in drawn.contiguous_iter().into_iter().flatten() {
        let (transforms, placed) = ContiguousRef::split(transforms);
        let ((meshes, shaped), (chosen, covered)) = (ContiguousRef::split(meshes), ContiguousRef::split(chosen));
        let lit = ContiguousRef::split(selections).1;
        let columns = [Some(&placed), Some(&shaped), Some(&covered), Some(&lit)];
        let rows = (entities, transforms, meshes, chosen);
        let changed = first_changed(columns);
        if changed.is_some() {
            list.instances.reserve(tables().map(<[Entity]>::len).sum());
            table.slots.reserve(tables);
        }
        if materials.regroups() {
            table.settle_all(all_rows(&placed), Looking::AtMaterials, &library, &materials, list, rows);
        }
        if let Some(changed) = changed {
            table.settle_all(changed, Looking::AtObjects, &library, &materials, list, rows);
        }
    }
    incomplete.bypass_change_detection().wait_for_meshes(&mut table.meshless);
    batches::change_transparent(list, std::mem::take(&mut table.blended));
    list.objects = table.pages.used_slots();
}

/// Columns that decide where an object's record goes.
type Rows<'a> = (&'a [Entity], &'a [GlobalTransform], &'a [MeshId], &'a [MaterialId]);

/// Reason for which rows are looked at.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Looking {
    /// Their material's batch is another now, or their material is new or gone. The others are passed over.
    AtMaterials,
    /// They changed themselves.
    AtObjects,
}

/// Place of the first changed row, see [`first_changed`]: by transform, mesh, material and lights.
type Changed<'a> = (usize, Since, [&'a [Tick]; 4]);

/// The batch of an object; `None` where it draws nothing.
fn batch_of(
    library: &Library,
    materials: &MaterialTable,
    mesh: MeshId,
    material: MaterialId,
    transform: &GlobalTransform,
) -> Option<BatchKey> {
    let entry = library.mesh(mesh).filter(|entry| entry.is_drawn())?;
    let (class, mut pipeline) = materials.placed(library.known_material(material));
    pipeline.vertex_colors = !entry.mesh.colors.is_empty();
    pipeline.mirrored = is_mirrored(transform);
    Some(BatchKey { pipeline, class, mesh })
}

fn is_mirrored(transform: &GlobalTransform) -> bool {
    transform.affine().matrix3.determinant() < 0.0
}

impl InstanceTable {
    /// [`Self::settle_rows`] for a table, some rows at a time: of each, what is found is kept until it is settled.
    fn settle_all(
        &mut self,
        (first, since, columns): Changed,
        looking: Looking,
        library: &Library,
        materials: &MaterialTable,
        list: &mut DrawList,
        rows: Rows,
    ) {
        let end = rows.0.len();
        for start in (first..end).step_by(BLOCK) {
            let block = start..end.min(start + BLOCK);
            self.settle_rows((block, since, columns), looking, library, materials, list, rows);
        }
    }

    /// Gives rows of a table that changed the slots of their batches, and marks the records that are others now.
    fn settle_rows(
        &mut self,
        (block, since, columns): (Range<usize>, Since, [&[Tick]; 4]),
        looking: Looking,
        library: &Library,
        materials: &MaterialTable,
        list: &mut DrawList,
        (entities, transforms, meshes, chosen): Rows,
    ) {
        let [_, shaped, covered, _] = columns;
        // While mesh and material are what they were, only a transform that mirrors makes the batch another.
        let same_kind = looking == Looking::AtObjects && shaped.is_empty() && covered.is_empty();
        let batch = |row: usize| batch_of(library, materials, meshes[row], chosen[row], &transforms[row]);
        // What has a material that is not there follows the default.
        let is_regrouped = |material: MaterialId| {
            materials.is_regrouped(material) || materials.is_regrouped(library.known_material(material))
        };
        let passes = |row: usize| looking == Looking::AtMaterials && !is_regrouped(chosen[row]);
        let mut found = std::mem::take(&mut self.found);
        let table = &*self;
        let keeps = |row: usize, slot: &u32| {
            let key = table.pages.key(*slot);
            let stays = if same_kind {
                key.pipeline.mirrored == is_mirrored(&transforms[row])
            } else {
                batch(row) == Some(key)
            };
            stays && key.pipeline.alpha != AlphaMode::Blend
        };
        // Most keep what they have, which is found out in parallel. The list does not shrink: to grow it costs time.
        let (first, most) = (block.start, block.len());
        found.resize(most.max(found.len()), (0, UNSETTLED));
        let part = rows_per_task(most, LIGHT_ROWS);
        let mut counts = vec![0; most.div_ceil(part)];
        let parts = found[..most].chunks_mut(part).zip(&mut counts);
        in_parallel(parts.enumerate(), |(number, (found, count))| {
            let start = first + number * part;
            since.for_each(columns, start..start + found.len(), |row| {
                if !passes(row) {
                    let slot = table.slot(entities[row]).filter(|slot| keeps(row, slot)).unwrap_or(UNSETTLED);
                    found[*count] = (row as u32, slot);
                    *count += 1;
                }
            });
        });
        // The others one after another: the first of them gets the lowest slot.
        for (count, found) in counts.into_iter().zip(found.chunks(part)) {
            for &(row, slot) in &found[..count] {
                let row = row as usize;
                if slot != UNSETTLED {
                    list.instances.dirty.mark(slot);
                } else if let Some(key) = batch(row) {
                    let slot = self.settle(entities[row], key, list);
                    list.instances.dirty.mark(slot);
                    if key.pipeline.alpha == AlphaMode::Blend {
                        let bounds = world_bounds(library, meshes[row], &transforms[row]);
                        self.blended.insert(slot, bounds.map(|bounds| Transparent { slot, key, bounds }));
                    }
                } else {
                    if library.mesh(meshes[row]).is_none() {
                        self.meshless.push(entities[row]);
                    }
                    if let Some(taken) = self.slots.take(entities[row]) {
                        self.release(taken, list);
                    }
                }
            }
        }
        self.found = found;
    }
}

/// Rows of a table that are settled together: in tests few, so that there are several such blocks.
const BLOCK: usize = if cfg!(test) { 3 * LIGHT_ROWS } else { 1 << 17 };
/// In place of a slot that is yet to be found.
const UNSETTLED: u32 = u32::MAX;
