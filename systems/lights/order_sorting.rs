//! When the order of objects is sorted, and how.
//!
//! An order is only as good as it was when it was sorted. All of it is sorted again when its groups have grown, which
//! costs as much as searching everything once. What moves on while the rest stands would stretch the boxes of its
//! neighbours long before that: such objects leave for a part of their own behind the settled ones, where the newcomers
//! are, too, and which is sorted by itself now and then.

use super::curve::hilbert_keys;
use super::order::{NOWHERE, ObjectOrder, PART_PLACES};
use super::tree::{Node, WIDTH};
use crate::ecs::bits::for_each_set;
use bevy_tasks::TaskPool;

/// After every object was searched this often on average, the order is looked at.
const LOOK_AFTER: usize = 16;
/// The order is sorted again when its groups have grown by this factor.
const WORN: f64 = 1.3;
/// And when more than one object in so many is no longer, or not yet, where sorting would put it.
const MANY_UNSETTLED: usize = 8;
/// Objects that move go to a part of their own, which is sorted, each time they have moved for so many frames ...
const GATHER_AFTER: usize = 32;
/// ... and are no fewer than these, and while that part is no more than one in so many of all: to sort it must not take
/// long.
const FEW_MOVING: usize = 64;
const MANY_GATHERED: usize = 16;

impl ObjectOrder {
    /// Gives objects that moved for a while a part of the order of their own, sorted by itself, and the newcomers with
    /// them.
    pub(crate) fn gather_moving(&mut self, pool: &TaskPool) {
        let moving = self.dirty_count();
        self.moved += moving;
        let range = FEW_MOVING..=self.spheres.len() / MANY_GATHERED;
        if !range.contains(&moving) {
            self.moved = 0;
        }
        if !range.contains(&moving) || self.moved < GATHER_AFTER * moving {
            return;
        }
        self.moved = 0;
        let settled = self.settled as u32;
        let mut places = Vec::with_capacity(moving);
        for (&bits, first) in self.dirty.iter().zip((0..settled).step_by(64)) {
            for_each_set(bits, |bit| places.push(first + bit));
        }
        places.retain(|&place| place < settled);
        if !range.contains(&(self.unsettled() + places.len())) {
            places.clear();
        }
        for place in places {
            let (sphere, object) = (self.spheres[place as usize], self.objects[place as usize]);
            self.leave(place);
            if let Some(object) = object {
                let place = self.claim(object);
                self.moved(place, sphere);
            }
        }
        self.sort_unsettled(pool);
    }

    /// Number of objects behind the settled ones.
    fn unsettled(&self) -> usize {
        self.spheres.len() - self.settled - self.free.len()
    }

    /// Sorts the objects behind the settled ones along a curve of their own.
    fn sort_unsettled(&mut self, pool: &TaskPool) {
        let (first, end) = (self.settled, self.spheres.len());
        let keys = hilbert_keys(pool, &self.spheres[first..]);
        let mut order: Vec<(u32, usize)> = keys.into_iter().zip(first..).collect();
        order.retain(|&(_, old)| self.objects[old].is_some());
        radsort::sort_by_key(&mut order, |&(key, _)| key);
        let is_dirty = |dirty: &[u64], place: usize| dirty[place / 64] >> (place % 64) & 1;
        let sorted = order.iter().map(|&(_, old)| (self.spheres[old], self.objects[old], is_dirty(&self.dirty, old)));
        let sorted: Vec<_> = sorted.chain(std::iter::repeat((NOWHERE, None, 0))).take(end - first).collect();
        self.free = (first as u32 + order.len() as u32..end as u32).rev().collect();
        for ((sphere, object, dirty), place) in sorted.into_iter().zip(first..) {
            (self.spheres[place], self.objects[place]) = (sphere, object);
            self.dirty[place / 64] = self.dirty[place / 64] & !(1 << (place % 64)) | dirty << (place % 64);
            self.set_stale(place as u32);
            object.into_iter().for_each(|object| self.places.set(object, place as u32));
        }
    }

    /// Tells if the order has changed or worn so much that sorting pays.
    pub(crate) fn needs_sorting(&mut self, pool: &TaskPool) -> bool {
        if self.unsettled() * MANY_UNSETTLED > self.spheres.len() {
            return true;
        }
        if self.searched < LOOK_AFTER * self.spheres.len().max(WIDTH) {
            return false;
        }
        self.searched = 0;
        self.refresh(pool);
        self.extent() > WORN * self.sorted_extent
    }

    /// Sum of the diagonals of the settled groups' boxes.
    fn extent(&self) -> f64 {
        let nodes = self.levels.first().into_iter().flatten().take(self.settled / (WIDTH * WIDTH));
        nodes.map(Node::extent).sum()
    }

    /// Sorts the objects along a Hilbert curve; places without one are given up.
    pub(crate) fn sort(&mut self, pool: &TaskPool) {
        let keys = hilbert_keys(pool, &self.spheres);
        let mut order: Vec<(u32, u32)> = keys.into_iter().zip(0..).collect();
        order.retain(|&(_, old)| self.objects[old as usize].is_some());
        radsort::sort_by_key(&mut order, |&(key, _)| key);
        // One after another: of each list there is an old and a new one only while it is made.
        let mut dirty = vec![0; order.len().div_ceil(64)];
        for (new, &(_, old)) in order.iter().enumerate() {
            dirty[new / 64] |= (self.dirty[old as usize / 64] >> (old % 64) & 1) << (new % 64);
        }
        self.dirty = dirty;
        self.spheres = order.iter().map(|&(_, old)| self.spheres[old as usize]).collect();
        self.objects = order.iter().map(|&(_, old)| self.objects[old as usize]).collect();
        for (object, place) in self.objects.iter().flatten().zip(0..) {
            self.places.set(*object, place);
        }
        self.stale = vec![u64::MAX; order.len().div_ceil(PART_PLACES)];
        drop(order);
        self.levels.clear();
        self.free.clear();
        self.left.clear();
        (self.settled, self.moved, self.searched) = (self.spheres.len(), 0, 0);
        self.refresh(pool);
        self.sorted_extent = self.extent();
    }
}
