//! The cells of a world and the portals between them.

use super::geometry::{Plane, area_vector, middle};
use crate::space::bounds::Aabb;
use bevy_ecs::prelude::*;
use glam::Vec3;

/// The number of what lies in no cell. Cells count from 1.
pub const OUTSIDE: u32 = 0;

/// Metres that a corner of a mesh may lie beyond the plane of one of its triangles for the mesh to count as convex.
const CONVEX: f32 = 0.005;

/// A convex room.
#[derive(Clone, PartialEq, Debug)]
pub struct Cell {
    /// For people.
    pub name: String,
    pub(crate) planes: Vec<Plane>,
    aabb: Aabb,
}

/// Reason for which a mesh is no cell.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum CellError {
    /// A corner lies beyond a triangle's plane.
    #[error("expected a convex mesh, found one that is not, by {:.0} mm", .0 * 1000.0)]
    NotConvex(f32),
    /// It has no volume.
    #[error("expected a mesh with a volume")]
    Flat,
}

impl Cell {
    /// A box.
    pub fn new_box(name: impl Into<String>, aabb: Aabb) -> Self {
        let sides = [Vec3::X, Vec3::Y, Vec3::Z].into_iter();
        let planes = sides.flat_map(|axis| {
            let low = Plane { normal: axis, offset: axis.dot(aabb.min) };
            [low, Plane { normal: -axis, offset: -axis.dot(aabb.max) }]
        });
        Self { name: name.into(), planes: planes.collect(), aabb }
    }

    /// The hull of a convex mesh, by corners and the triangles among them.
    ///
    /// # Errors
    /// The mesh is flat, or not convex by more than 5 mm.
    pub fn new_hull(name: impl Into<String>, corners: &[Vec3], indices: &[u32]) -> Result<Self, CellError> {
        let aabb = Aabb::around(corners);
        let inside = middle(corners);
        let mut planes: Vec<Plane> = Vec::new();
        for triangle in indices.chunks_exact(3) {
            let corner = |i: usize| corners.get(triangle[i] as usize).copied().unwrap_or(inside);
            let (a, b, c) = (corner(0), corner(1), corner(2));
            let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
            let normal = if normal.dot(inside - a) < 0.0 { -normal } else { normal };
            let least = corners.iter().map(|p| normal.dot(*p)).fold(f32::INFINITY, f32::min);
            let beyond = normal.dot(a) - least;
            if beyond > CONVEX {
                return Err(CellError::NotConvex(beyond));
            }
            let is_same = |plane: &Plane| plane.normal.dot(normal) > 0.999_999 && (plane.offset - least).abs() < 1e-4;
            if !planes.iter().any(is_same) {
                planes.push(Plane { normal, offset: least });
            }
        }
        let is_thick = planes.len() > 3 && planes.iter().all(|plane| plane.distance(inside) > 1e-3);
        if is_thick { Ok(Self { name: name.into(), planes, aabb }) } else { Err(CellError::Flat) }
    }

    /// Its walls: it is within all of these.
    pub fn planes(&self) -> &[Plane] {
        &self.planes
    }

    /// The box around it.
    pub fn aabb(&self) -> Aabb {
        self.aabb
    }

    /// Metres that a point lies within it, negative outside.
    pub fn depth(&self, point: Vec3) -> f32 {
        self.planes.iter().map(|plane| plane.distance(point)).fold(f32::INFINITY, f32::min)
    }

    /// Metres by which a box reaches into it, as far as planes tell: negative where one of them lies between.
    pub(crate) fn overlap(&self, center: Vec3, half: Vec3) -> f32 {
        self.reaches(center, half).map(|(into, _)| into).fold(f32::INFINITY, f32::min)
    }

    /// Metres by which a box reaches into it, of each plane, with half the box's extent along that plane's normal.
    pub(crate) fn reaches(&self, center: Vec3, half: Vec3) -> impl Iterator<Item = (f32, f32)> {
        self.planes.iter().map(move |plane| (plane.farthest(center, half), plane.normal.abs().dot(half)))
    }

    /// Metres that a box lies within it on all sides, negative where it sticks out.
    pub(crate) fn holds(&self, center: Vec3, half: Vec3) -> f32 {
        self.planes.iter().map(|plane| plane.nearest(center, half)).fold(f32::INFINITY, f32::min)
    }
}

/// A portal's place: a convex polygon between two cells.
#[derive(Clone, PartialEq, Debug)]
pub struct Opening {
    /// Numbers of cells; [`OUTSIDE`] for none.
    pub between: [u32; 2],
    /// World space, in order around it.
    pub polygon: Vec<Vec3>,
    /// The entity whose [`Portal`](super::doors::Portal) says how far it is open; `None`: it is open.
    pub portal: Option<Entity>,
}

/// The cells and portals of a world. Empty: walls keep nothing out.
#[derive(Resource, Clone, PartialEq, Debug, Default)]
pub struct Cells {
    cells: Vec<Cell>,
    openings: Vec<Opening>,
    /// Normal of each opening, from the first of its cells to the second; unit.
    normals: Vec<Vec3>,
    /// Openings of each cell, those of outside first.
    of_cell: Vec<Vec<u32>>,
    bounds: Aabb,
}

impl Cells {
    /// Numbers the cells from 1 on in their order. Openings that are no polygon, or that name no cell, or the same
    /// twice, are left out.
    pub fn new(cells: Vec<Cell>, mut openings: Vec<Opening>) -> Self {
        let is_known = |number: &u32| *number as usize <= cells.len();
        openings.retain(|opening| {
            let [a, b] = opening.between;
            a != b && opening.between.iter().all(is_known) && area_vector(&opening.polygon).length_squared() > 0.0
        });
        let mut of_cell = vec![Vec::new(); cells.len() + 1];
        let mut normals = Vec::new();
        for (opening, number) in openings.iter().zip(0..) {
            opening.between.iter().for_each(|&cell| of_cell[cell as usize].push(number));
            let normal = area_vector(&opening.polygon).normalize();
            let toward = middle(&opening.polygon);
            // From the middle of a cell to the opening is the way out of it.
            let out_of = |cell: u32| {
                cells.get((cell as usize).wrapping_sub(1)).map(|cell| normal.dot(toward - cell.aabb.center()))
            };
            let [first, second] = opening.between.map(out_of);
            let forward = first.unwrap_or(0.0) - second.unwrap_or(0.0);
            normals.push(if forward < 0.0 { -normal } else { normal });
        }
        let bounds = cells.iter().map(Cell::aabb).reduce(Aabb::union).unwrap_or_default();
        Self { cells, openings, normals, of_cell, bounds }
    }

    /// Tells if there is no cell.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// In order of their numbers, from 1 on.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// All portals.
    pub fn openings(&self) -> &[Opening] {
        &self.openings
    }

    /// The cell of a number; `None` for outside.
    pub fn cell(&self, number: u32) -> Option<&Cell> {
        self.cells.get((number as usize).wrapping_sub(1))
    }

    /// The box around all cells.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// The number of the first cell that holds a point, or [`OUTSIDE`].
    pub fn at(&self, point: Vec3) -> u32 {
        let is_in = |aabb: Aabb| point.cmpge(aabb.min).all() && point.cmple(aabb.max).all();
        if !is_in(self.bounds) {
            return OUTSIDE;
        }
        let found = self.cells.iter().position(|cell| is_in(cell.aabb) && cell.depth(point) >= 0.0);
        found.map_or(OUTSIDE, |index| index as u32 + 1)
    }

    /// The openings of a cell: the number of each, the cell beyond it, and the unit normal toward that.
    pub(crate) fn openings_of(&self, cell: u32) -> impl Iterator<Item = (u32, u32, Vec3)> {
        self.of_cell[cell as usize].iter().map(move |&number| {
            let (opening, normal) = (&self.openings[number as usize], self.normals[number as usize]);
            let [first, second] = opening.between;
            if first == cell { (number, second, normal) } else { (number, first, -normal) }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hull_is_that_of_a_convex_mesh_or_refused() {
        let corners: Vec<Vec3> =
            (0..8).map(|i| Vec3::new((i & 1) as f32 * 4.0, (i >> 1 & 1) as f32 * 3.0, (i >> 2) as f32 * 5.0)).collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let indices: Vec<u32> = quads.iter().flat_map(|q| [q[0], q[1], q[2], q[0], q[2], q[3]]).collect();
        let hull = Cell::new_hull("a", &corners, &indices).expect("a box is convex");
        assert_eq!(hull.planes.len(), 6);
        assert_eq!((hull.depth(Vec3::new(1.0, 1.5, 2.0)), hull.depth(Vec3::new(-2.0, 1.0, 1.0))), (1.0, -2.0));
        // A corner that is pushed in by a third of the box.
        let mut dented = corners.clone();
        dented[7] = Vec3::new(3.0, 2.0, 3.0);
        assert!(matches!(Cell::new_hull("a", &dented, &indices), Err(CellError::NotConvex(by)) if by > 0.1));
        let flat: Vec<Vec3> = corners.iter().map(|p| *p * Vec3::new(1.0, 0.0, 1.0)).collect();
        assert!(Cell::new_hull("a", &flat, &indices).is_err());
    }

    #[test]
    fn an_opening_s_normal_leads_into_the_cell_beyond_it() {
        let cell = |x: f32| Cell::new_box("", Aabb { min: Vec3::X * x, max: Vec3::new(x + 4.0, 3.0, 4.0) });
        let polygon: Vec<Vec3> =
            [(0.0, 1.0), (0.0, 2.0), (2.0, 2.0), (2.0, 1.0)].map(|(y, z)| Vec3::new(4.0, y, z)).into();
        let out: Vec<Vec3> = polygon.iter().map(|p| *p + Vec3::X * 4.0).collect();
        let opening = |between, polygon: &[Vec3]| Opening { between, polygon: polygon.to_vec(), portal: None };
        let cells =
            Cells::new(vec![cell(0.0), cell(4.0)], vec![opening([2, 1], &polygon), opening([OUTSIDE, 2], &out)]);
        let of = |number| cells.openings_of(number).collect::<Vec<_>>();
        assert_eq!(of(1), [(0, 2, Vec3::X)]);
        assert_eq!(of(2), [(0, 1, Vec3::NEG_X), (1, OUTSIDE, Vec3::X)]);
        assert_eq!(of(OUTSIDE), [(1, 2, Vec3::NEG_X)]);
        assert_eq!([1.0, 5.0, 9.0].map(|x| cells.at(Vec3::new(x, 1.0, 1.0))), [1, 2, OUTSIDE]);
    }
}
