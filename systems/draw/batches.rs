//! Pages of instance slots listed by batch, in drawing order: pipeline, then material class, then mesh.
//!
//! Done only when a page was begun or given up. Blended objects are kept one by one: their order depends on the view,
//! see [`sort_transparent`].

use super::instances::InstanceTable;
use super::list::{Batch, BatchKey, DrawList, Transparent};
use super::view::{View, in_frustum};
use crate::assets::material::AlphaMode;
use bevy_ecs::prelude::*;
use std::collections::BTreeMap;

/// Lists the pages anew if they changed.
pub fn update_batches(mut table: ResMut<InstanceTable>, mut list: ResMut<DrawList>) {
    let (table, list) = (table.bypass_change_detection(), list.bypass_change_detection());
    if !table.pages.take_changed() {
        return;
    }
    list.batches.clear();
    list.pages.clear();
    for (key, pages) in table.pages.batches().filter(|(key, _)| key.pipeline.alpha != AlphaMode::Blend) {
        let first = list.pages.len() as u32;
        list.pages.extend(pages);
        list.batches.push(Batch { key, pages: first..list.pages.len() as u32 });
    }
    list.batches_version += 1;
}

/// Changes of blended objects in a frame, by slot: their new entry, or `None` where one went.
pub(crate) type BlendedChanges = BTreeMap<u32, Option<Transparent>>;

/// Brings the list of blended objects up to date, which is in slot order.
pub(crate) fn change_transparent(list: &mut DrawList, changes: BlendedChanges) {
    if changes.is_empty() {
        return;
    }
    list.transparent_version += 1;
    let mut none_comes_or_goes = true;
    for (slot, change) in &changes {
        match (list.transparent.binary_search_by_key(slot, |t| t.slot), change) {
            (Ok(index), Some(object)) => list.transparent[index] = *object,
            (Err(_), None) => {}
            _ => none_comes_or_goes = false,
        }
    }
    // All that come and go together: one at a time, each would move those behind it.
    if !none_comes_or_goes {
        list.transparent.retain(|object| !changes.contains_key(&object.slot));
        list.transparent.extend(changes.into_values().flatten());
        list.transparent.sort_by_key(|object| object.slot);
    }
}

/// Blended objects that follow each other and share a draw.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct BlendedRun {
    /// State that its instances share.
    pub key: BatchKey,
    /// Range of the sorted slots.
    pub slots: std::ops::Range<u32>,
}

/// Orders the blended objects that may be in a view: farthest first along the viewing direction, equal ones by slot.
/// Returns their slots, and the runs of neighbours with the same key.
pub fn sort_transparent<'a>(
    transparent: impl IntoIterator<Item = &'a Transparent>,
    view: &View,
) -> (Vec<u32>, Vec<BlendedRun>) {
    let (planes, eye, direction) = (view.frustum_planes(), view.eye(), view.direction());
    let in_view = transparent.into_iter().filter(|item| in_frustum(&planes, item.bounds));
    let mut order: Vec<&Transparent> = in_view.collect();
    order.sort_by(|a, b| {
        // From the eye: far from the origin, rounding would come before what lies between two panes.
        let depth = |item: &Transparent| (item.bounds.center - eye).dot(direction);
        depth(b).total_cmp(&depth(a)).then(a.slot.cmp(&b.slot))
    });
    let mut runs: Vec<BlendedRun> = Vec::new();
    for (i, item) in (0..).zip(&order) {
        match runs.last_mut() {
            Some(last) if last.key == item.key => last.slots.end += 1,
            _ => runs.push(BlendedRun { key: item.key, slots: i..i + 1 }),
        }
    }
    (order.iter().map(|item| item.slot).collect(), runs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets::library::Library;
    use crate::assets::material::{Material, MaterialId};
    use crate::assets::mesh::MeshId;
    use crate::assets::shapes;
    use crate::draw::camera::Camera;
    use crate::draw::instances::InstanceTable;
    use crate::draw::list::PAGE_SLOTS;
    use crate::ecs::tables::Records;
    use crate::simulation::Simulation;
    use crate::space::bounds::Sphere;
    use crate::space::transform::Transform;
    use glam::Vec3;

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

    /// Every object is in a page of its batch or in the blended list, once, and its record is in its slot.
    fn check_groups(simulation: &mut Simulation) {
        let mut objects = simulation.world.query_filtered::<Entity, With<MeshId>>();
        let mut slots: Vec<(u32, u32)> = Vec::new();
        for entity in objects.iter(&simulation.world) {
            let slot = simulation.world.resource::<InstanceTable>().slot(entity);
            slots.extend(slot.map(|slot| (slot, entity.index_u32())));
        }
        slots.sort_unstable();
        let (list, table) = (simulation.draw_list(), simulation.world.resource::<InstanceTable>());
        assert!(list.batches.is_sorted_by(|a, b| a.key < b.key && a.pages.end == b.pages.start));
        let mut listed: Vec<(u32, u32)> = list.transparent.iter().map(|t| (t.slot, t.slot)).collect();
        for batch in &list.batches {
            let pages = &list.pages[batch.pages.start as usize..batch.pages.end as usize];
            assert!(!pages.is_empty() && pages.is_sorted_by(|a, b| a < b));
            for page in pages {
                let here = page * PAGE_SLOTS..(page + 1) * PAGE_SLOTS;
                let used: Vec<u32> = slots.iter().map(|s| s.0).filter(|slot| here.contains(slot)).collect();
                assert!(!used.is_empty() && used.iter().all(|&slot| table.pages.key(slot) == batch.key));
                listed.extend(used.iter().map(|&slot| (slot, slot)));
            }
        }
        listed.sort_unstable();
        assert_eq!(listed.iter().map(|l| l.0).collect::<Vec<_>>(), slots.iter().map(|s| s.0).collect::<Vec<_>>());
        assert_eq!(list.objects as usize, slots.len());
        let records = simulation.instance_records();
        for slot in 0..records.slot_count() {
            match slots.binary_search_by_key(&slot, |s| s.0) {
                Ok(index) => assert_eq!(records.get(slot).entity, slots[index].1),
                Err(_) => assert_eq!(records.get(slot), crate::draw::records::InstanceRecord::default()),
            }
        }
    }

    #[test]
    fn every_object_is_listed_once_through_spawn_despawn_and_change() {
        let (mut simulation, entities) = scene(600);
        simulation.frame();
        check_groups(&mut simulation);
        assert_eq!(simulation.draw_list().batches.len(), 4);
        assert_eq!(simulation.draw_list().transparent.len(), 200);
        for i in [3, 10, 11, 59] {
            simulation.world.despawn(entities[i]);
        }
        simulation.world.entity_mut(entities[0]).insert(MaterialId::DEFAULT);
        simulation.world.entity_mut(entities[1]).remove::<MeshId>();
        simulation.frame();
        check_groups(&mut simulation);
        assert_eq!(simulation.world.resource::<crate::ecs::stats::FrameStats>().objects, 595);
        for (i, &entity) in entities.iter().enumerate().skip(60) {
            match i % 7 {
                0..4 => drop(simulation.world.despawn(entity)),
                4 => drop(simulation.world.entity_mut(entity).insert(MeshId::from_slot(1))),
                _ => {}
            }
        }
        simulation.frame();
        check_groups(&mut simulation);
        for i in 0..100 {
            simulation.world.spawn((MeshId::from_slot(i % 2), MaterialId::from_slot(i % 4)));
        }
        simulation.frame();
        check_groups(&mut simulation);
        let all: Vec<Entity> =
            simulation.world.query_filtered::<Entity, With<MeshId>>().iter(&simulation.world).collect();
        for entity in all {
            simulation.world.despawn(entity);
        }
        simulation.frame();
        check_groups(&mut simulation);
        assert!(simulation.draw_list().batches.is_empty() && simulation.draw_list().pages.is_empty());
    }

    #[test]
    fn a_material_that_comes_after_its_objects_is_theirs_then() {
        let (mut simulation, entities) = scene(2);
        let next = MaterialId::from_slot(simulation.library().materials().count() as u32);
        simulation.world.entity_mut(entities[0]).insert(next);
        simulation.frame();
        assert!(simulation.draw_list().transparent.is_empty(), "drawn as the default");
        let glass = Material { alpha: AlphaMode::Blend, ..Material::default() };
        assert_eq!(simulation.world.resource_mut::<Library>().add_material(glass), next);
        simulation.frame();
        check_groups(&mut simulation);
        assert_eq!(simulation.draw_list().transparent.len(), 1);
    }

    #[test]
    fn slots_are_stable_and_the_lowest_free_one_of_the_batch_is_reused() {
        let (mut simulation, entities) = scene(60);
        simulation.frame();
        let slot = |s: &Simulation, e| s.world.resource::<InstanceTable>().slot(e);
        let before: Vec<_> = entities.iter().map(|&e| slot(&simulation, e)).collect();
        simulation.world.despawn(entities[30]);
        simulation.world.despawn(entities[12]);
        simulation.frame();
        let kept = |i: &usize| ![12, 30].contains(i);
        assert!((0..60).filter(kept).all(|i| slot(&simulation, entities[i]) == before[i]));
        let version = simulation.draw_list().batches_version;
        let new = simulation.world.spawn((MeshId::from_slot(0), MaterialId::from_slot(1))).id();
        simulation.frame();
        assert_eq!(slot(&simulation, new), before[12]);
        assert_eq!(simulation.draw_list().batches_version, version, "a page with room was there");
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
        let slot = simulation.world.resource::<InstanceTable>().slot(entities[12]).unwrap();
        let dirty = simulation.draw_list().instances.dirty.ranges(0);
        assert_eq!(dirty.into_iter().flatten().collect::<Vec<_>>(), [slot]);
        assert_eq!(simulation.draw_list().batches_version, version);
    }

    #[test]
    fn an_object_without_its_parent_any_more_is_written_where_it_is_now() {
        let (mut simulation, entities) = scene(3);
        let parent = simulation.world.spawn(Transform::from_xyz(0.0, 50.0, 0.0)).id();
        simulation.world.entity_mut(entities[0]).insert(ChildOf(parent));
        let height = |simulation: &mut Simulation| {
            simulation.frame();
            let slot = simulation.world.resource::<InstanceTable>().slot(entities[0]).unwrap();
            simulation.instance_records().get(slot).world_from_object[1][3]
        };
        assert_eq!(height(&mut simulation), 50.0);
        assert_eq!(height(&mut simulation), 50.0);
        simulation.world.entity_mut(entities[0]).remove::<ChildOf>();
        assert_eq!(height(&mut simulation), 0.0);
    }

    #[test]
    fn a_mirrored_object_gets_its_own_pipeline() {
        let (mut simulation, entities) = scene(2);
        simulation.frame();
        simulation.world.get_mut::<Transform>(entities[0]).unwrap().scale.x = -1.0;
        simulation.frame();
        let mirrored = simulation.draw_list().batches.iter().filter(|b| b.key.pipeline.mirrored);
        assert_eq!(mirrored.map(|b| b.pages.len()).collect::<Vec<_>>(), [1]);
    }

    /// So many that several tasks look for them; some of each come out of their page, some are blended.
    #[test]
    fn some_that_move_or_are_mirrored_among_many_get_the_slots_and_records_that_are_theirs() {
        let (mut simulation, entities) = scene(20_000);
        simulation.frame();
        for turn in [3, 5, 1000] {
            for (i, &entity) in entities.iter().enumerate().skip(1) {
                let mut entity = simulation.world.entity_mut(entity);
                let mut transform = entity.get_mut::<Transform>().unwrap();
                // In the second turn all that move keep their slots, and are moved up in the lists a part at a time.
                if i % turn == 0 && (turn != 5 || i % 3 != 2) {
                    transform.translation.y += 1.0;
                }
                if turn != 5 && i % (2 * turn + 1) == 0 {
                    transform.scale.x *= -1.0;
                }
                // In the first turn only: in the others, all keep what they look like.
                if turn == 3 && i % 11 == 0 {
                    entity.insert(MaterialId::from_slot((i % 3) as u32));
                }
            }
            simulation.frame();
            check_groups(&mut simulation);
            let mut objects = simulation.world.query::<(Entity, &Transform, &MeshId, &MaterialId)>();
            let (records, table) = (simulation.instance_records(), simulation.world.resource::<InstanceTable>());
            for (object, transform, &mesh, &material) in objects.iter(&simulation.world) {
                let slot = table.slot(object).unwrap();
                let (key, record) = (table.pages.key(slot), records.get(slot));
                assert_eq!((key.pipeline.mirrored, key.mesh), (transform.scale.x < 0.0, mesh));
                assert_eq!((record.material, record.world_from_object[0][0]), (material.slot(), transform.scale.x));
                assert_eq!(record.world_from_object[1][3], transform.translation.y);
            }
        }
    }

    fn looking(from: Vec3, to: Vec3) -> View {
        let up = if (to - from).normalize().y.abs() > 0.9 { Vec3::X } else { Vec3::Y };
        let place = Transform::from_translation(from).looking_at(to, up).compute_affine();
        View::new(&place, &Camera { far: 60.0, ..Camera::default() }, 160, 90)
    }

    #[test]
    fn blended_objects_come_farthest_first_and_neighbours_share_draws() {
        let (mut simulation, _) = scene(12);
        simulation.frame();
        let named = |slots: Vec<u32>| -> Vec<i32> {
            let record = |slot: u32| simulation.instance_records().get(slot);
            slots.into_iter().map(|slot| record(slot).world_from_object[0][3] as i32).collect()
        };
        // Along the diagonal on which they are.
        let along = looking(Vec3::new(-10.0, 0.0, 10.0), Vec3::ZERO);
        let (slots, runs) = sort_transparent(&simulation.draw_list().transparent, &along);
        assert_eq!(named(slots), [11, 8, 5, 2]);
        assert_eq!(runs.iter().map(|run| run.slots.clone()).collect::<Vec<_>>(), [0..1, 1..2, 2..3, 3..4]);
        // From above all are as far, as exactly as floats can tell.
        let above = looking(Vec3::new(6.0, 32.0, -6.0), Vec3::new(6.0, 0.0, -6.0));
        let (slots, runs) = sort_transparent(&simulation.draw_list().transparent, &above);
        assert_eq!((slots.len(), runs.len()), (4, 2));
    }

    /// Panes a few centimetres apart, tens of kilometres from the origin, where their coordinates are worth less than
    /// that.
    #[test]
    fn blended_objects_far_from_the_origin_are_sorted_by_what_lies_between_them() {
        let far = Vec3::new(65_536.0, 0.0, 65_536.0);
        let view = looking(far + Vec3::new(3.0, 1.0, 5.0), far);
        let direction = view.direction();
        let pane = |slot: u32| {
            let center = far + Vec3::new(0.0, 0.03 * (7 - slot) as f32, 0.0);
            Transparent {
                slot,
                key: BatchKey { pipeline: Default::default(), class: Default::default(), mesh: MeshId::from_slot(0) },
                bounds: Sphere { center, radius: 0.5 },
            }
        };
        let panes: Vec<Transparent> = (0..8).map(pane).collect();
        assert!(direction.y < 0.0, "the higher, the nearer");
        assert_eq!(sort_transparent(&panes, &view).0, [7, 6, 5, 4, 3, 2, 1, 0]);
    }

    #[test]
    fn blended_objects_out_of_view_are_left_out() {
        let mut simulation = Simulation::new();
        let mut library = simulation.world.resource_mut::<Library>();
        let mesh = library.add_mesh(shapes::sphere(1.0, 8, 4));
        let glass = library.add_material(Material { alpha: AlphaMode::Blend, ..Material::default() });
        for i in 0..1000 {
            let place = Vec3::new((i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32) * 9.0 - 40.0;
            let scale = 0.5 + (i % 7) as f32 * 0.5;
            simulation.world.spawn((mesh, glass, Transform::from_translation(place).with_scale(Vec3::splat(scale))));
        }
        simulation.frame();
        let all = &simulation.draw_list().transparent;
        assert_eq!(all.len(), 1000);
        for to in [Vec3::X, Vec3::NEG_Y, Vec3::new(0.3, -0.5, 0.8)] {
            let view = looking(Vec3::splat(2.0), Vec3::splat(2.0) + to);
            let (slots, runs) = sort_transparent(all, &view);
            assert_eq!(runs.iter().map(|run| run.slots.len()).sum::<usize>(), slots.len());
            // Some point of the ball is where the projection keeps it, or near enough.
            let clip_from_world = view.clip_from_world();
            let kept = |point: Vec3| {
                let clip = clip_from_world * point.extend(1.0);
                clip.x.abs() <= clip.w && clip.y.abs() <= clip.w && (0.0..=clip.w).contains(&clip.z)
            };
            let mut seen = 0;
            for item in all {
                let toward = |i: i32| Vec3::new((i % 5 - 2) as f32, (i / 5 % 5 - 2) as f32, (i / 25 - 2) as f32) * 0.5;
                let points =
                    (0..125).map(|i| item.bounds.center + toward(i).clamp_length_max(1.0) * item.bounds.radius);
                if points.into_iter().any(kept) {
                    assert!(slots.contains(&item.slot), "{:?}", item.bounds);
                    seen += 1;
                }
            }
            assert!(seen > 10 && slots.len() < seen * 2, "{seen} in view, {} listed", slots.len());
        }
    }
}
