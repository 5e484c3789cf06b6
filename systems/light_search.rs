//! The search for the three most relevant lights of each object: exact, and fast at a million objects and 100,000 lights.
//!
//! Objects come in an order in which neighbours are near each other ([`crate::object_order`]), in packets of
//! [`PACKET`]. A packet asks the [`LightTree`] once for the lights that may reach any of its objects. Groups of as many
//! objects as a vector has lanes then go through that list twice: light by light for those that may reach the group
//! (lanes are lights), and through what is left with the true scores (lanes are objects), where the best stay in
//! registers. A last pass adds up the remainder.
//!
//! The result equals [`crate::brute_force`] bit for bit on every instruction set: lights are added up in
//! [`crate::light_tree::search_order`], nothing is fused or approximated, and each object's result depends on nothing but
//! itself and the lights that reach it. Which instructions the processor has is found out when the program runs
//! ([`Level`]).

use crate::bounds::Sphere;
use crate::draw_list::{LightRecord, NO_LIGHT};
use crate::light_tree::{Block, LightTree, MARGIN, Node, Volume, WIDTH};
use crate::lights::{LightPolicy, Selection};
use crate::relevance::{ROUNDING, SQUARINGS, ScoredLight};
pub use fearless_simd::Level;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch};

/// Objects that share one walk through the tree.
pub const PACKET: usize = 128;
/// Lanes of the widest vector.
const LANES: usize = 16;
/// A coordinate whose square is infinite.
const OUT_OF_REACH: f32 = 1e30;

/// Lists that a search reuses from packet to packet.
#[derive(Default)]
pub struct Scratch {
    stack: Vec<(u32, u32)>,
    points: Candidates,
    spots: Candidates,
    /// Slots of the lights that reach some object of the group, with a bit for each that they reach: directional, point,
    /// spot.
    reaching: [Vec<(u32, u32)>; 3],
}

/// Lights that may reach a packet, fields side by side, and those of them that may reach a group.
#[derive(Default)]
struct Candidates {
    position: [Vec<f32>; 3],
    range: Vec<f32>,
    axis: [Vec<f32>; 3],
    tan: Vec<f32>,
    slots: Vec<u32>,
    count: usize,
    hits: Vec<u32>,
    hit_count: usize,
}

/// Chooses the lights of each sphere; `scored` is indexed by slot, and `tree` built from it. A sphere that is not finite
/// has none. Fast where neighbours in `spheres` are near each other.
pub fn select(
    level: Level,
    tree: &LightTree,
    scored: &[ScoredLight],
    policy: LightPolicy,
    (spheres, out): (&[Sphere], &mut [Selection]),
    scratch: &mut Scratch,
) {
    dispatch!(level, simd => {
        for (spheres, out) in spheres.chunks(PACKET).zip(out.chunks_mut(PACKET)) {
            select_packet(simd, tree, scored, policy, spheres, out, scratch);
        }
    });
}

/// The slots of all lights that reach a sphere, in [`crate::light_tree::search_order`].
pub fn reaching(level: Level, tree: &LightTree, scored: &[ScoredLight], sphere: Sphere, scratch: &mut Scratch) -> Vec<u32> {
    let mut out = [Selection::default()];
    select(level, tree, scored, LightPolicy::Hard, (&[sphere], &mut out), scratch);
    scratch.reaching.iter().flatten().map(|&(slot, _)| slot).collect()
}

#[inline(always)]
fn select_packet<S: Simd>(
    simd: S,
    tree: &LightTree,
    scored: &[ScoredLight],
    policy: LightPolicy,
    spheres: &[Sphere],
    out: &mut [Selection],
    scratch: &mut Scratch,
) {
    let Scratch { stack, points, spots, reaching } = scratch;
    points.count = 0;
    spots.count = 0;
    if let Some(volume) = Volume::around(spheres) {
        walk(simd, tree, &volume, stack, |simd, block| {
            let hit = in_range(simd, block, &volume);
            if hit & !block.spots != 0 {
                points.take(simd, block, hit & !block.spots, false);
            }
            let hit = hit & block.spots;
            if hit != 0 {
                let hit = hit & in_cone(simd, block, &volume);
                spots.take(simd, block, hit, true);
            }
        });
    }
    for (spheres, out) in spheres.chunks(S::f32s::LEN).zip(out.chunks_mut(S::f32s::LEN)) {
        reaching.iter_mut().for_each(Vec::clear);
        let Some(volume) = Volume::around(spheres) else {
            out.fill(Selection::default());
            continue;
        };
        points.filter::<S, false>(simd, &volume);
        spots.filter::<S, true>(simd, &volume);
        let objects = Objects::load(simd, spheres);
        let mut top = Top::new(simd);
        for &slot in &tree.everywhere {
            let score = S::f32s::splat(simd, scored[slot as usize].luminance);
            let score = objects.is_finite.select(score, S::f32s::splat(simd, 0.0));
            reaching[0].extend(top.offer(simd, score, slot));
        }
        for &slot in &points.hits[..points.hit_count] {
            reaching[1].extend(top.offer(simd, objects.score::<false>(simd, &scored[slot as usize]), slot));
        }
        for &slot in &spots.hits[..spots.hit_count] {
            reaching[2].extend(top.offer(simd, objects.score::<true>(simd, &scored[slot as usize]), slot));
        }
        let weights = top.weights(simd, policy);
        let mut remainder = Remainder::new(simd);
        if policy != LightPolicy::Hard && top.scores[3].simd_gt(0.0).any_true() {
            for &light in &reaching[0] {
                remainder.add::<DIRECTIONAL>(simd, &objects, scored, top.left_out(simd, weights, light), light.0);
            }
            for &light in &reaching[1] {
                remainder.add::<POINT>(simd, &objects, scored, top.left_out(simd, weights, light), light.0);
            }
            for &light in &reaching[2] {
                remainder.add::<SPOT>(simd, &objects, scored, top.left_out(simd, weights, light), light.0);
            }
        }
        store(&top, weights, &remainder, out);
    }
}

/// Calls `visit` for each block with lights that may reach the volume, in order.
#[inline(always)]
fn walk<S: Simd>(
    simd: S,
    tree: &LightTree,
    volume: &Volume,
    stack: &mut Vec<(u32, u32)>,
    mut visit: impl FnMut(S, &Block),
) {
    stack.clear();
    if !tree.blocks.is_empty() {
        stack.push((tree.levels.len() as u32 - 1, 0));
    }
    while let Some((level, index)) = stack.pop() {
        let mut hit = node_in_range(simd, &tree.levels[level as usize][index as usize], volume);
        let first = index * WIDTH as u32;
        if level == 0 {
            while hit != 0 {
                visit(simd, &tree.blocks[(first + hit.trailing_zeros()) as usize]);
                hit &= hit - 1;
            }
        } else {
            // The first child on top.
            while hit != 0 {
                let last = hit.ilog2();
                stack.push((level - 1, first + last));
                hit ^= 1 << last;
            }
        }
    }
}

/// Squared distance of points from the volume's box.
#[inline(always)]
fn gap_squared<S: Simd>(simd: S, min: [S::f32s; 3], max: [S::f32s; 3], volume: &Volume) -> S::f32s {
    let zero = S::f32s::splat(simd, 0.0);
    let gap = |axis: usize| {
        let below = S::f32s::splat(simd, volume.min[axis]) - max[axis];
        let above = min[axis] - S::f32s::splat(simd, volume.max[axis]);
        below.max(above).max(zero)
    };
    let (x, y, z) = (gap(0), gap(1), gap(2));
    x * x + y * y + z * z
}

/// Which of the lights come near enough: a bit each.
#[inline(always)]
fn within<S: Simd>(simd: S, range: S::f32s, gap_squared: S::f32s, volume: &Volume) -> u64 {
    let reach = (range + S::f32s::splat(simd, volume.radius)) * S::f32s::splat(simd, 1.0 + MARGIN);
    (reach * reach).simd_gt(gap_squared).to_bitmask()
}

#[inline(always)]
fn node_in_range<S: Simd>(simd: S, node: &Node, volume: &Volume) -> u64 {
    let mut bits = 0;
    for k in (0..WIDTH).step_by(S::f32s::LEN) {
        let load = |array: &[f32; WIDTH]| S::f32s::from_slice(simd, &array[k..k + S::f32s::LEN]);
        let gap = gap_squared(simd, node.min.each_ref().map(load), node.max.each_ref().map(load), volume);
        bits |= within(simd, load(&node.range), gap, volume) << k;
    }
    bits
}

#[inline(always)]
fn in_range<S: Simd>(simd: S, block: &Block, volume: &Volume) -> u64 {
    let mut bits = 0;
    for k in (0..WIDTH).step_by(S::f32s::LEN) {
        let load = |array: &[f32; WIDTH]| S::f32s::from_slice(simd, &array[k..k + S::f32s::LEN]);
        let position = block.position.each_ref().map(load);
        bits |= within(simd, load(&block.range), gap_squared(simd, position, position, volume), volume) << k;
    }
    bits
}

#[inline(always)]
fn in_cone<S: Simd>(simd: S, block: &Block, volume: &Volume) -> u64 {
    let mut bits = 0;
    for k in (0..WIDTH).step_by(S::f32s::LEN) {
        let load = |array: &[f32; WIDTH]| S::f32s::from_slice(simd, &array[k..k + S::f32s::LEN]);
        let (position, axis) = (block.position.each_ref().map(load), block.axis.each_ref().map(load));
        bits |= cone_meets(simd, position, axis, load(&block.tan), volume) << k;
    }
    bits
}

/// Which of the spots' cones meet the sphere around the volume: the score's own test, with room for rounding.
#[inline(always)]
fn cone_meets<S: Simd>(
    simd: S,
    position: [S::f32s; 3],
    axis: [S::f32s; 3],
    tan: S::f32s,
    volume: &Volume,
) -> u64 {
    let zero = S::f32s::splat(simd, 0.0);
    let center = volume.around.center;
    let x = S::f32s::splat(simd, center.x) - position[0];
    let y = S::f32s::splat(simd, center.y) - position[1];
    let z = S::f32s::splat(simd, center.z) - position[2];
    let squared = x * x + y * y + z * z;
    let t = x * axis[0] + y * axis[1] + z * axis[2];
    // The subtraction cancels; its error is a small part of the distance, and room is made for it.
    let off_axis = (squared - t * t).max(zero).sqrt();
    let radius = S::f32s::splat(simd, volume.around.radius) + squared.sqrt() * S::f32s::splat(simd, 1e-3);
    let along = t + radius;
    let off = (off_axis - radius).max(zero);
    (along.simd_gt(zero) & (along * tan).simd_ge(off)).to_bitmask()
}

impl Candidates {
    /// Makes room for one more vector in every list.
    fn make_room(&mut self) {
        let room = self.count + LANES;
        if self.slots.len() < room {
            let room = room.next_power_of_two().max(256);
            for list in self.position.iter_mut().chain(&mut self.axis).chain([&mut self.range, &mut self.tan]) {
                list.resize(room, 0.0);
            }
            self.slots.resize(room, 0);
            self.hits.resize(room, 0);
        }
    }

    /// Appends the lights of a block whose bits are set.
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, block: &Block, bits: u64, are_spots: bool) {
        self.make_room();
        let lanes = S::f32s::LEN;
        for k in (0..WIDTH).step_by(lanes) {
            let bits = bits >> k & ((1 << lanes) - 1);
            let mask = S::mask32s::from_bitmask(simd, bits);
            let at = self.count..self.count + lanes;
            let pack = |from: &[f32; WIDTH], to: &mut Vec<f32>| {
                S::f32s::from_slice(simd, &from[k..k + lanes]).compress(mask).store_slice(&mut to[at.clone()]);
            };
            for axis in 0..3 {
                pack(&block.position[axis], &mut self.position[axis]);
            }
            pack(&block.range, &mut self.range);
            if are_spots {
                for axis in 0..3 {
                    pack(&block.axis[axis], &mut self.axis[axis]);
                }
                pack(&block.tan, &mut self.tan);
            }
            let slots = S::u32s::from_slice(simd, &block.slots[k..k + lanes]);
            slots.compress(mask).store_slice(&mut self.slots[at.clone()]);
            self.count += bits.count_ones() as usize;
        }
    }

    /// Finds those that may reach the group.
    #[inline(always)]
    fn filter<S: Simd, const SPOTS: bool>(&mut self, simd: S, volume: &Volume) {
        self.hit_count = 0;
        let lanes = S::f32s::LEN;
        for k in (0..self.count).step_by(lanes) {
            let load = |list: &Vec<f32>| S::f32s::from_slice(simd, &list[k..k + lanes]);
            let position = self.position.each_ref().map(load);
            let mut hit = within(simd, load(&self.range), gap_squared(simd, position, position, volume), volume);
            // Behind the last one lies what earlier packets left.
            if self.count - k < lanes {
                hit &= (1 << (self.count - k)) - 1;
            }
            if SPOTS && hit != 0 {
                hit &= cone_meets(simd, position, self.axis.each_ref().map(load), load(&self.tan), volume);
            }
            let slots = S::u32s::from_slice(simd, &self.slots[k..k + lanes]);
            let packed = slots.compress(S::mask32s::from_bitmask(simd, hit));
            packed.store_slice(&mut self.hits[self.hit_count..self.hit_count + lanes]);
            self.hit_count += hit.count_ones() as usize;
        }
    }
}

/// A group of objects, one per lane.
struct Objects<S: Simd> {
    center: [S::f32s; 3],
    radius: S::f32s,
    is_finite: S::mask32s,
}

impl<S: Simd> Objects<S> {
    /// Lanes without an object, or with one that is not finite, are out of reach: no score of theirs is above 0.
    #[inline(always)]
    fn load(simd: S, spheres: &[Sphere]) -> Self {
        let mut lanes = [[OUT_OF_REACH; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]];
        for (i, sphere) in spheres.iter().enumerate() {
            if sphere.center.is_finite() && sphere.radius.is_finite() {
                let values = [sphere.center.x, sphere.center.y, sphere.center.z, sphere.radius.max(0.0)];
                (0..4).for_each(|k| lanes[k][i] = values[k]);
            }
        }
        let [x, y, z, radius] = lanes.each_ref().map(|lanes| S::f32s::from_slice(simd, &lanes[..S::f32s::LEN]));
        Self { center: [x, y, z], radius, is_finite: x.simd_lt(OUT_OF_REACH) }
    }

    /// From the light to the objects.
    #[inline(always)]
    fn offset(&self, simd: S, light: &ScoredLight) -> [S::f32s; 3] {
        [
            self.center[0] - S::f32s::splat(simd, light.position.x),
            self.center[1] - S::f32s::splat(simd, light.position.y),
            self.center[2] - S::f32s::splat(simd, light.position.z),
        ]
    }

    /// [`crate::relevance::score`], operation by operation; where that is 0 it may be less or not a number.
    #[inline(always)]
    fn score<const SPOT: bool>(&self, simd: S, light: &ScoredLight) -> S::f32s {
        let splat = |value: f32| S::f32s::splat(simd, value);
        let (zero, one) = (splat(0.0), splat(1.0));
        let v = self.offset(simd, light);
        let distance = dot(v, v).sqrt();
        let d = (distance * splat(1.0 - ROUNDING) - self.radius).max(zero);
        let window = range_window(simd, d * d, light);
        let denominator = denominator(simd, d, light);
        if !SPOT {
            return window / denominator;
        }
        let r = self.radius + distance * splat(ROUNDING);
        let axis = light.axis.to_array().map(splat);
        let t = dot(v, axis);
        let off = [v[0] - axis[0] * t, v[1] - axis[1] * t, v[2] - axis[2] * t];
        let along = t + r;
        let tan = (dot(off, off).sqrt() - r).max(zero) / along;
        let tan_squared = tan * tan;
        let cos = one / (one + tan_squared).sqrt();
        let cone = window * cone_step(simd, cos, splat(light.cos_outer), light);
        let score = cone / (denominator * (one + splat(light.falloff) * tan_squared));
        along.simd_gt(zero).select(score, zero)
    }
}

#[inline(always)]
fn dot<T: Copy + std::ops::Mul<Output = T> + std::ops::Add<Output = T>>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn range_window<S: Simd>(simd: S, distance_squared: S::f32s, light: &ScoredLight) -> S::f32s {
    let x = distance_squared * S::f32s::splat(simd, light.inverse_range_squared);
    let window = (S::f32s::splat(simd, 1.0) - x * x).max(S::f32s::splat(simd, 0.0));
    window * window
}

#[inline(always)]
fn denominator<S: Simd>(simd: S, d: S::f32s, light: &ScoredLight) -> S::f32s {
    let [constant, linear, quadratic, least] = light.denominator.to_array().map(|value| S::f32s::splat(simd, value));
    (constant + d * (linear + d * quadratic)).max(least)
}

#[inline(always)]
fn cone_step<S: Simd>(simd: S, cos: S::f32s, edge: S::f32s, light: &ScoredLight) -> S::f32s {
    let step = (cos - edge) * S::f32s::splat(simd, light.inverse_cone);
    let step = step.max(S::f32s::splat(simd, 0.0)).min(S::f32s::splat(simd, 1.0));
    step * step
}

/// The four best scores of each lane.
struct Top<S: Simd> {
    scores: [S::f32s; 4],
    slots: [S::u32s; 3],
    dropped: S::f32s,
    reaching: S::u32s,
}

impl<S: Simd> Top<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        Self {
            scores: [S::f32s::splat(simd, 0.0); 4],
            slots: [S::u32s::splat(simd, NO_LIGHT); 3],
            dropped: S::f32s::splat(simd, 0.0),
            reaching: S::u32s::splat(simd, 0),
        }
    }

    /// Takes a light in; of equal scores the lower slot is ahead. Its slot and a bit for each object that it reaches;
    /// `None` where there is none.
    #[inline(always)]
    fn offer(&mut self, simd: S, score: S::f32s, slot: u32) -> Option<(u32, u32)> {
        let zero = S::f32s::splat(simd, 0.0);
        let reaches = score.simd_gt(zero);
        let bits = reaches.to_bitmask() as u32;
        if bits == 0 {
            return None;
        }
        let light = (slot, bits);
        let [s0, s1, s2, s3] = self.scores;
        let [i0, i1, i2] = self.slots;
        let slot = S::u32s::splat(simd, slot);
        let better = |other: S::f32s, taken: S::u32s| {
            score.simd_gt(other) | (score.simd_eq(other) & slot.simd_lt(taken) & reaches)
        };
        let (b0, b1, b2) = (better(s0, i0), better(s1, i1), better(s2, i2));
        let score = reaches.select(score, zero);
        self.dropped += b2.select(s2, score);
        self.reaching += reaches.select(S::u32s::splat(simd, 1), S::u32s::splat(simd, 0));
        self.slots = [b0.select(slot, i0), b0.select(i0, b1.select(slot, i1)), b1.select(i1, b2.select(slot, i2))];
        self.scores = [s0.max(score), s1.max(s0.min(score)), s2.max(s1.min(score)), s3.max(s2.min(score))];
        Some(light)
    }

    #[inline(always)]
    fn weights(&self, simd: S, policy: LightPolicy) -> [S::f32s; 3] {
        let (zero, one) = (S::f32s::splat(simd, 0.0), S::f32s::splat(simd, 1.0));
        let [scores @ .., fourth] = self.scores;
        scores.map(|score| {
            let ratio = fourth / score;
            let squared = ratio * ratio;
            let weight = if policy == LightPolicy::Hard { one } else { one - squared * squared };
            score.simd_gt(zero).select(weight, zero)
        })
    }

    /// 1 − the weight of a light, 0 where it does not reach.
    #[inline(always)]
    fn left_out(&self, simd: S, weights: [S::f32s; 3], (slot, bits): (u32, u32)) -> S::f32s {
        let slot = S::u32s::splat(simd, slot);
        let weight = S::f32s::splat(simd, 0.0);
        let weight = self.slots[2].simd_eq(slot).select(weights[2], weight);
        let weight = self.slots[1].simd_eq(slot).select(weights[1], weight);
        let weight = self.slots[0].simd_eq(slot).select(weights[0], weight);
        let reaches = S::mask32s::from_bitmask(simd, bits.into());
        reaches.select(S::f32s::splat(simd, 1.0) - weight, S::f32s::splat(simd, 0.0))
    }
}

const DIRECTIONAL: u32 = LightRecord::DIRECTIONAL;
const POINT: u32 = LightRecord::POINT;
/// Either kind of spot.
const SPOT: u32 = LightRecord::SPOT_CONE;

/// What the weights leave out, summed per lane.
struct Remainder<S: Simd> {
    ambient: [S::f32s; 3],
    direction: [S::f32s; 3],
}

impl<S: Simd> Remainder<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        let zero = [S::f32s::splat(simd, 0.0); 3];
        Self { ambient: zero, direction: zero }
    }

    /// Adds a light, [`crate::relevance::at_center`] operation by operation.
    #[inline(always)]
    fn add<const KIND: u32>(
        &mut self,
        simd: S,
        objects: &Objects<S>,
        scored: &[ScoredLight],
        left_out: S::f32s,
        slot: u32,
    ) {
        let light = &scored[slot as usize];
        let splat = |value: f32| S::f32s::splat(simd, value);
        let zero = splat(0.0);
        let (irradiance, toward) = if KIND == DIRECTIONAL {
            (splat(light.luminance), (-light.axis).to_array().map(splat))
        } else {
            let v = objects.offset(simd, light);
            let squared = dot(v, v);
            let d = squared.sqrt();
            let inverse_distance = d.simd_gt(zero).select(splat(1.0) / d, zero);
            let mut irradiance = range_window(simd, squared, light) / denominator(simd, d, light);
            if KIND == SPOT {
                let cos = dot(v, light.axis.to_array().map(splat)) * inverse_distance;
                let edge = splat(light.cos_outer + ROUNDING);
                irradiance *= if light.kind == LightRecord::SPOT_CONE {
                    cone_step(simd, cos, edge, light)
                } else {
                    cos.simd_gt(edge).select(power(simd, cos, light.exponent), zero)
                };
            }
            (irradiance, v.map(|v| v * -inverse_distance))
        };
        // Where it does not reach, the irradiance may be no number.
        let part = left_out.simd_gt(zero).select(left_out * irradiance, zero);
        let directed = part * splat(light.directed);
        let tint = light.tint.to_array();
        for axis in 0..3 {
            self.ambient[axis] += splat(tint[axis]) * part;
            self.direction[axis] += toward[axis] * directed;
        }
    }
}

/// [`crate::relevance`]'s power.
#[inline(always)]
fn power<S: Simd>(simd: S, x: S::f32s, e: f32) -> S::f32s {
    let splat = |value: f32| S::f32s::splat(simd, value);
    let one = splat(1.0);
    let root = x.sqrt().sqrt();
    let z = (root - one) / (root + one);
    let z2 = z * z;
    let series = one + z2 * (splat(1.0 / 3.0) + z2 * (splat(1.0 / 5.0) + z2 * splat(1.0 / 7.0)));
    let scale = splat(1.0 / (1 << SQUARINGS) as f32);
    let exponent = (splat(8.0 * e) * (z * series)).max(splat(-80.0)) * scale;
    let mut result = one + exponent * (one + exponent * (splat(0.5) + exponent * splat(1.0 / 6.0)));
    for _ in 0..SQUARINGS {
        result *= result;
    }
    result
}

/// From lanes to objects.
#[inline(always)]
fn store<S: Simd>(top: &Top<S>, weights: [S::f32s; 3], remainder: &Remainder<S>, out: &mut [Selection]) {
    let slots = top.slots.each_ref().map(|v| v.as_slice());
    let weights = weights.each_ref().map(|v| v.as_slice());
    let ambient = remainder.ambient.each_ref().map(|v| v.as_slice());
    let direction = remainder.direction.each_ref().map(|v| v.as_slice());
    let (reaching, dropped) = (top.reaching.as_slice(), top.dropped.as_slice());
    for (i, out) in out.iter_mut().enumerate() {
        *out = Selection {
            lights: slots.map(|v| v[i]),
            weights: weights.map(|v| v[i]),
            remainder_ambient: ambient.map(|v| v[i]).into(),
            remainder_direction: direction.map(|v| v[i]).into(),
            reaching: reaching[i],
            dropped: dropped[i],
        };
    }
}
