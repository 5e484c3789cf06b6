//! The instance table: one stable slot per drawn object.
//!
//! A slot is taken when an object first appears in a frame and kept while it lives and is drawn with the same mesh,
//! pipeline and class (`pages.rs` gives slots out). So an object that moves rewrites its own record and nothing
//! else. The records are in the [`DrawList`].

use crate::batches;
use crate::bounds::WorldBounds;
use crate::changes::{LIGHT_ROWS, Since, all_rows, first_changed, moved, rows_per_task};
use crate::draw_list::{BatchKey, DrawList, InstanceRecord, Transparent};
use crate::hidden::InheritedHidden;
use crate::library::{AlphaMode, Library, MaterialId, MeshId};
use crate::materials::MaterialTable;
use crate::pages::SlotPages;
use crate::parallel::in_parallel;
use crate::pieces::PieceOf;
use crate::selected_lights::SelectedLights;
use bevy_ecs::change_detection::{ContiguousMut, ContiguousRef, Tick};
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;
use bevy_transform::components::GlobalTransform;
use glam::{Affine3A, Vec3A};

/// The slot of a drawn entity in the instance table. Derived.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug)]
#[component(clone_behavior = Ignore)]
pub struct InstanceSlot(u32);

impl InstanceSlot {
    const NONE: Self = Self(u32::MAX);

    /// The slot; `None` before the first frame.
    pub fn get(self) -> Option<u32> {
        (self != Self::NONE).then_some(self.0)
    }
}

impl Default for InstanceSlot {
    fn default() -> Self {
        Self::NONE
    }
}

/// Which slots are in use, and by what kind of object.
#[derive(Resource, Debug, Default)]
pub struct InstanceTable {
    pub(crate) pages: SlotPages,
    /// Given back since the last frame.
    freed: Vec<u32>,
    /// Rows of a table to be written, and their slots; what lies behind them is of no meaning, and stays for later.
    rows: Vec<u32>,
    slots: Vec<u32>,
}

impl InstanceTable {
    /// Empties a slot: its record draws nothing from now on.
    fn release(&mut self, slot: u32, list: &mut DrawList) {
        if self.pages.key(slot).pipeline.alpha == AlphaMode::Blend {
            batches::remove_transparent(list, slot);
        }
        self.pages.release(slot);
        list.instances.write(slot, InstanceRecord::default());
    }

    /// The slot of an object of that batch: the one that it has, unless its batch is another now.
    fn settle(&mut self, slot: &mut InstanceSlot, key: BatchKey, list: &mut DrawList) -> u32 {
        if let Some(taken) = slot.get() {
            if self.pages.key(taken) == key {
                return taken;
            }
            self.release(taken, list);
        }
        let taken = self.pages.take(key);
        *slot = InstanceSlot(taken);
        taken
    }
}

/// Runs when an entity loses its mesh, by itself or with its life.
pub(crate) fn free_slot(mut world: DeferredWorld, context: HookContext) {
    let Some(mut component) = world.get_mut::<InstanceSlot>(context.entity) else { return };
    let Some(slot) = std::mem::take(&mut *component).get() else { return };
    if let Some(mut table) = world.get_resource_mut::<InstanceTable>() {
        table.freed.push(slot);
    }
}

type Drawn<'a> = (
    Entity,
    Option<&'a PieceOf>,
    Ref<'a, GlobalTransform>,
    Ref<'a, MeshId>,
    Ref<'a, MaterialId>,
    Ref<'a, WorldBounds>,
    Ref<'a, SelectedLights>,
    &'a mut InstanceSlot,
);

/// Writes the records of objects that are new, moved, or changed their mesh, material or lights.
pub fn update_instances(
    mut drawn: Query<Drawn, Without<InheritedHidden>>,
    library: Res<Library>,
    materials: Res<MaterialTable>,
    mut table: ResMut<InstanceTable>,
    mut list: ResMut<DrawList>,
) {
    let (table, list) = (table.bypass_change_detection(), list.bypass_change_detection());
    for slot in std::mem::take(&mut table.freed) {
        table.release(slot, list);
    }
    for (entities, pieces, transforms, meshes, chosen, bounds, selections, slots) in
        drawn.contiguous_iter_mut().into_iter().flatten()
    {
        let (transforms, placed) = ContiguousRef::split(transforms);
        let ((meshes, shaped), (chosen, covered)) = (ContiguousRef::split(meshes), ContiguousRef::split(chosen));
        let ((bounds, bounded), (selections, lit)) = (ContiguousRef::split(bounds), ContiguousRef::split(selections));
        let slots = ContiguousMut::bypass_change_detection_split(slots).0;
        let columns = [moved(&placed, &bounded), Some(&shaped), Some(&covered), Some(&lit)];
        let changed = if materials.regroup { Some(all_rows(&placed)) } else { first_changed(columns) };
        let Some(changed) = changed else { continue };
        // First what decides the slots, then the records, which are many bytes.
        let placing = (transforms, meshes, chosen, bounds, slots);
        let count = table.slots_of_rows(changed, &library, &materials, list, placing);
        list.instances.write_all(&table.slots[..count], |index| {
            let row = table.rows[index] as usize;
            let object = pieces.map_or(entities[row], |pieces| pieces[row].0);
            let material = known(chosen[row], &library);
            InstanceRecord::new(object, &transforms[row].affine(), material, &selections[row])
        });
    }
    list.objects = table.pages.used_slots();
}

impl InstanceRecord {
    /// The record of an object.
    #[inline]
    pub fn new(entity: Entity, world_from_object: &Affine3A, material: MaterialId, selected: &SelectedLights) -> Self {
        let (m, t) = (world_from_object.matrix3.transpose(), world_from_object.translation);
        let row = |axis: Vec3A, translation: f32| [axis.x, axis.y, axis.z, translation];
        let SelectedLights { lights, remainder, last_side_and_dropped, remainder_unit, reaching } = *selected;
        Self {
            world_from_object: [row(m.x_axis, t.x), row(m.y_axis, t.y), row(m.z_axis, t.z)],
            lights,
            material: material.0,
            remainder,
            last_side_and_dropped,
            remainder_unit,
            reaching,
            entity: entity.index_u32(),
        }
    }
}

/// The material, or the default where the library has no such.
fn known(material: MaterialId, library: &Library) -> MaterialId {
    if library.material(material).is_some() { material } else { MaterialId::DEFAULT }
}

/// Columns that decide where an object's record goes.
type Placing<'a> = (&'a [GlobalTransform], &'a [MeshId], &'a [MaterialId], &'a [WorldBounds], &'a mut [InstanceSlot]);

/// Where to look for rows that changed, see [`first_changed`]: by transform, mesh, material and lights.
type Changed<'a> = (usize, Since, [&'a [Tick]; 4]);

/// The batch of an object; `None` where it draws nothing.
fn batch_of(
    library: &Library,
    materials: &MaterialTable,
    mesh: MeshId,
    material: MaterialId,
    transform: &GlobalTransform,
) -> Option<BatchKey> {
    let entry = library.mesh(mesh).filter(|entry| !entry.mesh.indices.is_empty())?;
    let (class, mut pipeline) = materials.placed(known(material, library));
    pipeline.vertex_colors = !entry.mesh.colors.is_empty();
    pipeline.mirrored = is_mirrored(transform);
    Some(BatchKey { pipeline, class, mesh })
}

fn is_mirrored(transform: &GlobalTransform) -> bool {
    transform.affine().matrix3.determinant() < 0.0
}

impl InstanceTable {
    /// Finds the rows of a table that changed, into `rows`, and their slots, into `slots`, but for those that draw
    /// nothing; returns how many there are.
    fn slots_of_rows(
        &mut self,
        (first, since, columns): Changed,
        library: &Library,
        materials: &MaterialTable,
        list: &mut DrawList,
        (transforms, meshes, chosen, bounds, slots): Placing,
    ) -> usize {
        let [_, shaped, covered, _] = columns;
        // While mesh and material are what they were, only a transform that mirrors makes the batch another.
        let same_kind = !materials.regroup && shaped.is_empty() && covered.is_empty();
        let batch = |row: usize| batch_of(library, materials, meshes[row], chosen[row], &transforms[row]);
        let (pages, held) = (&self.pages, &*slots);
        let keeps = |row: usize, slot: &u32| {
            let key = pages.key(*slot);
            let stays = if same_kind {
                key.pipeline.mirrored == is_mirrored(&transforms[row])
            } else {
                batch(row) == Some(key)
            };
            stays && key.pipeline.alpha != AlphaMode::Blend
        };
        // Most keep what they have, which is found out in parallel. The lists do not shrink: to grow them costs time.
        let most = held.len() - first;
        let (mut rows, mut found) = (std::mem::take(&mut self.rows), std::mem::take(&mut self.slots));
        rows.resize(most.max(rows.len()), 0);
        found.resize(most.max(found.len()), UNSETTLED);
        let part = rows_per_task(most, LIGHT_ROWS);
        let mut counts = vec![(0, false); most.div_ceil(part)];
        let parts = rows[..most].chunks_mut(part).zip(found.chunks_mut(part)).zip(&mut counts);
        in_parallel(parts.enumerate(), |(number, ((rows, found), (count, unsettled)))| {
            let start = first + number * part;
            since.for_each(columns, start..start + rows.len(), |row| {
                let slot = held[row].get().filter(|slot| keeps(row, slot)).unwrap_or(UNSETTLED);
                (rows[*count], found[*count]) = (row as u32, slot);
                *count += 1;
                *unsettled |= slot == UNSETTLED;
            });
        });
        // The others one after another: the first of them gets the lowest slot.
        let mut settled = 0;
        for ((count, unsettled), start) in counts.into_iter().zip((0..).step_by(part)) {
            if !unsettled {
                if settled < start {
                    rows.copy_within(start..start + count, settled);
                    found.copy_within(start..start + count, settled);
                }
                settled += count;
                continue;
            }
            for index in start..start + count {
                let row = rows[index] as usize;
                let mut slot = found[index];
                if slot == UNSETTLED {
                    let Some(key) = batch(row) else {
                        if let Some(taken) = std::mem::take(&mut slots[row]).get() {
                            self.release(taken, list);
                        }
                        continue;
                    };
                    slot = self.settle(&mut slots[row], key, list);
                    if key.pipeline.alpha == AlphaMode::Blend {
                        batches::put_transparent(list, Transparent { slot, key, bounds: bounds[row].0 });
                    }
                }
                (rows[settled], found[settled]) = (rows[index], slot);
                settled += 1;
            }
        }
        (self.rows, self.slots) = (rows, found);
        settled
    }
}

/// In place of a slot that is yet to be found.
const UNSETTLED: u32 = u32::MAX;
