//! The search for the most relevant lights of each object: exact, and fast at a million objects and 100,000 lights.
//!
//! Objects come in an order in which neighbours are near each other ([`crate::lights::ObjectOrder`]), in packets of
//! `PACKET`. Several packets ask the [`LightTree`] once for the lights that may reach any of their objects, and each
//! packet takes its own from that list. So do groups of as many objects as a vector has lanes (lanes are lights). A
//! group then scores what is left (lanes are objects), lists what reaches any of its objects, and goes through that
//! list twice: for the best, which stay in registers, and for the ambient cube. Where objects may have more than three
//! lights, it finds their thresholds in between, and lists what weighs something.
//!
//! If only some of the objects are searched ([`select_sparse`]), packets and groups end where the next object is too
//! far away in the order. An object that is left alone goes through its packet's list by itself (`alone.rs`).
//!
//! The result equals [`crate::lights::brute_force`] bit for bit on every instruction set: lights are added up in
//! [`crate::lights::search_order`], nothing is fused or approximated, and each object's result depends on nothing
//! but itself and the lights that reach it. Which instructions the processor has is found out when the program runs
//! ([`Level`]).

use super::alone::select_one;
use super::candidates::{Candidates, Row, cone_meets, gap_squared, load, load3, node_in_range, within};
use super::enough::Shares;
use super::lanes::{Floats, LANES, Met, Objects, Shining, Top, splat};
use super::residual::{DIRECTIONAL, POINT, Residual, SPOT};
use super::results::{Found, Lanes};
use crate::ecs::bits::for_each_set;
use crate::ecs::read_ahead::read_ahead;
use crate::lights::brute_force;
use crate::lights::lists::ListedLights;
use crate::lights::policy::{LightPolicy, Policies};
use crate::lights::relevance::ScoredLight;
use crate::lights::selected::{MOST_WEIGHT, WEIGHT_BITS};
use crate::lights::tree::{LightTree, Volume, WIDTH};
use crate::space::bounds::Sphere;
pub use fearless_simd::Level;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch};

/// Objects that share one walk through the tree.
const CLUSTER: usize = 1024;
/// Objects that share a list of candidates, from which each group takes its own.
const PACKET: usize = 128;
/// Places that clusters, packets and groups span at most: the objects of some places only, too far from each other,
/// would share long lists for little.
const CLUSTER_SPAN: u32 = 2048;
const PACKET_SPAN: u32 = 256;
const GROUP_SPAN: u32 = 64;
/// Groups of no more objects are not worth a vector: they choose one by one.
const FEW: usize = 3;

/// Lists that a search reuses.
#[derive(Default)]
pub struct Scratch {
    /// Number of objects in each group of the cluster, and the volume around them.
    groups: Vec<(usize, Option<Volume>)>,
    /// Number of groups in each packet of the cluster.
    packets: Vec<usize>,
    stack: Vec<(u32, u32)>,
    points: Nearby,
    spots: Nearby,
    /// Lights that reach some object of the group: directional, point and spot lights.
    reaching: [Reaching; 3],
    /// Lights that reach an object that chooses by itself.
    one: Vec<brute_force::Reaching>,
    /// Lights beyond their three of the objects of the last search.
    pub further: ListedLights,
    listing: Listing,
}

/// The lights of a group beyond the three of its objects.
#[derive(Default)]
struct Listing {
    /// A bit for each object that has the light, its slot, and its weights in the units of [`SelectedLights`].
    lights: Vec<(u32, u32, [f32; LANES])>,
}

/// Lights of one kind that may reach a cluster of objects.
#[derive(Default)]
pub(crate) struct Nearby {
    cluster: Candidates,
    /// Those that may reach the packet.
    packet: Candidates,
    /// Those of them that may reach the group: places in the tree.
    group: Vec<u32>,
    group_count: usize,
}

impl Nearby {
    /// Finds those of the packet that may reach the volume.
    #[inline(always)]
    pub fn find<S: Simd, const SPOTS: bool>(&mut self, simd: S, volume: &Volume) {
        self.group_count = self.packet.find::<S, SPOTS>(simd, volume, &mut self.group);
    }

    pub fn near(&self) -> &[u32] {
        &self.group[..self.group_count]
    }
}

/// Lights that reach some object of a group.
#[derive(Default)]
struct Reaching {
    lights: Vec<Met>,
    count: usize,
}

impl Reaching {
    /// An empty list with room for so many, and one that does not count.
    #[inline(always)]
    fn room(&mut self, lights: usize) -> &mut [Met] {
        self.count = 0;
        if self.lights.len() < lights + 1 {
            self.lights.resize((lights + 1).next_power_of_two().max(256), Met::default());
        }
        &mut self.lights[..lights + 1]
    }

    fn as_slice(&self) -> &[Met] {
        &self.lights[..self.count]
    }
}

/// Groups whose objects all have three at full weight and nothing else.
const HARD: u8 = 0;
/// Groups whose objects all have three, and an ambient cube.
const THREE: u8 = 1;
/// Groups of which some object may have more than three.
const LISTED: u8 = 2;

/// Chooses the lights of each sphere; `scored` is indexed by slot, and `tree` built from it. A sphere that is not
/// finite has none. Fast where neighbours in `spheres` are near each other. What they have beyond their three is in the
/// scratch afterwards.
pub fn select<F: Found>(
    level: Level,
    tree: &LightTree,
    scored: &[ScoredLight],
    policies: Policies,
    (spheres, out): (&[Sphere], &mut [F]),
    scratch: &mut Scratch,
) {
    scratch.further.clear();
    let places: [u32; CLUSTER] = std::array::from_fn(|place| place as u32);
    let first = (0..).step_by(CLUSTER);
    for ((spheres, out), first) in spheres.chunks(CLUSTER).zip(out.chunks_mut(CLUSTER)).zip(first) {
        let policies = policies.part(first..first + spheres.len());
        add_sparse(level, tree, scored, policies, (&places[..spheres.len()], spheres, out), scratch);
    }
}

/// [`select`] for objects at some places only of a longer list of neighbours; ascending.
pub fn select_sparse<F: Found>(
    level: Level,
    tree: &LightTree,
    scored: &[ScoredLight],
    policies: Policies,
    work: (&[u32], &[Sphere], &mut [F]),
    scratch: &mut Scratch,
) {
    scratch.further.clear();
    add_sparse(level, tree, scored, policies, work, scratch);
}

/// [`select_sparse`], behind what was listed before.
fn add_sparse<F: Found>(
    level: Level,
    tree: &LightTree,
    scored: &[ScoredLight],
    policies: Policies,
    (places, spheres, mut out): (&[u32], &[Sphere], &mut [F]),
    scratch: &mut Scratch,
) {
    dispatch!(level, simd => {
        let mut first = 0;
        while first < places.len() {
            let range = first..first + together(&places[first..], CLUSTER, CLUSTER_SPAN);
            let (cluster, later) = out.split_at_mut(range.len());
            let work = (&places[range.clone()], &spheres[range.clone()], cluster);
            let policies = policies.part(range.clone());
            match policies {
                Policies::Same(LightPolicy::Hard) => {
                    select_cluster::<_, _, HARD>(simd, tree, scored, policies, work, scratch);
                }
                _ if policies.are_listed() => {
                    select_cluster::<_, _, LISTED>(simd, tree, scored, policies, work, scratch);
                }
                _ => select_cluster::<_, _, THREE>(simd, tree, scored, policies, work, scratch),
            }
            (first, out) = (range.end, later);
        }
    });
}

/// Number of the first places that belong together: at most `count`, within `span` places.
#[inline(always)]
fn together(places: &[u32], count: usize, span: u32) -> usize {
    let places = &places[..count.min(places.len())];
    places.partition_point(|&place| place - places[0] < span)
}

#[inline(always)]
fn select_cluster<S: Simd, F: Found, const KIND: u8>(
    simd: S,
    tree: &LightTree,
    scored: &[ScoredLight],
    policies: Policies,
    (places, mut spheres, mut out): (&[u32], &[Sphere], &mut [F]),
    scratch: &mut Scratch,
) {
    let lanes = Floats::<S>::LEN;
    let Scratch { groups, packets, stack, points, spots, reaching, one, further, listing } = scratch;
    groups.clear();
    packets.clear();
    let mut first = 0;
    while first < places.len() {
        let packet = &places[first..first + together(&places[first..], PACKET, PACKET_SPAN)];
        let groups_before = groups.len();
        let mut start = 0;
        while start < packet.len() {
            let count = together(&packet[start..], lanes, GROUP_SPAN);
            let spheres = &spheres[first + start..first + start + count];
            groups.push((count, Objects::load(simd, spheres).volume(simd)));
            start += count;
        }
        packets.push(groups.len() - groups_before);
        first += packet.len();
    }
    points.cluster.count = 0;
    spots.cluster.count = 0;
    if let Some(volume) = Volume::union(groups.iter().map(|group| group.1)) {
        walk(simd, tree, &volume, stack, &mut points.cluster, &mut spots.cluster);
    }
    let mut groups = &groups[..];
    // Of the group's first object.
    let mut number = 0;
    for &packet in &*packets {
        let (packet, later) = groups.split_at(packet);
        groups = later;
        if let Some(volume) = Volume::union(packet.iter().map(|group| group.1)) {
            points.cluster.filter::<S, false>(simd, &volume, &mut points.packet);
            spots.cluster.filter::<S, true>(simd, &volume, &mut spots.packet);
            read_lights_ahead(tree, points.packet.places());
            read_lights_ahead(tree, spots.packet.places());
        }
        for &(count, volume) in packet {
            let (group, later) = spheres.split_at(count);
            let (found, later_out) = std::mem::take(&mut out).split_at_mut(count);
            (spheres, out) = (later, later_out);
            let policies = policies.part(number..number + count);
            number += count;
            let Some(volume) = volume else {
                found.fill(F::default());
                list_none::<KIND>(further, count);
                continue;
            };
            if count <= FEW {
                for (i, (&sphere, found)) in group.iter().zip(found).enumerate() {
                    let (policy, near) = (policies.of(i), (&mut *points, &mut *spots));
                    *found = F::new(&select_one(simd, tree, scored, policy, sphere, near, one, further));
                    list_none::<KIND>(further, 1);
                }
                continue;
            }
            points.find::<S, false>(simd, &volume);
            spots.find::<S, true>(simd, &volume);
            if points.near().is_empty() && spots.near().is_empty() && tree.everywhere.is_empty() {
                found.fill(F::default());
                list_none::<KIND>(further, count);
                continue;
            }
            let objects = Objects::load(simd, group);
            let near = (points.near(), spots.near());
            select_group::<_, _, KIND>(simd, tree, scored, policies, &objects, near, reaching, listing, found);
            if KIND == LISTED {
                listing.list(count, further);
            }
        }
    }
}

/// So many objects have no light beyond their three, or none but those that were pushed.
#[inline(always)]
fn list_none<const KIND: u8>(further: &mut ListedLights, objects: usize) {
    if KIND == LISTED {
        (0..objects).for_each(|_| further.end_object());
    }
}

impl Listing {
    /// Lists the group's lights object by object.
    #[inline(always)]
    fn list(&mut self, objects: usize, further: &mut ListedLights) {
        for object in 0..objects {
            for &(bits, slot, ref units) in &self.lights {
                if bits >> object & 1 != 0 {
                    further.push(slot << WEIGHT_BITS | units[object] as u32);
                }
            }
            further.end_object();
        }
    }
}

#[inline(always)]
#[allow(clippy::too_many_arguments)]
fn select_group<S: Simd, F: Found, const KIND: u8>(
    simd: S,
    tree: &LightTree,
    scored: &[ScoredLight],
    policies: Policies,
    objects: &Objects<S>,
    (near_points, near_spots): (&[u32], &[u32]),
    [everywhere, points, spots]: &mut [Reaching; 3],
    listing: &mut Listing,
    out: &mut [F],
) {
    let list = everywhere.room(tree.everywhere.len());
    let mut count = 0;
    for &slot in &tree.everywhere {
        list[count].slot = slot;
        count += usize::from(list[count].set_score(simd, objects.everywhere(simd, &scored[slot as usize])));
    }
    everywhere.count = count;
    meet::<S, false, KIND>(simd, tree, objects, near_points, points);
    meet::<S, true, KIND>(simd, tree, objects, near_spots, spots);
    let mut top = Top::new(simd);
    for list in [&*everywhere, points, spots] {
        for met in list.as_slice() {
            top.offer(simd, met);
        }
    }
    let mut weights = if KIND == HARD { top.full_weights(simd) } else { top.weights(simd) };
    let mut residual = Residual::new(simd);
    let mut dropped = top.dropped;
    if KIND == LISTED {
        let mut shares = Shares::new(simd, &policies, out.len());
        if shares.listed.any_true() {
            let lists = [everywhere.as_slice(), points.as_slice(), spots.as_slice()];
            shares.find_thresholds(simd, tree, objects.radius, lists, &top);
        }
        let mut listed = Listed::new(simd, shares, &top, weights, listing);
        for met in everywhere.as_slice() {
            if let Some(left_out) = listed.take(simd, &top, met) {
                residual.add::<DIRECTIONAL>(simd, objects, &scored[met.slot as usize], met, left_out);
            }
        }
        for met in points.as_slice() {
            if let Some(left_out) = listed.take(simd, &top, met) {
                residual.add::<POINT>(simd, objects, &tree.lights[met.place as usize], met, left_out);
            }
        }
        for met in spots.as_slice() {
            if let Some(left_out) = listed.take(simd, &top, met) {
                residual.add::<SPOT>(simd, objects, &tree.lights[met.place as usize], met, left_out);
            }
        }
        (weights, dropped) = (listed.weights, listed.shares.listed.select(listed.dropped, top.dropped));
    } else if KIND == THREE && top.has_fourth() {
        for met in everywhere.as_slice() {
            let left_out = top.left_out(simd, weights, met.slot);
            residual.add::<DIRECTIONAL>(simd, objects, &scored[met.slot as usize], met, left_out);
        }
        for met in points.as_slice() {
            let left_out = top.left_out(simd, weights, met.slot);
            residual.add::<POINT>(simd, objects, &tree.lights[met.place as usize], met, left_out);
        }
        for met in spots.as_slice() {
            let left_out = top.left_out(simd, weights, met.slot);
            residual.add::<SPOT>(simd, objects, &tree.lights[met.place as usize], met, left_out);
        }
    }
    F::store(simd, &Lanes { top: &top, weights, dropped, residual: &residual }, out);
}

/// The weights of a group's lights where objects may have more than three, as light after light is taken in.
struct Listed<'a, S: Simd> {
    shares: Shares<S>,
    /// Weights of the three, as if there were no others.
    least: [Floats<S>; 3],
    weights: [Floats<S>; 3],
    /// Sum of what is left out of the scores.
    dropped: Floats<S>,
    listing: &'a mut Listing,
}

impl<'a, S: Simd> Listed<'a, S> {
    #[inline(always)]
    fn new(simd: S, shares: Shares<S>, top: &Top<S>, least: [Floats<S>; 3], listing: &'a mut Listing) -> Self {
        listing.lights.clear();
        let full = top.full_weights(simd);
        let least = [
            shares.hard.select(full[0], least[0]),
            shares.hard.select(full[1], least[1]),
            shares.hard.select(full[2], least[2]),
        ];
        Self { shares, least, weights: least, dropped: splat(simd, 0.0), listing }
    }

    /// Gives a light its weights; what they leave out, if that is something.
    #[inline(always)]
    fn take(&mut self, simd: S, top: &Top<S>, met: &Met) -> Option<Floats<S>> {
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let score = met.score(simd);
        let least = top.weight_of(simd, self.least, met.slot);
        let weight = score.simd_gt(zero).select(self.shares.weight(simd, score, least), zero);
        let slot = S::u32s::splat(simd, met.slot);
        let mut others = self.shares.listed & weight.simd_gt(zero);
        for (kept, chosen) in self.weights.iter_mut().zip(top.slots) {
            let is_it = chosen.simd_eq(slot);
            *kept = is_it.select(weight, *kept);
            others &= !is_it;
        }
        let bits = others.to_bitmask() as u32;
        if bits != 0 {
            let mut units = [0.0; LANES];
            (weight * splat(simd, MOST_WEIGHT) + splat(simd, 0.5)).store_slice(&mut units[..Floats::<S>::LEN]);
            self.listing.lights.push((bits, met.slot, units));
        }
        let left_out = one - weight;
        self.dropped += score * left_out;
        let left_out = self.shares.hard.select(zero, left_out);
        let counts = left_out.simd_gt(zero) & score.simd_gt(zero);
        counts.any_true().then_some(left_out)
    }
}

/// Lists those of the lights at these places of the tree that reach some object. There is no branch on whether one
/// does, which is hard to predict.
#[inline(always)]
fn meet<S: Simd, const SPOTS: bool, const KIND: u8>(
    simd: S,
    tree: &LightTree,
    objects: &Objects<S>,
    places: &[u32],
    reaching: &mut Reaching,
) {
    let list = reaching.room(places.len());
    let (lights, slots) = (&tree.lights[..], &tree.slots[..tree.lights.len()]);
    let mut count = 0;
    for &place in places {
        let (score, lengths) = objects.score::<SPOTS>(simd, &Shining::of(simd, &lights[place as usize]));
        let met = &mut list[count];
        (met.place, met.slot) = (place, slots[place as usize]);
        if KIND != HARD {
            met.set_lengths::<S, SPOTS>(&lengths);
        }
        count += usize::from(met.set_score(simd, score));
    }
    reaching.count = count;
}

/// Collects the lights that may reach the volume, in order.
#[inline(always)]
fn walk<S: Simd>(
    simd: S,
    tree: &LightTree,
    volume: &Volume,
    stack: &mut Vec<(u32, u32)>,
    points: &mut Candidates,
    spots: &mut Candidates,
) {
    stack.clear();
    if !tree.blocks.is_empty() {
        stack.push((tree.levels.len() as u32 - 1, 0));
    }
    while let Some((level, index)) = stack.pop() {
        let mut hit = node_in_range(simd, &tree.levels[level as usize][index as usize], volume);
        let first = index * WIDTH as u32;
        if level == 0 {
            for_each_set(hit, |block| tree.blocks[(first + block) as usize].read_ahead());
            for_each_set(
                hit,
                #[inline(always)]
                |block| take(simd, tree, first + block, volume, points, spots),
            );
            continue;
        }
        while hit != 0 {
            // The first child on top.
            let last = hit.ilog2();
            hit ^= 1 << last;
            stack.push((level - 1, first + last));
        }
    }
}

/// Reads something of both cache lines of the lights at these places: later, where few objects share lights, each would
/// wait for its own.
#[inline(always)]
fn read_lights_ahead(tree: &LightTree, places: &[u32]) {
    let lights = places.iter().map(|&place| &tree.lights[place as usize]);
    read_ahead(lights.map(|light| light.inverse_range_squared.to_bits() ^ light.range.to_bits()));
}

/// Collects the lights of a block that may reach the volume.
#[inline(always)]
fn take<S: Simd>(
    simd: S,
    tree: &LightTree,
    block: u32,
    volume: &Volume,
    points: &mut Candidates,
    spots: &mut Candidates,
) {
    let lanes = Floats::<S>::LEN;
    let first = block * WIDTH as u32;
    let block = &tree.blocks[block as usize];
    for k in (0..WIDTH).step_by(lanes) {
        let row = Row {
            position: load3(simd, &block.position, k),
            range: load(simd, &block.range, k),
            axis: load3(simd, &block.axis, k),
            tan: load(simd, &block.tan, k),
            places: S::u32s::from_slice(simd, &COUNT[k..k + lanes]) + S::u32s::splat(simd, first),
        };
        let gap = gap_squared(simd, row.position, row.position, volume);
        let near = within(simd, row.range, gap, volume);
        let are_spots = block.spots >> k;
        if near & !are_spots != 0 {
            points.append::<S, false>(simd, &row, near & !are_spots);
        }
        if near & are_spots != 0 {
            let near = near & are_spots & cone_meets(simd, row.position, row.axis, row.tan, volume);
            spots.append::<S, true>(simd, &row, near);
        }
    }
}

const COUNT: [u32; WIDTH] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];
