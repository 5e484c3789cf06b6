//! Reach of a light or an eye: windows, found by a flood through portals (Luebke, Georges: "Portals and Mirrors:
//! Simple, Fast Evaluation of Potentially Visible Sets", 1995; by planes as in Doom 3's renderer).
//!
//! A window is a cell and planes: through the source and each edge of the portal, as far as it is seen through the
//! portals before it, and the portal's own plane. The source's own cell is a window without planes. Cells are convex, so
//! no ray comes back to one that it has left, and a flood ends. A window is never smaller than what is seen.

use super::cells::{Cells, OUTSIDE};
use super::geometry::{Plane, area_vector, clip, middle, smooth_step};
use super::occupied::Occupied;
use crate::space::bounds::Aabb;
use glam::Vec3;

/// Metres from a window within which a share fades, as far from the source as the portal; farther proportionally more.
const FADE: f32 = 0.1;
/// Metres that planes are moved outward, against rounding.
const MARGIN: f32 = 0.001;
/// Metres: a source that is nearer to a portal sees all that its own cell sees through it.
const NEAR: f32 = 0.05;
/// A portal of this solid angle, in steradians, lets the full share through, a smaller one less: what comes into sight
/// comes smoothly.
const FULL_ANGLE: f32 = 0.02;
/// The same for parallel light: square metres, seen along the light.
const FULL_AREA: f32 = 0.05;
/// A portal that is open this far lets the full share through.
const FULL_OPEN: f32 = 0.5;
/// Planes through the edges of a portal, at most; more edges add none.
const MOST_EDGES: usize = 11;
/// Windows of one cell, at most: where there are more, they are one without planes.
const MOST_OF_A_CELL: usize = 32;
/// Windows that are looked at, at most. Where there are more, each cell that can be reached is a window.
const MOST_STEPS: usize = 4096;

/// Origin of a flood: a light or an eye.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Source {
    /// A place, and the metres that it reaches.
    Point(Vec3, f32),
    /// Parallel light from outside: the unit vector along which it goes.
    Parallel(Vec3),
}

/// A part of a cell that a source may reach.
#[derive(Clone, PartialEq, Debug)]
pub struct Window {
    /// The cell's number.
    pub cell: u32,
    /// Relative to [`Flood::anchor`]. None: all of the cell.
    pub planes: Vec<Plane>,
    /// Share of the light that comes through the portals on the way, 0 to 1.
    pub share: f32,
    /// Metres from the source to the nearest portal on the way, as far as that is seen, at least 5 cm; infinite for
    /// parallel light.
    pub near: f32,
}

/// All that a source may reach. Empty: nothing.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Flood {
    /// The source's cell.
    pub cell: u32,
    /// World space; planes count from here.
    pub anchor: Vec3,
    /// In no order that means anything; the same for the same source.
    pub windows: Vec<Window>,
}

impl Flood {
    /// Floods from a source, with the opening of each portal, 0 to 1.
    pub fn new(cells: &Cells, open: &[f32], source: Source) -> Self {
        let (cell, anchor) = match source {
            Source::Point(place, _) => (cells.at(place), place),
            Source::Parallel(_) => (OUTSIDE, cells.bounds().center()),
        };
        let mut flooding =
            Flooding { cells, open, source, steps: 0, found: Self { cell, anchor, windows: Vec::new() } };
        let way = Way { open: 1.0, size: f32::INFINITY, near: f32::INFINITY };
        flooding.enter(cell, &[], way, &mut vec![(u32::MAX, cell)]);
        if flooding.steps > MOST_STEPS {
            flooding.enter_all();
        }
        flooding.found
    }

    /// Share of the light that an object gets, 0 to 1: the most through any window.
    pub fn share(&self, object: &Occupied) -> f32 {
        let center = object.center - self.anchor;
        // To the box's farthest corner. Where a source moves, planes turn about the edges of a portal: there they move
        // farther than it by as much as that corner lies farther away than the portal.
        let reach = (center.abs() + object.half).length();
        let mut most = 0.0f32;
        for window in &self.windows {
            let Some(weight) = object.weight(window.cell) else { continue };
            let full = weight * window.share;
            if full > most {
                let inside = window.planes.iter().map(|plane| plane.farthest(center, object.half));
                let fade = FADE * (reach / window.near).max(1.0);
                most = most.max(full * smooth_step(1.0 + inside.fold(f32::INFINITY, f32::min) / fade));
            }
        }
        most
    }

    /// Tells if it has a window in a cell.
    pub fn reaches(&self, cell: u32) -> bool {
        self.windows.iter().any(|window| window.cell == cell)
    }
}

/// State of the portals on a way.
#[derive(Clone, Copy)]
struct Way {
    /// Product of their openings, 0 to 1.
    open: f32,
    /// Least apparent size: a solid angle, or for parallel light an area.
    size: f32,
    /// Distance to the nearest portal; see [`Window::near`].
    near: f32,
}

/// A flood on its way.
struct Flooding<'a> {
    cells: &'a Cells,
    open: &'a [f32],
    source: Source,
    steps: usize,
    found: Flood,
}

impl Flooding<'_> {
    /// Adds a window, and those beyond it. The path has the portals on the way, and the cells beyond them.
    fn enter(&mut self, cell: u32, planes: &[Plane], way: Way, path: &mut Vec<(u32, u32)>) {
        self.steps += 1;
        if self.steps > MOST_STEPS {
            return;
        }
        let full = if matches!(self.source, Source::Point(..)) { FULL_ANGLE } else { FULL_AREA };
        let share = smooth_step(way.size / full) * smooth_step(way.open / FULL_OPEN);
        self.add(Window { cell, planes: planes.to_vec(), share, near: way.near });
        let cells = self.cells;
        for (number, beyond, normal) in cells.openings_of(cell) {
            // Out of a convex cell no ray leads back. What begins outside has all of outside.
            let is_known = path.iter().any(|&(portal, cell)| portal == number || cell == beyond && cell != OUTSIDE);
            let own = self.open.get(number as usize).copied().unwrap_or(1.0);
            if own <= 0.0 || is_known || beyond == self.found.cell {
                continue;
            }
            let anchor = self.found.anchor;
            let polygon: Vec<Vec3> = cells.openings()[number as usize].polygon.iter().map(|p| *p - anchor).collect();
            let way = Way { open: way.open * own, ..way };
            let Some((inner, way)) = self.through(&polygon, normal, planes, way) else { continue };
            path.push((number, beyond));
            self.enter(beyond, &inner, way, path);
            path.pop();
        }
    }

    /// Planes through the visible part of a portal, and the state of the way then. `None`: nothing is visible.
    fn through(&self, polygon: &[Vec3], normal: Vec3, planes: &[Plane], way: Way) -> Option<(Vec<Plane>, Way)> {
        let ahead = normal.dot(polygon[0]);
        if let Source::Point(_, range) = self.source {
            let Aabb { min, max } = Aabb::around(polygon);
            if min.max(-max).max(Vec3::ZERO).length() > range {
                return None;
            }
            if ahead.abs() < NEAR && is_before(polygon, normal) {
                return Some((planes.to_vec(), way));
            }
        }
        let seen = planes.iter().fold(polygon.to_vec(), |polygon, plane| clip(&polygon, plane));
        if seen.len() < 3 {
            return None;
        }
        let center = middle(&seen);
        let area = 0.5 * area_vector(&seen).length();
        let new_size = match self.source {
            Source::Point(..) => area * ahead / center.length().powi(3).max(f32::MIN_POSITIVE),
            Source::Parallel(along) => area * normal.dot(along),
        };
        if new_size <= 0.0 {
            return None;
        }
        let mut near = way.near;
        let mut inner = Vec::with_capacity(seen.len() + 1);
        for (i, &a) in seen.iter().enumerate().take(MOST_EDGES) {
            let b = seen[(i + 1) % seen.len()];
            let across = match self.source {
                Source::Point(..) => {
                    near = near.min(to_segment(a, b).max(NEAR));
                    a.cross(b)
                }
                Source::Parallel(along) => along.cross(b - a),
            };
            let Some(side) = across.try_normalize() else { continue };
            let side = if side.dot(center - a) < 0.0 { -side } else { side };
            inner.push(Plane { normal: side, offset: side.dot(a) - MARGIN });
        }
        inner.push(Plane { normal, offset: ahead - MARGIN });
        Some((inner, Way { size: new_size.min(way.size), near, ..way }))
    }

    fn add(&mut self, window: Window) {
        let of_cell = |other: &&Window| other.cell == window.cell;
        let windows = &mut self.found.windows;
        match windows.iter().filter(of_cell).count() {
            // They are one already.
            1 if windows.iter().any(|w| w.cell == window.cell && w.planes.is_empty()) => {
                let all = windows.iter_mut().find(|w| w.cell == window.cell);
                all.into_iter().for_each(|all| all.share = all.share.max(window.share));
            }
            count if count < MOST_OF_A_CELL => windows.push(window),
            _ => {
                let share = windows.iter().filter(of_cell).map(|w| w.share).fold(window.share, f32::max);
                windows.retain(|w| w.cell != window.cell);
                windows.push(Window { planes: Vec::new(), share, ..window });
            }
        }
    }

    /// Makes each cell that open portals lead to a window without planes.
    fn enter_all(&mut self) {
        self.found.windows.clear();
        let (cells, mut next) = (self.cells, vec![self.found.cell]);
        while let Some(cell) = next.pop() {
            if self.found.reaches(cell) {
                continue;
            }
            self.found.windows.push(Window { cell, planes: Vec::new(), share: 1.0, near: f32::INFINITY });
            let open = cells
                .openings_of(cell)
                .filter(|(number, ..)| self.open.get(*number as usize).is_none_or(|&open| open > 0.0));
            next.extend(open.map(|(_, beyond, _)| beyond));
        }
    }
}

/// Metres from the origin to a segment.
fn to_segment(a: Vec3, b: Vec3) -> f32 {
    let along = b - a;
    let t = (-a.dot(along) / along.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
    (a + along * t).length()
}

/// Tells if the origin is before a polygon, or [`NEAR`] to that.
fn is_before(polygon: &[Vec3], normal: Vec3) -> bool {
    let center = middle(polygon);
    polygon.iter().enumerate().all(|(i, &a)| {
        let b = polygon[(i + 1) % polygon.len()];
        let Some(side) = (b - a).cross(normal).try_normalize() else { return true };
        let side = if side.dot(center - a) < 0.0 { -side } else { side };
        side.dot(-a) > -NEAR
    })
}
