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
use crate::light_candidates::{Candidates, Row, cone_meets, gap_squared, load, load3, node_in_range, within};
use crate::light_lanes::{DIRECTIONAL, Floats, Objects, POINT, Remainder, SPOT, Top, store};
use crate::light_tree::{Block, LightTree, Volume, WIDTH};
use crate::lights::{LightPolicy, Selection};
use crate::relevance::ScoredLight;
pub use fearless_simd::Level;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch};

/// Objects that share one walk through the tree.
const CLUSTER: usize = 1024;
/// Objects that share a list of candidates, from which each group takes its own.
const PACKET: usize = 128;

/// Lists that a search reuses.
#[derive(Default)]
pub struct Scratch {
    /// Around each group of the cluster.
    volumes: Vec<Option<Volume>>,
    stack: Vec<(u32, u32)>,
    points: Nearby,
    spots: Nearby,
    /// What reaches some object of the group: directional, point and spot lights.
    reaching: [Reaching; 3],
}

/// Lights of one kind that may reach a cluster of objects.
#[derive(Default)]
struct Nearby {
    cluster: Candidates,
    /// Copies of the cluster's lights, so that they lie close together.
    lights: Vec<ScoredLight>,
    slots: Vec<u32>,
    /// Those that may reach the packet.
    packet: Candidates,
    /// Those of them that may reach the group: places in `lights`.
    group: Vec<u32>,
    group_count: usize,
}

/// Lights that reach some object of a group: which one, and a bit for each object.
#[derive(Default)]
struct Reaching {
    lights: Vec<(u32, u32)>,
    count: usize,
}

impl Reaching {
    fn clear(&mut self, room: usize) {
        self.count = 0;
        if self.lights.len() < room + 1 {
            self.lights.resize(room.next_power_of_two().max(256), (0, 0));
        }
    }

    /// Keeps a light if any bit is set.
    #[inline(always)]
    fn add(&mut self, light: u32, bits: u32) {
        self.lights[self.count] = (light, bits);
        self.count += usize::from(bits != 0);
    }

    fn as_slice(&self) -> &[(u32, u32)] {
        &self.lights[..self.count]
    }
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
        for (spheres, out) in spheres.chunks(CLUSTER).zip(out.chunks_mut(CLUSTER)) {
            select_cluster(simd, tree, scored, policy, spheres, out, scratch);
        }
    });
}

/// The slots of all lights that reach a sphere, in [`crate::light_tree::search_order`].
pub fn reaching(
    level: Level,
    tree: &LightTree,
    scored: &[ScoredLight],
    sphere: Sphere,
    scratch: &mut Scratch,
) -> Vec<u32> {
    let mut out = [Selection::default()];
    select(level, tree, scored, LightPolicy::Hard, (&[sphere], &mut out), scratch);
    let Scratch { points, spots, reaching: [everywhere, near_points, near_spots], .. } = scratch;
    let everywhere = everywhere.as_slice().iter().map(|&(slot, _)| slot);
    let points = near_points.as_slice().iter().map(|&(light, _)| points.slots[light as usize]);
    let spots = near_spots.as_slice().iter().map(|&(light, _)| spots.slots[light as usize]);
    everywhere.chain(points).chain(spots).collect()
}

#[inline(always)]
fn select_cluster<S: Simd>(
    simd: S,
    tree: &LightTree,
    scored: &[ScoredLight],
    policy: LightPolicy,
    spheres: &[Sphere],
    out: &mut [Selection],
    scratch: &mut Scratch,
) {
    let lanes = Floats::<S>::LEN;
    let Scratch { volumes, stack, points, spots, reaching } = scratch;
    volumes.clear();
    // Not by `extend`: it would not be inlined, and each operation would become a call.
    for spheres in spheres.chunks(lanes) {
        volumes.push(Objects::load(simd, spheres).volume(simd));
    }
    points.clear();
    spots.clear();
    if let Some(volume) = Volume::union(volumes) {
        walk(simd, tree, scored, &volume, stack, points, spots);
    }
    let packets = spheres.chunks(PACKET).zip(out.chunks_mut(PACKET)).zip(volumes.chunks(PACKET / lanes));
    for ((spheres, out), volumes) in packets {
        let Some(volume) = Volume::union(volumes) else {
            out.fill(Selection::default());
            continue;
        };
        points.cluster.filter::<S, false>(simd, &volume, &mut points.packet);
        spots.cluster.filter::<S, true>(simd, &volume, &mut spots.packet);
        for ((spheres, out), volume) in spheres.chunks(lanes).zip(out.chunks_mut(lanes)).zip(volumes) {
            if let Some(volume) = volume {
                points.group_count = points.packet.find::<S, false>(simd, volume, &mut points.group);
                spots.group_count = spots.packet.find::<S, true>(simd, volume, &mut spots.group);
                let objects = Objects::load(simd, spheres);
                select_group(simd, tree, scored, policy, &objects, (points, spots), reaching, out);
            } else {
                out.fill(Selection::default());
            }
        }
    }
}

#[inline(always)]
#[allow(clippy::too_many_arguments)]
fn select_group<S: Simd>(
    simd: S,
    tree: &LightTree,
    scored: &[ScoredLight],
    policy: LightPolicy,
    objects: &Objects<S>,
    (points, spots): (&Nearby, &Nearby),
    [everywhere, near_points, near_spots]: &mut [Reaching; 3],
    out: &mut [Selection],
) {
    everywhere.clear(tree.everywhere.len());
    near_points.clear(points.group_count);
    near_spots.clear(spots.group_count);
    let mut top = Top::new(simd);
    for &slot in &tree.everywhere {
        everywhere.add(slot, top.offer(simd, objects.everywhere(simd, &scored[slot as usize]), slot));
    }
    for &light in &points.group[..points.group_count] {
        let score = objects.score::<false>(simd, &points.lights[light as usize]);
        near_points.add(light, top.offer(simd, score, points.slots[light as usize]));
    }
    for &light in &spots.group[..spots.group_count] {
        let score = objects.score::<true>(simd, &spots.lights[light as usize]);
        near_spots.add(light, top.offer(simd, score, spots.slots[light as usize]));
    }
    let weights = top.weights(simd, policy);
    let mut remainder = Remainder::new(simd);
    if policy != LightPolicy::Hard && top.has_fourth() {
        for &(slot, bits) in everywhere.as_slice() {
            let left_out = top.left_out(simd, weights, slot);
            remainder.add::<DIRECTIONAL>(simd, objects, &scored[slot as usize], left_out, bits);
        }
        for &(light, bits) in near_points.as_slice() {
            let left_out = top.left_out(simd, weights, points.slots[light as usize]);
            remainder.add::<POINT>(simd, objects, &points.lights[light as usize], left_out, bits);
        }
        for &(light, bits) in near_spots.as_slice() {
            let left_out = top.left_out(simd, weights, spots.slots[light as usize]);
            remainder.add::<SPOT>(simd, objects, &spots.lights[light as usize], left_out, bits);
        }
    }
    store(&top, weights, &remainder, out);
}

/// Collects the lights that may reach the volume, in order.
#[inline(always)]
fn walk<S: Simd>(
    simd: S,
    tree: &LightTree,
    scored: &[ScoredLight],
    volume: &Volume,
    stack: &mut Vec<(u32, u32)>,
    points: &mut Nearby,
    spots: &mut Nearby,
) {
    stack.clear();
    if !tree.blocks.is_empty() {
        stack.push((tree.levels.len() as u32 - 1, 0));
    }
    while let Some((level, index)) = stack.pop() {
        let mut hit = node_in_range(simd, &tree.levels[level as usize][index as usize], volume);
        let first = index * WIDTH as u32;
        while hit != 0 {
            if level == 0 {
                let block = &tree.blocks[(first + hit.trailing_zeros()) as usize];
                hit &= hit - 1;
                let near = in_range(simd, block, volume);
                if near & !block.spots != 0 {
                    points.take(simd, scored, block, near & !block.spots, false);
                }
                if near & block.spots != 0 {
                    spots.take(simd, scored, block, near & block.spots & in_cone(simd, block, volume), true);
                }
            } else {
                // The first child on top.
                let last = hit.ilog2();
                hit ^= 1 << last;
                stack.push((level - 1, first + last));
            }
        }
    }
}

#[inline(always)]
fn in_range<S: Simd>(simd: S, block: &Block, volume: &Volume) -> u64 {
    let mut bits = 0;
    for k in (0..WIDTH).step_by(Floats::<S>::LEN) {
        let position = load3(simd, &block.position, k);
        let gap = gap_squared(simd, position, position, volume);
        bits |= within(simd, load(simd, &block.range, k), gap, volume) << k;
    }
    bits
}

#[inline(always)]
fn in_cone<S: Simd>(simd: S, block: &Block, volume: &Volume) -> u64 {
    let mut bits = 0;
    for k in (0..WIDTH).step_by(Floats::<S>::LEN) {
        let (position, axis) = (load3(simd, &block.position, k), load3(simd, &block.axis, k));
        bits |= cone_meets(simd, position, axis, load(simd, &block.tan, k), volume) << k;
    }
    bits
}

impl Nearby {
    fn clear(&mut self) {
        self.cluster.count = 0;
        self.lights.clear();
        self.slots.clear();
    }

    /// Appends the lights of a block whose bits are set.
    #[inline(always)]
    fn take<S: Simd>(&mut self, simd: S, scored: &[ScoredLight], block: &Block, bits: u64, are_spots: bool) {
        let lanes = Floats::<S>::LEN;
        for k in (0..WIDTH).step_by(lanes) {
            let row = Row {
                position: load3(simd, &block.position, k),
                range: load(simd, &block.range, k),
                axis: load3(simd, &block.axis, k),
                tan: load(simd, &block.tan, k),
            };
            self.cluster.append(simd, &row, bits >> k & ((1 << lanes) - 1), are_spots);
        }
        let mut rest = bits;
        while rest != 0 {
            let slot = block.slots[rest.trailing_zeros() as usize];
            self.cluster.lights[self.lights.len()] = self.lights.len() as u32;
            self.lights.push(scored[slot as usize]);
            self.slots.push(slot);
            rest &= rest - 1;
        }
        self.group.resize(self.cluster.lights.len(), 0);
    }
}
