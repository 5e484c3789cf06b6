//! Sight of an eye in a world with cells, as the culling shader reads it.
//!
//! An object that no window shows need not be drawn. Whether doors are open does not matter here: a shut door hides what
//! is behind it by being drawn.

use super::cells::{Cell, Cells, OUTSIDE};
use super::flood::{Flood, Source};
use super::geometry::Plane;
use glam::Vec3;

/// Metres: an eye that is nearer to a cell's walls may be within one, and sees what is in there.
const NEAR_WALL: f32 = 0.25;

/// Planes, normal and offset: a point p is within where normal · p + offset ≥ 0, world space. A list of planes ends
/// with one without a normal, whose offset says of what: one of the constants.
///
/// First come all cells: what is wholly within one is not outside. Then come the windows: something is in sight if it is
/// partly within all planes of one of them, and for a window of outside, not wholly within a cell.
#[derive(Clone, PartialEq, Debug)]
pub struct Sight(pub Vec<[f32; 4]>);

impl Sight {
    /// Ends the planes of a cell.
    pub const CELL: f32 = 1.0;
    /// Ends a window of a cell.
    pub const WINDOW: f32 = 2.0;
    /// Ends a window of outside.
    pub const OUTSIDE: f32 = 3.0;
    /// Ends everything.
    pub const END: f32 = 4.0;
    /// Planes and ends, at most: where there would be more, everything is in sight.
    pub const MOST: usize = 1024;

    /// Everything.
    pub fn everything() -> Self {
        Self(vec![[0.0, 0.0, 0.0, Self::WINDOW], [0.0, 0.0, 0.0, Self::END]])
    }

    /// Sight from a place, through all portals, open or not.
    pub fn new(cells: &Cells, eye: Vec3) -> Self {
        let is_near_wall = |cell: &Cell| cell.depth(eye).abs() < NEAR_WALL;
        if !eye.is_finite() || cells.cells().iter().any(is_near_wall) {
            return Self::everything();
        }
        let mut planes = Vec::new();
        let mut list = |all: &mut dyn Iterator<Item = &Plane>, anchor: Vec3| {
            planes.extend(all.map(|plane| plane.normal.extend(-plane.offset - plane.normal.dot(anchor)).to_array()));
        };
        let end = |code: f32| Plane { normal: Vec3::ZERO, offset: -code };
        for cell in cells.cells() {
            list(&mut cell.planes.iter().chain([&end(Self::CELL)]), Vec3::ZERO);
        }
        let flood = Flood::new(cells, &[], Source::Point(eye, f32::INFINITY));
        for window in &flood.windows {
            list(&mut window.planes.iter(), flood.anchor);
            let of_cell = cells.cell(window.cell).into_iter().flat_map(|cell| &cell.planes);
            let code = if window.cell == OUTSIDE { Self::OUTSIDE } else { Self::WINDOW };
            list(&mut of_cell.chain([&end(code)]), Vec3::ZERO);
        }
        list(&mut [&end(Self::END)].into_iter(), Vec3::ZERO);
        if planes.len() <= Self::MOST { Self(planes) } else { Self::everything() }
    }
}
