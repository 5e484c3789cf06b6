//! Outlines in pictures: convex hulls of projected places, their boxes, and how much of them lies within the picture.

use super::outer_vertices::extremes;
use glam::{DVec2, DVec3};

/// Pairs of vertices that are looked at.
const MOST_EDGES: usize = 250_000;

/// A convex polygon, its corners in order around it.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Outline(Vec<DVec2>);

impl Outline {
    /// The convex hull of some places (Andrew, "Another efficient algorithm for convex hulls in two dimensions", 1979).
    pub fn around(mut places: Vec<DVec2>) -> Self {
        places.retain(|place| place.is_finite());
        places.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
        places.dedup();
        let half = |places: &mut dyn Iterator<Item = DVec2>| {
            let mut chain: Vec<DVec2> = Vec::new();
            for place in places {
                while let [.., a, b] = chain[..]
                    && (b - a).perp_dot(place - b) <= 0.0
                {
                    chain.pop();
                }
                chain.push(place);
            }
            chain.pop();
            chain
        };
        let (mut lower, upper) = (half(&mut places.iter().copied()), half(&mut places.iter().rev().copied()));
        lower.extend(upper);
        if lower.is_empty() {
            lower = places;
        }
        Self(lower)
    }

    /// Left, top, right, bottom; `None` where there is no corner.
    pub fn bounds(&self) -> Option<[f64; 4]> {
        let (first, rest) = self.0.split_first()?;
        let (low, high) =
            rest.iter().fold((*first, *first), |(low, high), corner| (low.min(*corner), high.max(*corner)));
        Some([low.x, low.y, high.x, high.y])
    }

    /// (Shoelace formula.)
    pub fn area(&self) -> f64 {
        let next = self.0.iter().cycle().skip(1);
        self.0.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f64>().abs() / 2.0
    }

    /// Part of it within left, top, right, bottom (Sutherland and Hodgman, "Reentrant polygon clipping", 1974).
    pub fn within(&self, [left, top, right, bottom]: [f64; 4]) -> Self {
        // Of each side: its inward normal, and the offset that is 0 on it.
        let sides = [(DVec2::X, -left), (DVec2::Y, -top), (-DVec2::X, right), (-DVec2::Y, bottom)];
        sides.into_iter().fold(self.clone(), |outline, (normal, offset)| outline.cut(normal, offset))
    }

    fn cut(&self, normal: DVec2, offset: f64) -> Self {
        let inside = |corner: DVec2| corner.dot(normal) + offset;
        let mut corners = Vec::new();
        for (a, b) in self.0.iter().zip(self.0.iter().cycle().skip(1)) {
            let (at_a, at_b) = (inside(*a), inside(*b));
            if at_a >= 0.0 {
                corners.push(*a);
            }
            if (at_a > 0.0 && at_b < 0.0) || (at_a < 0.0 && at_b > 0.0) {
                corners.push(a.lerp(*b, at_a / (at_a - at_b)));
            }
        }
        Self(corners)
    }
}

/// The places of a convex solid's vertices that are at least `near` away along z, and where its edges meet that plane.
/// `vertices`: camera axes. Each edge is between two of them; where that is too many pairs, outermost ones stand for
/// all.
pub(super) fn before_plane(vertices: &[DVec3], near: f64) -> Vec<DVec3> {
    let (mut before, behind): (Vec<DVec3>, Vec<DVec3>) = vertices.iter().copied().partition(|vertex| vertex.z >= near);
    let (mut ahead, mut hidden) = (before.clone(), behind);
    if ahead.len() * hidden.len() > MOST_EDGES {
        (ahead, hidden) = (extremes(&ahead), extremes(&hidden));
    }
    for hidden in hidden {
        let cut = |seen: &DVec3| seen.lerp(hidden, (seen.z - near) / (seen.z - hidden.z)).with_z(near);
        before.extend(ahead.iter().map(cut));
    }
    before
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn square(size: f64) -> Outline {
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.5, 0.5), (0.5, 0.0)];
        Outline::around(corners.map(|(x, y)| DVec2::new(x, y) * size).to_vec())
    }

    #[test]
    fn a_square_half_out_of_the_picture() {
        let square = square(4.0);
        assert_eq!((square.0.len(), square.area(), square.bounds()), (4, 16.0, Some([0.0, 0.0, 4.0, 4.0])));
        let half = square.within([2.0, -9.0, 9.0, 9.0]);
        assert_eq!((half.area(), half.bounds()), (8.0, Some([2.0, 0.0, 4.0, 4.0])));
        let none = square.within([5.0, -9.0, 9.0, 9.0]);
        assert_eq!((none.area(), none.bounds()), (0.0, None));
        assert_eq!(square.within([1.0, 1.0, 2.0, 3.0]).area(), 2.0);
    }

    #[test]
    fn a_box_through_the_plane_of_the_eye_is_cut_there() {
        let corner = |x: f64, z: f64| DVec3::new(x, 0.0, z);
        let cut = before_plane(&[corner(0.0, 5.0), corner(2.0, 5.0), corner(0.0, -5.0), corner(2.0, -5.0)], 1.0);
        assert_eq!(cut.iter().map(|place| place.z).fold(f64::MAX, f64::min), 1.0);
        let (left, right) =
            cut.iter().fold((f64::MAX, f64::MIN), |(low, high), place| (low.min(place.x), high.max(place.x)));
        assert_eq!((left, right), (0.0, 2.0));
    }

    /// Tests a ball around the eye: its section is a disk of radius √(r² − near²), and outermost vertices reach nearly
    /// as far.
    #[test]
    fn a_solid_of_many_vertices_is_cut_where_its_outermost_ones_say() {
        let ball = systems::assets::shapes::sphere(5.0, 128, 64).positions;
        let vertices: Vec<DVec3> = ball.into_iter().map(glam::Vec3::as_dvec3).collect();
        let cut = before_plane(&vertices, 3.0);
        assert!(cut.len() < 2 * vertices.len(), "{} of {}", cut.len(), vertices.len());
        let reach = cut.iter().map(|place| place.truncate().length()).fold(0.0, f64::max);
        // Directions are 22 degrees apart at the most.
        assert!(reach <= 4.0 + 1e-6 && reach > 4.0 * 0.9, "{reach}");
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        /// All places are within the hull, whose corners are some of them; a line has none within.
        #[test]
        fn a_hull_is_around_all(places in prop::collection::vec((-9_i32..9, -9_i32..9), 1..40)) {
            let places: Vec<DVec2> = places.into_iter().map(|(x, y)| DVec2::new(x.into(), y.into())).collect();
            let hull = Outline::around(places.clone());
            prop_assert!(hull.0.iter().all(|corner| places.contains(corner)));
            // In integers, without rounding.
            for (a, b) in hull.0.iter().zip(hull.0.iter().cycle().skip(1)) {
                prop_assert!(places.iter().all(|place| (*b - *a).perp_dot(*place - *a) >= 0.0));
            }
        }
    }
}
