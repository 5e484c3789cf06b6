//! Rooms, whose corners lie within their walls: so no light comes through these.

use super::lattice::{CELLS, SPACING};
use crate::space::bounds::Aabb;
use glam::{IVec3, UVec3, Vec3};
use serde::{Deserialize, Serialize};

/// Most corners of a room, some 60 m along each side; what is larger has those of the world.
const MOST_CORNERS: f32 = 32_768.0;

/// A box of air with corners of its own, evenly apart.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Room {
    /// World space of the first corner, metres.
    pub low: Vec3,
    /// From the first corner to the last, metres.
    pub size: Vec3,
    /// Corners along each axis.
    pub corners: UVec3,
}

impl Room {
    /// Metres of the outermost corners from the walls.
    pub const INSET: f32 = 0.05;

    /// Room within some walls; `None`: it has no air.
    pub fn within(walls: &Aabb) -> Option<Self> {
        let (low, size) = (walls.min + Self::INSET, walls.max - walls.min - 2.0 * Self::INSET);
        let corners = (size / SPACING).ceil().max(Vec3::ONE);
        (size.min_element() > 0.0 && corners.element_product() < MOST_CORNERS).then(|| Self {
            low,
            size,
            corners: corners.as_uvec3() + 1,
        })
    }

    /// Corners in a metre, along each axis.
    pub fn corners_per_metre(&self) -> Vec3 {
        (self.corners - 1).as_vec3() / self.size
    }

    /// Bricks along each axis.
    pub fn bricks(&self) -> UVec3 {
        let cells = self.corners - 1;
        UVec3::from(cells.to_array().map(|cells| cells.div_ceil(CELLS as u32)))
    }

    /// World space of a corner; those beyond the last are the last.
    pub fn place(&self, corner: IVec3) -> Vec3 {
        let last = self.corners.as_ivec3() - 1;
        self.low + self.size * corner.min(last).as_vec3() / last.as_vec3()
    }

    /// Tells if a place lies within.
    pub fn has(&self, place: Vec3) -> bool {
        let at = place - self.low;
        at.cmpge(Vec3::splat(-Self::INSET)).all() && at.cmple(self.size + Self::INSET).all()
    }

    /// First and last cell of the world's grid that it has a part in.
    pub fn cells(&self) -> [IVec3; 2] {
        let cell = |place: Vec3| (place / SPACING).floor().as_ivec3();
        [cell(self.low - Self::INSET), cell(self.low + self.size + Self::INSET)]
    }
}
