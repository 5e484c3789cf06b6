//! Openness as renderers read it: bricks of corners in three-dimensional textures, and a table of where each brick is.

use super::cells::OFFSET;
use super::directions::Weights;
use super::lattice::{BRICK, CORNERS, Lattice, OPEN, SPACING, brick_of};
use crate::weather::sky::Sky;
use glam::{IVec3, UVec3, Vec3};
use std::collections::BTreeMap;

/// Openness of a corner toward +X, −X, +Z and −Z: 255 is open.
pub type OpennessTexel = [u8; 4];

/// Openness of a world under a sky.
#[derive(Clone, PartialEq, Debug)]
pub struct Openness {
    /// World space of the table's first brick, metres.
    pub origin: Vec3,
    /// Bricks of the table along each axis.
    pub table_size: UVec3,
    /// Number of each brick, counted from 1, and the texel of `rooms` at which the list of its rooms begins; 0: there
    /// is none, and without both all is open. X fastest, then Y, then Z.
    pub table: Vec<[u32; 2]>,
    /// Three texels for each room: its first corner and its first brick's number; corners per metre and 0; size and
    /// bricks along each axis, 10 bits each. Then lists: how many rooms, and their numbers.
    pub rooms: Vec<[u32; 4]>,
    /// Bricks of the textures along each axis; brick n is at (n mod x, n / x mod y, n / (x y)).
    pub texture_bricks: UVec3,
    /// Openness of corners to the sides, in the order of the texture's texels.
    pub sides: Vec<OpennessTexel>,
    /// Openness of corners upward.
    pub up: Vec<u8>,
}

impl Openness {
    /// Corners along a side of a brick.
    pub const CORNERS: u32 = CORNERS as u32;
    /// Metres from a corner to the next.
    pub const SPACING: f32 = SPACING;
    /// Metres from a surface along its normal at which pixels read openness.
    pub const OFFSET: f32 = OFFSET;

    /// Weighs what corners see by the light of a sky.
    pub fn new(lattice: &Lattice, sky: &Sky) -> Self {
        let corners = lattice.openness(&Weights::of(sky));
        let count = lattice.corners.len() / BRICK;
        let side = (count as f64).cbrt().ceil() as u32;
        let texture_bricks = UVec3::new(side, side, (count as u32).div_ceil(side * side));
        let texels = texture_bricks * CORNERS as u32;
        let all = texels.element_product() as usize;
        let (mut sides, mut up) = (vec![[u8::MAX; 4]; all], vec![u8::MAX; all]);
        let mut table = vec![[0; 2]; lattice.size.element_product() as usize];
        let entry = |brick: IVec3| {
            let at = (brick - lattice.low).as_uvec3();
            ((at.z * lattice.size.y + at.y) * lattice.size.x + at.x) as usize
        };
        for (number, brick) in (1..).zip(&lattice.bricks) {
            table[entry(*brick)][0] = number;
        }
        let rooms = rooms(lattice, |brick, list| table[entry(brick)][1] = list);
        for (number, own) in (0..).zip(lattice.corners.chunks_exact(BRICK)) {
            let first = UVec3::new(number % side, number / side % side, number / (side * side)) * CORNERS as u32;
            for (k, &corner) in (0..).zip(own).filter(|(_, corner)| **corner != OPEN) {
                let within =
                    UVec3::new(k % CORNERS as u32, k / CORNERS as u32 % CORNERS as u32, k / (CORNERS * CORNERS) as u32);
                let at = first + within;
                let texel = ((at.z * texels.y + at.y) * texels.x + at.x) as usize;
                let [x, back_x, z, back_z, y] = corners[corner as usize].map(byte);
                (sides[texel], up[texel]) = ([x, back_x, z, back_z], y);
            }
        }
        Self { origin: lattice.origin(), table_size: lattice.size, table, rooms, texture_bricks, sides, up }
    }
}

/// Texels of rooms, and lists of those that bricks have. `list`: takes a brick and where its list begins.
fn rooms(lattice: &Lattice, mut list: impl FnMut(IVec3, u32)) -> Vec<[u32; 4]> {
    let (mut texels, mut first) = (Vec::new(), lattice.bricks.len() as u32);
    let mut of_bricks = BTreeMap::<[i32; 3], Vec<u32>>::new();
    for (number, room) in (0..).zip(&lattice.rooms) {
        let floats = |v: Vec3, last: u32| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), last];
        let bricks = room.bricks();
        let along = bricks.x | bricks.y << 10 | bricks.z << 20;
        texels.extend([floats(room.low, first), floats(room.corners_per_metre(), 0), floats(room.size, along)]);
        first += bricks.element_product();
        let [low, high] = room.cells().map(brick_of);
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    of_bricks.entry([x, y, z]).or_default().push(number);
                }
            }
        }
    }
    for (brick, rooms) in of_bricks {
        list(brick.into(), texels.len() as u32);
        let words: Vec<u32> = std::iter::once(rooms.len() as u32).chain(rooms).collect();
        texels.extend(words.chunks(4).map(|words| std::array::from_fn(|i| words.get(i).copied().unwrap_or(0))));
    }
    texels
}

fn byte(openness: f32) -> u8 {
    (openness.clamp(0.0, 1.0) * 255.0).round() as u8
}
