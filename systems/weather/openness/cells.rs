//! Cells of the grid that surfaces look into: those whose corners pixels interpolate between.
//!
//! Surfaces near which nothing rises, however large, need no corners: all of the sky is open there.

use super::corners::{FAR, Occluder};
use super::lattice::SPACING;
use glam::{IVec2, IVec3, Vec2, Vec3, Vec3Swizzles};
use std::collections::{BTreeSet, HashMap};

/// Metres from a surface along its normal at which pixels read openness.
pub const OFFSET: f32 = 1.0;
/// Heights above large level surfaces that things which move on them have, metres.
const ABOVE: [f32; 2] = [2.5, 4.5];
/// Cosine of the slope up to which something drives on a surface.
const LEVEL: f32 = 0.8;
/// Metres between places of a surface: no cell in between is missed by much.
const STEP: f32 = 1.0;
/// Most cells of a world.
const MOST_CELLS: usize = 1 << 22;

/// Metres along a side of a tile, for which heights are kept.
const TILE: f32 = 25.0;
/// Most tiles that one triangle may cover; what is larger, some 3 km, hides nothing.
const MOST_TILES: i64 = 1 << 14;
/// Slope up to which what rises hides nothing: 3° above the horizon.
const LOW: f32 = 0.05;

/// Cell of a place.
pub fn cell_of(place: Vec3) -> IVec3 {
    (place / SPACING).floor().as_ivec3()
}

fn tile_of(place: Vec2) -> IVec2 {
    (place / TILE).floor().as_ivec2()
}

/// First and last tile of some points.
fn tiles_of(points: &[Vec3; 3]) -> [IVec2; 2] {
    let [a, b, c] = points.map(|point| point.xz());
    [tile_of(a.min(b).min(c)), tile_of(a.max(b).max(c))]
}

fn count([low, high]: [IVec2; 2]) -> i64 {
    let size = high.as_i64vec2() - low.as_i64vec2() + 1;
    size.x.saturating_mul(size.y)
}

fn each([low, high]: [IVec2; 2]) -> impl Iterator<Item = IVec2> {
    (low.y..=high.y).flat_map(move |y| (low.x..=high.x).map(move |x| IVec2::new(x, y)))
}

/// Heights from which on all is open, by tile.
struct Skyline {
    heights: HashMap<IVec2, f32>,
    /// First and last tile that has one.
    bounds: Option<[IVec2; 2]>,
}

impl Skyline {
    fn of(triangles: &[Occluder]) -> Self {
        let mut tops = HashMap::<IVec2, f32>::new();
        for Occluder { corners, .. } in triangles {
            let top = corners[0].y.max(corners[1].y).max(corners[2].y);
            let tiles = tiles_of(corners);
            if count(tiles) <= MOST_TILES {
                for tile in each(tiles) {
                    let known = tops.entry(tile).or_insert(top);
                    *known = known.max(top);
                }
            }
        }
        let reach = (FAR / TILE) as i32;
        let mut heights = HashMap::<IVec2, f32>::new();
        for (tile, top) in &tops {
            for around in each([IVec2::splat(-reach), IVec2::splat(reach)]) {
                // From the nearest places of both.
                let away = (around.abs() - 1).max(IVec2::ZERO).as_vec2().length() * TILE;
                let height = top - LOW * away;
                let known = heights.entry(tile + around).or_insert(height);
                *known = known.max(height);
            }
        }
        let low = heights.keys().copied().reduce(IVec2::min);
        let high = heights.keys().copied().reduce(IVec2::max);
        Self { heights, bounds: low.zip(high).map(|(low, high)| [low, high]) }
    }

    fn is_open(&self, place: Vec3) -> bool {
        self.heights.get(&tile_of(place.xz())).is_none_or(|height| place.y >= *height)
    }

    /// Tells if all is open that a small triangle looks into. `below`: also from its underside.
    fn is_open_around(&self, corners: &[Vec3; 3], below: bool) -> bool {
        let [a, b, c] = corners;
        let (low, high) = (a.min(*b).min(*c) - OFFSET, a.max(*b).max(*c) + OFFSET);
        let least = if below { low.y } else { low.y + OFFSET };
        let mut tiles = each([tile_of(low.xz()), tile_of(high.xz())]);
        tiles.all(|tile| self.heights.get(&tile).is_none_or(|height| least >= *height))
    }

    /// Tells if a part of the world that a triangle is in has nothing that rises.
    fn is_far(&self, corners: &[Vec3; 3]) -> bool {
        let Some([first, last]) = self.bounds else { return true };
        let [low, high] = tiles_of(corners);
        low.cmpgt(last).any() || high.cmplt(first).any()
    }
}

/// Cells so far.
struct Cells<'a> {
    skyline: &'a Skyline,
    most: usize,
    /// Y first, then Z, then X.
    all: BTreeSet<[i32; 3]>,
}

impl Cells<'_> {
    fn add(&mut self, place: Vec3) {
        if !self.skyline.is_open(place) {
            let IVec3 { x, y, z } = cell_of(place);
            self.all.insert([y, z, x]);
        }
    }

    /// Adds those of a triangle with that normal; a large one in parts.
    fn add_triangle(&mut self, corners: [Vec3; 3], normal: Vec3, of: &Occluder) {
        let [a, b, c] = corners;
        if self.all.len() > self.most || self.skyline.is_far(&corners) {
            return;
        }
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        if longest > TILE {
            let [ab, bc, ca] = [a.midpoint(b), b.midpoint(c), c.midpoint(a)];
            for part in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
                self.add_triangle(part, normal, of);
            }
            return;
        }
        if self.skyline.is_open_around(&corners, normal.y < 0.0 || of.is_double_sided) {
            return;
        }
        let steps = (longest / STEP).ceil().max(1.0) as u32;
        for i in 0..=steps {
            for j in 0..=steps - i {
                let place = a + (b - a) * (i as f32 / steps as f32) + (c - a) * (j as f32 / steps as f32);
                self.add(place + normal * OFFSET);
                if of.is_double_sided {
                    self.add(place - normal * OFFSET);
                }
                if of.is_large && normal.y > LEVEL {
                    ABOVE.iter().for_each(|above| self.add(place + Vec3::Y * *above));
                }
            }
        }
    }
}

/// Cells that pixels of these surfaces read, and of what moves on them, ascending; `None`: there are too many.
pub fn cells_of(triangles: &[Occluder]) -> Option<Vec<IVec3>> {
    at_most(MOST_CELLS, triangles)
}

fn at_most(most: usize, triangles: &[Occluder]) -> Option<Vec<IVec3>> {
    let skyline = Skyline::of(triangles);
    let mut cells = Cells { skyline: &skyline, most, all: BTreeSet::new() };
    for triangle in triangles {
        let [a, b, c] = triangle.corners;
        let normal = (b - a).cross(c - a).try_normalize();
        normal.into_iter().for_each(|normal| cells.add_triangle(triangle.corners, normal, triangle));
    }
    let cells = cells.all;
    (cells.len() <= most).then(|| cells.into_iter().map(|[y, z, x]| IVec3::new(x, y, z)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(corners: [Vec3; 3]) -> Occluder {
        Occluder { corners, is_double_sided: false, is_large: true }
    }

    fn ground(half: f32) -> [Occluder; 2] {
        let corner = |x: f32, z: f32| Vec3::new(x * half, 0.0, z * half);
        let [a, b, c, d] = [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)];
        [triangle([a, b, c]), triangle([a, c, d])]
    }

    /// However large it is.
    #[test]
    fn level_ground_needs_no_corners_but_where_something_rises() {
        for half in [10.0, 500.0, 1e4, 1e6] {
            assert_eq!(cells_of(&ground(half)), Some(Vec::new()), "{half}");
        }
        let post = triangle([Vec3::new(0.0, 0.0, 0.0), Vec3::new(0.5, 0.0, 0.0), Vec3::new(0.0, 6.0, 0.0)]);
        for half in [500.0, 1e4, 1e6] {
            let all: Vec<Occluder> = ground(half).into_iter().chain([post]).collect();
            let cells = cells_of(&all).expect("few");
            let far = cells.iter().map(|cell| (cell.as_vec3() * SPACING).xz().length()).fold(0.0, f32::max);
            assert!(cells.len() > 500 && far < FAR + 3.0 * TILE, "{half}: {} up to {far}", cells.len());
            assert!(cells.contains(&cell_of(Vec3::new(5.0, 1.0, 5.0))), "{half}");
        }
    }

    #[test]
    fn too_many_cells_are_none() {
        let hill = [triangle([Vec3::ZERO, Vec3::new(0.0, 9.0, 90.0), Vec3::new(90.0, 9.0, 0.0)])];
        let count = cells_of(&hill).expect("few").len();
        assert!(count > 1000 && at_most(count, &hill).is_some(), "{count}");
        assert_eq!(at_most(count - 1, &hill), None);
    }
}
