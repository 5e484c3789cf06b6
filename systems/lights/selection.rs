//! Choice of lights in a frame, and of the objects that make it again.
//!
//! An object keeps its lights while neither it nor any light that reaches it changed. [`select_lights`] collects the
//! objects that moved, marks those that a changed light reaches or did reach before the change
//! (`ObjectOrder::mark`), and searches for these only. Where most would be marked, marking is left out and all are
//! searched. What comes out is the same as if all had been searched in every frame.

use super::floods::LightFloods;
use super::indoors::{Searched, Walls};
use super::lists::{LightLists, MOST_LISTED};
use super::order::{Dirty, ObjectOrder};
use super::policy::{LightPolicies, LightPolicy, Policies};
use super::relevance::ScoredLight;
use super::selected::SelectedLights;
use super::table::LightTable;
use super::tree::LightTree;
use crate::assets::library::Library;
use crate::assets::mesh::MeshId;
use crate::assets::object_bounds::{world_bounds, world_box};
use crate::cells::cells::Cells;
use crate::ecs::bits::for_each_set;
use crate::ecs::changes::{LIGHT_ROWS, note_changed, rows_per_task, touch};
use crate::ecs::entity_numbers::EntityNumbers;
use crate::ecs::parallel::{in_parallel, map_on_pool};
use crate::ecs::read_ahead::read_ahead;
use crate::ecs::stats::FrameStats;
use crate::lights::lists::ListedLights;
use crate::lights::search::clusters::{self, Level, Scratch};
use crate::space::bounds::Sphere;
use crate::space::transform::GlobalTransform;
use bevy_ecs::change_detection::{ContiguousMut, ContiguousRef, Tick};
use bevy_ecs::entity::{Entities, EntityIndex};
use bevy_ecs::prelude::*;
use bevy_tasks::{ComputeTaskPool, TaskPool};
use glam::Vec3;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Objects per task.
const CHUNK: usize = 4096;
/// Places of a block in a search of all objects. Their results are kept, 40 bytes each, until they are with their
/// objects. All objects are looked through for each block.
const BLOCK: usize = 1 << 17;
/// Objects are marked as long as no more than one in this many lights changed, or no more than a few.
const MANY_LIGHTS: usize = 8;
const FEW_LIGHTS: usize = 64;
/// All objects are searched if more than one in this many are marked.
const MANY_OBJECTS: usize = 4;
/// All objects look their selection up if more than one in this many were searched: that reads them in the order they
/// lie in memory, and to find one by its entity costs as much as to pass so many by.
const SOME_OBJECTS: usize = 16;

/// [`clusters::select`] with the spheres shared out over the threads of a pool; `places` where they are not
/// neighbours, see [`clusters::select_sparse`]. Returns what the objects have beyond their three, task by task.
pub fn select_parallel(
    pool: &TaskPool,
    tree: &LightTree,
    scored: &[ScoredLight],
    policies: Policies,
    places: Option<&[u32]>,
    (spheres, out): (&[Sphere], &mut [SelectedLights]),
) -> Vec<ListedLights> {
    let level = Level::new();
    let most = MOST_LISTED / spheres.len().div_ceil(CHUNK).max(1);
    let parts = spheres.chunks(CHUNK).zip(out.chunks_mut(CHUNK)).enumerate();
    map_on_pool(pool, parts, |(i, (spheres, out))| {
        let range = i * CHUNK..i * CHUNK + spheres.len();
        let policies = policies.part(range.clone());
        let mut scratch = Scratch::default();
        scratch.further = ListedLights::with_room(most);
        match places {
            Some(places) => {
                let work = (&places[range], spheres, out);
                clusters::select_sparse(level, tree, scored, policies, work, &mut scratch);
            }
            None => clusters::select(level, tree, scored, policies, (spheres, out), &mut scratch),
        }
        scratch.further
    })
}

/// Memory that [`select_lights`] keeps from frame to frame.
#[derive(Default)]
pub struct Kept {
    policies: LightPolicies,
    /// Scratch: a bit per row of a table, whether it changed.
    changed: Vec<u64>,
    dirty: Dirty,
    spheres: Vec<Sphere>,
    selections: Vec<SelectedLights>,
    /// Policies of the objects that are searched, where they differ.
    each: Vec<LightPolicy>,
    /// Scratch.
    targets: Vec<Target>,
}

/// Chooses the lights of the objects that changed or that a light which changed reaches, and keeps the lists of those
/// that have more than three.
#[allow(clippy::too_many_arguments)]
pub fn select_lights(
    table: Res<LightTable>,
    policies: Res<LightPolicies>,
    library: Res<Library>,
    (cells, floods): (Res<Cells>, Res<LightFloods>),
    mut order: ResMut<ObjectOrder>,
    mut lists: ResMut<LightLists>,
    mut kept: Local<Kept>,
    mut stats: ResMut<FrameStats>,
    entities: &Entities,
    objects: Query<Placed>,
    mut selections: Query<(Entity, &mut SelectedLights)>,
) {
    let pool = ComputeTaskPool::get();
    let level = Level::new();
    let kept = &mut *kept;
    let lists = lists.bypass_change_detection();
    lists.begin_frame();
    order.release_freed(lists);
    collect_moved(objects, &library, &mut order, &mut kept.changed);
    order.gather_moving(pool);
    let aabb = |object: EntityIndex| {
        let (_, place, mesh) = objects.get(entities.resolve_from_index(object)).ok()?;
        world_box(&library, *mesh, &place)
    };
    let walls = floods.has_cells().then(|| Walls { cells: &cells, floods: &floods, aabb: &aabb });
    // What found no room may find some.
    let had_refused = lists.forget_refused();
    if std::mem::replace(&mut kept.policies, *policies) != *policies
        || had_refused
        || floods.are_new()
        || table.changes().len() > FEW_LIGHTS.max(table.scored().len() / MANY_LIGHTS)
    {
        order.mark_all();
    } else if let Some(walls) = &walls {
        if !floods.changes().is_empty() {
            walls.mark(pool, level, &mut order);
        }
    } else if !table.changes().is_empty() {
        order.mark(pool, level, table.changes());
    }
    if order.needs_sorting(pool) {
        order.sort(pool);
    }
    if !table.shadow_lights().is_empty() {
        // Renderers look for what they reach.
        order.refresh(pool);
    }
    let (order, each) = (&mut *order, &mut kept.each);
    let common = order.own_policies.common(&policies);
    // Of objects at some places, or at all from the first on.
    let mut search = |order: &ObjectOrder, places: Option<&[u32]>, first, spheres: &[Sphere], found: &mut Vec<_>| {
        found.resize(spheres.len(), SelectedLights::default());
        let place = |i: usize| places.map_or(first + i as u32, |places| places[i]);
        let object = |i: usize| order.object(place(i));
        if let Some(walls) = &walls {
            let own = |object| order.own_policies.of(object, &policies);
            let policy = |i| common.or_else(|| object(i).map(own)).unwrap_or(LightPolicy::Three);
            let searched = Searched { spheres, object: &object, policy: &policy, place: &place };
            return walls.search(pool, table.scored(), &searched, lists, found);
        }
        if common.is_none() {
            each.clear();
            let policy = |object| order.own_policies.of(object, &policies);
            each.extend((0..spheres.len()).map(|i| object(i).map_or(LightPolicy::Three, policy)));
        }
        let policies = common.map_or(Policies::Each(each), Policies::Same);
        let further = select_parallel(pool, table.tree(), table.scored(), policies, places, (spheres, found));
        lists.take(&further, (0..spheres.len()).map(object), found);
    };
    let (count, all) = (order.dirty_count(), order.spheres().len());
    stats.selected = count;
    if count == 0 {
        order.nothing_dirty();
        return;
    }
    if count * MANY_OBJECTS > all {
        order.take_all();
        for (spheres, first) in order.spheres().chunks(BLOCK).zip((0..).step_by(BLOCK)) {
            search(order, None, first, spheres, &mut kept.selections);
            let (places, found) = (order.places(), &kept.selections);
            let index = |place: u32| place.wrapping_sub(first) as usize;
            for rows in selections.contiguous_iter_mut().into_iter().flatten() {
                write_found(rows, places, found, |place| index(place) < found.len(), index);
            }
        }
        if all > BLOCK {
            // What comes next in the frame has room there.
            kept.selections = Vec::new();
        }
        return;
    }
    order.take_dirty(&mut kept.dirty);
    let dirty = &kept.dirty;
    kept.spheres.clear();
    kept.spheres.extend(dirty.places.iter().map(|&place| order.spheres()[place as usize]));
    search(order, Some(&dirty.places), 0, &kept.spheres, &mut kept.selections);
    let found = &kept.selections;
    if count * SOME_OBJECTS > all {
        for rows in selections.contiguous_iter_mut().into_iter().flatten() {
            write_found(rows, order.places(), found, |place| dirty.contains(place), |place| dirty.index(place));
        }
        return;
    }
    locate(entities, order, &dirty.places, &mut kept.targets);
    for rows in selections.contiguous_iter_mut().into_iter().flatten() {
        write_targets(rows, entities, &kept.targets, found);
    }
}

/// Destination of a selection: a row of a table, and its index among those that were found.
#[derive(Clone, Copy, Default)]
struct Target {
    table: u32,
    row: u32,
    found: u32,
}

/// Lists where the objects at some places are: by table, and ascending there.
fn locate(entities: &Entities, order: &ObjectOrder, places: &[u32], targets: &mut Vec<Target>) {
    targets.clear();
    for (places, first) in places.chunks(ROWS).zip((0..).step_by(ROWS)) {
        let objects = places.iter().filter_map(|&place| order.object(place));
        read_ahead(objects.map(|object| entities.resolve_from_index(object).generation().to_bits()));
        for (&place, found) in places.iter().zip(first..) {
            let object = order.object(place).map(|object| entities.resolve_from_index(object));
            let Some(Ok(at)) = object.map(|object| entities.get_spawned(object)) else { continue };
            targets.push(Target { table: at.table_id.as_u32(), row: at.table_row.index_u32(), found });
        }
    }
    radsort::sort_by_key(targets, |target| (target.table, target.row));
}

/// Rows that are looked at together.
const ROWS: usize = 1024;

/// Writes what was found for the objects of a table: for those at places for which `is_found` says so, the selection of
/// that `index`. What is to be written is listed first, without a branch that is hard to predict.
fn write_found(
    (objects, selections): (&[Entity], ContiguousMut<SelectedLights>),
    places: &EntityNumbers,
    found: &[SelectedLights],
    is_found: impl Fn(u32) -> bool + Sync,
    index: impl Fn(u32) -> usize + Sync,
) {
    write_parts(selections, rows_per_task(objects.len(), LIGHT_ROWS), |mut part| {
        let mut writes = [(0, 0); ROWS];
        let rows = part.first..part.first + part.selections.len();
        for (objects, first) in objects[rows.clone()].chunks(ROWS).zip(rows.step_by(ROWS)) {
            let mut count = 0;
            for (&object, row) in objects.iter().zip(first as u32..) {
                let place = places.get(object);
                writes[count] = (row, place);
                count += usize::from(is_found(place));
            }
            for (_, at) in &mut writes[..count] {
                *at = index(*at) as u32;
            }
            part.write(&mut writes[..count], found);
        }
        part.any
    });
}

/// Writes what was found for those of a table's objects that are among the targets.
fn write_targets(
    (objects, selections): (&[Entity], ContiguousMut<SelectedLights>),
    entities: &Entities,
    targets: &[Target],
    found: &[SelectedLights],
) {
    let Some(at) = objects.first().and_then(|&object| entities.get_spawned(object).ok()) else { return };
    let table = at.table_id.as_u32();
    let before = |row: usize| targets.partition_point(|target| (target.table, target.row as usize) < (table, row));
    let count = before(objects.len()) - before(0);
    if count == 0 {
        return;
    }
    let tasks = (count / ROWS).clamp(1, ComputeTaskPool::get().thread_num());
    write_parts(selections, objects.len().div_ceil(tasks), |mut part| {
        let mut writes = [(0, 0); ROWS];
        let targets = &targets[before(part.first)..before(part.first + part.selections.len())];
        for targets in targets.chunks(ROWS) {
            for (write, target) in writes.iter_mut().zip(targets) {
                *write = (target.row, target.found);
            }
            part.write(&mut writes[..targets.len()], found);
        }
        part.any
    });
}

/// Selections of some rows of a table, to write to.
struct Part<'a> {
    /// The first row.
    first: usize,
    selections: &'a mut [SelectedLights],
    changed: &'a mut [Tick],
    this_run: Tick,
    /// Set if a selection is another now.
    any: bool,
}

impl Part<'_> {
    /// Writes to rows what was found, where it is not what they have; all of it is read ahead. The list is of no
    /// meaning afterwards.
    #[inline(always)]
    fn write(&mut self, writes: &mut [(u32, u32)], found: &[SelectedLights]) {
        let (selections, changed) = (&mut *self.selections, &mut *self.changed);
        let at = |(row, index): (u32, u32)| (row as usize - self.first, index as usize);
        let ends = |selection: &SelectedLights| selection.lights[0] ^ selection.reaching_or_list;
        read_ahead(writes.iter().map(|&write| {
            let (row, index) = at(write);
            ends(&selections[row]) ^ ends(&found[index]) ^ changed[row].get()
        }));
        let mut count = 0;
        for i in 0..writes.len() {
            let (row, index) = at(writes[i]);
            writes[count] = writes[i];
            count += usize::from(selections[row] != found[index]);
        }
        for &write in &writes[..count] {
            let (row, index) = at(write);
            (selections[row], changed[row]) = (found[index], self.this_run);
        }
        self.any |= count > 0;
    }
}

/// Shares the rows of a table out, so many to a task; `write` says whether it changed any.
fn write_parts(selections: ContiguousMut<SelectedLights>, rows: usize, write: impl Fn(Part) -> bool + Sync) {
    let (selections, mut ticks) = ContiguousMut::bypass_change_detection_split(selections);
    let this_run = ticks.this_run();
    let any = AtomicBool::new(false);
    let parts = selections.chunks_mut(rows).zip(ticks.changed_mut().chunks_mut(rows));
    in_parallel(parts.enumerate(), |(number, (selections, changed))| {
        if write(Part { first: number * rows, selections, changed, this_run, any: false }) {
            any.store(true, Relaxed);
        }
    });
    if any.into_inner() {
        touch(ticks);
    }
}

/// Place and mesh of an object, which give its bounds.
type Placed<'a> = (Entity, Ref<'a, GlobalTransform>, Ref<'a, MeshId>);

/// Enters the objects that moved or changed their mesh into the order, and gives places to those that are new there;
/// `changed` is scratch.
fn collect_moved(objects: Query<Placed>, library: &Library, order: &mut ObjectOrder, changed: &mut Vec<u64>) {
    let tables = || objects.contiguous_iter().into_iter().flatten().map(|(entities, ..)| entities);
    for (entities, transforms, meshes) in objects.contiguous_iter().into_iter().flatten() {
        let ((transforms, moved), (meshes, chosen)) = (ContiguousRef::split(transforms), ContiguousRef::split(meshes));
        let count = note_changed([Some(&moved), Some(&chosen)], changed);
        if count == 0 {
            continue;
        }
        order.reserve(tables);
        let rows = Rows { library, entities, transforms, meshes };
        for row in enter_known(order, &rows, (changed, count)) {
            let row = row as usize;
            if let Some(bounds) = rows.bounds(row) {
                let place = order.claim(entities[row].index());
                order.moved(place, bounds);
            }
        }
    }
}

/// The objects of a table.
struct Rows<'a> {
    library: &'a Library,
    entities: &'a [Entity],
    transforms: &'a [GlobalTransform],
    meshes: &'a [MeshId],
}

impl Rows<'_> {
    /// `None` where the mesh is yet to come.
    #[inline(always)]
    fn bounds(&self, row: usize) -> Option<Sphere> {
        world_bounds(self.library, self.meshes[row], &self.transforms[row])
    }

    /// Reads what is needed to know of some rows.
    #[inline(always)]
    fn read_ahead(&self, rows: impl Iterator<Item = usize>) {
        read_ahead(rows.map(|row| {
            let place = self.transforms[row].translation();
            place.x.to_bits() ^ self.meshes[row].slot()
        }));
    }
}

/// Enters the rows of a table that moved or changed their mesh and have a place in the order; returns the others,
/// ascending. What has no bounds, as its mesh is yet to come, stays where it is. The bits and how many are set: see
/// [`note_changed`].
fn enter_known(order: &mut ObjectOrder, table: &Rows, (changed, count): (&[u64], usize)) -> Vec<u32> {
    // Each task looks through all that changed for those with a place in its part of the order.
    let tasks = (count / ROWS).clamp(1, ComputeTaskPool::get().thread_num());
    let (parts, places) = order.parts(tasks);
    let mut others = vec![Vec::new(); parts.len()];
    in_parallel(parts.into_iter().zip(&mut others), |(mut part, others)| {
        let (mut rows, mut spheres) = ([(0, 0); ROWS], [Sphere::default(); ROWS]);
        let mut count = 0;
        for (word, &bits) in changed.iter().enumerate() {
            let first = word * 64;
            // Bit by bit takes longer, and where many move most words are such.
            if bits == u64::MAX {
                rows[count..count + 64].iter_mut().zip(first..).for_each(|(row, changed)| row.0 = changed);
                count += 64;
            } else {
                for_each_set(bits, |bit| {
                    rows[count].0 = first + bit as usize;
                    count += 1;
                });
            }
            if count + 64 <= ROWS && word + 1 < changed.len() {
                continue;
            }
            let listed = std::mem::take(&mut count);
            let mut concerned = 0;
            for i in 0..listed {
                let (row, _) = rows[i];
                let place = places.get(table.entities[row]);
                rows[concerned] = (row, place);
                concerned += usize::from(part.is_concerned(place));
            }
            let rows = &rows[..concerned];
            part.read_ahead(rows.iter().map(|&(_, place)| place));
            table.read_ahead(rows.iter().map(|&(row, _)| row));
            for (sphere, &(row, _)) in spheres.iter_mut().zip(rows) {
                *sphere = table.bounds(row).unwrap_or(NO_BOUNDS);
            }
            for (&(row, place), &sphere) in rows.iter().zip(&spheres) {
                if sphere.radius != NO_BOUNDS.radius && part.moved(place, sphere) {
                    others.push(row as u32);
                }
            }
        }
    });
    let mut others = others.concat();
    others.sort_unstable();
    others
}

/// Stands for the bounds of what has none.
const NO_BOUNDS: Sphere = Sphere { center: Vec3::ZERO, radius: -1.0 };
