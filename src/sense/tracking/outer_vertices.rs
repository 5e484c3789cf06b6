//! The vertices of a mesh that its convex hull may have: those that its outline needs, from wherever it is seen.
//!
//! A vertex within a tetrahedron of others is inside of the hull, and so are its projections. The tetrahedra are
//! between the middle and the triangles of an octahedron, split into smaller ones, whose corners are each the vertex
//! that is farthest that way (after Akl and Toussaint, "A fast convex hull algorithm", 1978, which has a quadrilateral
//! in the plane). What is left is more than the hull's own vertices, and few of those of a detailed mesh.

use glam::{DMat3, DVec3, Vec3};
use std::collections::{BTreeMap, BTreeSet};

/// Number of times that the triangles of an octahedron are split into four: 66 directions, 128 triangles.
const SPLITS: u32 = 2;

/// Share of a tetrahedron's height, nearer than which to its outer face vertices stay: a bound on how the sums below
/// round.
const MARGIN: f64 = 1e-9;

/// The places, each once, that the convex hull of all may have as a vertex.
pub(super) fn outer_vertices(positions: impl IntoIterator<Item = Vec3>) -> Vec<DVec3> {
    let mut seen = BTreeSet::new();
    let is_new = |place: &Vec3| seen.insert(place.to_array().map(f32::to_bits));
    let places: Vec<DVec3> = positions.into_iter().filter(is_new).map(Vec3::as_dvec3).collect();
    let sides: Vec<[DVec3; 3]> = octahedron().into_iter().flat_map(|side| split(side, SPLITS)).collect();
    if places.len() <= sides.len() {
        return places;
    }
    let mut known: BTreeMap<[u64; 3], DVec3> = BTreeMap::new();
    let mut corner = |direction: DVec3| {
        let key = direction.to_array().map(f64::to_bits);
        *known.entry(key).or_insert_with(|| farthest(&places, direction))
    };
    let corners: Vec<[DVec3; 3]> = sides.into_iter().map(|side| side.map(&mut corner)).collect();
    let middle = corners.iter().flatten().sum::<DVec3>() / (3 * corners.len()) as f64;
    let weights_of: Vec<DMat3> = corners
        .into_iter()
        .map(|corners| DMat3::from_cols(corners[0] - middle, corners[1] - middle, corners[2] - middle))
        .filter(|tetrahedron| {
            // A flat one holds nothing.
            let size = tetrahedron.col(0).length() * tetrahedron.col(1).length() * tetrahedron.col(2).length();
            tetrahedron.determinant().abs() > 1e-6 * size
        })
        .map(|tetrahedron| tetrahedron.inverse())
        .collect();
    let is_inside = |place: &DVec3| {
        weights_of.iter().any(|weights_of| {
            let weights = *weights_of * (*place - middle);
            weights.min_element() >= 0.0 && weights.element_sum() < 1.0 - MARGIN
        })
    };
    places.into_iter().filter(|place| !is_inside(place)).collect()
}

/// Some of the outermost places, at most 66.
pub(super) fn extremes(places: &[DVec3]) -> Vec<DVec3> {
    let sides = octahedron().into_iter().flat_map(|side| split(side, SPLITS));
    let directions: BTreeSet<[u64; 3]> = sides.flatten().map(|corner| corner.to_array().map(f64::to_bits)).collect();
    let farthest = directions.into_iter().map(|bits| farthest(places, DVec3::from(bits.map(f64::from_bits))));
    let mut found: Vec<DVec3> = farthest.collect();
    found.dedup();
    found
}

fn farthest(places: &[DVec3], direction: DVec3) -> DVec3 {
    let along = |place: &&DVec3| place.dot(direction);
    places.iter().max_by(|a, b| along(a).total_cmp(&along(b))).copied().unwrap_or_default()
}

/// Corners of its eight sides, on the unit sphere.
fn octahedron() -> [[DVec3; 3]; 8] {
    std::array::from_fn(|octant| {
        let sign = |axis: usize| if octant >> axis & 1 == 0 { 1.0 } else { -1.0 };
        [DVec3::X * sign(0), DVec3::Y * sign(1), DVec3::Z * sign(2)]
    })
}

/// A triangle on the unit sphere as four, so many times.
fn split([a, b, c]: [DVec3; 3], times: u32) -> Vec<[DVec3; 3]> {
    if times == 0 {
        return vec![[a, b, c]];
    }
    let [ab, bc, ca] = [a + b, b + c, c + a].map(DVec3::normalize);
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].into_iter().flat_map(|side| split(side, times - 1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use systems::assets::shapes;

    #[test]
    fn of_a_ball_its_surface_is_left() {
        let sphere = shapes::sphere(1.0, 32, 16).positions;
        let inside = sphere.iter().map(|place| *place * 0.7);
        let left = outer_vertices(sphere.iter().copied().chain(inside));
        assert!(left.iter().all(|place| place.length() > 0.99), "{left:?}");
        let all: BTreeSet<_> = sphere.iter().map(|place| place.to_array().map(f32::to_bits)).collect();
        assert_eq!(left.len(), all.len());
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        /// From each side, the farthest of all is as far as the farthest of what is left; of flat clouds, too.
        #[test]
        fn what_is_left_reaches_as_far_as_all(
            places in prop::collection::vec(prop::array::uniform3(-1.0_f32..1.0), 1..600),
            height in prop::sample::select(vec![0.0_f32, 1e-4, 1.0]),
            directions in prop::collection::vec(prop::array::uniform3(-1.0_f64..1.0), 20),
        ) {
            let places: Vec<Vec3> = places.into_iter().map(|[x, y, z]| Vec3::new(x, y * height, z)).collect();
            let left = outer_vertices(places.iter().copied());
            for direction in directions.into_iter().map(DVec3::from_array) {
                let reach = |places: &[DVec3]| places.iter().map(|place| place.dot(direction)).fold(f64::MIN, f64::max);
                let all: Vec<DVec3> = places.iter().map(|place| place.as_dvec3()).collect();
                prop_assert_eq!(reach(&left), reach(&all));
            }
        }
    }
}
