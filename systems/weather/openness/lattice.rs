//! Corners of the grid that are kept, and bricks of them.
//!
//! Corners of cells that surfaces look into are asked, and count where they are not within something. The others of a
//! brick go by those around them: ring by ring, each is the mean of its neighbours that are known by then. That follows
//! from the corner's place alone, so bricks that share a corner have the same there.

use super::cells::cells_of;
use super::corners::{Occluder, Occluders, View};
use super::directions::{AXES, Bits, Weights};
use crate::ecs::parallel::map_in_parallel;
use crate::space::box_tree::Open;
use glam::{IVec3, UVec3, Vec3};
use std::collections::{BTreeSet, HashMap};
use std::hash::{BuildHasherDefault, Hasher};

/// Metres from a corner to the next.
pub const SPACING: f32 = 2.0;
/// Cells along a side of a brick.
pub const CELLS: i32 = 4;
/// Corners along a side of a brick: bricks share those between them.
pub const CORNERS: i32 = CELLS + 1;
/// Corners of a brick.
pub const BRICK: usize = (CORNERS * CORNERS * CORNERS) as usize;
/// Most bricks along a side of the world, and in its box: those of a table that a device can hold.
const MOST_ALONG: i64 = 2048;
const MOST_BRICKS: i64 = 1 << 24;
/// Corners that a thread asks at a time.
const TOGETHER: usize = 64;
/// A corner that nothing is known of: open.
pub const OPEN: u32 = u32::MAX;

/// Corners of a world.
#[derive(Clone, PartialEq, Debug)]
pub struct Lattice {
    /// What is open, of corners that were asked.
    bits: Vec<Bits>,
    /// Each further corner: where its neighbours begin in `neighbours`; and the end.
    starts: Vec<u32>,
    neighbours: Vec<u32>,
    /// The brick of the lowest coordinates, and the number of bricks along each axis.
    pub low: IVec3,
    /// Number of bricks along each axis.
    pub size: UVec3,
    /// Bricks that there are.
    pub bricks: Vec<IVec3>,
    /// Corners of each brick, [`OPEN`] where nothing is known: X fastest, then Y, then Z.
    pub corners: Vec<u32>,
}

/// A corner or brick as a number: 21 bits for each coordinate.
fn key(at: IVec3) -> u64 {
    let bits = |coordinate: i32| u64::from((coordinate + (1 << 20)) as u32) & 0x1f_ffff;
    bits(at.x) | bits(at.y) << 21 | bits(at.z) << 42
}

/// Hash of one number, by a product (Knuth: "The Art of Computer Programming", volume 3, section 6.4).
#[derive(Clone, Copy, Default)]
struct ByProduct(u64);

impl Hasher for ByProduct {
    fn finish(&self) -> u64 {
        self.0 ^ self.0 >> 32
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| self.write_u64(self.0 << 8 | u64::from(*byte)));
    }

    fn write_u64(&mut self, number: u64) {
        self.0 = number.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
}

type ByPlace = HashMap<u64, u32, BuildHasherDefault<ByProduct>>;

impl Lattice {
    /// Asks all corners; `None`: there is nothing, or it lies too far apart.
    pub fn new(triangles: Vec<Occluder>) -> Option<Self> {
        let cells = cells_of(&triangles);
        let brick = |cell: &IVec3| IVec3::from(cell.to_array().map(|coordinate| coordinate.div_euclid(CELLS)));
        let bricks: BTreeSet<[i32; 3]> = cells.iter().map(|cell| brick(cell).to_array()).collect();
        let bricks: Vec<IVec3> = bricks.into_iter().map(IVec3::from).collect();
        let low = bricks.iter().copied().reduce(IVec3::min)?;
        let high = bricks.iter().copied().reduce(IVec3::max)?;
        let along = (high - low).as_i64vec3() + 1;
        if along.max_element() > MOST_ALONG || along.element_product() > MOST_BRICKS {
            return None;
        }
        let eight = |cell: &IVec3| {
            let cell = *cell;
            (0..8).map(move |k| cell + IVec3::new(k & 1, k >> 1 & 1, k >> 2))
        };
        let asked: BTreeSet<[i32; 3]> = cells.iter().flat_map(eight).map(|corner| corner.to_array()).collect();
        let asked: Vec<IVec3> = asked.into_iter().map(IVec3::from).collect();
        let occluders = Occluders::new(triangles);
        let views = map_in_parallel(asked.chunks(TOGETHER), |corners: &[IVec3]| {
            let mut open = Open::default();
            let view = |corner: &IVec3| occluders.view(corner.as_vec3() * SPACING, &mut open);
            corners.iter().map(view).collect::<Vec<View>>()
        });
        let views = views.into_iter().flatten();
        let mut known = ByPlace::default();
        let mut bits = Vec::new();
        for (corner, view) in asked.iter().zip(views).filter(|(_, view)| !view.is_within) {
            known.insert(key(*corner), bits.len() as u32);
            bits.push(view.open);
        }
        let mut lattice = Self {
            starts: vec![0],
            neighbours: Vec::new(),
            low,
            size: along.as_uvec3(),
            corners: Vec::new(),
            bricks,
            bits,
        };
        lattice.fill(&mut known);
        let corners = lattice.bricks.iter().flat_map(corners_of_brick);
        lattice.corners = corners.map(|corner| known.get(&key(corner)).copied().unwrap_or(OPEN)).collect();
        Some(lattice)
    }

    /// Finds neighbours for the corners of bricks that are not known.
    fn fill(&mut self, known: &mut ByPlace) {
        let mut missing: Vec<IVec3> = self.bricks.iter().flat_map(corners_of_brick).collect();
        missing.sort_unstable_by_key(|corner| key(*corner));
        missing.dedup();
        // Across a brick, whose other side may be known.
        for _ in 0..CORNERS {
            let mut ring = Vec::new();
            missing.retain(|corner| {
                if known.contains_key(&key(*corner)) {
                    return false;
                }
                let around = (0..27).map(|k| *corner + IVec3::new(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1));
                let first = self.neighbours.len();
                self.neighbours.extend(around.filter_map(|at| known.get(&key(at)).copied()));
                if self.neighbours.len() > first {
                    self.starts.push(self.neighbours.len() as u32);
                    ring.push(*corner);
                }
                self.neighbours.len() == first
            });
            // After the ring: none is another's neighbour within it.
            let first = known.len() as u32;
            known.extend(ring.into_iter().zip(first..).map(|(corner, number)| (key(corner), number)));
        }
    }

    /// Number of corners that were asked and count.
    pub fn asked(&self) -> usize {
        self.bits.len()
    }

    /// Openness of all corners along the axes.
    pub(super) fn openness(&self, weights: &Weights) -> Vec<[f32; AXES]> {
        let mut all: Vec<[f32; AXES]> = self.bits.iter().map(|bits| weights.openness(bits)).collect();
        for ends in self.starts.array_windows() {
            let [first, end] = ends.map(|end: u32| end as usize);
            let share = 1.0 / (end - first) as f32;
            let of = |axis: usize| self.neighbours[first..end].iter().map(|own| all[*own as usize][axis]).sum::<f32>();
            let mean = std::array::from_fn(|axis| of(axis) * share);
            all.push(mean);
        }
        all
    }

    /// World space of the lowest corner, metres.
    pub fn origin(&self) -> Vec3 {
        (self.low * CELLS).as_vec3() * SPACING
    }
}

/// The corners of a brick: X fastest, then Y, then Z.
fn corners_of_brick(brick: &IVec3) -> impl Iterator<Item = IVec3> + use<> {
    let first = *brick * CELLS;
    let within = |k: i32| IVec3::new(k % CORNERS, k / CORNERS % CORNERS, k / (CORNERS * CORNERS));
    (0..CORNERS * CORNERS * CORNERS).map(move |k| first + within(k))
}
