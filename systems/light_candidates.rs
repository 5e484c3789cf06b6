//! Lists of lights that may reach some objects, fields side by side, and the tests that make the lists shorter.
//!
//! The tests must keep every light whose score is above 0 for any object inside the volume: they use the score's own
//! conditions for range and cone, with room for rounding.

use crate::light_lanes::{Floats, LANES, splat};
use crate::light_tree::{MARGIN, Node, Volume, WIDTH};
use fearless_simd::Simd;
use fearless_simd::prelude::*;

/// Lights of one kind, sorted as the search adds them up.
#[derive(Default)]
pub(crate) struct Candidates {
    position: [Vec<f32>; 3],
    range: Vec<f32>,
    axis: [Vec<f32>; 3],
    tan: Vec<f32>,
    /// Where the light itself is found.
    pub lights: Vec<u32>,
    pub count: usize,
}

/// As many lights as a vector has lanes.
pub(crate) struct Row<S: Simd> {
    pub position: [Floats<S>; 3],
    pub range: Floats<S>,
    pub axis: [Floats<S>; 3],
    pub tan: Floats<S>,
}

/// Sixteen numbers, or as many of them as a vector has lanes.
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

/// Which of the lights come near enough: a bit each.
#[inline(always)]
pub(crate) fn within<S: Simd>(simd: S, range: Floats<S>, gap_squared: Floats<S>, volume: &Volume) -> u64 {
    let reach = (range + splat(simd, volume.radius)) * splat(simd, 1.0 + MARGIN);
    (reach * reach).simd_gt(gap_squared).to_bitmask()
}

/// Which of the spots' cones meet the sphere around the volume: the score's own test, with room for rounding.
#[inline(always)]
pub(crate) fn cone_meets<S: Simd>(
    simd: S,
    position: [Floats<S>; 3],
    axis: [Floats<S>; 3],
    tan: Floats<S>,
    volume: &Volume,
) -> u64 {
    let zero = splat(simd, 0.0);
    let center = volume.around.center;
    let x = splat(simd, center.x) - position[0];
    let y = splat(simd, center.y) - position[1];
    let z = splat(simd, center.z) - position[2];
    let squared = x * x + y * y + z * z;
    let t = x * axis[0] + y * axis[1] + z * axis[2];
    // The subtraction cancels; its error is a small part of the distance, and room is made for it.
    let off_axis = (squared - t * t).max(zero).sqrt();
    let radius = splat(simd, volume.around.radius) + squared.sqrt() * splat(simd, 1e-3);
    let along = t + radius;
    let off = (off_axis - radius).max(zero);
    (along.simd_gt(zero) & (along * tan).simd_ge(off)).to_bitmask()
}

/// Which children of a node may reach the volume, or be reached from it: a bit each.
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
    /// Makes room for one more row.
    fn make_room(&mut self) {
        let room = self.count + LANES;
        if self.lights.len() < room {
            let room = room.next_power_of_two().max(256);
            for list in self.position.iter_mut().chain(&mut self.axis).chain([&mut self.range, &mut self.tan]) {
                list.resize(room, 0.0);
            }
            self.lights.resize(room, 0);
        }
    }

    /// Appends the lights whose bits are set; where to find them is left to the caller.
    #[inline(always)]
    pub fn append<S: Simd>(&mut self, simd: S, row: &Row<S>, bits: u64, are_spots: bool) {
        self.make_room();
        let mask = S::mask32s::from_bitmask(simd, bits);
        let at = self.count..self.count + Floats::<S>::LEN;
        for axis in 0..3 {
            row.position[axis].compress(mask).store_slice(&mut self.position[axis][at.clone()]);
        }
        row.range.compress(mask).store_slice(&mut self.range[at.clone()]);
        if are_spots {
            for axis in 0..3 {
                row.axis[axis].compress(mask).store_slice(&mut self.axis[axis][at.clone()]);
            }
            row.tan.compress(mask).store_slice(&mut self.tan[at]);
        }
        self.count += bits.count_ones() as usize;
    }

    #[inline(always)]
    fn row<S: Simd>(&self, simd: S, k: usize) -> Row<S> {
        let [x, y, z] = &self.position;
        let [axis_x, axis_y, axis_z] = &self.axis;
        Row {
            position: [load(simd, x, k), load(simd, y, k), load(simd, z, k)],
            range: load(simd, &self.range, k),
            axis: [load(simd, axis_x, k), load(simd, axis_y, k), load(simd, axis_z, k)],
            tan: load(simd, &self.tan, k),
        }
    }

    /// Which lights of a row may reach the volume: a bit each.
    #[inline(always)]
    fn hits<S: Simd, const SPOTS: bool>(&self, simd: S, row: &Row<S>, k: usize, volume: &Volume) -> u64 {
        let gap = gap_squared(simd, row.position, row.position, volume);
        let mut hit = within(simd, row.range, gap, volume);
        // Behind the last one lies what was there before.
        if self.count - k < Floats::<S>::LEN {
            hit &= (1 << (self.count - k)) - 1;
        }
        if SPOTS && hit != 0 {
            hit &= cone_meets(simd, row.position, row.axis, row.tan, volume);
        }
        hit
    }

    /// Copies those that may reach the volume.
    #[inline(always)]
    pub fn filter<S: Simd, const SPOTS: bool>(&self, simd: S, volume: &Volume, out: &mut Self) {
        out.count = 0;
        for k in (0..self.count).step_by(Floats::<S>::LEN) {
            let row = self.row(simd, k);
            let hit = self.hits::<S, SPOTS>(simd, &row, k, volume);
            let first = out.count;
            out.append(simd, &row, hit, SPOTS);
            self.copy_places(simd, k, hit, &mut out.lights[first..]);
        }
    }

    /// Lists where to find those that may reach the volume; how many there are.
    #[inline(always)]
    pub fn find<S: Simd, const SPOTS: bool>(&self, simd: S, volume: &Volume, out: &mut [u32]) -> usize {
        let mut count = 0;
        for k in (0..self.count).step_by(Floats::<S>::LEN) {
            let hit = self.hits::<S, SPOTS>(simd, &self.row(simd, k), k, volume);
            self.copy_places(simd, k, hit, &mut out[count..]);
            count += hit.count_ones() as usize;
        }
        count
    }

    #[inline(always)]
    fn copy_places<S: Simd>(&self, simd: S, k: usize, hit: u64, out: &mut [u32]) {
        let lanes = Floats::<S>::LEN;
        let places = S::u32s::from_slice(simd, &self.lights[k..k + lanes]);
        places.compress(S::mask32s::from_bitmask(simd, hit)).store_slice(&mut out[..lanes]);
    }
}
