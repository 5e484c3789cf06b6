//! Which objects choose their lights again in a frame, and their choice.
//!
//! An object keeps its lights while neither it nor any light that reaches it changed. [`select_lights`] collects the
//! objects that moved, marks those that a changed light reaches or did reach before the change
//! (`ObjectOrder::mark`), and searches for these only. Where most would be marked, marking is left out and all are
//! searched. What comes out is the same as if all had been searched in every frame.
//!
//! For the policy `All`, [`list_reaching`] then lists all lights that reach each object.

use crate::bounds::{Sphere, WorldBounds};
use crate::changes::for_each_changed;
use crate::draw_list::{DrawList, MAX_REACHING};
use crate::instances::InstanceSlot;
use crate::library::MeshId;
use crate::light_search::{self, Level, Scratch};
use crate::light_tree::LightTree;
use crate::lights::{LightPolicy, LightTable, Selection};
use crate::object_order::{Dirty, ObjectOrder, Place};
use crate::relevance::ScoredLight;
use crate::stats::FrameStats;
use bevy_ecs::change_detection::{ContiguousMut, ContiguousRef};
use bevy_ecs::prelude::*;
use bevy_tasks::{ComputeTaskPool, TaskPool};

/// Objects per task.
const CHUNK: usize = 4096;
/// Objects are marked as long as no more than one in this many lights changed, or no more than a few.
const MANY_LIGHTS: usize = 8;
const FEW_LIGHTS: usize = 64;
/// All objects are searched if more than one in this many are marked.
const MANY_OBJECTS: usize = 4;
/// All objects look their selection up if more than one in this many were searched: that reads them in the order they lie
/// in memory, and to find one by its entity costs as much as to pass so many by.
const SOME_OBJECTS: usize = 64;

/// [`light_search::select`] with the spheres shared out over the threads of a pool; `places` where they are not
/// neighbours, see [`light_search::select_sparse`].
pub fn select_parallel(
    pool: &TaskPool,
    tree: &LightTree,
    scored: &[ScoredLight],
    policy: LightPolicy,
    places: Option<&[u32]>,
    (spheres, out): (&[Sphere], &mut [Selection]),
) {
    let level = Level::new();
    let search = |places: Option<&[u32]>, spheres: &[Sphere], out: &mut [Selection]| {
        let scratch = &mut Scratch::default();
        match places {
            Some(places) => light_search::select_sparse(level, tree, scored, policy, (places, spheres, out), scratch),
            None => light_search::select(level, tree, scored, policy, (spheres, out), scratch),
        }
    };
    if spheres.len() <= CHUNK {
        return search(places, spheres, out);
    }
    pool.scope(|scope| {
        for (i, (spheres, out)) in spheres.chunks(CHUNK).zip(out.chunks_mut(CHUNK)).enumerate() {
            let places = places.map(|places| &places[i * CHUNK..i * CHUNK + spheres.len()]);
            let search = &search;
            scope.spawn(async move { search(places, spheres, out) });
        }
    });
}

/// What [`select_lights`] keeps from frame to frame.
#[derive(Default)]
pub struct Kept {
    policy: LightPolicy,
    dirty: Dirty,
    spheres: Vec<Sphere>,
    selections: Vec<Selection>,
}

/// Chooses the lights of the objects that changed or that a light which changed reaches.
#[allow(clippy::type_complexity)]
pub fn select_lights(
    table: Res<LightTable>,
    policy: Res<LightPolicy>,
    mut order: ResMut<ObjectOrder>,
    mut kept: Local<Kept>,
    mut stats: ResMut<FrameStats>,
    mut objects: ParamSet<(
        Query<(Entity, Ref<WorldBounds>, &Place), With<MeshId>>,
        Query<&mut Place>,
        Query<&mut Selection>,
        Query<(&Place, &mut Selection)>,
    )>,
) {
    let pool = ComputeTaskPool::get();
    let level = Level::new();
    let kept = &mut *kept;
    order.release_freed();
    let new = collect_moved(&objects.p0(), &mut order);
    for (entity, place) in new {
        if let Ok(mut component) = objects.p1().get_mut(entity) {
            *component = place;
        }
    }
    if std::mem::replace(&mut kept.policy, *policy) != *policy
        || table.changes().len() > FEW_LIGHTS.max(table.scored().len() / MANY_LIGHTS)
    {
        order.mark_all();
    } else if !table.changes().is_empty() {
        order.mark(pool, level, table.changes());
    }
    if order.needs_sorting() {
        let mut places = objects.p1();
        order.sort(pool, |entity, place| {
            let found = places.get_mut(entity);
            found.map(|mut component| *component = place).is_ok()
        });
    }
    order.take_dirty(&mut kept.dirty);
    let dirty = &kept.dirty;
    stats.selected = dirty.places.len();
    let all = order.spheres().len();
    let is_all = dirty.places.len() * MANY_OBJECTS > all;
    kept.spheres.clear();
    if !is_all {
        kept.spheres.extend(dirty.places.iter().map(|&place| order.spheres()[place as usize]));
    }
    let spheres = if is_all { order.spheres() } else { &kept.spheres };
    kept.selections.resize(spheres.len(), Selection::default());
    let places = (!is_all).then_some(&dirty.places[..]);
    let work = (spheres, &mut kept.selections[..]);
    select_parallel(pool, table.tree(), table.scored(), *policy, places, work);
    let found = &kept.selections;
    if is_all {
        objects.p3().par_iter_mut().for_each(|(place, mut selection)| {
            if let Some(&found) = found.get(place.0 as usize) {
                selection.set_if_neq(found);
            }
        });
    } else if dirty.places.len() * SOME_OBJECTS > all {
        for (places, mut selections) in objects.p3().contiguous_iter_mut().into_iter().flatten() {
            write_rows(places, &mut selections, dirty, found);
        }
    } else {
        let mut selections = objects.p2();
        for (&place, &found) in dirty.places.iter().zip(found) {
            if let Ok(mut selection) = selections.get_mut(order.entity(place)) {
                selection.set_if_neq(found);
            }
        }
    }
}

/// Rows that are looked at together.
const ROWS: usize = 1024;

/// Writes what was found for the objects of a table. First they are listed, without a branch that is hard to predict;
/// then little lies between one access to memory and the next, and the processor waits for many of them at once.
fn write_rows(places: &[Place], selections: &mut ContiguousMut<Selection>, dirty: &Dirty, found: &[Selection]) {
    let mut rows = [0; ROWS];
    for first in (0..places.len()).step_by(ROWS) {
        let mut count = 0;
        for (row, &place) in (first..).zip(&places[first..places.len().min(first + ROWS)]) {
            rows[count] = row;
            count += usize::from(dirty.contains(place));
        }
        for &row in &rows[..count] {
            let found = found[dirty.index(places[row])];
            if differ(&selections.bypass_change_detection()[row], &found) {
                selections.reborrow().slice(row as u32..row as u32 + 1)[0] = found;
            }
        }
    }
}

/// Whether any bits differ.
fn differ(a: &Selection, b: &Selection) -> bool {
    let (a, b): (&[u32; 17], &[u32; 17]) = (bytemuck::cast_ref(a), bytemuck::cast_ref(b));
    a.iter().zip(b).fold(0, |bits, (a, b)| bits | (a ^ b)) != 0
}

/// Enters the objects whose bounds changed into the order; those that are new there, with their places.
fn collect_moved(
    objects: &Query<(Entity, Ref<WorldBounds>, &Place), With<MeshId>>,
    order: &mut ObjectOrder,
) -> Vec<(Entity, Place)> {
    let mut new = Vec::new();
    let mut enter = |entity: Entity, bounds: &WorldBounds, mut place: Place| {
        if !order.owns(entity, place) {
            place = order.claim(entity);
            new.push((entity, place));
        }
        order.moved(place, bounds.0);
    };
    for (entities, bounds, places) in objects.contiguous_iter().into_iter().flatten() {
        let (bounds, ticks) = ContiguousRef::split(bounds);
        for_each_changed(&ticks, |row| enter(entities[row], &bounds[row], places[row]));
    }
    new
}

/// Lists the lights that reach each drawn object, for the policy `All`; empty for the others.
pub fn list_reaching(
    table: Res<LightTable>,
    policy: Res<LightPolicy>,
    stats: Res<FrameStats>,
    mut list: ResMut<DrawList>,
    objects: Query<(&WorldBounds, &Selection, &InstanceSlot)>,
) {
    let list = list.bypass_change_detection();
    if *policy != LightPolicy::All {
        // Gives the memory back, too.
        (list.reaching, list.reaching_elements) = (Vec::new(), 0);
        return;
    }
    if stats.selected == 0 && list.instances.dirty.is_empty() && list.reaching_elements > 0 {
        return;
    }
    let slots = list.instances.records.len();
    list.reaching_version += 1;
    list.reaching.clear();
    list.reaching_elements = slots as u64 + objects.iter().map(|(_, found, _)| u64::from(found.reaching)).sum::<u64>();
    if list.reaching_elements > MAX_REACHING {
        return;
    }
    let drawn = objects.iter().filter_map(|(bounds, _, slot)| Some((slot.get()?, bounds.0)));
    let drawn: Vec<(u32, Sphere)> = drawn.collect();
    let (level, table) = (Level::new(), &*table);
    let found = ComputeTaskPool::get().scope(|scope| {
        for drawn in drawn.chunks(CHUNK) {
            scope.spawn(async move {
                let mut scratch = Scratch::default();
                let reaching =
                    |&(_, sphere)| light_search::reaching(level, table.tree(), table.scored(), sphere, &mut scratch);
                drawn.iter().map(reaching).collect::<Vec<_>>()
            });
        }
    });
    list.reaching.resize(slots, 0);
    for ((slot, _), lights) in drawn.iter().zip(found.iter().flatten()) {
        list.reaching[*slot as usize] = list.reaching.len() as u32;
        list.reaching.extend(lights);
    }
}
