//! The fine mesh as rays meet it: a tree over its triangles that no ray slips through, or a baked map would have
//! pinholes.

use super::Surface;
use crate::tools::maps::MapError;
use glam::{Vec3, Vec3A};
use systems::space::box_tree::Open;
use systems::space::triangle_tree::{INNER_SIZE, TreeRay, TriangleTree, Unfit};

/// Side of triangles that a ray meets.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Sides {
    /// Side that faces against the ray; both sides of two-sided triangles.
    Front,
    /// Side that faces along the ray; both sides of two-sided triangles.
    Back,
}

/// Hit of a ray on the mesh.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hit {
    /// Index in the surface.
    pub triangle: u32,
    /// Barycentric weights of the triangle's corners, 1 together.
    pub weights: Vec3,
    /// From the ray's origin, metres.
    pub distance: f32,
}

/// A surface that rays are cast at.
pub struct Target<'a> {
    /// Source of the tree.
    pub surface: &'a Surface,
    tree: TriangleTree,
}

impl<'a> Target<'a> {
    /// Builds the tree.
    ///
    /// # Errors
    /// There is nothing to meet, or it is too degenerate.
    pub fn new(surface: &'a Surface) -> Result<Self, MapError> {
        let corners = |triangle: &[u32; 3]| triangle.map(|vertex| surface.positions[vertex as usize]);
        let tree = TriangleTree::new(surface.triangles.iter().map(corners)).map_err(|unfit| {
            let told = match unfit {
                Unfit::Empty => "all triangles are at one point: expected a mesh with a surface".to_owned(),
                Unfit::Size(largest) => format!("coordinates up to {largest} m: too large or too small to bake"),
            };
            MapError::refused(&surface.source, told)
        })?;
        Ok(Self { surface, tree })
    }

    /// The first triangle that a ray meets up to a distance. `direction` is unit.
    pub fn first_hit(&self, origin: Vec3, direction: Vec3, distance: f32, sides: Sides) -> Option<Hit> {
        let against = if sides == Sides::Front { -1.0 } else { 1.0 };
        let (ray, far) = self.ray(origin, direction, distance);
        let (triangle, met) = self.tree.nearest(&ray, far, &mut Open::default(), |triangle, met| {
            let wrong_side = met.along * against < 0.0;
            !wrong_side || self.surface.is_two_sided(triangle)
        })?;
        Some(Hit { triangle, weights: met.weights(), distance: met.t / self.tree.inner_from_metres() })
    }

    /// Tells if a ray meets anything, from either side, up to a distance. `direction` is unit.
    pub fn is_hit(&self, origin: Vec3, direction: Vec3, distance: f32) -> bool {
        let (ray, far) = self.ray(origin, direction, distance);
        self.tree.is_hit(&ray, far)
    }

    /// Metres off a surface at which a ray must start to leave it: some ten times the rounding of coordinates.
    pub fn step_off(&self) -> f32 {
        INNER_SIZE / (1 << 17) as f32 / self.tree.inner_from_metres()
    }

    /// With its end.
    fn ray(&self, origin: Vec3, direction: Vec3, distance: f32) -> (TreeRay, f32) {
        let scale = self.tree.inner_from_metres();
        (TreeRay::new(Vec3A::from(origin) * scale, direction.into(), 0.0), distance * scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::UVec2;
    use proptest::prelude::*;
    use systems::assets::shapes;

    fn soup(corners: Vec<[Vec3; 3]>) -> Surface {
        Surface {
            triangles: (0..corners.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
            positions: corners.into_iter().flatten().collect(),
            ..Surface::default()
        }
    }

    /// Möller and Trumbore's test in double precision. `None` near an edge, where either answer is right.
    fn brute_force(surface: &Surface, origin: Vec3, direction: Vec3) -> Option<Option<f64>> {
        let (origin, direction) = (origin.as_dvec3(), direction.as_dvec3());
        let mut nearest: Option<f64> = None;
        for triangle in 0..surface.triangles.len() as u32 {
            let [a, b, c] = surface.corners(triangle).map(Vec3::as_dvec3);
            let (ab, ac) = (b - a, c - a);
            let across = direction.cross(ac);
            let determinant = ab.dot(across);
            let from = origin - a;
            let (u, v) = (from.dot(across) / determinant, direction.dot(from.cross(ab)) / determinant);
            let t = ac.dot(from.cross(ab)) / determinant;
            let inside = u.min(v).min(1.0 - u - v);
            if inside.abs() < 1e-3 || determinant.abs() < 1e-3 || t.abs() < 1e-3 {
                return None;
            }
            if inside > 0.0 && t > 0.0 {
                nearest = Some(nearest.map_or(t, |nearest| nearest.min(t)));
            }
        }
        Some(nearest)
    }

    fn point() -> impl Strategy<Value = Vec3> {
        [-1.0f32..1.0, -1.0..1.0, -1.0..1.0].prop_map(Vec3::from_array)
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]
        #[test]
        fn the_bvh_meets_what_every_triangle_tested_one_by_one_meets(
            corners in prop::collection::vec([point(), point(), point()], 1..40),
            rays in prop::collection::vec((point(), point()), 30),
            size in prop::sample::select(vec![1e-3f32, 1.0, 1e4]),
        ) {
            let unit = soup(corners);
            let scaled = Surface { positions: unit.positions.iter().map(|p| p * size).collect(), ..unit.clone() };
            let target = Target::new(&scaled).expect("a surface");
            for (origin, direction) in rays {
                let Some(direction) = direction.try_normalize() else { continue };
                let Some(expected) = brute_force(&unit, origin, direction) else { continue };
                let near = |sides| target.first_hit(origin * size, direction, f32::INFINITY, sides);
                let hits = [near(Sides::Front), near(Sides::Back)].into_iter().flatten();
                let got = hits.map(|hit| hit.distance / size).reduce(f32::min);
                prop_assert_eq!(got.is_some(), expected.is_some());
                prop_assert_eq!(target.is_hit(origin * size, direction, f32::INFINITY), expected.is_some());
                if let (Some(got), Some(expected)) = (got, expected) {
                    prop_assert!((f64::from(got) - expected).abs() < 1e-3, "{} instead of {}", got, expected);
                }
            }
        }
    }

    #[test]
    fn nothing_slips_through_edges_and_vertices() {
        let plane = shapes::plane(glam::Vec2::splat(2.0), UVec2::splat(7));
        let place = glam::Affine3A::from_rotation_x(0.3);
        let surface = Surface::of_mesh(&plane, &place, super::super::Role::High).expect("a plane");
        let target = Target::new(&surface).expect("a surface");
        let up = place.transform_vector3(Vec3::Y);
        // Along all edges and diagonals, and at the vertices, but for the border.
        let inner = (-48..=48).map(|i| i as f32 / 49.0);
        for x in inner.clone() {
            for z in inner.clone() {
                let at = place.transform_point3(Vec3::new(x, 0.0, z));
                for tilt in [Vec3::ZERO, Vec3::X * 0.3, Vec3::Z * -0.7] {
                    let direction = (-up + tilt).normalize();
                    assert!(target.is_hit(at - direction * 3.0, direction, 10.0), "({x}, {z}) {tilt}");
                    let hit = target.first_hit(at - direction * 3.0, direction, 10.0, Sides::Front).expect("a hit");
                    assert!((hit.distance - 3.0).abs() < 1e-5 && hit.weights.min_element() >= 0.0);
                }
            }
        }
    }

    #[test]
    fn sides_and_distances_count() {
        let surface =
            Surface::of_mesh(&shapes::cube(Vec3::splat(2.0)), &glam::Affine3A::IDENTITY, super::super::Role::High)
                .expect("a cube");
        let target = Target::new(&surface).expect("a surface");
        let cast = |distance, sides| target.first_hit(Vec3::new(0.2, 5.0, 0.1), Vec3::NEG_Y, distance, sides);
        assert_eq!(cast(10.0, Sides::Front).map(|hit| hit.distance), Some(4.0));
        assert_eq!(cast(10.0, Sides::Back).map(|hit| hit.distance), Some(6.0));
        assert_eq!(cast(3.9, Sides::Front), None);
        assert!(target.is_hit(Vec3::ZERO, Vec3::Y, 1.1) && !target.is_hit(Vec3::ZERO, Vec3::Y, 0.9));
    }

    #[test]
    fn rays_stop_at_what_is_in_the_way_and_before_what_is_behind_the_light() {
        let plane = shapes::plane(glam::Vec2::splat(2.0), UVec2::splat(4));
        let surface = Surface::of_mesh(&plane, &glam::Affine3A::IDENTITY, super::super::Role::High).expect("a plane");
        let target = Target::new(&surface).expect("a surface");
        let below = Vec3::new(0.1, -1.0, 0.2);
        assert!(target.is_hit(below, Vec3::Y, f32::INFINITY));
        assert!(target.is_hit(below, Vec3::Y, 1.5));
        assert!(!target.is_hit(below, Vec3::Y, 0.5), "the light is nearer");
        assert!(!target.is_hit(below, Vec3::NEG_Y, f32::INFINITY));
        assert!(!target.is_hit(below + Vec3::X * 2.0, Vec3::Y, f32::INFINITY));
    }

    #[test]
    fn what_has_no_extent_is_refused() {
        let point = soup(vec![[Vec3::ZERO; 3]]);
        assert!(Target::new(&point).is_err());
    }

    /// A chain of nodes.
    #[test]
    fn many_times_the_same_triangle_is_a_surface() {
        for count in [50, 5000] {
            let stacked = soup(vec![[Vec3::ZERO, Vec3::X, Vec3::Y]; count]);
            let target = Target::new(&stacked).expect("a surface");
            assert!(target.is_hit(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z, 2.0), "{count}");
            assert!(!target.is_hit(Vec3::new(0.7, 0.7, 1.0), Vec3::NEG_Z, 2.0), "{count}");
        }
    }
}
