//! Openness as renderers read it: bricks of corners in three-dimensional textures, and a table of where each brick is.

use super::cells::OFFSET;
use super::directions::Weights;
use super::lattice::{BRICK, CORNERS, Lattice, OPEN, SPACING};
use crate::weather::sky::Sky;
use glam::{UVec3, Vec3};

/// Openness of a corner toward +X, −X, +Z and −Z: 255 is open.
pub type OpennessTexel = [u8; 4];

/// Openness of a world under a sky.
#[derive(Clone, PartialEq, Debug)]
pub struct Openness {
    /// World space of the table's first brick, metres.
    pub origin: Vec3,
    /// Bricks of the table along each axis.
    pub table_size: UVec3,
    /// Number of each brick, counted from 1; 0: there is none, and all is open. X fastest, then Y, then Z.
    pub table: Vec<u32>,
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
        let count = lattice.bricks.len();
        let side = (count as f64).cbrt().ceil() as u32;
        let texture_bricks = UVec3::new(side, side, (count as u32).div_ceil(side * side));
        let texels = texture_bricks * CORNERS as u32;
        let all = texels.element_product() as usize;
        let (mut sides, mut up) = (vec![[u8::MAX; 4]; all], vec![u8::MAX; all]);
        let mut table = vec![0; lattice.size.element_product() as usize];
        for ((number, brick), own) in (0..).zip(&lattice.bricks).zip(lattice.corners.chunks_exact(BRICK)) {
            let at = (*brick - lattice.low).as_uvec3();
            table[((at.z * lattice.size.y + at.y) * lattice.size.x + at.x) as usize] = number + 1;
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
        Self { origin: lattice.origin(), table_size: lattice.size, table, texture_bricks, sides, up }
    }
}

fn byte(openness: f32) -> u8 {
    (openness.clamp(0.0, 1.0) * 255.0).round() as u8
}
