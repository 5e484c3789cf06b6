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
use crate::object_order::{ObjectOrder, Place};
use crate::relevance::ScoredLight;
use crate::stats::FrameStats;
use bevy_ecs::change_detection::ContiguousRef;
use bevy_ecs::prelude::*;
use bevy_tasks::{ComputeTaskPool, TaskPool};

/// Objects per task.
const CHUNK: usize = 4096;
/// Objects are marked as long as no more than one in this many lights changed, or no more than a few.
const MANY_LIGHTS: usize = 8;
const FEW_LIGHTS: usize = 64;
/// All objects are searched if more than one in this many are marked.
const MANY_OBJECTS: usize = 4;

/// [`light_search::select`] with the spheres shared out over the threads of a pool.
pub fn select_parallel(
    pool: &TaskPool,
    tree: &LightTree,
    scored: &[ScoredLight],
    policy: LightPolicy,
    spheres: &[Sphere],
    out: &mut [Selection],
) {
    let level = Level::new();
    if spheres.len() <= CHUNK {
        return light_search::select(level, tree, scored, policy, (spheres, out), &mut Scratch::default());
    }
    pool.scope(|scope| {
        for work in spheres.chunks(CHUNK).zip(out.chunks_mut(CHUNK)) {
            scope.spawn(async move {
                light_search::select(level, tree, scored, policy, work, &mut Scratch::default());
            });
        }
    });
}

/// What [`select_lights`] keeps from frame to frame.
#[derive(Default)]
pub struct Kept {
    policy: LightPolicy,
    places: Vec<u32>,
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
        || table.changes().len() / 2 > FEW_LIGHTS.max(table.scored().len() / MANY_LIGHTS)
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
    order.take_dirty(&mut kept.places);
    stats.selected = kept.places.len();
    if kept.places.len() * MANY_OBJECTS > order.spheres().len() {
        // By place, so that all objects can look theirs up at once.
        kept.selections.resize(order.spheres().len(), Selection::default());
        select_parallel(pool, table.tree(), table.scored(), *policy, order.spheres(), &mut kept.selections);
        let selections = &kept.selections;
        objects.p3().par_iter_mut().for_each(|(place, mut selection)| {
            if let Some(&found) = selections.get(place.0 as usize) {
                selection.set_if_neq(found);
            }
        });
        return;
    }
    kept.spheres.clear();
    kept.spheres.extend(kept.places.iter().map(|&place| order.spheres()[place as usize]));
    kept.selections.clear();
    kept.selections.resize(kept.places.len(), Selection::default());
    select_parallel(pool, table.tree(), table.scored(), *policy, &kept.spheres, &mut kept.selections);
    let mut selections = objects.p2();
    for (&place, &found) in kept.places.iter().zip(&kept.selections) {
        if let Ok(mut selection) = selections.get_mut(order.entity(place)) {
            selection.set_if_neq(found);
        }
    }
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
