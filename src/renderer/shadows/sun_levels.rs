//! The levels of a directional light's shadows: squares across its rays, around an eye, each twice as wide as the one
//! before.
//!
//! A level is not fitted to what the camera shows. Its middle is the eye's place, rounded to a grid of a quarter of
//! half its width. So what can be seen of it depends on the light's direction, the rounded eye and the casters alone:
//! it is the same for all cameras nearby, whatever way they look, and is drawn anew where the eye enters another cell
//! of the grid. Cells are whole numbers of texels, so samples stay at their places in the world then, and edges do not
//! crawl (Valient, "Stable Rendering of Cascaded Shadow Maps", ShaderX6, 2008, has the rounding to texels).
//!
//! A point is looked up in the first level whose inner three quarters hold it, seen from the true eye, which is off the
//! middle by an eighth at most. Depths are linear over [`DEPTH`] metres around the middle. What casts and is nearer to
//! the light than that lies flat on the near plane; what is farther away is no caster.

use super::shadow::Shadow;
use super::shadow_layers::{Face, Turn, WIDEST_FILTER, filter_of, rounding};
use glam::{DVec3, Vec3};
use systems::lights::LightRecord;
use systems::space::Sphere;

/// Most levels of a light around an eye: of the coarsest layers.
pub(crate) const MOST_LEVELS: u32 = 8;
/// Metres that a texel of the first level covers, whatever its side is.
pub(crate) const FIRST_TEXEL: f32 = 1.0 / 48.0;
/// Metres from the middle of the last level to its sides, whatever the first one's are.
const LAST: f32 = 256.0;
/// Metres from the near plane to the far one. A float has steps of 0.1 mm there.
pub(crate) const DEPTH: f32 = 2048.0;
/// Cells of the grid from the middle of a level to its sides.
const CELLS: f64 = 4.0;
/// Distances from an eye, across the rays, between which a level is looked up, in parts of its half width. Nearer
/// places have a finer level by themselves. Twice 0.3 is 0.8 of 0.75 (`shaders/shadows.wgsl`: `LEVEL_ALONE`,
/// `LEVEL_USED`).
pub(crate) const LOOKED_UP: [f32; 2] = [0.3, 0.75];
/// Distance from the middle of a level, in parts of its half width, up to which it is read but for filters. It includes
/// eyes anywhere in the level's cell.
const READ: f32 = LOOKED_UP[1] + 0.5 / CELLS as f32 + 0.01;

/// A level of a directional light around an eye: all that decides what its layer holds, beside the casters.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct SunLevel {
    level: u32,
    /// Texels along a side.
    side: u32,
    /// The way that the light's frame is turned.
    pub turn: Turn,
    /// Cell of the grid, in the light's frame.
    cell: [i32; 3],
}

impl SunLevel {
    /// The levels of a light around an eye, world space, the finest first.
    pub fn around(eye: Vec3, turn: Turn, side: u32) -> impl Iterator<Item = Self> + use<> {
        let at = turn.matrix() * eye.as_dvec3();
        let level = move |level| {
            let empty = Self { level, side, turn, cell: [0; 3] };
            Self { cell: (at / empty.cell_width()).round().to_array().map(|at| at as i32), ..empty }
        };
        (0..MOST_LEVELS).map(level).take_while(|level| level.half() <= LAST)
    }

    /// Metres that a texel covers.
    fn texel(self) -> f32 {
        FIRST_TEXEL * (1u32 << self.level) as f32
    }

    /// Metres from the middle to the sides.
    fn half(self) -> f32 {
        0.5 * self.side as f32 * self.texel()
    }

    /// Metres along a side of a cell of the grid.
    fn cell_width(self) -> f64 {
        f64::from(self.half()) / CELLS
    }

    /// Its middle, world space.
    fn origin(self) -> Vec3 {
        let middle = DVec3::from(self.cell.map(f64::from)) * self.cell_width();
        (self.turn.matrix().inverse() * middle).as_vec3()
    }

    /// The record that shaders read: where an eye is from the middle, in the light's frame, and the layer.
    pub fn record(self, eye: Vec3, layer: u32) -> [u32; 4] {
        let offset = (self.turn.matrix() * (eye.as_dvec3() - self.origin().as_dvec3())).as_vec3();
        [offset.x.to_bits(), offset.y.to_bits(), offset.z.to_bits(), layer]
    }
}

/// A level, and where it is in the world.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct SunLayer {
    /// Its middle.
    pub origin: Vec3,
    /// The axes of the light's frame.
    axes: [Vec3; 3],
    level: SunLevel,
    /// Tangent of half the angle of the light's disc.
    size: f32,
}

impl SunLayer {
    pub fn new(level: SunLevel, size: f32) -> Self {
        Self { origin: level.origin(), axes: level.turn.rows(), level, size }
    }

    /// Metres that a texel covers.
    pub fn texel(&self) -> f32 {
        self.level.texel()
    }

    /// The whole layer.
    pub fn face(&self) -> Face {
        let ([x, y, z], half) = (self.axes, self.level.half());
        Face { right: x / half, up: y / half, toward: z / DEPTH, corner: [0, 0], size: self.level.side }
    }

    /// Tells if a box, world space, may be in the part of the level that is read, or before it.
    pub fn may_reach(&self, min: Vec3, max: Vec3) -> bool {
        let (center, half) = ((min + max) * 0.5, (max - min) * 0.5);
        self.is_before(center, |axis| axis.abs().dot(half))
    }

    /// The same for a sphere.
    pub fn reaches(&self, sphere: Sphere) -> bool {
        self.is_before(sphere.center, |_| sphere.radius)
    }

    /// Toward the light, unit; world space.
    pub fn toward(&self) -> Vec3 {
        self.axes[2].normalize()
    }

    /// The shadow of a sphere, with room for what filters read.
    pub fn shadow(&self, sphere: Sphere) -> Shadow {
        let room = filter_of(self.size) * self.texel() + rounding(sphere.center, self.origin);
        let start = Sphere { center: sphere.center, radius: sphere.radius * 1.001 + room };
        Shadow { start, along: -self.toward(), growth: 0.0, length: f32::INFINITY }
    }

    /// Tells if an eye may look up in this level what lies behind a sphere.
    pub fn serves(&self, eye: Vec3, Sphere { center, radius }: Sphere) -> bool {
        let (v, [x, y, _], half) = (center - eye, self.axes, self.level.half());
        let across = x.dot(v).abs().max(y.dot(v).abs());
        // A thousandth: directions are rounded to 15 bits.
        let room = radius + 1e-3 * (half + across);
        let [nearest, farthest] = LOOKED_UP.map(|part| part * half);
        (self.level.level == 0 || across + room >= nearest) && across - room <= farthest
    }

    /// The same for something that reaches so far along an axis from its centre.
    fn is_before(&self, center: Vec3, reach: impl Fn(Vec3) -> f32) -> bool {
        let (v, [x, y, z]) = (center - self.origin, self.axes);
        let room = |axis| reach(axis) * 1.001 + rounding(center, self.origin);
        let read = READ * self.level.half() + WIDEST_FILTER * self.texel();
        x.dot(v).abs() <= read + room(x) && y.dot(v).abs() <= read + room(y) && z.dot(v) >= -0.5 * DEPTH - room(z)
    }
}

/// The way that a directional light's frame is turned.
pub(crate) fn turn_of(light: &LightRecord) -> Turn {
    Turn::new(-Vec3::from(light.position))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::renderer::shadows::sides::SIDES;

    const DOWN: [Vec3; 3] = [Vec3::NEG_Y, Vec3::new(0.6, -0.3, 0.5), Vec3::Z];

    /// Three quarters of half a level's width around the eye are in it, and so are filters.
    #[test]
    fn a_level_holds_what_is_around_its_eye() {
        for (i, way) in (0..300).map(|i| (i as f32, DOWN[i % 3])) {
            let eye = Vec3::new((i * 0.37).sin(), (i * 0.91).cos(), (i * 0.53).sin()) * (1.0 + i * i);
            let turn = Turn::new(way);
            for level in SIDES.into_iter().flat_map(|side| SunLevel::around(eye, turn, side)) {
                let [x, y, z, _] = level.record(eye, 0).map(f32::from_bits);
                // An eighth, and what rounding a place to a float does so far from the origin.
                let most = level.half() / 8.0 + 2e-7 * eye.length();
                assert!(Vec3::new(x, y, z).abs().max_element() <= most, "{x} {y} {z} {most}");
            }
        }
    }

    /// Cells are whole numbers of texels.
    #[test]
    fn samples_stay_where_they_are_when_the_eye_moves() {
        let turn = Turn::new(DOWN[1]);
        let all = |eye: Vec3| SIDES.into_iter().flat_map(move |side| SunLevel::around(eye, turn, side));
        let (all_here, all_there) = (all(Vec3::new(3.0, 2.0, 1.0)), all(Vec3::new(203.0, -40.0, 150.0)));
        for (here, there) in all_here.zip(all_there) {
            let (here, there) = (SunLayer::new(here, 0.0), SunLayer::new(there, 0.0));
            assert_ne!(here, there);
            let way = turn.matrix() * (there.origin - here.origin).as_dvec3() / f64::from(here.texel());
            // Places are rounded to floats.
            assert!((way - way.round()).abs().max_element() < 1e-2, "{way}");
        }
    }

    /// Around an eye each level has a ring of its own, and the next one's begins where it begins to blend.
    #[test]
    fn an_eye_looks_up_what_has_no_finer_level_by_itself() {
        let (eye, turn) = (Vec3::new(40.0, 2.0, -30.0), Turn::new(DOWN[1].normalize()));
        let side = turn.rows()[0];
        for (across, levels) in [
            (1.0, 0..1),
            (4.7, 0..1),
            (5.0, 0..2),
            (5.9, 0..2),
            (7.0, 1..2),
            (30.0, 3..4),
            (170.0, 5..6),
            (195.0, 6..6),
        ] {
            let sphere = Sphere { center: eye + across * side + 300.0 * turn.rows()[2], radius: 0.01 };
            for (level, around) in (0..).zip(SunLevel::around(eye, turn, 768)) {
                let layer = SunLayer::new(around, 0.0);
                let serves = layer.serves(eye, sphere);
                assert_eq!(serves, levels.contains(&level), "{across} {level}");
                assert!(!serves || layer.reaches(sphere));
            }
        }
    }

    /// Coarser layers have smaller levels, of the same texels, and more of them: all reach as far.
    #[test]
    fn levels_of_all_sides_have_the_same_texels_and_reach_as_far() {
        for (side, first, count) in [(192, 2.0, 8), (384, 4.0, 7), (768, 8.0, 6)] {
            let levels: Vec<_> = SunLevel::around(Vec3::X, Turn::new(DOWN[0]), side).collect();
            assert_eq!((levels[0].half(), levels.len()), (first, count));
            assert_eq!((levels[0].texel(), levels[count - 1].half()), (FIRST_TEXEL, LAST));
        }
    }

    #[test]
    fn what_is_before_a_level_is_reached_however_far_and_what_is_beside_it_is_not() {
        for way in DOWN.map(Vec3::normalize) {
            let mut levels = SunLevel::around(Vec3::new(5.0, 1.0, -7.0), Turn::new(way), 768);
            let level = SunLayer::new(levels.nth(2).expect("six levels"), 0.0);
            let side = Turn::new(way).rows()[0];
            let ball =
                |along: f32, across: f32| Sphere { center: level.origin - along * way + across * side, radius: 1.0 };
            let boxed = |sphere: Sphere| level.may_reach(sphere.center - sphere.radius, sphere.center + sphere.radius);
            for (along, across, reached) in [
                (0.0, 0.0, true),
                (5000.0, 20.0, true),
                (-1000.0, 28.0, true),
                (-1100.0, 0.0, false),
                // 32 m to the side, of which 28 are read.
                (0.0, 30.0, false),
            ] {
                let sphere = ball(along, across);
                assert_eq!(level.reaches(sphere), reached, "{along} {across}");
                assert!(boxed(sphere) || !reached);
            }
        }
    }
}
