//! The instance table: one stable slot per drawn object.
//!
//! A slot is taken when an object first appears in a frame and kept while it lives and is drawn with the same mesh,
//! pipeline and class (`pages.rs` gives slots out). So an object that moves rewrites its own record and nothing
//! else. The records are in the [`DrawList`].

use crate::batches;
use crate::bounds::WorldBounds;
use crate::changes::{for_each_changed_in, moved};
use crate::draw_list::{BatchKey, DrawList, InstanceRecord, Transparent};
use crate::hidden::InheritedHidden;
use crate::library::{AlphaMode, Library, MaterialId, MeshId};
use crate::lights::Selection;
use crate::materials::MaterialTable;
use crate::pages::SlotPages;
use crate::pieces::PieceOf;
use bevy_ecs::change_detection::{ContiguousMut, ContiguousRef};
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;
use bevy_transform::components::GlobalTransform;
use glam::Affine3A;

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
        // First what decides the slots, one after another; then the records, which are many bytes, in parallel.
        table.slots.clear();
        table.slots_of_rows(&library, &materials, list, (transforms, meshes, chosen, bounds, slots));
        list.instances.write_all(&table.slots, |index| {
            let row = table.rows[index] as usize;
            let object = pieces.map_or(entities[row], |pieces| pieces[row].0);
            record(object, &transforms[row].affine(), known(chosen[row], &library), &selections[row])
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

impl InstanceTable {
    /// Finds the slots of the rows in `rows`, into `slots`; drops the rows that draw nothing.
    fn slots_of_rows(
        &mut self,
        library: &Library,
        materials: &MaterialTable,
        list: &mut DrawList,
        (transforms, meshes, chosen, bounds, slots): Placing,
    ) {
        let mut rows = std::mem::take(&mut self.rows);
        rows.retain(|&row| {
            let row = row as usize;
            let (mesh, slot) = (meshes[row], &mut slots[row]);
            let Some(entry) = library.mesh(mesh).filter(|entry| !entry.mesh.indices.is_empty()) else {
                if let Some(taken) = std::mem::take(slot).get() {
                    self.release(taken, list);
                }
                return false;
            };
            let (class, mut pipeline) = materials.placed(known(chosen[row], library));
            pipeline.vertex_colors = !entry.mesh.colors.is_empty();
            pipeline.mirrored = transforms[row].affine().matrix3.determinant() < 0.0;
            let key = BatchKey { pipeline, class, mesh };
            let taken = self.settle(slot, key, list);
            if pipeline.alpha == AlphaMode::Blend {
                let center = bounds[row].0.center;
                batches::put_transparent(list, Transparent { slot: taken, key, center });
            }
            self.slots.push(taken);
            true
        });
        self.rows = rows;
    }
}

fn record(entity: Entity, world_from_object: &Affine3A, material: MaterialId, selection: &Selection) -> InstanceRecord {
    let (m, t) = (world_from_object.matrix3.transpose(), world_from_object.translation);
    let row = |axis: glam::Vec3A, translation: f32| [axis.x, axis.y, axis.z, translation];
    InstanceRecord {
        world_from_object: [row(m.x_axis, t.x), row(m.y_axis, t.y), row(m.z_axis, t.z)],
        lights: selection.lights,
        material: material.0,
        weights: selection.weights,
        entity: entity.index().index(),
        remainder_ambient: selection.remainder_ambient.to_array(),
        reaching: selection.reaching,
        remainder_direction: selection.remainder_direction.to_array(),
        dropped: selection.dropped,
        remainder_sides: selection.remainder_sides.to_array(),
        pad0: 0,
    }
}
