//! Triangle of each texel of a map: triangles drawn into the square of their UVs.
//!
//! A texel belongs to the triangle that its centre lies in; of several, to the first in the file, and it counts as
//! overlapping. A centre on a common edge belongs to one of the two. A texel whose centre lies in none, but which a
//! triangle comes near to, belongs to the nearest: so the borders of charts are baked rather than guessed, and slivers
//! between centres are not lost. UVs beyond 0..1 go around, as a repeating texture does.

use super::Surface;
use glam::{DVec2, DVec3, Vec3};
use std::ops::RangeInclusive;

/// Distance from a texel's centre within which a triangle claims it, texels; a little less than half a side. A chart
/// that ends where a texel begins does not claim it, and nor does one that touches it by rounding.
const NEAR: f64 = 0.49;
/// Share of the way to the triangle's middle by which the nearest point of an edge is moved. The fine mesh may end
/// right there, and by rounding the ray would miss it.
const INWARD: f64 = 1e-3;
/// Texels looked at, for each texel of the map: UVs that go around the map more often are no chart of it.
const MAX_COVER: usize = 256;
/// Nothing is there.
const NONE: u32 = u32::MAX;

/// The place that a texel shows.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Texel {
    /// Index in the surface.
    pub triangle: u32,
    /// Barycentric weights of the triangle's corners, 1 together, none below 0.
    pub weights: Vec3,
}

/// The triangle of each texel.
#[derive(Clone, Debug)]
pub struct Unwrap {
    size: (usize, usize),
    owners: Vec<u32>,
    /// Texels whose centre lies in several triangles.
    pub overlapping: usize,
    /// Triangles without area in the UVs.
    pub flat: usize,
    /// UV area of all the others, in units of the whole map.
    pub uv_area: f64,
}

/// A triangle in texels: x right, y down.
struct Chart {
    corners: [DVec2; 3],
    /// Twice its area; below 0 where it is mirrored.
    area: f64,
}

impl Unwrap {
    /// Draws all triangles.
    ///
    /// # Errors
    /// No triangle has an area in the UVs, or they cover the map far too often.
    pub fn new(surface: &Surface, size: (usize, usize)) -> Result<Self, String> {
        let texels = size.0 * size.1;
        let (mut overlapping, mut flat, mut area) = (0, 0, 0.0);
        let mut owners = vec![NONE; texels];
        // How far from the centre; 0: within. Below 0: within several.
        let mut distance = vec![f32::INFINITY; texels];
        let too_often =
            || format!("the UVs cover the map more than {MAX_COVER} times: expected UVs that unfold the mesh");
        let mut budget = MAX_COVER * texels + 1024 * surface.triangles.len();
        for triangle in 0..surface.triangles.len() as u32 {
            let Some(chart) = Chart::new(surface, triangle, size) else {
                flat += 1;
                continue;
            };
            area += chart.area.abs() * 0.5;
            for (y, columns) in chart.rows() {
                let count =
                    usize::try_from(columns.end().saturating_sub(*columns.start())).map_or(0, |count| count + 1);
                budget = budget.checked_sub(count + 1).ok_or_else(too_often)?;
                for x in columns {
                    let nearness = chart.distance(centre(x, y)) as f32;
                    let index = wrapped(y, size.1) * size.0 + wrapped(x, size.0);
                    let known = &mut distance[index];
                    if nearness == 0.0 && *known <= 0.0 {
                        overlapping += usize::from(*known == 0.0);
                        *known = -1.0;
                    } else if nearness < *known && f64::from(nearness) <= NEAR {
                        *known = nearness;
                        owners[index] = triangle;
                    }
                }
            }
        }
        if flat == surface.triangles.len() {
            return Err("no triangle has an area in the UVs: expected UVs that unfold the mesh".into());
        }
        Ok(Self { size, owners, overlapping, flat, uv_area: area / texels as f64 })
    }

    /// Place that the texel at (x, y) shows.
    pub fn texel(&self, surface: &Surface, x: usize, y: usize) -> Option<Texel> {
        let triangle = Some(self.owners[y * self.size.0 + x]).filter(|&owner| owner != NONE)?;
        let chart = Chart::new(surface, triangle, self.size)?;
        let nearest = chart.copies_of(centre(x as i64, y as i64), self.size).min_by(|a, b| {
            let distance = |&at: &DVec2| chart.at(chart.weights(at)).distance_squared(at);
            distance(a).total_cmp(&distance(b))
        })?;
        let mut weights = chart.weights(nearest);
        if chart.at(weights).distance(nearest) > 1e-6 {
            weights = weights * (1.0 - INWARD) + INWARD / 3.0;
        }
        Some(Texel { triangle, weights: weights.as_vec3() })
    }
}

fn centre(x: i64, y: i64) -> DVec2 {
    DVec2::new(x as f64, y as f64) + 0.5
}

fn wrapped(at: i64, size: usize) -> usize {
    at.rem_euclid(size as i64) as usize
}

impl Chart {
    /// `None` without an area.
    fn new(surface: &Surface, triangle: u32, size: (usize, usize)) -> Option<Self> {
        let size = DVec2::new(size.0 as f64, size.1 as f64);
        let corners = surface.triangles[triangle as usize].map(|vertex| surface.uvs[vertex as usize].as_dvec2() * size);
        let area = (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
        (area != 0.0 && area.is_finite()).then_some(Self { corners, area })
    }

    fn bounds(&self) -> (DVec2, DVec2) {
        let [a, b, c] = self.corners;
        (a.min(b).min(c), a.max(b).max(c))
    }

    /// Rows of texels, and the columns in them, that may be near.
    fn rows(&self) -> impl Iterator<Item = (i64, RangeInclusive<i64>)> {
        let (low, high) = self.bounds();
        let texels = |low: f64, high: f64| (low - 0.5 - NEAR).ceil() as i64..=(high - 0.5 + NEAR).floor() as i64;
        texels(low.y, high.y).map(move |y| {
            let middle = y as f64 + 0.5;
            let (left, right) = self.extent(middle - NEAR, middle + NEAR);
            (y, texels(left, right))
        })
    }

    /// From where to where along x it lies within a strip of y.
    fn extent(&self, top: f64, bottom: f64) -> (f64, f64) {
        let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
        for (from, to) in self.edges() {
            let (from, to) = if from.y <= to.y { (from, to) } else { (to, from) };
            if to.y < top || from.y > bottom {
                continue;
            }
            let at = |y: f64| {
                let y = y.clamp(from.y, to.y);
                if to.y == from.y { from.x } else { from.x + (to.x - from.x) * ((y - from.y) / (to.y - from.y)) }
            };
            let flat_end = if to.y == from.y { to.x } else { at(bottom) };
            for x in [at(top), at(bottom), flat_end] {
                (left, right) = (left.min(x), right.max(x));
            }
        }
        (left, right)
    }

    fn edges(&self) -> [(DVec2, DVec2); 3] {
        let [a, b, c] = self.corners;
        [(a, b), (b, c), (c, a)]
    }

    /// From a point; exactly 0 within. Points on an edge that two triangles share are within one of them.
    fn distance(&self, at: DVec2) -> f64 {
        let within = |&(from, to): &(DVec2, DVec2)| {
            let (from, to) = if self.area > 0.0 { (from, to) } else { (to, from) };
            // The same number for both triangles, but for the sign: from the same end.
            let swapped = (from.y, from.x) > (to.y, to.x);
            let (near, far) = if swapped { (to, from) } else { (from, to) };
            let side = (far - near).perp_dot(at - near);
            if side == 0.0 { swapped } else { (side < 0.0) == swapped }
        };
        if self.edges().iter().all(within) {
            return 0.0;
        }
        // A centre on an edge that belongs to the neighbour, or to none.
        self.at(self.weights(at)).distance(at).max(f64::from(f32::MIN_POSITIVE))
    }

    fn at(&self, weights: DVec3) -> DVec2 {
        self.corners[0] * weights.x + self.corners[1] * weights.y + self.corners[2] * weights.z
    }

    /// Barycentric weights of the triangle's point that is nearest to a place.
    fn weights(&self, at: DVec2) -> DVec3 {
        let [a, b, c] = self.corners;
        let part = |from: DVec2, to: DVec2| (to - from).perp_dot(at - from) / self.area;
        let inside = DVec3::new(part(b, c), part(c, a), part(a, b));
        if inside.min_element() >= 0.0 {
            return inside / inside.element_sum();
        }
        let on_edge = |i: usize| {
            let (from, to) = self.edges()[i];
            let along = to - from;
            let length = along.length_squared();
            let share = if length > 0.0 { ((at - from).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
            let mut weights = [0.0; 3];
            (weights[i], weights[(i + 1) % 3]) = (1.0 - share, share);
            DVec3::from_array(weights)
        };
        let distance = |weights: &DVec3| self.at(*weights).distance_squared(at);
        let [first, second, third] = [on_edge(0), on_edge(1), on_edge(2)];
        let nearer = |a: DVec3, b: DVec3| if distance(&b) < distance(&a) { b } else { a };
        nearer(nearer(first, second), third)
    }

    /// Copies of a texel's centre, as the map repeats, that are near the triangle.
    fn copies_of(&self, centre: DVec2, size: (usize, usize)) -> impl Iterator<Item = DVec2> {
        let size = DVec2::new(size.0 as f64, size.1 as f64);
        let (low, high) = self.bounds();
        let first = ((low - NEAR - centre) / size).ceil();
        let last = ((high + NEAR - centre) / size).floor();
        let range = |first: f64, last: f64| first as i64..=last as i64;
        range(first.y, last.y).flat_map(move |row| {
            range(first.x, last.x).map(move |column| centre + DVec2::new(column as f64, row as f64) * size)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::Role;
    use super::*;
    use glam::{Affine3A, UVec2, Vec2};
    use proptest::prelude::*;
    use systems::assets::{Mesh, shapes};

    fn surface(mesh: &Mesh) -> Surface {
        Surface::of_mesh(mesh, &Affine3A::IDENTITY, Role::Low { uv_set: 0 }).expect("UVs")
    }

    fn sheet(uvs: impl Fn(Vec2) -> Vec2, segments: u32) -> Surface {
        let mut mesh = shapes::plane(Vec2::ONE, UVec2::splat(segments));
        mesh.uvs[0].iter_mut().for_each(|uv| *uv = uvs(*uv));
        surface(&mesh)
    }

    #[test]
    fn a_full_sheet_covers_every_texel_once_and_in_its_place() {
        // Segments of which some pass through the centres of texels, and some do not.
        for segments in [1, 3, 8, 16, 32] {
            let plane = sheet(|uv| uv, segments);
            let unwrap = Unwrap::new(&plane, (16, 8)).expect("UVs");
            assert_eq!((unwrap.overlapping, unwrap.flat), (0, 0), "{segments}");
            assert!((unwrap.uv_area - 1.0).abs() < 1e-9);
            for (x, y) in (0..8).flat_map(|y| (0..16).map(move |x| (x, y))) {
                let texel = unwrap.texel(&plane, x, y).expect("covered");
                let corners = plane.triangles[texel.triangle as usize].map(|v| plane.uvs[v as usize]);
                let at = corners[0] * texel.weights.x + corners[1] * texel.weights.y + corners[2] * texel.weights.z;
                let wanted = Vec2::new((x as f32 + 0.5) / 16.0, (y as f32 + 0.5) / 8.0);
                assert!(at.distance(wanted) < 1e-6, "{at} instead of {wanted}");
            }
        }
    }

    #[test]
    fn a_quarter_covers_its_texels_and_those_it_touches() {
        let covered = |uvs: fn(Vec2) -> Vec2| {
            let plane = sheet(uvs, 2);
            let unwrap = Unwrap::new(&plane, (8, 8)).expect("UVs");
            let all = (0..64).filter(|i| unwrap.texel(&plane, i % 8, i / 8).is_some());
            (all.collect::<Vec<_>>(), unwrap.overlapping)
        };
        let (texels, overlapping) = covered(|uv| uv * 0.5);
        assert_eq!(texels, (0..4).flat_map(|y| (0..4).map(move |x| y * 8 + x)).collect::<Vec<_>>());
        assert_eq!(overlapping, 0);
        // Beyond 1 it goes around.
        assert_eq!(covered(|uv| uv * 0.5 + 1.0), (texels.clone(), 0));
        // A quarter of a texel larger: the fifth column and row are touched, their centres are not within.
        assert_eq!(covered(|uv| uv * (4.25 / 8.0)).0.len(), 25);
        // Folded at the middle, half of it lies on the other half.
        let (folded, overlapping) = covered(|uv| Vec2::new((uv.x - 0.5).abs(), uv.y * 0.5));
        assert_eq!((folded, overlapping), (texels, 16));
    }

    #[test]
    fn slivers_between_centres_are_kept() {
        let thin = sheet(|uv| Vec2::new(0.5 + uv.x * 0.01, uv.y), 1);
        let unwrap = Unwrap::new(&thin, (8, 8)).expect("UVs");
        assert!((0..8).all(|y| unwrap.texel(&thin, 4, y).is_some()));
    }

    #[test]
    fn useless_uvs_are_refused() {
        let refused = |uvs: fn(Vec2) -> Vec2| Unwrap::new(&sheet(uvs, 2), (64, 64)).map(drop).expect_err("useless");
        assert!(refused(|_| Vec2::splat(0.3)).contains("no triangle has an area"));
        assert!(refused(|uv| Vec2::new(uv.x, 0.5)).contains("no triangle has an area"));
        assert!(refused(|uv| uv * 1e6).contains("more than 256 times"));
        assert!(refused(|uv| uv * 1e30).contains("more than 256 times"));
        assert!(Unwrap::new(&sheet(|uv| uv * 3.0, 2), (64, 64)).is_ok_and(|unwrap| unwrap.overlapping == 64 * 64));
    }

    proptest! {
        #[test]
        fn the_nearest_point_is_nearer_than_any_other(
            corners in prop::array::uniform3([-9.0..9.0f64, -9.0..9.0]), at in [-9.0..9.0f64, -9.0..9.0],
        ) {
            let corners = corners.map(DVec2::from_array);
            let chart = Chart { corners, area: (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]) };
            prop_assume!(chart.area.abs() > 0.1);
            let at = DVec2::from_array(at);
            let weights = chart.weights(at);
            prop_assert!(weights.min_element() >= 0.0 && (weights.element_sum() - 1.0).abs() < 1e-9);
            for (i, j) in (0..=16).flat_map(|i| (0..=16 - i).map(move |j| (f64::from(i) / 16.0, f64::from(j) / 16.0))) {
                let elsewhere = chart.at(DVec3::new(i, j, 1.0 - i - j));
                prop_assert!(chart.at(weights).distance(at) <= elsewhere.distance(at) + 1e-9);
            }
        }
    }
}
