//! Instance slots grouped into draws: pipeline, then material class, then mesh.
//!
//! Done only when an object appeared, vanished, or changed what it is drawn with; moving objects keep their place.
//! Blended objects are not grouped here: their order depends on the view, see [`sort_transparent`].

use crate::draw_list::{Batch, BatchKey, DrawList, Transparent};
use crate::instances::InstanceTable;
use crate::library::AlphaMode;
use bevy_ecs::prelude::*;
use glam::Vec3;
use std::collections::BTreeMap;

/// Groups all slots anew if need be.
pub fn update_batches(table: Res<InstanceTable>, mut list: ResMut<DrawList>) {
    let list = list.bypass_change_detection();
    if table.regroup {
        group(&table, list);
    }
    if table.regroup || table.transparent_moved {
        list.transparent.clear();
        for (slot, occupant) in table.occupants.iter().enumerate() {
            if let Some(o) = occupant.filter(|o| o.key.pipeline.alpha == AlphaMode::Blend) {
                list.transparent.push(Transparent { slot: slot as u32, key: o.key, center: o.center });
            }
        }
    }
}

/// A counting sort by key; slots ascend within a batch.
fn group(table: &InstanceTable, list: &mut DrawList) {
    let opaque = || {
        table.occupants.iter().enumerate().filter_map(|(slot, occupant)| {
            let key = occupant.as_ref()?.key;
            (key.pipeline.alpha != AlphaMode::Blend).then_some((slot as u32, key))
        })
    };
    let mut next: BTreeMap<BatchKey, u32> = BTreeMap::new();
    opaque().for_each(|(_, key)| *next.entry(key).or_default() += 1);
    list.batches.clear();
    let mut first = 0;
    for (&key, entry) in &mut next {
        let count = std::mem::replace(entry, first);
        list.batches.push(Batch { key, first, count });
        first += count;
    }
    list.slots.clear();
    list.slots.resize(first as usize, 0);
    for (slot, key) in opaque() {
        if let Some(place) = next.get_mut(&key) {
            list.slots[*place as usize] = slot;
            *place += 1;
        }
    }
    list.batches_version += 1;
}

/// Orders blended objects for a view: farthest first along the viewing direction, equal ones by slot. Neighbours with
/// the same key share a draw. Returns their slots, and batches whose `first` counts from the start of those.
pub fn sort_transparent(transparent: &[Transparent], view_direction: Vec3) -> (Vec<u32>, Vec<Batch>) {
    let mut order: Vec<&Transparent> = transparent.iter().collect();
    order.sort_by(|a, b| {
        let (da, db) = (a.center.dot(view_direction), b.center.dot(view_direction));
        db.total_cmp(&da).then(a.slot.cmp(&b.slot))
    });
    let mut batches: Vec<Batch> = Vec::new();
    for (i, item) in order.iter().enumerate() {
        match batches.last_mut() {
            Some(last) if last.key == item.key => last.count += 1,
            _ => batches.push(Batch { key: item.key, first: i as u32, count: 1 }),
        }
    }
    (order.iter().map(|item| item.slot).collect(), batches)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Simulation;
    use crate::library::{Library, Material, MaterialId, MeshId};
    use crate::shapes;
    use bevy_transform::components::Transform;

    /// `count` cubes and spheres in turn, with 3 materials of which the last is blended.
    fn scene(count: usize) -> (Simulation, Vec<Entity>) {
        let mut simulation = Simulation::new();
        let mut library = simulation.world.resource_mut::<Library>();
        let meshes = [library.add_mesh(shapes::cube(Vec3::ONE)), library.add_mesh(shapes::sphere(1.0, 8, 4))];
        let alphas = [AlphaMode::Opaque, AlphaMode::Mask, AlphaMode::Blend];
        let materials = alphas.map(|alpha| library.add_material(Material { alpha, ..Material::default() }));
        let entities = (0..count)
            .map(|i| {
                let place = Transform::from_xyz(i as f32, 0.0, -(i as f32));
                simulation.world.spawn((meshes[i % 2], materials[i % 3], place)).id()
            })
            .collect();
        (simulation, entities)
    }

    fn check_groups(simulation: &Simulation) {
        let (list, table) = (simulation.draw_list(), simulation.world.resource::<InstanceTable>());
        let mut seen = Vec::new();
        let mut keys = Vec::new();
        for batch in &list.batches {
            let slots = &list.slots[batch.first as usize..(batch.first + batch.count) as usize];
            assert!(slots.is_sorted());
            assert!(slots.iter().all(|&s| table.occupants[s as usize].unwrap().key == batch.key));
            seen.extend_from_slice(slots);
            keys.push(batch.key);
        }
        assert!(keys.is_sorted() && keys.windows(2).all(|k| k[0] != k[1]));
        seen.extend(list.transparent.iter().map(|t| t.slot));
        seen.sort_unstable();
        let used: Vec<u32> =
            (0..table.occupants.len() as u32).filter(|&s| table.occupants[s as usize].is_some()).collect();
        assert_eq!(seen, used);
    }

    #[test]
    fn every_slot_is_in_exactly_one_group_through_spawn_despawn_and_change() {
        let (mut simulation, entities) = scene(60);
        simulation.frame();
        check_groups(&simulation);
        assert_eq!(simulation.draw_list().batches.len(), 4);
        assert_eq!(simulation.draw_list().transparent.len(), 20);
        for i in [3, 10, 11, 59] {
            simulation.world.despawn(entities[i]);
        }
        simulation.world.entity_mut(entities[0]).insert(MaterialId::DEFAULT);
        simulation.world.entity_mut(entities[1]).remove::<MeshId>();
        simulation.frame();
        check_groups(&simulation);
        assert_eq!(simulation.world.resource::<crate::stats::FrameStats>().objects, 55);
    }

    #[test]
    fn slots_are_stable_and_the_lowest_free_one_is_reused() {
        let (mut simulation, entities) = scene(10);
        simulation.frame();
        let slot = |s: &Simulation, e| s.world.get::<crate::instances::InstanceSlot>(e).unwrap().get();
        simulation.world.despawn(entities[7]);
        simulation.world.despawn(entities[2]);
        simulation.frame();
        assert_eq!(slot(&simulation, entities[9]), Some(9));
        let new = simulation.world.spawn(MeshId(0)).id();
        simulation.frame();
        assert_eq!(slot(&simulation, new), Some(2));
    }

    #[test]
    fn a_moved_object_rewrites_its_record_only_and_a_still_frame_writes_nothing() {
        let (mut simulation, entities) = scene(30);
        simulation.frame();
        let version = simulation.draw_list().batches_version;
        simulation.frame();
        assert!(simulation.draw_list().instances.dirty.is_empty());
        simulation.world.get_mut::<Transform>(entities[12]).unwrap().translation.y = 1.0;
        simulation.frame();
        assert_eq!(format!("{:?}", simulation.draw_list().instances.dirty.ranges(0)), "[12..13]");
        assert_eq!(simulation.draw_list().batches_version, version);
    }

    #[test]
    fn a_mirrored_object_gets_its_own_pipeline() {
        let (mut simulation, entities) = scene(2);
        simulation.frame();
        simulation.world.get_mut::<Transform>(entities[0]).unwrap().scale.x = -1.0;
        simulation.frame();
        let mirrored = simulation.draw_list().batches.iter().filter(|b| b.key.pipeline.mirrored);
        assert_eq!(mirrored.map(|b| b.count).collect::<Vec<_>>(), [1]);
    }

    #[test]
    fn blended_objects_come_farthest_first_and_neighbours_share_draws() {
        let (mut simulation, _) = scene(12);
        simulation.frame();
        let (slots, batches) = sort_transparent(&simulation.draw_list().transparent, Vec3::NEG_Z);
        assert_eq!(slots, [11, 8, 5, 2]);
        assert_eq!(batches.iter().map(|b| (b.first, b.count)).collect::<Vec<_>>(), [(0, 1), (1, 1), (2, 1), (3, 1)]);
        let (slots, batches) = sort_transparent(&simulation.draw_list().transparent, Vec3::ZERO);
        assert_eq!((slots.len(), batches.len()), (4, 4));
    }
}
