//! Lights sorted in space, under a tree of boxes: finds those that may reach a volume.
//!
//! Point and spot lights are sorted along a Morton curve and cut into blocks of 16, whose fields lie side by side so
//! that one vector operation tests many lights. Sixteen blocks make a node, sixteen nodes make one of the level above.
//! If few lights change, [`LightTree::update`] merges them into the sorted list and fills only the blocks that are not
//! what they were. The tree is the one that [`LightTree::build`] would make.
//!
//! Order matters only to sums, whose rounding depends on it. [`search_order`] says what it is, and a search must keep
//! it: directional lights by slot, then point lights, then spots along the curve. The curve's cells do not depend on
//! the other lights, so two lights keep their order whatever happens around them.

use super::record::LightRecord;
use super::relevance::ScoredLight;
use crate::ecs::parallel::on_pool;
use crate::ecs::read_ahead::read_ahead;
use bevy_tasks::ComputeTaskPool;
use glam::Vec3;

/// Lights of a block, blocks of a node, children of a node.
pub(crate) const WIDTH: usize = 16;
/// Up to one in so many lights may have changed for the rest of the tree to stay.
const FEW: usize = 16;
/// Lights per task when a tree is built.
const LIGHTS_PER_TASK: usize = 512 * WIDTH;
/// Cells of the curve per metre, and bits per axis: ±65 km. What lies further out is in the outermost cells.
const CELLS_PER_METRE: f32 = 16.0;
const AXIS_BITS: u32 = 21;
/// Margin of the tests for range and cone over what rounding can do.
pub(crate) const MARGIN: f32 = 1e-5;

/// Sixteen lights. What is not a light has NaN for its range, and fails every comparison.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Block {
    pub position: [[f32; WIDTH]; 3],
    pub range: [f32; WIDTH],
    pub axis: [[f32; WIDTH]; 3],
    /// Tangent of the spot's outer angle, rounded up.
    pub tan: [f32; WIDTH],
    /// One bit per spot.
    pub spots: u64,
}

/// Boxes around the lights of sixteen children, and their longest ranges.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Node {
    pub min: [[f32; WIDTH]; 3],
    pub max: [[f32; WIDTH]; 3],
    pub range: [f32; WIDTH],
}

/// All lights of a frame, for [`crate::lights::search`].
#[derive(Clone, Debug, Default)]
pub struct LightTree {
    /// Slots of the directional lights, ascending.
    pub(crate) everywhere: Vec<u32>,
    /// Copies in the order of the blocks, so that those that a search needs lie close together, and their slots.
    pub(crate) lights: Vec<ScoredLight>,
    pub(crate) slots: Vec<u32>,
    pub(crate) blocks: Vec<Block>,
    /// From the nodes above the blocks to the root.
    pub(crate) levels: Vec<Vec<Node>>,
    /// Position of each light on the curve, and its slot.
    keys: Vec<(u64, u32)>,
    /// Keys of the tree before.
    old_keys: Vec<(u64, u32)>,
}

impl LightTree {
    /// A tree over the lights; indexed by slot.
    pub fn new(scored: &[ScoredLight]) -> Self {
        let mut tree = Self::default();
        tree.build(scored);
        tree
    }

    /// Builds the tree anew, in the memory it has.
    pub fn build(&mut self, scored: &[ScoredLight]) {
        self.everywhere.clear();
        self.keys.clear();
        for (light, slot) in scored.iter().zip(0..) {
            self.enter(light, slot);
        }
        // Stable, so that lights in one cell stay in the order of their slots.
        radsort::sort_by_key(&mut self.keys, |&(key, _)| key);
        self.resize();
        let keys = self.keys.chunks(LIGHTS_PER_TASK).zip(self.slots.chunks_mut(LIGHTS_PER_TASK));
        let blocks = self.lights.chunks_mut(LIGHTS_PER_TASK).zip(self.blocks.chunks_mut(LIGHTS_PER_TASK / WIDTH));
        let parts = keys.zip(blocks);
        match ComputeTaskPool::try_get() {
            Some(pool) => on_pool(pool, parts, |(keys, blocks)| fill(keys, blocks, scored)),
            None => parts.for_each(|(keys, blocks)| fill(keys, blocks, scored)),
        }
        self.build_levels();
    }

    fn enter(&mut self, light: &ScoredLight, slot: u32) {
        match light.kind {
            LightRecord::OFF => {}
            LightRecord::DIRECTIONAL => self.everywhere.push(slot),
            _ => self.keys.push((morton(light.position), slot)),
        }
    }

    fn resize(&mut self) {
        self.slots.resize(self.keys.len(), 0);
        self.lights.resize(self.keys.len(), ScoredLight::OFF);
        self.blocks.resize(self.keys.len().div_ceil(WIDTH), Block::EMPTY);
    }

    fn build_levels(&mut self) {
        self.levels.clear();
        let mut level: Vec<Node> =
            self.blocks.chunks(WIDTH).map(|blocks| Node::new(blocks.iter().map(Block::bounds))).collect();
        while level.len() > 1 {
            let above = level.chunks(WIDTH).map(|nodes| Node::new(nodes.iter().map(Node::bounds))).collect();
            self.levels.push(std::mem::replace(&mut level, above));
        }
        self.levels.push(level);
    }

    /// Makes the tree what [`Self::build`] would, after the lights in some slots changed. Where they are few, only the
    /// blocks in which something is another light than before, or elsewhere, are filled again.
    pub fn update(&mut self, scored: &[ScoredLight], changed: &[u32]) {
        if changed.is_empty() {
            return;
        }
        if changed.len() * FEW > self.keys.len() {
            return self.build(scored);
        }
        let mut is_changed = vec![0u64; scored.len().div_ceil(64)];
        let changed = changed.iter().copied().filter(|&slot| {
            let (word, bit) = (&mut is_changed[slot as usize / 64], 1 << (slot % 64));
            let is_first = *word & bit == 0;
            *word |= bit;
            is_first
        });
        // Those that changed, in order, take the place of the whole list, which is then merged with them.
        std::mem::swap(&mut self.keys, &mut self.old_keys);
        self.keys.clear();
        let directional = self.everywhere.len();
        changed.for_each(|slot| self.enter(&scored[slot as usize], slot));
        let is_changed = |slot: u32| is_changed[slot as usize / 64] >> (slot % 64) & 1 != 0;
        let mut place = 0..;
        self.everywhere.retain(|&slot| place.next() >= Some(directional) || !is_changed(slot));
        self.everywhere.sort_unstable();
        let mut moved = std::mem::take(&mut self.keys);
        moved.sort_unstable();
        let mut moved = moved.into_iter().peekable();
        for &old in self.old_keys.iter().filter(|&&(_, slot)| !is_changed(slot)) {
            while let Some(new) = moved.next_if(|&new| new < old) {
                self.keys.push(new);
            }
            self.keys.push(old);
        }
        self.keys.extend(moved);
        self.refill(scored, is_changed);
    }

    /// Brings lights, blocks and nodes up to date with the keys.
    fn refill(&mut self, scored: &[ScoredLight], is_changed: impl Fn(u32) -> bool) {
        let old_blocks = self.blocks.len();
        let old_count = self.slots.len();
        self.resize();
        let mut touched = Vec::new();
        for (block, keys) in self.keys.chunks(WIDTH).enumerate() {
            let first = block * WIDTH;
            let mut is_stale = first + keys.len() != (first + WIDTH).min(old_count);
            for (&(_, slot), place) in keys.iter().zip(first..) {
                if self.slots[place] != slot || is_changed(slot) || place >= old_count {
                    (self.slots[place], self.lights[place]) = (slot, scored[slot as usize]);
                    is_stale = true;
                }
            }
            if is_stale {
                self.blocks[block] = Block::new(&self.lights[first..first + keys.len()]);
                touched.push(block);
            }
        }
        if self.blocks.len() != old_blocks {
            return self.build_levels();
        }
        for &block in &touched {
            self.levels[0][block / WIDTH].set(block % WIDTH, self.blocks[block].bounds());
        }
        touched.iter_mut().for_each(|block| *block /= WIDTH);
        touched.dedup();
        refit(&mut self.levels, touched);
    }
}

/// Brings the boxes above some nodes of the lowest level up to date; ascending, each once.
pub(crate) fn refit(levels: &mut [Vec<Node>], mut touched: Vec<usize>) {
    for level in 1..levels.len() {
        let (below, above) = levels.split_at_mut(level);
        for &node in &touched {
            above[0][node / WIDTH].set(node % WIDTH, below[level - 1][node].bounds());
        }
        touched.iter_mut().for_each(|node| *node /= WIDTH);
        touched.dedup();
    }
}

/// Copies lights into the order of the tree, and their fields into blocks.
fn fill(
    (keys, slots): (&[(u64, u32)], &mut [u32]),
    (lights, blocks): (&mut [ScoredLight], &mut [Block]),
    scored: &[ScoredLight],
) {
    for ((&(_, slot), place), light) in keys.iter().zip(slots).zip(&mut *lights) {
        (*place, *light) = (slot, scored[slot as usize]);
    }
    for (lights, block) in lights.chunks(WIDTH).zip(blocks) {
        *block = Block::new(lights);
    }
}

/// Tangent of a spot's outer angle, rounded up, of 1 − the cosine of that.
pub(crate) fn outer_tan(versine: f32) -> f32 {
    (versine * (2.0 - versine)).max(0.0).sqrt() / (1.0 - versine).max(1e-6) * (1.0 + MARGIN) + MARGIN
}

impl Block {
    /// Without lights.
    const EMPTY: Self = Self {
        position: [[0.0; WIDTH]; 3],
        range: [f32::NAN; WIDTH],
        axis: [[0.0; WIDTH]; 3],
        tan: [0.0; WIDTH],
        spots: 0,
    };

    fn new(lights: &[ScoredLight]) -> Self {
        let mut versine = [0.0f32; WIDTH];
        let mut block = Self::EMPTY;
        for (i, light) in lights.iter().enumerate().take(WIDTH) {
            for axis in 0..3 {
                block.position[axis][i] = light.position[axis];
                block.axis[axis][i] = light.axis[axis];
            }
            block.range[i] = light.range;
            versine[i] = light.versine_outer;
            block.spots |= u64::from(light.kind != LightRecord::POINT) << i;
        }
        // Apart, so that several are computed at once.
        for (tan, versine) in block.tan.iter_mut().zip(versine) {
            *tan = outer_tan(versine);
        }
        block
    }

    /// Reads something of each cache line.
    #[inline(always)]
    pub fn read_ahead(&self) {
        let lines = self.position.iter().chain(&self.axis).chain([&self.range, &self.tan]);
        read_ahead(lines.map(|line| line[0].to_bits()).chain([self.spots as u32]));
    }

    fn bounds(&self) -> Option<(Vec3, Vec3, f32)> {
        let lights = (0..WIDTH).filter(|&i| !self.range[i].is_nan());
        let points = lights.map(|i| (Vec3::from(self.position.map(|axis| axis[i])), self.range[i]));
        points.map(|(p, range)| (p, p, range)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1), a.2.max(b.2)))
    }
}

impl Node {
    /// Without children.
    pub const EMPTY: Self = Self { min: [[0.0; WIDTH]; 3], max: [[0.0; WIDTH]; 3], range: [f32::NAN; WIDTH] };

    fn new(children: impl Iterator<Item = Option<(Vec3, Vec3, f32)>>) -> Self {
        let mut node = Self::EMPTY;
        children.enumerate().for_each(|(i, bounds)| node.set(i, bounds));
        node
    }

    /// Box and longest range of a child; `None`: nothing there.
    pub fn set(&mut self, i: usize, bounds: Option<(Vec3, Vec3, f32)>) {
        let (min, max, range) = bounds.unwrap_or((Vec3::ZERO, Vec3::ZERO, f32::NAN));
        for axis in 0..3 {
            self.min[axis][i] = min[axis];
            self.max[axis][i] = max[axis];
        }
        self.range[i] = range;
    }

    /// Boxes and longest ranges of its children, and which they are.
    pub fn numbered(&self) -> impl Iterator<Item = (usize, (Vec3, Vec3, f32))> {
        (0..WIDTH).filter(|&i| !self.range[i].is_nan()).map(|i| {
            let corner = |corners: &[[f32; WIDTH]; 3]| Vec3::new(corners[0][i], corners[1][i], corners[2][i]);
            (i, (corner(&self.min), corner(&self.max), self.range[i]))
        })
    }

    fn children(&self) -> impl Iterator<Item = (Vec3, Vec3, f32)> {
        self.numbered().map(|(_, bounds)| bounds)
    }

    /// Around all children.
    pub fn bounds(&self) -> Option<(Vec3, Vec3, f32)> {
        self.children().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1), a.2.max(b.2)))
    }

    /// Sum of the diagonals of the children's boxes.
    pub fn extent(&self) -> f64 {
        self.children().map(|(min, max, _)| f64::from(min.distance(max))).sum()
    }
}

/// The order in which lights are added up: slots of all that are not off.
pub fn search_order(scored: &[ScoredLight]) -> Vec<u32> {
    let mut order: Vec<_> = scored.iter().zip(0..).filter_map(|(light, slot)| order_of(light, slot)).collect();
    order.sort_unstable();
    order.into_iter().map(|(_, _, slot)| slot).collect()
}

/// Key of a light in the [`search_order`]; `None` for one that is off.
pub(crate) fn order_of(light: &ScoredLight, slot: u32) -> Option<(u32, u64, u32)> {
    match light.kind {
        LightRecord::OFF => None,
        LightRecord::DIRECTIONAL => Some((0, 0, slot)),
        LightRecord::POINT => Some((1, morton(light.position), slot)),
        _ => Some((2, morton(light.position), slot)),
    }
}

/// Position of a point on the Morton curve.
pub(crate) fn morton(point: Vec3) -> u64 {
    let half = (1u32 << (AXIS_BITS - 1)) as f32;
    let top = (1u32 << AXIS_BITS) - 1;
    let cell = |v: f32| spread(((v * CELLS_PER_METRE + half).max(0.0) as u32).min(top).into());
    cell(point.x) | cell(point.y) << 1 | cell(point.z) << 2
}

/// Spreads 21 bits to every third place.
fn spread(bits: u64) -> u64 {
    let x = (bits | bits << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

/// Query of a tree: some spheres that lights may reach.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Volume {
    /// Box around the centres.
    pub min: Vec3,
    pub max: Vec3,
    /// The largest radius, with room for rounding.
    pub radius: f32,
}

impl Volume {
    /// Around spheres with these extremes of their centres and this largest radius; all finite.
    #[inline(always)]
    pub fn new(min: Vec3, max: Vec3, radius: f32) -> Self {
        let radius = radius + 1e-6 * (min.abs() + max.abs()).element_sum() + radius * MARGIN;
        Self { min, max, radius }
    }

    /// Around all; `None` where there is none.
    #[inline(always)]
    pub fn union(volumes: impl Iterator<Item = Option<Self>>) -> Option<Self> {
        let (mut min, mut max, mut radius) = (Vec3::INFINITY, Vec3::NEG_INFINITY, 0.0f32);
        for volume in volumes.flatten() {
            (min, max, radius) = (min.min(volume.min), max.max(volume.max), radius.max(volume.radius));
        }
        (min.x <= max.x).then(|| Self::new(min, max, radius))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::relevance::light_record;
    use crate::space::transform::{GlobalTransform, Transform};

    /// Numbers from 0 to 1 that look random.
    fn any(seed: &mut u32) -> f32 {
        *seed = seed.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let mixed = ((*seed >> ((*seed >> 28 & 7) + 4)) ^ *seed).wrapping_mul(277_803_737);
        (mixed >> 8) as f32 / (1 << 24) as f32
    }

    fn any_light(seed: &mut u32) -> ScoredLight {
        let mut light = match (any(seed) * 20.0) as u32 {
            0 => crate::lights::components::Light::directional(1.0),
            1 => return ScoredLight::OFF,
            2..=8 => crate::lights::components::Light::spot(1.0, 10.0, 0.5),
            _ => crate::lights::components::Light::point(1.0, 10.0),
        };
        light.intensity = 0.1 + any(seed);
        let place = Transform::from_xyz(any(seed) * 300.0, any(seed) * 10.0, any(seed) * 300.0);
        ScoredLight::new(&light_record(&light, &GlobalTransform::from(place)))
    }

    /// Few lights move, some of them far, change their kind, go out, come.
    #[test]
    fn an_updated_tree_is_the_tree_that_a_build_gives() {
        let seed = &mut 7;
        let mut scored: Vec<ScoredLight> = (0..3000).map(|_| any_light(seed)).collect();
        let mut tree = LightTree::new(&scored);
        for round in 0..40 {
            let mut changed = Vec::new();
            for _ in 0..round * 4 {
                let slot = ((any(seed) * scored.len() as f32) as usize).min(scored.len() - 1);
                changed.push(slot as u32);
                if any(seed) < 0.5 {
                    scored[slot].position.x += 0.3;
                } else {
                    scored[slot] = any_light(seed);
                }
            }
            for _ in 0..round % 3 * 10 {
                changed.push(scored.len() as u32);
                scored.push(any_light(seed));
            }
            tree.update(&scored, &changed);
            let built = LightTree::new(&scored);
            assert_eq!((&tree.everywhere, &tree.slots), (&built.everywhere, &built.slots), "round {round}");
            assert_eq!((&tree.keys, &tree.lights), (&built.keys, &built.lights), "round {round}");
            // As text, in which what is not a number equals itself.
            let boxes = |tree: &LightTree| format!("{:?} {:?}", tree.blocks, tree.levels);
            assert!(boxes(&tree) == boxes(&built), "round {round}");
        }
    }
}
