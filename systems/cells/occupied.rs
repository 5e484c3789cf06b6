//! Cells that an object is in, by its box.
//!
//! A cell counts in full where half of the box is in it, and less the less is, so that what goes from room to room
//! changes smoothly; from a few centimetres beside the box on it does not count. So does outside, which begins where the
//! cells together do not cover the box. A wall's face is in the room that it faces and in no other, if cells end within
//! walls.

use super::cells::{Cell, Cells, OUTSIDE};
use super::geometry::{Plane, Solid, smooth_step};
use crate::space::bounds::Aabb;
use glam::Vec3;

/// Metres from a cell at which it does not count for an object.
pub(crate) const EDGE: f32 = 0.05;
/// Metres: an object that reaches so far into a cell, or half of which does, counts there in full.
const FULLY: f32 = 0.45;
/// Metres: narrower gaps between cells are none.
const GAP: f32 = 0.001;

/// Cells that a box is in.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Occupied {
    /// World space.
    pub(crate) center: Vec3,
    pub(crate) half: Vec3,
    /// Numbers of cells, [`OUTSIDE`] among them, and how much the box counts there: above 0, at most 1.
    cells: Vec<(u32, f32)>,
}

impl Occupied {
    /// Finds the cells of a box, world space; none if it is not finite.
    pub fn new(cells: &Cells, aabb: Aabb) -> Self {
        let mut occupied = Self::default();
        occupied.set(cells, aabb);
        occupied
    }

    /// [`Self::new`], in the memory that is there.
    pub(crate) fn set(&mut self, cells: &Cells, aabb: Aabb) {
        (self.center, self.half) = (aabb.center(), (aabb.max - aabb.min) * 0.5);
        self.cells.clear();
        let (center, half) = (self.center, self.half);
        if !(center.is_finite() && half.is_finite()) {
            return;
        }
        let is_beside = |other: Aabb| aabb.min.cmpgt(other.max + EDGE).any() || aabb.max.cmplt(other.min - EDGE).any();
        if is_beside(cells.bounds()) {
            self.cells.push((OUTSIDE, 1.0));
            return;
        }
        let near = cells.cells().iter().zip(1..).filter(|(cell, _)| !is_beside(cell.aabb()));
        for (cell, number) in near {
            let weight = cell.reaches(center, half).map(|(into, half)| weight(into, half)).fold(1.0, f32::min);
            if weight > 0.0 {
                self.cells.push((number, weight));
            }
        }
        let weight = weight(self.reaches_outside(cells), half.min_element());
        if weight > 0.0 {
            self.cells.push((OUTSIDE, weight));
        }
    }

    /// Cells and weights.
    pub fn cells(&self) -> &[(u32, f32)] {
        &self.cells
    }

    /// Tells if it is in no cell, and not near one.
    pub(crate) fn is_outside(&self) -> bool {
        self.cells == [(OUTSIDE, 1.0)]
    }

    /// Weight of the box in a cell, above 0, at most 1.
    #[inline]
    pub(crate) fn weight(&self, cell: u32) -> Option<f32> {
        self.cells.iter().find(|(number, _)| *number == cell).map(|(_, weight)| *weight)
    }

    /// Metres that the box reaches into the space that no cell covers; negative: away from it, up to [`EDGE`]. Covered
    /// space ends [`GAP`] beyond the cells.
    fn reaches_outside(&self, cells: &Cells) -> f32 {
        let near: Vec<&Cell> = self.cells.iter().filter_map(|&(number, _)| cells.cell(number)).collect();
        if near.iter().any(|cell| cell.holds(self.center, self.half) >= EDGE) {
            return -EDGE;
        }
        // What is left of the box and its surroundings, cell by cell.
        let mut left = vec![Solid::new_box(self.half + EDGE + GAP)];
        for cell in near {
            left = left.into_iter().flat_map(|solid| self.without(solid, cell)).collect();
        }
        left.iter().map(|solid| solid.reaches(self.half) + GAP).fold(-EDGE, f32::max)
    }

    /// The parts of a solid, relative to the centre, that a cell does not cover.
    fn without(&self, solid: Solid, cell: &Cell) -> Vec<Solid> {
        let (mut inside, mut parts) = (Some(solid), Vec::new());
        for plane in &cell.planes {
            let Some(solid) = inside else { break };
            let plane = Plane { normal: plane.normal, offset: -plane.distance(self.center) - GAP };
            parts.extend(solid.clip(&plane.flipped()));
            inside = solid.clip(&plane);
        }
        parts
    }
}

/// Weight of a box that reaches `into` metres into a cell; `half`: half its extent that way.
fn weight(into: f32, half: f32) -> f32 {
    smooth_step((into + EDGE) / (half.min(FULLY) + EDGE))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn aabb(min: [f32; 3], max: [f32; 3]) -> Aabb {
        Aabb { min: min.into(), max: max.into() }
    }

    /// Two rooms side by side, with their common wall's middle at x = 4.
    fn rooms() -> Cells {
        let cell = |x: f32| Cell::new_box("", aabb([x, 0.0, 0.0], [x + 4.0, 3.0, 4.0]));
        Cells::new(vec![cell(0.0), cell(4.0)], Vec::new())
    }

    fn occupied(min: [f32; 3], max: [f32; 3]) -> Vec<(u32, f32)> {
        Occupied::new(&rooms(), aabb(min, max)).cells
    }

    #[test]
    fn an_object_is_in_the_cells_that_its_box_touches() {
        assert_eq!(occupied([1.0, 1.0, 1.0], [2.0, 2.0, 2.0]), [(1, 1.0)]);
        // A solid wall between two rooms, and a face of it.
        assert_eq!(occupied([3.9, 0.1, 1.0], [4.1, 2.9, 2.0]), [(1, 1.0), (2, 1.0)]);
        assert_eq!(occupied([3.9, 0.1, 1.0], [3.9, 2.9, 2.0]), [(1, 1.0)]);
        assert_eq!(occupied([10.0, 1.0, 1.0], [11.0, 2.0, 2.0]), [(OUTSIDE, 1.0)]);
        // The outer wall's faces: within it is the room's, out of it outside's.
        assert_eq!(occupied([0.1, 0.1, 1.0], [0.1, 2.9, 2.0]), [(1, 1.0)]);
        assert_eq!(occupied([-0.1, 0.1, 1.0], [-0.1, 2.9, 2.0]), [(OUTSIDE, 1.0)]);
        // One that sticks out.
        assert_eq!(occupied([-0.5, 0.1, 1.0], [1.0, 2.9, 2.0]), [(1, 1.0), (OUTSIDE, 1.0)]);
        // One of which a fifth of its half is in the other room: it counts by smoothstep((10 cm + 5 cm) / (45 cm + 5 cm)).
        let [(_, first), (_, second)] = occupied([2.0, 0.1, 1.0], [4.1, 2.9, 2.0])[..] else { panic!("two rooms") };
        assert!(first == 1.0 && (second - 0.216).abs() < 1e-4, "{first} {second}");
        let [_, (_, out)] = occupied([-0.1, 0.1, 1.0], [2.0, 2.9, 2.0])[..] else { panic!("a room and outside") };
        // Gaps of a millimetre are none: outside begins so far away, and the step is at most 1.5 / 50 cm steep.
        assert!((out - 0.216).abs() < 1.5 * GAP / 0.5, "{out}");
        assert_eq!(Occupied::new(&rooms(), aabb([f32::NAN; 3], [1.0; 3])).cells, []);
    }

    #[test]
    fn weights_are_continuous_where_an_object_goes_through_a_wall() {
        let place = |x: f32| Occupied::new(&rooms(), aabb([x - 0.3, 1.0, 1.0], [x + 0.3, 2.0, 2.0]));
        let mut before = place(-1.0);
        // From outside through both rooms, to outside again.
        for i in 0..100_000 {
            let now = place(-1.0 + i as f32 * 1e-4);
            for cell in 0..3 {
                let weight = |occupied: &Occupied| occupied.weight(cell).unwrap_or(0.0);
                // The step is steepest in its middle: 1.5 over 35 cm, half of the box and 5 cm. Places are rounded.
                assert!((weight(&now) - weight(&before)).abs() < 1.6 * 1e-4 / 0.35, "{cell} at {i}");
            }
            before = now;
        }
        assert_eq!(before.cells, [(2, 1.0), (OUTSIDE, 1.0)].as_slice()[1..].to_vec());
    }

    /// A wall that is not along an axis: two wedges that share a slanted plane.
    #[test]
    fn hulls_that_meet_leave_nothing_outside() {
        let slanted = Plane { normal: Vec3::new(1.0, 0.0, 1.0).normalize(), offset: 4.0 };
        let mut wedges = [(); 2].map(|()| Cell::new_box("", aabb([0.0, 0.0, 0.0], [6.0, 3.0, 6.0])));
        wedges[0].planes.push(slanted);
        wedges[1].planes.push(slanted.flipped());
        let cells = Cells::new(wedges.to_vec(), Vec::new());
        let across = Occupied::new(&cells, aabb([2.0, 1.0, 2.0], [3.8, 2.0, 3.8]));
        assert_eq!(across.cells, [(1, 1.0), (2, 1.0)]);
        let out = Occupied::new(&cells, aabb([2.0, 2.4, 2.0], [3.8, 3.6, 3.8]));
        assert_eq!(out.cells, [(1, 1.0), (2, 1.0), (OUTSIDE, 1.0)]);
    }
}
