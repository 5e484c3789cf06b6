//! Corners of the grid that are kept, and bricks of them.
//!
//! Corners of cells that surfaces look into are asked, and count where they are not within something. The others of a
//! brick go by those around them: ring by ring, each is the mean of its neighbours that are known by then. That follows
//! from the corner's place alone, so bricks that share a corner have the same there.

use super::cells::cells_of;
use super::corners::{Occluder, Occluders, View};
use super::directions::{AXES, Bits, Weights};
use super::rooms::Room;
use crate::ecs::parallel::map_in_parallel;
use crate::space::box_tree::Open;
use glam::{IVec3, UVec3, Vec3};
use serde::{Deserialize, Serialize};
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
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Lattice {
    /// Open directions of corners that were asked.
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
    /// Corners of each brick, and then of each room's bricks: X fastest, then Y, then Z. `u32::MAX`: nothing is known.
    pub corners: Vec<u32>,
    /// Rooms.
    pub rooms: Vec<Room>,
}

/// Reason for which a world has no lattice: it takes more corners than there may be.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TooLarge;

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
    /// Asks all corners. `None`: all is open.
    ///
    /// # Errors
    /// There are too many, or they lie too far apart.
    pub fn new(triangles: Vec<Occluder>, rooms: Vec<Room>) -> Result<Option<Self>, TooLarge> {
        let cells = cells_of(&triangles).ok_or(TooLarge)?;
        let bricks: BTreeSet<[i32; 3]> = cells.iter().map(|cell| brick_of(*cell).to_array()).collect();
        let bricks: Vec<IVec3> = bricks.into_iter().map(IVec3::from).collect();
        // Rooms are found by the bricks that they lie in.
        let of_rooms = rooms.iter().flat_map(|room| room.cells().map(brick_of));
        let low = bricks.iter().copied().chain(of_rooms.clone()).reduce(IVec3::min);
        let high = bricks.iter().copied().chain(of_rooms).reduce(IVec3::max);
        let Some((low, high)) = low.zip(high) else { return Ok(None) };
        let along = (high - low).as_i64vec3() + 1;
        if along.max_element() > MOST_ALONG || along.element_product() > MOST_BRICKS {
            return Err(TooLarge);
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
        let is_in_room = |corner: &IVec3| rooms.iter().any(|room| room.has(corner.as_vec3() * SPACING));
        let mut known = ByPlace::default();
        let mut bits = Vec::new();
        // Those of rooms see what no place outside sees.
        let counts = |(corner, view): &(&IVec3, View)| !view.is_within && !is_in_room(corner);
        for (corner, view) in asked.iter().zip(views).filter(counts) {
            known.insert(key(*corner), bits.len() as u32);
            bits.push(view.open);
        }
        let mut lattice = Self {
            starts: vec![0],
            neighbours: Vec::new(),
            low,
            size: along.as_uvec3(),
            corners: Vec::new(),
            rooms: rooms.clone(),
            bricks: bricks.clone(),
            bits,
        };
        // All that are asked come before those that go by others.
        let within: Vec<ByPlace> = rooms.iter().map(|room| lattice.ask_room(room, &occluders)).collect();
        lattice.add_bricks(&bricks, known);
        for (room, known) in rooms.iter().zip(within) {
            lattice.add_bricks(&bricks_of(room), known);
        }
        Ok(Some(lattice))
    }

    /// Asks the corners of a room, by their numbers along its axes.
    fn ask_room(&mut self, room: &Room, occluders: &Occluders) -> ByPlace {
        let UVec3 { x, y, z } = room.corners;
        let corner = |i: u32| IVec3::new((i % x) as i32, (i / x % y) as i32, (i / (x * y)) as i32);
        let corners: Vec<IVec3> = (0..x * y * z).map(corner).collect();
        let views = map_in_parallel(corners.chunks(TOGETHER), |corners: &[IVec3]| {
            let mut open = Open::default();
            corners.iter().map(|corner| occluders.view(room.place(*corner), &mut open)).collect::<Vec<View>>()
        });
        let views = corners.iter().zip(views.into_iter().flatten()).filter(|(_, view)| !view.is_within);
        let mut known = ByPlace::default();
        for (corner, view) in views {
            known.insert(key(*corner), self.bits.len() as u32);
            self.bits.push(view.open);
        }
        known
    }

    /// Adds the corners of bricks, the missing ones by those around them.
    fn add_bricks(&mut self, bricks: &[IVec3], mut known: ByPlace) {
        self.fill(bricks, &mut known);
        let corners = bricks.iter().flat_map(corners_of_brick);
        self.corners.extend(corners.map(|corner| known.get(&key(corner)).copied().unwrap_or(OPEN)));
    }

    /// Finds neighbours for the corners of bricks that are not known.
    fn fill(&mut self, bricks: &[IVec3], known: &mut ByPlace) {
        let mut missing: Vec<IVec3> = bricks.iter().flat_map(corners_of_brick).collect();
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
            let first = (self.bits.len() + self.starts.len() - 1 - ring.len()) as u32;
            known.extend(ring.into_iter().zip(first..).map(|(corner, number)| (key(corner), number)));
        }
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

    /// Writes it as bytes, to be kept.
    pub fn to_bytes(&self) -> Vec<u8> {
        postcard::to_stdvec(self).unwrap_or_default()
    }

    /// Reads bytes that were kept; `None`: they are none of [`Self::to_bytes`].
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (own, rest) = postcard::take_from_bytes::<Self>(bytes).ok()?;
        (rest.is_empty() && own.is_sound()).then_some(own)
    }

    /// Tells if all numbers in it are those of something.
    fn is_sound(&self) -> bool {
        let along = self.size.as_i64vec3();
        let count = |room: &Room| room.bricks().element_product() as usize;
        let (asked, all) = (self.bits.len(), self.bits.len() + self.starts.len().saturating_sub(1));
        let ends = self.starts.array_windows().zip(asked..);
        let is_filled = |([first, end], number): (&[u32; 2], usize)| {
            let own = self.neighbours.get(*first as usize..*end as usize);
            own.is_some_and(|own| !own.is_empty() && own.iter().all(|neighbour| (*neighbour as usize) < number))
        };
        let is_within = |brick: &IVec3| {
            let at = brick.as_i64vec3() - self.low.as_i64vec3();
            at.min_element() >= 0 && at.cmplt(along).all()
        };
        along.min_element() > 0
            && along.max_element() <= MOST_ALONG
            && along.element_product() <= MOST_BRICKS
            && !self.starts.is_empty()
            && ends.into_iter().all(is_filled)
            && self.bricks.iter().all(is_within)
            && self.rooms.iter().flat_map(|room| room.cells().map(brick_of)).all(|brick| is_within(&brick))
            && self.rooms.iter().all(|room| room.corners.min_element() > 1 && room.corners.max_element() <= 1024)
            && self.corners.len() == (self.bricks.len() + self.rooms.iter().map(count).sum::<usize>()) * BRICK
            && self.corners.iter().all(|corner| *corner == OPEN || (*corner as usize) < all)
    }

    /// World space of the lowest corner, metres.
    pub fn origin(&self) -> Vec3 {
        (self.low * CELLS).as_vec3() * SPACING
    }
}

/// The brick of a cell.
pub fn brick_of(cell: IVec3) -> IVec3 {
    IVec3::from(cell.to_array().map(|coordinate| coordinate.div_euclid(CELLS)))
}

/// The bricks of a room, by their numbers along its axes: X fastest, then Y, then Z.
fn bricks_of(room: &Room) -> Vec<IVec3> {
    let UVec3 { x, y, z } = room.bricks();
    let brick = |i: u32| IVec3::new((i % x) as i32, (i / x % y) as i32, (i / (x * y)) as i32);
    (0..x * y * z).map(brick).collect()
}

/// The corners of a brick: X fastest, then Y, then Z.
fn corners_of_brick(brick: &IVec3) -> impl Iterator<Item = IVec3> + use<> {
    let first = *brick * CELLS;
    let within = |k: i32| IVec3::new(k % CORNERS, k / CORNERS % CORNERS, k / (CORNERS * CORNERS));
    (0..CORNERS * CORNERS * CORNERS).map(move |k| first + within(k))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ecs::parallel::set_threads;
    use crate::space::bounds::Aabb;
    use crate::weather::openness::bricks::Openness;
    use crate::weather::sky::Sky;
    use crate::weather::sky_map::SkyMap;
    use half::f16;
    use std::f64::consts::PI;

    /// A rectangle as two triangles, counter-clockwise from where it is seen.
    fn rectangle(corner: Vec3, u: Vec3, v: Vec3) -> [Occluder; 2] {
        let triangle = |corners| Occluder { corners, is_double_sided: false, is_large: true };
        let opposite = corner + u + v;
        [triangle([corner, corner + u, opposite]), triangle([corner, opposite, corner + v])]
    }

    /// The faces of a box, seen from outside.
    fn solid(min: Vec3, max: Vec3) -> Vec<Occluder> {
        let Vec3 { x, y, z } = max - min;
        let (x, y, z) = (Vec3::X * x, Vec3::Y * y, Vec3::Z * z);
        let faces = [(min, y, x), (min, x, z), (min, z, y), (max, -x, -y), (max, -z, -x), (max, -y, -z)];
        faces.into_iter().flat_map(|(corner, u, v)| rectangle(corner, u, v)).collect()
    }

    fn ground() -> Vec<Occluder> {
        rectangle(Vec3::new(-40.0, 0.0, -40.0), Vec3::Z * 80.0, Vec3::X * 80.0).into()
    }

    /// A sky that is as bright everywhere.
    fn even() -> Sky {
        let texel = [f16::ONE.to_bits(); 4];
        let hemisphere = vec![texel; SkyMap::SIDE * SkyMap::SIDE];
        Sky { map: SkyMap { hemisphere, unit: 1.0, ..SkyMap::default() }, ..Sky::default() }
    }

    /// Openness toward +X, −X, +Z, −Z and +Y at a corner of the grid.
    fn at(lattice: &Lattice, corner: IVec3) -> [f32; AXES] {
        let all = lattice.openness(&Weights::of(&even()));
        let brick = IVec3::from(corner.to_array().map(|at| at.div_euclid(CELLS)));
        let number = lattice.bricks.iter().position(|own| *own == brick).expect("a brick");
        let IVec3 { x, y, z } = corner - brick * CELLS;
        let own = lattice.corners[number * BRICK + ((z * CORNERS + y) * CORNERS + x) as usize];
        all[own as usize]
    }

    /// Shares of an even sky are known: of a half, of a quarter, of what a plate hides. 256 directions lie 10° apart, so
    /// an edge is known to half of that, which is 0.04 of the light where it is strongest.
    #[test]
    fn openness_of_ground_walls_and_plates() {
        set_threads(None);
        let bound = 0.04;
        let near = |found: f32, expected: f64, what: &str| {
            assert!((f64::from(found) - expected).abs() < bound, "{what}: {found} for {expected}");
        };
        assert_eq!(Lattice::new(ground(), Vec::new()), Ok(None), "open ground");

        // A wall without end at x = 0.5, seen from its −X side. At a metre of height it hides all of the half sphere.
        let wall = solid(Vec3::new(0.5, 0.0, -300.0), Vec3::new(1.0, 90.0, 300.0));
        let walled = Lattice::new([ground(), wall].concat(), Vec::new()).expect("few").expect("corners");
        let [toward, away, _, _, up] = at(&walled, IVec3::new(0, 1, 0));
        near(toward, 0.0, "toward a wall");
        near(away, 1.0, "away from a wall");
        near(up, 0.5, "up beside a wall");

        // A plate of 20 by 20 m, 2 m above the corner in the middle: four times the share of a quarter, by Lambert's
        // formula.
        let plate = solid(Vec3::new(-10.0, 4.0, -10.0), Vec3::new(10.0, 4.2, 10.0));
        let below = Lattice::new([ground(), plate].concat(), Vec::new()).expect("few").expect("corners");
        let half = 10.0 / 2.0;
        let quarter =
            2.0 * half / (1.0f64 + half * half).sqrt() * (half / (1.0f64 + half * half).sqrt()).atan() / (2.0 * PI);
        let [.., up] = at(&below, IVec3::new(0, 1, 0));
        near(up, 1.0 - 4.0 * quarter, "below a plate");
    }

    #[test]
    fn corners_within_something_count_by_those_around_it() {
        set_threads(None);
        let house = solid(Vec3::new(-5.0, 0.0, -5.0), Vec3::new(5.0, 9.0, 5.0));
        let lattice = Lattice::new([ground(), house].concat(), Vec::new()).expect("few").expect("corners");
        // A metre within the wall; its neighbours outside see what is before the wall.
        let [toward, away, _, _, _] = at(&lattice, IVec3::new(2, 1, 0));
        assert!(toward > 0.6 && away < 0.5, "{toward} {away}");
    }

    #[test]
    fn bytes_come_back_and_broken_ones_are_refused() {
        set_threads(None);
        let lattice = Lattice::new([ground(), solid(Vec3::ZERO, Vec3::splat(3.0))].concat(), Vec::new())
            .expect("few")
            .expect("corners");
        let bytes = lattice.to_bytes();
        assert_eq!(Lattice::from_bytes(&bytes).as_ref(), Some(&lattice));
        assert_eq!(Lattice::from_bytes(&bytes[..bytes.len() - 1]), None);
        let mut wrong = lattice.clone();
        wrong.corners[0] = lattice.corners.iter().filter(|corner| **corner != OPEN).max().expect("some") + 1;
        assert_eq!(Lattice::from_bytes(&wrong.to_bytes()), None);
        let mut wrong = lattice.clone();
        wrong.size.x = 0;
        assert_eq!(Lattice::from_bytes(&wrong.to_bytes()), None);
        assert!(Lattice::new(Vec::new(), Vec::new()) == Ok(None));
    }

    /// Bricks share the corners between them, so that there is no seam.
    #[test]
    fn neighbouring_bricks_have_the_same_corners() {
        set_threads(None);
        let house = solid(Vec3::new(-5.0, 0.0, -5.0), Vec3::new(5.0, 9.0, 5.0));
        let lattice = Lattice::new([ground(), house].concat(), Vec::new()).expect("few").expect("corners");
        let of = |brick: IVec3| lattice.bricks.iter().position(|own| *own == brick).map(|number| number * BRICK);
        let mut compared = 0;
        for (number, brick) in lattice.bricks.iter().enumerate() {
            for (axis, step) in [IVec3::X, IVec3::Y, IVec3::Z].into_iter().zip([1, CORNERS, CORNERS * CORNERS]) {
                let Some(next) = of(*brick + axis) else { continue };
                let others = [1, CORNERS, CORNERS * CORNERS].into_iter().filter(|other| *other != step);
                let [first, second]: [i32; 2] = others.collect::<Vec<_>>().try_into().expect("two");
                for i in 0..CORNERS * CORNERS {
                    let within = i % CORNERS * first + i / CORNERS * second;
                    let [own, other] = [number * BRICK + (within + CELLS * step) as usize, next + within as usize];
                    assert_eq!(lattice.corners[own], lattice.corners[other], "{brick} {axis}");
                    compared += 1;
                }
            }
        }
        assert!(compared > 1000, "{compared}");
        let openness = Openness::new(&lattice, &even());
        assert_eq!(openness.table.iter().filter(|[number, _]| *number > 0).count(), lattice.bricks.len());
    }

    /// A room of 4 by 3 by 4 m without a window, whose walls are 10 cm thick, on open ground.
    fn closed_room() -> (Vec<Occluder>, Aabb) {
        let inner = Aabb { min: Vec3::new(-2.0, 0.1, -2.0), max: Vec3::new(2.0, 3.1, 2.0) };
        let (low, high) = (inner.min - 0.1, inner.max + 0.1);
        let walls = [
            (Vec3::new(low.x, low.y, low.z), Vec3::new(inner.min.x, high.y, high.z)),
            (Vec3::new(inner.max.x, low.y, low.z), Vec3::new(high.x, high.y, high.z)),
            (Vec3::new(low.x, low.y, low.z), Vec3::new(high.x, high.y, inner.min.z)),
            (Vec3::new(low.x, low.y, inner.max.z), Vec3::new(high.x, high.y, high.z)),
            (Vec3::new(low.x, inner.max.y, low.z), Vec3::new(high.x, high.y, high.z)),
        ];
        let solids = walls.into_iter().flat_map(|(low, high)| solid(low, high));
        (ground().into_iter().chain(solids).collect(), inner)
    }

    #[test]
    fn no_light_comes_through_the_walls_of_a_room() {
        set_threads(None);
        let (triangles, inner) = closed_room();
        let room = Room::within(&inner).expect("air");
        assert_eq!(room.corners, UVec3::new(3, 3, 3));
        let lattice = Lattice::new(triangles, vec![room]).expect("few").expect("corners");
        let all = lattice.openness(&Weights::of(&even()));
        let of_room = &lattice.corners[lattice.bricks.len() * BRICK..];
        assert_eq!(of_room.len(), BRICK);
        assert!(of_room.iter().all(|corner| *corner != OPEN && all[*corner as usize] == [0.0; AXES]));
        // Outside, a metre before the wall: the dark within does not count.
        let [away, toward, _, _, up] = at(&lattice, IVec3::new(2, 1, 0));
        assert!(away > 0.95 && up > 0.5 && toward < 0.6, "{away} {toward} {up}");
    }
}
