//! The objects in the order in which they are searched, under a tree of boxes that finds those a light reaches.
//!
//! Every object has a [`Place`] in an order along a Hilbert curve, so that neighbours in the order are neighbours in
//! space. The order is only as good as it was when it was sorted; results do not depend on it, so it is sorted again only
//! when it has become slow. Beside the spheres there is a bit for each object whose lights must be chosen again: it moved,
//! or `ObjectOrder::mark` found that a light which changed reaches it or did.

use crate::bounds::Sphere;
use crate::draw_list::LightRecord;
use crate::light_candidates::node_in_range;
use crate::light_lanes::{Floats, Objects};
use crate::light_search::Level;
use crate::light_tree::{Node, Volume, WIDTH};
use crate::relevance::ScoredLight;
use bevy_ecs::lifecycle::HookContext;
use bevy_ecs::prelude::*;
use bevy_ecs::world::DeferredWorld;
use bevy_tasks::TaskPool;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch};
use glam::Vec3;

/// Lights per task when objects are marked.
const LIGHTS_PER_TASK: usize = 128;
/// After every object was searched this often on average, the order is looked at.
const LOOK_AFTER: usize = 16;
/// The order is sorted again when its groups have grown by this factor.
const WORN: f64 = 1.3;
/// What is in no place, or not finite.
const NOWHERE: Sphere = Sphere { center: Vec3::NAN, radius: 0.0 };

/// Where an object is in the [`ObjectOrder`]. Derived.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug)]
#[component(clone_behavior = Ignore)]
pub struct Place(pub(crate) u32);

impl Place {
    pub(crate) const NONE: Self = Self(u32::MAX);
}

impl Default for Place {
    fn default() -> Self {
        Self::NONE
    }
}

/// Notes the place of an object that lost its mesh or its life; the next frame empties it.
pub(crate) fn free_place(mut world: DeferredWorld, context: HookContext) {
    let Some(mut component) = world.get_mut::<Place>(context.entity) else { return };
    let place = std::mem::take(&mut *component);
    if place == Place::NONE {
        return;
    }
    if let Some(mut order) = world.get_resource_mut::<ObjectOrder>() {
        order.freed.push((context.entity, place));
    }
}

/// Bounds of all objects by [`Place`], and which of them changed.
#[derive(Resource, Debug, Default)]
pub struct ObjectOrder {
    spheres: Vec<Sphere>,
    entities: Vec<Entity>,
    /// A bit per place: lights are to be chosen again.
    dirty: Vec<u64>,
    /// A bit per group of 16 places: its box in the tree is not up to date.
    stale: Vec<u64>,
    /// Boxes around groups, around nodes of 16 groups, …
    levels: Vec<Vec<Node>>,
    /// Given back since the last frame, by whom.
    freed: Vec<(Entity, Place)>,
    free: Vec<u32>,
    /// Objects that came since the order was sorted.
    added: usize,
    /// Searches since the order was looked at.
    searched: usize,
    /// Extent of the groups just after sorting.
    sorted_extent: f64,
}

impl ObjectOrder {
    /// Bounds by place; not finite where there is no object.
    pub fn spheres(&self) -> &[Sphere] {
        &self.spheres
    }

    /// Whether a place is an object's own: one that was disabled while the order was sorted, or is a copy of another
    /// object, has a place that is not.
    pub(crate) fn owns(&self, entity: Entity, Place(place): Place) -> bool {
        self.entities.get(place as usize) == Some(&entity)
    }

    /// The object at a place.
    pub fn entity(&self, place: u32) -> Entity {
        self.entities[place as usize]
    }

    /// Empties the places of objects that are gone.
    pub(crate) fn release_freed(&mut self) {
        for (entity, place) in std::mem::take(&mut self.freed) {
            if !self.owns(entity, place) {
                continue;
            }
            let place = place.0;
            self.spheres[place as usize] = NOWHERE;
            self.entities[place as usize] = Entity::PLACEHOLDER;
            self.dirty[place as usize / 64] &= !(1 << (place % 64));
            self.set_stale(place);
            self.free.push(place);
        }
    }

    /// A place for a new object.
    pub(crate) fn claim(&mut self, entity: Entity) -> Place {
        self.added += 1;
        if let Some(place) = self.free.pop() {
            self.entities[place as usize] = entity;
            return Place(place);
        }
        self.spheres.push(NOWHERE);
        self.entities.push(entity);
        self.dirty.resize(self.spheres.len().div_ceil(64), 0);
        self.stale.resize(self.spheres.len().div_ceil(64 * WIDTH), 0);
        Place(self.spheres.len() as u32 - 1)
    }

    /// The object at a place has moved.
    pub(crate) fn moved(&mut self, Place(place): Place, sphere: Sphere) {
        self.spheres[place as usize] = sphere;
        self.dirty[place as usize / 64] |= 1 << (place % 64);
        self.set_stale(place);
    }

    fn set_stale(&mut self, place: u32) {
        let group = place as usize / WIDTH;
        self.stale[group / 64] |= 1 << (group % 64);
    }

    /// Every object chooses again.
    pub(crate) fn mark_all(&mut self) {
        self.dirty.fill(u64::MAX);
        let rest = self.spheres.len() % 64;
        if let (1.., Some(last)) = (rest, self.dirty.last_mut()) {
            *last = (1 << rest) - 1;
        }
    }

    /// Places of the objects that are to choose again, ascending.
    pub(crate) fn take_dirty(&mut self, places: &mut Vec<u32>) {
        places.clear();
        for (word, bits) in self.dirty.iter_mut().enumerate() {
            let mut bits = std::mem::take(bits);
            while bits != 0 {
                let place = word as u32 * 64 + bits.trailing_zeros();
                if self.entities[place as usize] != Entity::PLACEHOLDER {
                    places.push(place);
                }
                bits &= bits - 1;
            }
        }
        self.searched += places.len();
    }

    /// Every object that one of the lights reaches chooses again; `lights` are lights as they were before a change and as
    /// they are after it.
    pub(crate) fn mark(&mut self, pool: &TaskPool, level: Level, lights: &[ScoredLight]) {
        if lights.iter().any(|light| light.range == f32::INFINITY) {
            return self.mark_all();
        }
        self.refresh();
        let order = &*self;
        let groups = self.spheres.len().div_ceil(WIDTH);
        let found = pool.scope(|scope| {
            for lights in lights.chunks(LIGHTS_PER_TASK) {
                scope.spawn(async move {
                    let mut found = Vec::new();
                    let mut stack = Vec::new();
                    dispatch!(level, simd => {
                        for light in lights.iter().filter(|light| light.kind != LightRecord::OFF) {
                            // So many that all may as well choose again.
                            if found.len() > groups {
                                break;
                            }
                            order.find(simd, light, &mut stack, &mut found);
                        }
                    });
                    found
                });
            }
        });
        if found.iter().any(|found| found.len() > groups) {
            return self.mark_all();
        }
        for (group, bits) in found.into_iter().flatten() {
            self.dirty[group as usize / 4] |= bits << (group % 4 * WIDTH as u32);
        }
    }

    /// Lists the groups that a light reaches, with a bit for each object that it does.
    #[inline(always)]
    fn find<S: Simd>(&self, simd: S, light: &ScoredLight, stack: &mut Vec<(u32, u32)>, found: &mut Vec<(u32, u64)>) {
        let volume = Volume::new(light.position, light.position, light.range);
        stack.clear();
        if !self.spheres.is_empty() {
            stack.push((self.levels.len() as u32 - 1, 0));
        }
        while let Some((level, index)) = stack.pop() {
            let mut hit = node_in_range(simd, &self.levels[level as usize][index as usize], &volume);
            while hit != 0 {
                let child = index * WIDTH as u32 + hit.trailing_zeros();
                hit &= hit - 1;
                if level > 0 {
                    stack.push((level - 1, child));
                    continue;
                }
                let bits = self.reached(simd, light, child as usize);
                if bits != 0 {
                    found.push((child, bits));
                }
            }
        }
    }

    /// Which objects of a group a light reaches.
    #[inline(always)]
    fn reached<S: Simd>(&self, simd: S, light: &ScoredLight, group: usize) -> u64 {
        let lanes = Floats::<S>::LEN;
        let places = group * WIDTH..self.spheres.len().min((group + 1) * WIDTH);
        let mut bits = 0;
        for (i, spheres) in self.spheres[places].chunks(lanes).enumerate() {
            let objects = Objects::load(simd, spheres);
            let (score, _) = if light.kind == LightRecord::POINT {
                objects.score::<false>(simd, light)
            } else {
                objects.score::<true>(simd, light)
            };
            bits |= score.simd_gt(0.0).to_bitmask() << (i * lanes);
        }
        bits
    }

    /// Brings the boxes of groups whose objects changed up to date, and those above them.
    fn refresh(&mut self) {
        self.resize_levels();
        let mut touched: Vec<usize> = Vec::new();
        for (word, bits) in self.stale.iter_mut().enumerate() {
            let mut bits = std::mem::take(bits);
            while bits != 0 {
                let group = word * 64 + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let places = (group * WIDTH).min(self.spheres.len())..self.spheres.len().min((group + 1) * WIDTH);
                if places.is_empty() {
                    continue;
                }
                self.levels[0][group / WIDTH].set(group % WIDTH, around(&self.spheres[places]));
                if touched.last() != Some(&(group / WIDTH)) {
                    touched.push(group / WIDTH);
                }
            }
        }
        for level in 1..self.levels.len() {
            let (below, above) = self.levels.split_at_mut(level);
            for &node in &touched {
                above[0][node / WIDTH].set(node % WIDTH, below[level - 1][node].bounds());
            }
            touched.iter_mut().for_each(|node| *node /= WIDTH);
            touched.dedup();
        }
    }

    /// Makes the tree as large as the order; all of it stale where it was not.
    fn resize_levels(&mut self) {
        let nodes = self.spheres.len().div_ceil(WIDTH * WIDTH);
        if self.levels.first().is_some_and(|level| level.len() == nodes) {
            return;
        }
        self.levels.clear();
        let mut nodes = nodes.max(1);
        loop {
            self.levels.push(vec![Node::EMPTY; nodes]);
            if nodes == 1 {
                break;
            }
            nodes = nodes.div_ceil(WIDTH);
        }
        self.stale.fill(u64::MAX);
    }

    /// Whether the order has changed or worn so much that sorting pays.
    pub(crate) fn needs_sorting(&mut self) -> bool {
        if self.added * 8 > self.spheres.len() {
            return true;
        }
        if self.searched < LOOK_AFTER * self.spheres.len().max(WIDTH) {
            return false;
        }
        self.searched = 0;
        self.refresh();
        self.extent() > WORN * self.sorted_extent
    }

    /// Sum of the diagonals of the groups' boxes.
    fn extent(&self) -> f64 {
        let nodes = self.levels.first().into_iter().flatten();
        nodes.map(Node::extent).sum()
    }

    /// Sorts the objects along a Hilbert curve. Calls `place` with each and its new place; where that says that the
    /// object is not to be had, it loses its place.
    pub(crate) fn sort(&mut self, pool: &TaskPool, mut place: impl FnMut(Entity, Place) -> bool) {
        let keys = hilbert_keys(pool, &self.spheres);
        let mut order: Vec<(u32, u32)> = keys.into_iter().zip(0..).collect();
        radsort::sort_by_key(&mut order, |&(key, _)| key);
        let (mut spheres, mut entities) = (Vec::with_capacity(order.len()), Vec::with_capacity(order.len()));
        let mut dirty = vec![0; order.len().div_ceil(64)];
        for (_, old) in order {
            let (entity, new) = (self.entities[old as usize], entities.len());
            if entity == Entity::PLACEHOLDER || !place(entity, Place(new as u32)) {
                continue;
            }
            dirty[new / 64] |= (self.dirty[old as usize / 64] >> (old % 64) & 1) << (new % 64);
            spheres.push(self.spheres[old as usize]);
            entities.push(entity);
        }
        dirty.truncate(spheres.len().div_ceil(64));
        let stale = vec![u64::MAX; spheres.len().div_ceil(64 * WIDTH)];
        *self = Self { spheres, entities, dirty, stale, ..Self::default() };
        self.refresh();
        self.sorted_extent = self.extent();
    }
}

/// Box around the centres and largest radius; nothing where no sphere is finite.
fn around(spheres: &[Sphere]) -> Option<(Vec3, Vec3, f32)> {
    let finite = spheres.iter().filter(|sphere| sphere.center.is_finite() && sphere.radius.is_finite());
    finite.fold(None, |bounds, sphere| {
        let (min, max, radius) = bounds.unwrap_or((Vec3::MAX, Vec3::MIN, 0.0f32));
        Some((min.min(sphere.center), max.max(sphere.center), radius.max(sphere.radius)))
    })
}

/// The spheres in the order of their places on a Hilbert curve.
pub fn along_the_curve(spheres: &[Sphere]) -> Vec<Sphere> {
    let pool = bevy_tasks::TaskPoolBuilder::new().num_threads(1).build();
    let mut order: Vec<(u32, u32)> = hilbert_keys(&pool, spheres).into_iter().zip(0..).collect();
    radsort::sort_by_key(&mut order, |&(key, _)| key);
    order.into_iter().map(|(_, index)| spheres[index as usize]).collect()
}

/// Where each sphere lies on a Hilbert curve through the box around all.
fn hilbert_keys(pool: &TaskPool, spheres: &[Sphere]) -> Vec<u32> {
    let (min, max, _) = around(spheres).unwrap_or_default();
    let extent = (max - min).max(Vec3::splat(1e-3));
    let (thin, height) = (extent.min_position(), extent.min_element());
    // A world that is no higher than a group of objects is wide has a curve of its own in the plane: those of three
    // dimensions jump about where they are cut.
    let area = extent.element_product() / height;
    let is_flat = height * height * spheres.len() as f32 <= area * WIDTH as f32;
    let keys = pool.scope(|scope| {
        for spheres in spheres.chunks(1 << 14) {
            scope.spawn(async move {
                // Cells are squares or cubes.
                let top = if is_flat { u16::MAX.into() } else { (1 << 10) - 1 };
                let scale = top as f32 / extent.max_element();
                let cell = |v: f32| ((v * scale).max(0.0) as u32).min(top);
                let key = |sphere: &Sphere| {
                    let [x, y, z] = (sphere.center - min).to_array().map(cell);
                    match thin {
                        _ if !is_flat => hilbert([x, y, z]),
                        0 => hilbert([y, z]),
                        1 => hilbert([x, z]),
                        _ => hilbert([x, y]),
                    }
                };
                spheres.iter().map(key).collect::<Vec<u32>>()
            });
        }
    });
    keys.concat()
}

/// Index of a cell on the Hilbert curve of so many dimensions, with as many bits per axis as fit (J. Skilling:
/// "Programming the Hilbert curve", AIP Conference Proceedings 707, 2004): coordinates to the transposed index in place,
/// then its bits interleaved.
fn hilbert<const AXES: usize>(mut x: [u32; AXES]) -> u32 {
    let bits = u32::BITS / AXES as u32;
    let mut bit = 1 << (bits - 1);
    while bit > 1 {
        for i in 0..AXES {
            if x[i] & bit != 0 {
                x[0] ^= bit - 1;
            } else {
                let swapped = (x[0] ^ x[i]) & (bit - 1);
                x[0] ^= swapped;
                x[i] ^= swapped;
            }
        }
        bit >>= 1;
    }
    for i in 1..AXES {
        x[i] ^= x[i - 1];
    }
    let mut turn = 0;
    let mut bit = 1 << (bits - 1);
    while bit > 1 {
        if x[AXES - 1] & bit != 0 {
            turn ^= bit - 1;
        }
        bit >>= 1;
    }
    let bits = (0..bits).rev().flat_map(|k| x.map(|axis| (axis ^ turn) >> k & 1));
    bits.fold(0, |index, bit| index << 1 | bit)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first cells of a curve: a block at the origin, so many cells wide.
    fn follow<const AXES: usize>(width: u32) {
        let mut cells: Vec<(u32, [u32; AXES])> = Vec::new();
        for mut i in 0..width.pow(AXES as u32) {
            let cell = std::array::from_fn(|_| (i % width, i /= width).0);
            cells.push((hilbert(cell), cell));
        }
        cells.sort_unstable();
        for pair in cells.windows(2) {
            let step: u32 = (0..AXES).map(|axis| pair[0].1[axis].abs_diff(pair[1].1[axis])).sum();
            assert_eq!((pair[1].0 - pair[0].0, step), (1, 1), "{pair:?}");
        }
    }

    #[test]
    fn the_curve_goes_from_cell_to_neighbouring_cell() {
        follow::<2>(64);
        follow::<3>(16);
    }
}
