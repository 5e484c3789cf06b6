//! The choice of lights in a world with cells.
//!
//! Objects that are outside, and that no light out of a cell reaches, choose among the lights that are outside, as if
//! there were no cells. Every other object goes through the lists of the cells that it is in. They are short: a light
//! is in the list of a cell that it has a window in.

use super::brute_force::{Reaching, choose};
use super::floods::{FloodChange, LightFloods};
use super::lists::{LightLists, ListedLights, MOST_LISTED};
use super::order::ObjectOrder;
use super::policy::{LightPolicy, Policies};
use super::relevance::{ScoredLight, score};
use super::selected::SelectedLights;
use super::selection::select_parallel;
use super::tree::{WIDTH, order_of};
use crate::cells::cells::{Cells, OUTSIDE};
use crate::cells::occupied::Occupied;
use crate::ecs::bits::for_each_set;
use crate::ecs::parallel::map_on_pool;
use crate::lights::search::clusters::Level;
use crate::space::bounds::{Aabb, Sphere};
use bevy_ecs::entity::EntityIndex;
use bevy_tasks::TaskPool;

/// Objects per task.
const CHUNK: usize = 256;

/// Cells and floods that decide which lights get to an object.
#[derive(Clone, Copy)]
pub(crate) struct Walls<'a, B> {
    pub cells: &'a Cells,
    pub floods: &'a LightFloods,
    /// The box of an object, world space.
    pub aabb: &'a B,
}

/// The objects of a search, by index.
pub(crate) struct Searched<'a, O, P> {
    pub spheres: &'a [Sphere],
    pub object: &'a O,
    pub policy: &'a P,
    /// Their places in the order.
    pub place: &'a (dyn Fn(usize) -> u32 + Sync),
}

/// The objects of a task that do not choose as if there were no cells.
#[derive(Default)]
struct Found {
    /// Indices of objects, and the lights that they chose.
    chosen: Vec<(u32, SelectedLights)>,
    further: ListedLights,
    /// The others.
    others: Vec<u32>,
}

impl<B: Fn(EntityIndex) -> Option<Aabb> + Sync> Walls<'_, B> {
    /// Chooses the lights of the objects, with what they have beyond their three in the lists.
    pub fn search<O, P>(
        &self,
        pool: &TaskPool,
        scored: &[ScoredLight],
        searched: &Searched<O, P>,
        lists: &mut LightLists,
        found: &mut [SelectedLights],
    ) where
        O: Fn(usize) -> Option<EntityIndex> + Sync,
        P: Fn(usize) -> LightPolicy + Sync,
    {
        let Searched { spheres, object, policy, place } = searched;
        let most = MOST_LISTED / spheres.len().div_ceil(CHUNK).max(1);
        let parts = map_on_pool(pool, spheres.chunks(CHUNK).enumerate(), |(chunk, spheres)| {
            let mut part = Found { further: ListedLights::with_room(most), ..Found::default() };
            let (mut occupied, mut reaching, mut slots) = (Occupied::default(), Vec::new(), Vec::new());
            for (&sphere, i) in spheres.iter().zip(chunk * CHUNK..) {
                let aabb = object(i).and_then(|object| (self.aabb)(object));
                let is_finite = sphere.center.is_finite() && sphere.radius.is_finite();
                let Some(aabb) = aabb.filter(|_| is_finite) else {
                    part.others.push(i as u32);
                    continue;
                };
                occupied.set(self.cells, aabb);
                if !self.list(scored, sphere, &occupied, &mut slots, &mut reaching) {
                    part.others.push(i as u32);
                    continue;
                }
                let light = |slot: u32| &scored[slot as usize];
                let selection = choose(&reaching, light, sphere.radius.max(0.0), policy(i), &mut part.further);
                part.further.end_object();
                part.chosen.push((i as u32, SelectedLights::pack(&selection)));
            }
            part
        });
        let others: Vec<usize> = parts.iter().flat_map(|part| &part.others).map(|&i| i as usize).collect();
        let other_spheres: Vec<Sphere> = others.iter().map(|&i| spheres[i]).collect();
        let places: Vec<u32> = others.iter().map(|&i| place(i)).collect();
        let policies: Vec<LightPolicy> = others.iter().map(|&i| policy(i)).collect();
        let mut chosen = vec![SelectedLights::default(); others.len()];
        let (tree, outdoor_lights) = self.floods.search_outdoors();
        let work = (&other_spheres[..], &mut chosen[..]);
        let further = select_parallel(pool, tree, outdoor_lights, Policies::Each(&policies), Some(&places), work);
        lists.take(&further, others.iter().map(|&i| object(i)), &mut chosen);
        others.into_iter().zip(chosen).for_each(|(i, chosen)| found[i] = chosen);
        for part in parts {
            let (indices, mut chosen): (Vec<u32>, Vec<SelectedLights>) = part.chosen.into_iter().unzip();
            lists.take(&[part.further], indices.iter().map(|&i| object(i as usize)), &mut chosen);
            indices.into_iter().zip(chosen).for_each(|(i, chosen)| found[i as usize] = chosen);
        }
    }

    /// Lists the lights that reach an object, in the order in which they are added up. Returns whether it has to choose
    /// among these: not if it is outside and no light in a cell reaches it.
    fn list(
        &self,
        scored: &[ScoredLight],
        sphere: Sphere,
        occupied: &Occupied,
        slots: &mut Vec<(u32, u64, u32)>,
        reaching: &mut Vec<Reaching>,
    ) -> bool {
        slots.clear();
        reaching.clear();
        let may_reach = |slot: u32| {
            let light = &scored[slot as usize];
            // Farther away no score is above 0, with room for rounding.
            let reach = 1.001 * (light.range + sphere.radius);
            let is_near =
                light.range == f32::INFINITY || light.position.distance_squared(sphere.center) < reach * reach;
            order_of(light, slot).filter(|_| is_near)
        };
        for &(cell, _) in occupied.cells() {
            slots.extend(self.floods.of_cell(cell).iter().filter_map(|&slot| may_reach(slot)));
        }
        let reach = |slot: u32| {
            let light = &scored[slot as usize];
            let score = score(light, sphere);
            let share = if score > 0.0 { self.floods.share(slot, occupied) } else { 0.0 };
            Reaching::new(light, slot, score, sphere, share)
        };
        if occupied.is_outside() && !slots.iter().any(|&(.., slot)| reach(slot).is_some()) {
            return false;
        }
        if occupied.weight(OUTSIDE).is_some() {
            slots.extend(self.floods.outdoors().iter().filter_map(|&slot| may_reach(slot)));
        }
        slots.sort_unstable();
        slots.dedup();
        reaching.extend(slots.iter().filter_map(|&(.., slot)| reach(slot)));
        true
    }

    /// Marks the objects that choose again: those for which a light that changed is another one than before, or that get
    /// another share of it.
    pub fn mark(&self, pool: &TaskPool, level: Level, order: &mut ObjectOrder) {
        order.refresh(pool);
        let changes = self.floods.changes();
        // Places of objects, and the changes that may concern them: the cells of an object are found once for all.
        let mut concerned: Vec<(u32, u32)> = Vec::new();
        for (number, change) in (0..).zip(changes) {
            let groups = if change.lights.iter().any(|light| light.range == f32::INFINITY) {
                (0..order.spheres().len().div_ceil(WIDTH) as u32).map(|group| (group, (1 << WIDTH) - 1)).collect()
            } else {
                order.find_reached(level, &change.lights)
            };
            for (group, bits) in groups {
                for_each_set(bits, |bit| concerned.push((group * WIDTH as u32 + bit, number)));
            }
        }
        concerned.sort_unstable();
        let by_place: Vec<_> = concerned.chunk_by(|a, b| a.0 == b.0).collect();
        let objects = &*order;
        let marked = map_on_pool(pool, by_place.chunks(CHUNK), |by_place| {
            let mut occupied = Occupied::default();
            let chooses = |of_place: &&&[(u32, u32)]| {
                let place = of_place[0].0;
                let object = objects.object_to_mark(place);
                let Some(aabb) = object.and_then(|object| (self.aabb)(object)) else { return false };
                occupied.set(self.cells, aabb);
                let sphere = objects.spheres()[place as usize];
                of_place.iter().any(|&(_, number)| self.concerns(&changes[number as usize], sphere, &occupied))
            };
            by_place.iter().filter(chooses).map(|of_place| of_place[0].0).collect::<Vec<u32>>()
        });
        marked.into_iter().flatten().for_each(|place| order.mark_one(place));
    }

    /// Tells if a light that changed is another one for an object than before, or the object gets another share of it.
    fn concerns(&self, change: &FloodChange, sphere: Sphere, occupied: &Occupied) -> bool {
        let lights = &change.lights;
        let after = self.floods.flood(change.slot);
        let floods = [change.flood_before.as_ref().unwrap_or(after), after];
        let gets = |i: usize| {
            let share = floods[i].share(occupied);
            if score(&lights[i], sphere) > 0.0 { share } else { 0.0 }
        };
        let (before, after) = (gets(0), gets(1));
        before != after || lights[0] != lights[1] && after > 0.0
    }
}
