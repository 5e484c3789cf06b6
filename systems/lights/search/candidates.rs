//! Lists of lights that may reach some objects, fields side by side, and the tests that make the lists shorter.
//!
//! The tests must keep every light whose score is above 0 for any object inside the volume: they use the score's own
//! conditions for range and cone, with room for rounding.

use super::lanes::{Floats, LANES, splat};
use crate::lights::relevance::ScoredLight;
use crate::lights::tree::{MARGIN, Node, Volume, WIDTH, outer_tan};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Lights of one kind, sorted as the search adds them up.
#[derive(Default)]
pub(crate) struct Candidates {
    position: [Vec<f32>; 3],
    range: Vec<f32>,
    axis: [Vec<f32>; 3],
    tan: Vec<f32>,
    /// Places of the lights in the tree.
    places: Vec<u32>,
    pub count: usize,
}

/// Lights in the lanes of a vector.
pub(crate) struct Row<S: Simd> {
    pub position: [Floats<S>; 3],
    pub range: Floats<S>,
    pub axis: [Floats<S>; 3],
    pub tan: Floats<S>,
    pub places: S::u32s,
}

/// Loads numbers of a list from index k on, one per lane.
#[inline(always)]
pub(crate) fn load<S: Simd>(simd: S, list: &[f32], k: usize) -> Floats<S> {
    Floats::<S>::from_slice(simd, &list[k..k + Floats::<S>::LEN])
}

#[inline(always)]
pub(crate) fn load3<S: Simd>(simd: S, lists: &[[f32; WIDTH]; 3], k: usize) -> [Floats<S>; 3] {
    [load(simd, &lists[0], k), load(simd, &lists[1], k), load(simd, &lists[2], k)]
}

/// Squared distance of points from the volume's box.
#[inline(always)]
pub(crate) fn gap_squared<S: Simd>(simd: S, min: [Floats<S>; 3], max: [Floats<S>; 3], volume: &Volume) -> Floats<S> {
    let x = gap(simd, min[0], max[0], volume.min.x, volume.max.x);
    let y = gap(simd, min[1], max[1], volume.min.y, volume.max.y);
    let z = gap(simd, min[2], max[2], volume.min.z, volume.max.z);
    x * x + y * y + z * z
}

/// Distance of intervals from another.
#[inline(always)]
fn gap<S: Simd>(simd: S, min: Floats<S>, max: Floats<S>, other_min: f32, other_max: f32) -> Floats<S> {
    (splat(simd, other_min) - max).max(min - splat(simd, other_max)).max(splat(simd, 0.0))
}

/// Lights that come near enough: a bit each.
#[inline(always)]
pub(crate) fn within<S: Simd>(simd: S, range: Floats<S>, gap_squared: Floats<S>, volume: &Volume) -> u64 {
    let reach = (range + splat(simd, volume.radius)) * splat(simd, 1.0 + MARGIN);
    (reach * reach).simd_gt(gap_squared).to_bitmask()
}

/// Spots whose cones meet the volume: a bit each.
#[inline(always)]
pub(crate) fn cone_meets<S: Simd>(
    simd: S,
    position: [Floats<S>; 3],
    axis: [Floats<S>; 3],
    tan: Floats<S>,
    volume: &Volume,
) -> u64 {
    let (center, half) = (volume.min * 0.5 + volume.max * 0.5, (volume.max - volume.min) * 0.5);
    let center = [splat(simd, center.x), splat(simd, center.y), splat(simd, center.z)];
    let half = [splat(simd, half.x), splat(simd, half.y), splat(simd, half.z)];
    let to_box = [center[0] - position[0], center[1] - position[1], center[2] - position[2]];
    cone_meets_box(simd, to_box, half, splat(simd, volume.radius), axis, tan)
}

/// Lanes whose cone meets its box, given from the apex to the centre, grown by a radius. It is the score's own test,
/// with room for rounding. It tests the point of the box that is furthest along the axis and the one that is nearest to
/// it.
#[inline(always)]
fn cone_meets_box<S: Simd>(
    simd: S,
    [x, y, z]: [Floats<S>; 3],
    half: [Floats<S>; 3],
    radius: Floats<S>,
    axis: [Floats<S>; 3],
    tan: Floats<S>,
) -> u64 {
    let distance = (x * x + y * y + z * z).sqrt();
    let t = x * axis[0] + y * axis[1] + z * axis[2];
    let off = [x - axis[0] * t, y - axis[1] * t, z - axis[2] * t];
    let off_squared = off[0] * off[0] + off[1] * off[1] + off[2] * off[2];
    // The subtraction cancels; its error is a small part of the distance, and room is made for it.
    let radius = radius + distance * splat(simd, 1e-3);
    let along = t + (axis[0].abs() * half[0] + axis[1].abs() * half[1] + axis[2].abs() * half[2]) + radius;
    // How far the box comes towards the axis, times the centre's distance from the axis, which saves a division.
    let toward = off[0].abs() * half[0] + off[1].abs() * half[1] + off[2].abs() * half[2];
    let reach = off_squared.sqrt() * (along * tan + radius) + toward;
    // Negated, so that what is not a number, far away, is kept.
    let outside = along.simd_le(splat(simd, 0.0)) | reach.simd_lt(off_squared);
    (!outside).to_bitmask()
}

/// Children of a node of objects that a spot's cone may meet: a bit each.
#[inline(always)]
pub(crate) fn node_in_cone<S: Simd>(simd: S, node: &Node, spot: &ScoredLight) -> u64 {
    let (position, axis, tan) = (spot.position.to_array(), spot.axis.to_array(), outer_tan(spot.versine_outer));
    let axis = [splat(simd, axis[0]), splat(simd, axis[1]), splat(simd, axis[2])];
    let mut bits = 0;
    for k in (0..WIDTH).step_by(Floats::<S>::LEN) {
        let (min, max) = (load3(simd, &node.min, k), load3(simd, &node.max, k));
        let (mut to_box, mut half) = (min, max);
        // Room for what rounding does far from the origin.
        let mut radius = load(simd, &node.range, k) * splat(simd, 1.0 + MARGIN);
        for i in 0..3 {
            let middle = min[i] * splat(simd, 0.5) + max[i] * splat(simd, 0.5);
            to_box[i] = middle - splat(simd, position[i]);
            half[i] = (max[i] - min[i]) * splat(simd, 0.5);
            radius += (min[i].abs() + max[i].abs() + splat(simd, position[i].abs())) * splat(simd, 1e-6);
        }
        bits |= cone_meets_box(simd, to_box, half, radius, axis, splat(simd, tan)) << k;
    }
    bits
}

/// Children of a node that may reach the volume, or be reached from it: a bit each.
#[inline(always)]
pub(crate) fn node_in_range<S: Simd>(simd: S, node: &Node, volume: &Volume) -> u64 {
    let mut bits = 0;
    for k in (0..WIDTH).step_by(Floats::<S>::LEN) {
        let (min, max) = (load3(simd, &node.min, k), load3(simd, &node.max, k));
        bits |= within(simd, load(simd, &node.range, k), gap_squared(simd, min, max, volume), volume) << k;
    }
    bits
}

impl Candidates {
    /// Makes room for so many lights and one more row.
    fn make_room(&mut self, lights: usize) {
        let room = lights + LANES;
        if self.places.len() < room {
            let room = room.next_power_of_two().max(256);
            for list in self.position.iter_mut().chain(&mut self.axis).chain([&mut self.range, &mut self.tan]) {
                list.resize(room, 0.0);
            }
            self.places.resize(room, 0);
        }
    }

    /// Places of the lights in the tree.
    pub fn places(&self) -> &[u32] {
        &self.places[..self.count]
    }

    /// Appends the lights whose bits are set.
    #[inline(always)]
    pub fn append<S: Simd, const SPOTS: bool>(&mut self, simd: S, row: &Row<S>, bits: u64) {
        self.make_room(self.count);
        self.count = self.lists().write::<S, SPOTS>(simd, row, bits);
    }

    /// All lists cut to the same length, so that it is compared once for all of them.
    #[inline(always)]
    fn lists(&mut self) -> Lists<'_> {
        let [x, y, z] = &mut self.position;
        let [axis_x, axis_y, axis_z] = &mut self.axis;
        let room = self.places.len();
        Lists {
            position: [&mut x[..room], &mut y[..room], &mut z[..room]],
            range: &mut self.range[..room],
            axis: [&mut axis_x[..room], &mut axis_y[..room], &mut axis_z[..room]],
            tan: &mut self.tan[..room],
            places: &mut self.places[..room],
            count: self.count,
        }
    }

    /// Calls back for each row with lights that may reach the volume: the row, and a bit for each of them.
    #[inline(always)]
    fn for_each_hit<S: Simd, const SPOTS: bool>(&self, simd: S, volume: &Volume, mut take: impl FnMut(&Row<S>, u64)) {
        let lanes = Floats::<S>::LEN;
        let [x, y, z] = &self.position;
        let [axis_x, axis_y, axis_z] = &self.axis;
        // Cut to the same length, so that it is compared once for all of them.
        let end = self.count.next_multiple_of(lanes);
        let (x, y, z, range, places) = (&x[..end], &y[..end], &z[..end], &self.range[..end], &self.places[..end]);
        let (axis_x, axis_y, axis_z, tan) = (&axis_x[..end], &axis_y[..end], &axis_z[..end], &self.tan[..end]);
        for k in (0..end).step_by(lanes) {
            let row = Row {
                position: [load(simd, x, k), load(simd, y, k), load(simd, z, k)],
                range: load(simd, range, k),
                axis: [load(simd, axis_x, k), load(simd, axis_y, k), load(simd, axis_z, k)],
                tan: load(simd, tan, k),
                places: S::u32s::from_slice(simd, &places[k..k + lanes]),
            };
            let gap = gap_squared(simd, row.position, row.position, volume);
            let mut hit = within(simd, row.range, gap, volume);
            // Behind the last one lies what was there before.
            if self.count - k < lanes {
                hit &= (1 << (self.count - k)) - 1;
            }
            if SPOTS && hit != 0 {
                hit &= cone_meets(simd, row.position, row.axis, row.tan, volume);
            }
            take(&row, hit);
        }
    }

    /// Copies those that may reach the volume.
    #[inline(always)]
    pub fn filter<S: Simd, const SPOTS: bool>(&self, simd: S, volume: &Volume, out: &mut Self) {
        out.make_room(self.count);
        out.count = 0;
        let mut lists = out.lists();
        self.for_each_hit::<S, SPOTS>(
            simd,
            volume,
            #[inline(always)]
            |row, hit| {
                lists.write::<S, SPOTS>(simd, row, hit);
            },
        );
        out.count = lists.count;
    }

    /// Lists the places of those that may reach the volume; how many there are.
    #[inline(always)]
    pub fn find<S: Simd, const SPOTS: bool>(&self, simd: S, volume: &Volume, out: &mut Vec<u32>) -> usize {
        if out.len() < self.count + LANES {
            out.resize((self.count + LANES).next_power_of_two(), 0);
        }
        let out = out.as_mut_slice();
        let mut count = 0;
        self.for_each_hit::<S, SPOTS>(
            simd,
            volume,
            #[inline(always)]
            |row, hit| {
                let mask = S::mask32s::from_bitmask(simd, hit);
                row.places.compress(mask).store_slice(&mut out[count..count + Floats::<S>::LEN]);
                count += hit.count_ones() as usize;
            },
        );
        count
    }
}

/// [`Candidates`] to append to.
struct Lists<'a> {
    position: [&'a mut [f32]; 3],
    range: &'a mut [f32],
    axis: [&'a mut [f32]; 3],
    tan: &'a mut [f32],
    places: &'a mut [u32],
    count: usize,
}

impl Lists<'_> {
    /// Appends the lights whose bits are set; how many there are then.
    #[inline(always)]
    fn write<S: Simd, const SPOTS: bool>(&mut self, simd: S, row: &Row<S>, bits: u64) -> usize {
        let mask = S::mask32s::from_bitmask(simd, bits);
        let at = self.count..self.count + Floats::<S>::LEN;
        for axis in 0..3 {
            row.position[axis].compress(mask).store_slice(&mut self.position[axis][at.clone()]);
        }
        row.range.compress(mask).store_slice(&mut self.range[at.clone()]);
        if SPOTS {
            for axis in 0..3 {
                row.axis[axis].compress(mask).store_slice(&mut self.axis[axis][at.clone()]);
            }
            row.tan.compress(mask).store_slice(&mut self.tan[at.clone()]);
        }
        row.places.compress(mask).store_slice(&mut self.places[at]);
        self.count += bits.count_ones() as usize;
        self.count
    }
}
