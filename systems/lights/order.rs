//! The objects in the order in which they are searched, under a tree of boxes that finds those a light reaches.
//!
//! Every object has a place in an order along a Hilbert curve, so that neighbours in the order are neighbours in
//! space. Results do not depend on the order, which is sorted when it has become slow (`order_sorting.rs`). Beside the
//! spheres there is a bit for each object whose lights must be chosen again: it moved, or `ObjectOrder::mark` found
//! that a light which changed reaches it or did.

use super::lists::LightLists;
use super::policy::OwnPolicies;
use super::record::LightRecord;
use super::relevance::ScoredLight;
use super::tree::{Node, Volume, WIDTH, refit};
use crate::ecs::bits::for_each_set;
use crate::ecs::entity_numbers::EntityNumbers;
use crate::ecs::parallel::map_on_pool;
use crate::ecs::read_ahead::read_ahead;
use crate::lights::search::candidates::{node_in_cone, node_in_range};
use crate::lights::search::clusters::Level;
use crate::lights::search::lanes::{Floats, Objects, Shining};
use crate::space::bounds::{Sphere, around};
use bevy_ecs::entity::EntityIndex;
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;
use bevy_tasks::TaskPool;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch};
use glam::Vec3;

/// Lights per task when objects are marked.
const LIGHTS_PER_TASK: usize = 128;
/// Groups of objects per task when their boxes are brought up to date.
const GROUPS_PER_TASK: usize = 512;
/// Sphere of an empty place, and of an object that is not finite.
pub(crate) const NOWHERE: Sphere = Sphere { center: Vec3::NAN, radius: 0.0 };

/// Notes the place of an object that lost its mesh or its life or is disabled; the next frame empties it.
pub(crate) fn free_place(mut world: DeferredWorld, context: HookContext) {
    let Some(mut order) = world.get_resource_mut::<ObjectOrder>() else { return };
    if let Some(place) = order.places.take(context.entity) {
        order.freed.push(place);
    }
}

/// Notes what has become of an object's policy; it chooses its lights again.
pub(crate) fn note_policy(mut world: DeferredWorld, object: Entity, note: impl FnOnce(&mut OwnPolicies, EntityIndex)) {
    let Some(mut order) = world.get_resource_mut::<ObjectOrder>() else { return };
    note(&mut order.own_policies, object.index());
    let place = order.places.get(object);
    if place != EntityNumbers::NONE {
        order.mark_one(place);
    }
}

/// Bounds of all objects by place, and which of them changed.
#[derive(Resource, Debug, Default)]
pub struct ObjectOrder {
    pub(crate) spheres: Vec<Sphere>,
    /// Object at each place.
    pub(crate) objects: Vec<Option<EntityIndex>>,
    /// Place of each object, by entity.
    pub(crate) places: EntityNumbers,
    /// A bit per place: lights are to be chosen again.
    pub(crate) dirty: Vec<u64>,
    /// Without which no bit of `dirty` is set.
    may_be_dirty: bool,
    /// A bit per group of 16 places: its box in the tree is not up to date.
    pub(crate) stale: Vec<u64>,
    /// Boxes around groups, around nodes of 16 groups, …
    pub(crate) levels: Vec<Vec<Node>>,
    /// Places before this one are as they were sorted; behind are objects that came since then, or moved.
    pub(crate) settled: usize,
    /// Given back since the last frame.
    freed: Vec<u32>,
    /// Policies of the objects that have one of their own.
    pub(crate) own_policies: OwnPolicies,
    /// Without an object, behind the settled ones: for the next that comes.
    pub(crate) free: Vec<u32>,
    /// Without an object, among the settled ones: what came there would have no neighbours.
    pub(crate) left: Vec<u32>,
    /// Objects that moved in each frame since those that do were gathered, added up.
    pub(crate) moved: usize,
    /// Searches since the order was looked at.
    pub(crate) searched: usize,
    /// Extent of the settled groups just after sorting.
    pub(crate) sorted_extent: f64,
}

/// Places whose bits fill a word of `ObjectOrder::stale`.
pub(crate) const PART_PLACES: usize = 64 * WIDTH;

/// A part of the order, for a task of its own.
#[derive(Default)]
pub(crate) struct OrderPart<'a> {
    first: usize,
    spheres: &'a mut [Sphere],
    dirty: &'a mut [u64],
    stale: &'a mut [u64],
    /// Its places, and for the last part all behind them.
    concerned: usize,
}

impl OrderPart<'_> {
    /// Tells if this part decides about an object at that place.
    #[inline]
    pub fn is_concerned(&self, place: u32) -> bool {
        (place as usize).wrapping_sub(self.first) < self.concerned
    }

    /// Reads what [`Self::moved`] writes, of some places.
    #[inline(always)]
    pub fn read_ahead(&self, places: impl Iterator<Item = u32>) {
        read_ahead(places.map(|place| {
            let sphere = self.spheres.get((place as usize).wrapping_sub(self.first));
            sphere.map_or(0, |sphere| sphere.radius.to_bits())
        }));
    }

    /// [`ObjectOrder::moved`] for a place that it is concerned with. Returns whether there is no such place.
    #[inline]
    pub fn moved(&mut self, place: u32, sphere: Sphere) -> bool {
        let place = (place as usize).wrapping_sub(self.first);
        let Some(old) = self.spheres.get_mut(place) else { return true };
        *old = sphere;
        self.dirty[place / 64] |= 1 << (place % 64);
        self.stale[place / PART_PLACES] |= 1 << (place / WIDTH % 64);
        false
    }
}

/// The objects that choose again in a frame.
#[derive(Debug, Default)]
pub(crate) struct Dirty {
    /// Ascending.
    pub places: Vec<u32>,
    /// A bit per place, and how many there are before each word.
    bits: Vec<u64>,
    before: Vec<u32>,
}

impl Dirty {
    /// Tells if the object at a place chooses again.
    pub fn contains(&self, place: u32) -> bool {
        self.bits.get(place as usize / 64).is_some_and(|bits| bits >> (place % 64) & 1 != 0)
    }

    /// Index of a place among those that choose again.
    pub fn index(&self, place: u32) -> usize {
        let word = place as usize / 64;
        self.before[word] as usize + (self.bits[word] & ((1 << (place % 64)) - 1)).count_ones() as usize
    }
}

impl ObjectOrder {
    /// Bounds by place; not finite where there is no object.
    pub fn spheres(&self) -> &[Sphere] {
        &self.spheres
    }

    pub(crate) fn places(&self) -> &EntityNumbers {
        &self.places
    }

    /// The object at a place, if there is one.
    pub(crate) fn object(&self, place: u32) -> Option<EntityIndex> {
        self.objects[place as usize]
    }

    /// Empties the places of objects that are gone, and takes their lists.
    pub(crate) fn release_freed(&mut self, lists: &mut LightLists) {
        for place in std::mem::take(&mut self.freed) {
            self.objects[place as usize].into_iter().for_each(|object| lists.free(object));
            self.leave(place);
        }
    }

    /// The object at a place chooses again.
    pub(crate) fn mark_one(&mut self, place: u32) {
        self.dirty[place as usize / 64] |= 1 << (place % 64);
        self.may_be_dirty = true;
    }

    /// Empties a place.
    pub(crate) fn leave(&mut self, place: u32) {
        self.spheres[place as usize] = NOWHERE;
        self.objects[place as usize] = None;
        self.dirty[place as usize / 64] &= !(1 << (place % 64));
        self.set_stale(place);
        if (place as usize) < self.settled { self.left.push(place) } else { self.free.push(place) }
    }

    /// A place for a new object.
    pub(crate) fn claim(&mut self, object: EntityIndex) -> u32 {
        let place = self.free.pop().unwrap_or_else(|| {
            self.spheres.push(NOWHERE);
            self.objects.push(None);
            self.dirty.resize(self.spheres.len().div_ceil(64), 0);
            self.stale.resize(self.spheres.len().div_ceil(PART_PLACES), 0);
            self.spheres.len() as u32 - 1
        });
        self.objects[place as usize] = Some(object);
        self.places.set(object, place);
        place
    }

    /// Makes room for the objects of some tables. Lists that grow little by little move, and leave gaps in the
    /// process's memory.
    pub(crate) fn reserve<'a, T: Iterator<Item = &'a [Entity]>>(&mut self, tables: impl Fn() -> T) {
        let objects: usize = tables().map(<[Entity]>::len).sum();
        self.spheres.reserve(objects.saturating_sub(self.spheres.len()));
        self.objects.reserve(objects.saturating_sub(self.objects.len()));
        self.places.reserve(tables);
    }

    /// The object at a place has moved.
    pub(crate) fn moved(&mut self, place: u32, sphere: Sphere) {
        self.spheres[place as usize] = sphere;
        self.mark_one(place);
        self.set_stale(place);
    }

    /// The order in so many parts, or fewer, to write in them what moved; and where each object is.
    pub(crate) fn parts(&mut self, count: usize) -> (Vec<OrderPart<'_>>, &EntityNumbers) {
        self.may_be_dirty = true;
        let places = self.spheres.len().div_ceil(count).next_multiple_of(PART_PLACES).max(PART_PLACES);
        let bits = self.dirty.chunks_mut(places / 64).zip(self.stale.chunks_mut(places / PART_PLACES));
        let parts = self.spheres.chunks_mut(places).zip(bits).zip((0..).step_by(places));
        let mut parts: Vec<OrderPart> = parts
            .map(|((spheres, (dirty, stale)), first)| OrderPart { first, spheres, dirty, stale, concerned: places })
            .collect();
        if parts.is_empty() {
            parts.push(OrderPart::default());
        }
        if let Some(last) = parts.last_mut() {
            // What is before it counts as far behind it, and farther than this.
            last.concerned = usize::MAX - last.first;
        }
        (parts, &self.places)
    }

    pub(crate) fn set_stale(&mut self, place: u32) {
        let group = place as usize / WIDTH;
        self.stale[group / 64] |= 1 << (group % 64);
    }

    /// Every object chooses again.
    pub(crate) fn mark_all(&mut self) {
        self.dirty.fill(u64::MAX);
        self.may_be_dirty = true;
        let rest = self.spheres.len() % 64;
        if let (1.., Some(last)) = (rest, self.dirty.last_mut()) {
            *last = (1 << rest) - 1;
        }
        for &place in self.free.iter().chain(&self.left) {
            self.dirty[place as usize / 64] &= !(1 << (place % 64));
        }
    }

    /// Number of objects that are to choose again.
    pub(crate) fn dirty_count(&self) -> usize {
        if !self.may_be_dirty {
            return 0;
        }
        self.dirty.iter().map(|bits| bits.count_ones() as usize).sum()
    }

    /// There is no object that is to choose again.
    pub(crate) fn nothing_dirty(&mut self) {
        self.may_be_dirty = false;
    }

    /// All objects choose now, whether they are to or not.
    pub(crate) fn take_all(&mut self) {
        self.dirty.fill(0);
        self.may_be_dirty = false;
        self.searched += self.spheres.len();
    }

    /// The objects that are to choose again.
    pub(crate) fn take_dirty(&mut self, dirty: &mut Dirty) {
        dirty.places.clear();
        dirty.before.clear();
        dirty.bits.clone_from(&self.dirty);
        self.dirty.fill(0);
        self.may_be_dirty = false;
        for (word, &bits) in dirty.bits.iter().enumerate() {
            dirty.before.push(dirty.places.len() as u32);
            for_each_set(bits, |bit| dirty.places.push(word as u32 * 64 + bit));
        }
        self.searched += dirty.places.len();
    }

    /// The corners of a box around all objects with bounds.
    pub(crate) fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let (min, max, radius) = self.levels.last()?.first()?.bounds()?;
        Some((min - radius, max + radius))
    }

    /// The objects of some kind, as [`Self::refresh`] left them. `may_hold` says of a box, by its corners, whether
    /// bounds of that kind may lie in it or stick out of it.
    pub(crate) fn within(
        &self,
        may_hold: impl Fn(Vec3, Vec3) -> bool,
        is_wanted: impl Fn(Sphere) -> bool,
    ) -> Vec<EntityIndex> {
        let mut objects = Vec::new();
        let mut stack: Vec<_> = self.levels.len().checked_sub(1).map(|top| (top, 0)).into_iter().collect();
        while let Some((level, index)) = stack.pop() {
            for (child, (min, max, radius)) in self.levels[level][index].numbered() {
                let (radius, child) = (Vec3::splat(radius), index * WIDTH + child);
                if !may_hold(min - radius, max + radius) {
                    continue;
                }
                if level > 0 {
                    stack.push((level - 1, child));
                    continue;
                }
                let places = child * WIDTH..self.spheres.len().min((child + 1) * WIDTH);
                let wanted = places.filter(|&place| is_wanted(self.spheres[place]));
                objects.extend(wanted.filter_map(|place| self.objects[place]));
            }
        }
        objects
    }

    /// Every object that one of the lights reaches chooses again; each light as it was before a change and as it is
    /// after it.
    pub(crate) fn mark(&mut self, pool: &TaskPool, level: Level, lights: &[[ScoredLight; 2]]) {
        if lights.iter().flatten().any(|light| light.range == f32::INFINITY) {
            return self.mark_all();
        }
        self.refresh(pool);
        let order = &*self;
        let groups = self.spheres.len().div_ceil(WIDTH);
        let found = map_on_pool(pool, lights.chunks(LIGHTS_PER_TASK), |lights| {
            let mut found = Vec::new();
            let mut stack = Vec::new();
            dispatch!(level, simd => {
                for change in lights {
                    // So many that all may as well choose again.
                    if found.len() > groups {
                        break;
                    }
                    order.find_changed(simd, change, &mut stack, &mut found);
                }
            });
            found
        });
        if found.iter().any(|found| found.len() > groups) {
            return self.mark_all();
        }
        self.may_be_dirty = true;
        for (group, bits) in found.into_iter().flatten() {
            self.dirty[group as usize / 4] |= bits << (group % 4 * WIDTH as u32);
        }
    }

    /// Lists the groups that a light reaches or did, with a bit for each object; after [`Self::refresh`].
    pub(crate) fn find_reached(&self, level: Level, change: &[ScoredLight; 2]) -> Vec<(u32, u64)> {
        let (mut stack, mut found) = (Vec::new(), Vec::new());
        dispatch!(level, simd => self.find_changed(simd, change, &mut stack, &mut found));
        found
    }

    /// The object at a place, unless it is to choose again already.
    pub(crate) fn object_to_mark(&self, place: u32) -> Option<EntityIndex> {
        let is_dirty = self.dirty.get(place as usize / 64)? >> (place % 64) & 1 != 0;
        self.objects.get(place as usize).copied().flatten().filter(|_| !is_dirty)
    }

    /// Lists the groups that a light reaches or did, with a bit for each object. One that moved a little reaches nearly
    /// what it did, and is looked for once.
    #[inline(always)]
    fn find_changed<S: Simd>(
        &self,
        simd: S,
        change: &[ScoredLight; 2],
        stack: &mut Vec<(u32, u32)>,
        found: &mut Vec<(u32, u64)>,
    ) {
        let [before, after] = change;
        let is_near = before.position.distance(after.position) < before.range.min(after.range);
        for lights in if is_near { change.chunks(2) } else { change.chunks(1) } {
            self.find(simd, lights, stack, found);
        }
    }

    /// Lists the groups that some light reaches, with a bit for each object.
    #[inline(always)]
    fn find<S: Simd>(&self, simd: S, lights: &[ScoredLight], stack: &mut Vec<(u32, u32)>, found: &mut Vec<(u32, u64)>) {
        let (mut min, mut max, mut range) = (Vec3::INFINITY, Vec3::NEG_INFINITY, 0.0f32);
        for light in lights.iter().filter(|light| light.kind != LightRecord::OFF) {
            (min, max, range) = (min.min(light.position), max.max(light.position), range.max(light.range));
        }
        stack.clear();
        if range > 0.0 && !self.spheres.is_empty() {
            stack.push((self.levels.len() as u32 - 1, 0));
        }
        let volume = Volume::new(min, max, range);
        while let Some((level, index)) = stack.pop() {
            let node = &self.levels[level as usize][index as usize];
            let hit = node_in_range(simd, node, &volume) & in_cones(simd, node, lights);
            let first = index * WIDTH as u32;
            if level > 0 {
                for_each_set(hit, |child| stack.push((level - 1, first + child)));
                continue;
            }
            for_each_set(hit, |group| read_group_ahead(&self.spheres, (first + group) as usize));
            for_each_set(
                hit,
                #[inline(always)]
                |group| {
                    let bits = self.reached(simd, lights, (first + group) as usize);
                    if bits != 0 {
                        found.push((first + group, bits));
                    }
                },
            );
        }
    }

    /// Objects of a group that some light reaches: a bit each.
    #[inline(always)]
    fn reached<S: Simd>(&self, simd: S, lights: &[ScoredLight], group: usize) -> u64 {
        let lanes = Floats::<S>::LEN;
        let places = group * WIDTH..self.spheres.len().min((group + 1) * WIDTH);
        let mut bits = 0;
        for (i, spheres) in self.spheres[places].chunks(lanes).enumerate() {
            let objects = Objects::load(simd, spheres);
            for light in lights {
                let (score, _) = match light.kind {
                    LightRecord::OFF => continue,
                    LightRecord::POINT => objects.score::<false>(simd, &Shining::of(simd, light)),
                    _ => objects.score::<true>(simd, &Shining::of(simd, light)),
                };
                bits |= score.simd_gt(0.0).to_bitmask() << (i * lanes);
            }
        }
        bits
    }

    /// Brings the boxes of groups whose objects changed up to date, and those above them.
    pub(crate) fn refresh(&mut self, pool: &TaskPool) {
        self.resize_levels();
        let stale = self.stale.iter().map(|bits| bits.count_ones() as usize).sum::<usize>();
        let words = self.stale.len().div_ceil((stale / GROUPS_PER_TASK).clamp(1, 4 * pool.thread_num())).max(1);
        let nodes = words * PART_PLACES / (WIDTH * WIDTH);
        let Some(level) = self.levels.first_mut() else { return };
        let parts =
            self.spheres.chunks(words * PART_PLACES).zip(self.stale.chunks_mut(words)).zip(level.chunks_mut(nodes));
        let touched = map_on_pool(pool, parts.enumerate(), |(part, ((spheres, stale), level))| {
            let mut touched: Vec<usize> = Vec::new();
            for (word, bits) in stale.iter_mut().enumerate() {
                let bits = std::mem::take(bits);
                for_each_set(bits, |bit| read_group_ahead(spheres, word * 64 + bit as usize));
                for_each_set(bits, |bit| {
                    let group = word * 64 + bit as usize;
                    let Some(spheres) = spheres.chunks(WIDTH).nth(group) else { return };
                    level[group / WIDTH].set(group % WIDTH, around(spheres));
                    let node = part * nodes + group / WIDTH;
                    if touched.last() != Some(&node) {
                        touched.push(node);
                    }
                });
            }
            touched
        });
        refit(&mut self.levels, touched.concat());
    }

    /// Makes the tree as large as the order, which only grows; all of it stale where it becomes higher.
    fn resize_levels(&mut self) {
        let above = |&nodes: &usize| (nodes > 1).then(|| nodes.div_ceil(WIDTH));
        let lowest = self.spheres.len().div_ceil(WIDTH * WIDTH).max(1);
        let sizes: Vec<usize> = std::iter::successors(Some(lowest), above).collect();
        if self.levels.len() != sizes.len() {
            self.levels = vec![Vec::new(); sizes.len()];
            self.stale.fill(u64::MAX);
        }
        for (level, nodes) in self.levels.iter_mut().zip(sizes) {
            level.resize(nodes, Node::EMPTY);
        }
    }
}

/// Reads something of each cache line of a group's spheres, if it is a whole one.
#[inline(always)]
fn read_group_ahead(spheres: &[Sphere], group: usize) {
    let Some(group) = spheres.get(group * WIDTH..(group + 1) * WIDTH) else { return };
    let radius = |i: usize| group[i].radius.to_bits();
    read_ahead((0..WIDTH).step_by(64 / size_of::<Sphere>()).chain([WIDTH - 1]).map(radius));
}

/// Children of a node that some of the lights shine at: a bit each.
#[inline(always)]
fn in_cones<S: Simd>(simd: S, node: &Node, lights: &[ScoredLight]) -> u64 {
    let mut bits = 0;
    for light in lights {
        bits |= match light.kind {
            LightRecord::OFF => 0,
            LightRecord::POINT => u64::MAX,
            _ => node_in_cone(simd, node, light),
        };
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy_tasks::TaskPoolBuilder;

    #[test]
    fn boxes_are_the_same_whatever_the_number_of_threads() {
        let levels = |threads: usize| {
            let pool = TaskPoolBuilder::new().num_threads(threads).build();
            let mut order = ObjectOrder::default();
            let sphere = |i: u32, turn: f32| Sphere { center: Vec3::new(i as f32 * turn, turn, -turn), radius: 1.0 };
            for i in 0..50_000 {
                let place = order.claim(EntityIndex::from_raw_u32(i).unwrap());
                order.moved(place, sphere(i, 1.0));
            }
            order.refresh(&pool);
            // Enough for a few tasks, and not all.
            for i in (0..50_000).step_by(20) {
                order.moved(i, sphere(i, -2.0));
            }
            order.refresh(&pool);
            let bounds = |level: &Vec<Node>| level.iter().map(Node::bounds).collect::<Vec<_>>();
            order.levels.iter().map(bounds).collect::<Vec<_>>()
        };
        let [one, many] = [1, 4].map(levels);
        assert_eq!(one, many);
        assert_eq!(
            one[2][0],
            around(&[
                Sphere { center: Vec3::new(-99_960.0, -2.0, -1.0), radius: 1.0 },
                Sphere { center: Vec3::new(49_999.0, 1.0, 2.0), radius: 1.0 },
            ])
        );
    }
}
