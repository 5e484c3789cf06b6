//! Movers, which hide the sky from what is beside them: ellipsoids in a grid.
//!
//! A mover is all that hangs below the topmost thing that is [`Interpolated`](crate::space::Interpolated): a vehicle
//! with its parts. Its box becomes an ellipsoid [`STRETCH`] times as wide, whose share of a surface's light is that of
//! a sphere in the space in which it is one: max(n′ · u, 0) / d², of a sphere d radii away, toward which u points. Beside
//! cars in a street, a prototype's error against rays is 0.070 of the mean light with that. With the boxes themselves by
//! Lambert's formula, which takes twelve arc cosines a box, it is 0.057, and 0.154 without either.

use crate::space::bounds::Aabb;
use glam::{Affine3A, Vec2, Vec3};

/// Half axes of an ellipsoid, in those of the box.
pub const STRETCH: f32 = 1.2;
/// Metres from an ellipsoid at which it hides nothing any more.
pub const REACH: f32 = 6.0;
/// Ellipsoids that a cell of the grid lists at most: the nearest ones.
pub const MOST_LISTED: usize = 8;
/// Metres along a side of a cell, unless there would be too many.
const CELL: f32 = 4.0;
/// Cells along a side of the grid.
const MOST_CELLS: u32 = 128;
/// Sizes of boxes that hide something, metres.
const SIZES: std::ops::RangeInclusive<f32> = 0.4..=40.0;

/// Four words of the table that shaders read.
pub type MoverTexel = [u32; 4];

/// Movers of a frame.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Movers {
    /// First those of rooms. Then two texels for each cell of the grid, rows along X, with the numbers of its ellipsoids,
    /// counted from 1. Then three for each ellipsoid: the rows of the matrix from the world to the space in which it is
    /// the unit sphere.
    pub texels: Vec<MoverTexel>,
    /// Texel of the first cell.
    pub first: u32,
    /// World space, X and Z of the first cell's corner, metres.
    pub origin: Vec2,
    /// Cells along X and Z.
    pub cells: [u32; 2],
    /// Metres along a side of a cell.
    pub cell: f32,
}

/// Box of a mover in the world.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Mover {
    /// From the mover's own space to the world.
    pub place: Affine3A,
    /// In its own space.
    pub aabb: Aabb,
}

impl Mover {
    /// From the world to the space in which the ellipsoid is the unit sphere; `None` where it hides nothing.
    fn sphere_from_world(&self) -> Option<Affine3A> {
        let (middle, half) = ((self.aabb.min + self.aabb.max) * 0.5, (self.aabb.max - self.aabb.min) * 0.5);
        let largest = 2.0 * half.max_element();
        if !SIZES.contains(&largest) {
            return None;
        }
        // A flat one is no ellipsoid.
        let half = half.max(Vec3::splat(0.02)) * STRETCH;
        let world_from_sphere = self.place * Affine3A::from_translation(middle) * Affine3A::from_scale(half);
        let inverse = world_from_sphere.inverse();
        inverse.is_finite().then_some(inverse)
    }

    /// Its extent over the ground, X and Z.
    fn extent(&self) -> [Vec2; 2] {
        let world = self.aabb.transformed(&self.place);
        [Vec2::new(world.min.x, world.min.z), Vec2::new(world.max.x, world.max.z)]
    }
}

impl Movers {
    /// Metres from an ellipsoid at which it hides nothing any more.
    pub const REACH: f32 = REACH;

    /// The texels of rooms.
    pub(crate) fn rooms(&self) -> &[MoverTexel] {
        &self.texels[..self.first as usize]
    }

    /// Lists movers in a grid, behind the texels of rooms. Of those that a cell has no room for, the farther ones are left
    /// out.
    pub fn new(rooms: &[MoverTexel], movers: &[Mover]) -> Self {
        let all: Vec<_> =
            movers.iter().filter_map(|mover| Some((mover.sphere_from_world()?, mover.extent()))).collect();
        let low = all.iter().map(|(_, [low, _])| *low).reduce(Vec2::min);
        let high = all.iter().map(|(_, [_, high])| *high).reduce(Vec2::max);
        let Some((low, high)) = low.zip(high) else {
            return Self { texels: rooms.to_vec(), first: rooms.len() as u32, cell: CELL, ..Self::default() };
        };
        let (low, high) = (low - REACH, high + REACH);
        let longest = (high - low).max_element();
        let mut cell = CELL;
        while longest / cell > MOST_CELLS as f32 {
            cell *= 2.0;
        }
        // At whole cells: a grid that grows leaves the others as they were.
        let origin = (low / cell).floor() * cell;
        let cells = ((high - origin) / cell).ceil().max(Vec2::ONE);
        let cells = [cells.x as u32, cells.y as u32];
        let mut lists: Vec<Vec<(f32, u32)>> = vec![Vec::new(); (cells[0] * cells[1]) as usize];
        for ((_, [low, high]), number) in all.iter().zip(1..) {
            let index = |at: Vec2| ((at - origin) / cell).floor().max(Vec2::ZERO);
            let (first, last) = (index(*low - REACH), index(*high + REACH));
            for z in first.y as u32..=(last.y as u32).min(cells[1] - 1) {
                for x in first.x as u32..=(last.x as u32).min(cells[0] - 1) {
                    let middle = origin + (Vec2::new(x as f32, z as f32) + 0.5) * cell;
                    let away = middle - middle.clamp(*low, *high);
                    lists[(z * cells[0] + x) as usize].push((away.length_squared(), number));
                }
            }
        }
        let mut texels = Vec::with_capacity(rooms.len() + lists.len() * 2 + all.len() * 3);
        texels.extend_from_slice(rooms);
        for mut list in lists {
            list.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let number = |i: usize| list.get(i).map_or(0, |(_, number)| *number);
            texels.extend((0..MOST_LISTED / 4).map(|four| std::array::from_fn(|i| number(4 * four + i))));
        }
        for (sphere_from_world, _) in &all {
            let (m, t) = (sphere_from_world.matrix3.transpose(), sphere_from_world.translation);
            let row = |axis: Vec3, t: f32| axis.extend(t).to_array().map(f32::to_bits);
            texels.extend([row(m.x_axis.into(), t.x), row(m.y_axis.into(), t.y), row(m.z_axis.into(), t.z)]);
        }
        Self { texels, first: rooms.len() as u32, origin, cells, cell }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn car(x: f32, z: f32) -> Mover {
        let aabb = Aabb { min: Vec3::new(-0.9, 0.0, -2.1), max: Vec3::new(0.9, 1.5, 2.1) };
        Mover { place: Affine3A::from_translation(Vec3::new(x, 0.0, z)) * Affine3A::from_rotation_y(0.4), aabb }
    }

    #[test]
    fn a_cell_lists_what_reaches_it_nearest_first() {
        let movers: Vec<Mover> = (0..40).map(|i| car((i % 8) as f32 * 3.0, (i / 8) as f32 * 5.0)).collect();
        let grid = Movers::new(&[], &movers);
        assert_eq!(grid.texels.len(), (grid.cells[0] * grid.cells[1]) as usize * 2 + movers.len() * 3);
        for z in 0..grid.cells[1] {
            for x in 0..grid.cells[0] {
                let middle = grid.origin + (Vec2::new(x as f32, z as f32) + 0.5) * grid.cell;
                let far = |mover: &Mover| {
                    let [low, high] = mover.extent();
                    (middle - middle.clamp(low, high)).length()
                };
                let at = ((z * grid.cells[0] + x) * 2) as usize;
                let listed: Vec<u32> = grid.texels[at..at + 2].concat().into_iter().take_while(|n| *n > 0).collect();
                let distances: Vec<f32> = listed.iter().map(|number| far(&movers[*number as usize - 1])).collect();
                assert!(distances.is_sorted(), "{x} {z}: {distances:?}");
                // What is left out is too far, or farther than those for which there is room.
                let farthest = if listed.len() == MOST_LISTED { distances[MOST_LISTED - 1] } else { REACH };
                let left_out = (1..=40).filter(|number| !listed.contains(number));
                let nearest = left_out.map(|number| far(&movers[number as usize - 1])).fold(f32::INFINITY, f32::min);
                assert!(nearest >= farthest, "{x} {z}: {nearest} {farthest}");
            }
        }
    }

    #[test]
    fn a_grid_of_far_movers_is_no_larger_than_it_may_be() {
        let grid = Movers::new(&[], &[car(-9000.0, 0.0), car(9000.0, 500.0)]);
        assert!(grid.cells.iter().all(|cells| *cells <= MOST_CELLS + 1), "{:?}", grid.cells);
        assert_eq!(Movers::new(&[], &[]), Movers { cell: CELL, ..Movers::default() });
    }
}
