//! The instance table: one stable slot per drawn object.
//!
//! A slot is taken when an object first appears in a frame and kept while it lives and is drawn with the same mesh,
//! pipeline and class (`pages.rs` gives slots out). So an object that moves rewrites its own record and nothing
//! else. The records are in the [`DrawList`].

use crate::batches;
use crate::bounds::WorldBounds;
use crate::changes::{LIGHT_ROWS, for_each_changed_in, moved, rows_per_task};
use crate::draw_list::{BatchKey, DrawList, InstanceRecord, Transparent};
use crate::hidden::InheritedHidden;
use crate::library::{AlphaMode, Library, MaterialId, MeshId};
use crate::lights::Selection;
use crate::materials::MaterialTable;
use crate::pages::SlotPages;
use crate::parallel::in_parallel;
use crate::pieces::PieceOf;
use bevy_ecs::change_detection::{ContiguousMut, ContiguousRef};
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;
use bevy_transform::components::GlobalTransform;

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
    /// Rows of a table to be written, and their slots.
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
    Ref<'a, Selection>,
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
        table.rows.clear();
        if materials.regroup {
            table.rows.extend(0..slots.len() as u32);
        } else {
            let columns = [moved(&placed, &bounded), Some(&shaped), Some(&covered), Some(&lit)];
            for_each_changed_in(columns, |row| table.rows.push(row as u32));
        }
        // First what decides the slots, then the records, which are many bytes.
        table.slots_of_rows(&library, &materials, list, (transforms, meshes, chosen, bounds, slots));
        list.instances.write_all(&table.slots, |index| {
            let row = table.rows[index] as usize;
            let object = pieces.map_or(entities[row], |pieces| pieces[row].0);
            let material = known(chosen[row], &library);
            InstanceRecord::new(object, &transforms[row].affine(), material, &selections[row])
        });
    }
    list.objects = table.pages.used_slots();
}

/// The material, or the default where the library has no such.
fn known(material: MaterialId, library: &Library) -> MaterialId {
    if library.material(material).is_some() { material } else { MaterialId::DEFAULT }
}

/// Columns that decide where an object's record goes.
type Placing<'a> = (&'a [GlobalTransform], &'a [MeshId], &'a [MaterialId], &'a [WorldBounds], &'a mut [InstanceSlot]);

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
    pipeline.mirrored = transform.affine().matrix3.determinant() < 0.0;
    Some(BatchKey { pipeline, class, mesh })
}

impl InstanceTable {
    /// Finds the slots of the rows in `rows`, into `slots`; drops the rows that draw nothing.
    fn slots_of_rows(
        &mut self,
        library: &Library,
        materials: &MaterialTable,
        list: &mut DrawList,
        (transforms, meshes, chosen, bounds, slots): Placing,
    ) {
        let batch = |row: usize| batch_of(library, materials, meshes[row], chosen[row], &transforms[row]);
        // Most keep what they have, which is found out in parallel.
        let (mut rows, mut found) = (std::mem::take(&mut self.rows), std::mem::take(&mut self.slots));
        found.resize(rows.len(), UNSETTLED);
        let part = rows_per_task(rows.len(), LIGHT_ROWS);
        let (pages, held) = (&self.pages, &*slots);
        in_parallel(rows.chunks(part).zip(found.chunks_mut(part)), |(rows, found)| {
            for (&row, found) in rows.iter().zip(found) {
                let (key, slot) = (batch(row as usize), held[row as usize].get());
                let keeps = |slot: &u32| {
                    key.is_some_and(|key| key.pipeline.alpha != AlphaMode::Blend && pages.key(*slot) == key)
                };
                *found = slot.filter(keeps).unwrap_or(UNSETTLED);
            }
        });
        // The others one after another: the first of them gets the lowest slot.
        let mut count = 0;
        for index in 0..rows.len() {
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
                    let center = bounds[row].0.center;
                    batches::put_transparent(list, Transparent { slot, key, center });
                }
            }
            (rows[count], found[count]) = (rows[index], slot);
            count += 1;
        }
        rows.truncate(count);
        found.truncate(count);
        (self.rows, self.slots) = (rows, found);
    }
}

/// In place of a slot that is yet to be found.
const UNSETTLED: u32 = u32::MAX;
