//! The fine mesh as rays meet it: a compressed wide BVH (obvhs) over its triangles.
//!
//! No ray may slip between two triangles that share an edge, or a baked map would have pinholes. The boxes are a little
//! larger than the triangles, to make up for the rounding in obvhs's box test; and a triangle is tested by the volumes
//! that the ray spans with its edges, which two triangles compute of a common edge from the same numbers in the same
//! way (Plücker coordinates, as Embree's robust mode does it).

use super::Surface;
use crate::maps::MapError;
use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::ploc::PlocBuilder;
use obvhs::ray::{Ray, RayHit};
use obvhs::{Boundable, BvhBuildParams};

/// Inside, lengths are multiplied by a power of two that brings the mesh to this size: obvhs leaves out what is nearer
/// than 0.0001 to the origin of a ray, whatever the unit.
const INNER_SIZE: f32 = 1024.0;
/// How much larger boxes are than what is in them, as a share of the largest coordinate.
const PADDING: f32 = 1.0 / (1 << 20) as f32;
/// How far outside a triangle, as a share of its size, a ray still meets it.
const EDGE_SLACK: f32 = 1.0 / (1 << 22) as f32;
/// obvhs's traversal stack has 32 places, and goes wrong silently beyond.
const MAX_DEPTH: usize = 30;

/// Which side of triangles a ray meets.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Sides {
    /// That which faces against the ray; both sides of two-sided triangles.
    Front,
    /// That which faces along the ray; both sides of two-sided triangles.
    Back,
}

/// Where a ray meets the mesh.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hit {
    /// Index in the surface.
    pub triangle: u32,
    /// Of the triangle's corners, 1 together.
    pub weights: Vec3,
    /// From the ray's origin, metres.
    pub distance: f32,
}

/// A surface that rays are cast at.
pub struct Target<'a> {
    /// What it was built from.
    pub surface: &'a Surface,
    bvh: CwBvh,
    /// Inner units, in the order of the BVH's leaves.
    corners: Vec<[Vec3A; 3]>,
    inner_from_metres: f32,
}

/// A triangle's box while the BVH is built.
struct Padded {
    aabb: Aabb,
}

impl Boundable for Padded {
    fn aabb(&self) -> Aabb {
        self.aabb
    }
}

impl<'a> Target<'a> {
    /// Builds the BVH.
    ///
    /// # Errors
    /// There is nothing to meet, or it is too degenerate.
    pub fn new(surface: &'a Surface) -> Result<Self, MapError> {
        let path = &surface.source;
        let largest = surface.positions.iter().fold(0.0f32, |largest, p| largest.max(p.abs().max_element()));
        if surface.triangles.is_empty() || largest == 0.0 {
            return Err(MapError::refused(path, "all triangles are at one point: expected a mesh with a surface"));
        }
        let inner_from_metres = (INNER_SIZE / largest).log2().floor().exp2();
        if !(inner_from_metres > 1e-30 && inner_from_metres < 1e30) {
            return Err(MapError::refused(
                path,
                format!("coordinates up to {largest} m: too large or too small to bake"),
            ));
        }
        let inner = |triangle: &[u32; 3]| {
            triangle.map(|vertex| Vec3A::from(surface.positions[vertex as usize]) * inner_from_metres)
        };
        let padding = Vec3A::splat(PADDING * INNER_SIZE);
        let boxes: Vec<Padded> = surface
            .triangles
            .iter()
            .map(|triangle| {
                let [a, b, c] = inner(triangle);
                Padded { aabb: Aabb::new(a.min(b).min(c) - padding, a.max(b).max(c) + padding) }
            })
            .collect();
        let bvh = build(&boxes);
        if depth(&bvh) > MAX_DEPTH {
            return Err(MapError::refused(path, "the triangles are distributed too unevenly for a BVH"));
        }
        let triangles = bvh.primitive_indices.iter();
        let corners = triangles.map(|&triangle| inner(&surface.triangles[triangle as usize])).collect();
        Ok(Self { surface, bvh, corners, inner_from_metres })
    }

    /// The first triangle that a ray meets up to a distance. `direction` is unit.
    pub fn first_hit(&self, origin: Vec3, direction: Vec3, distance: f32, sides: Sides) -> Option<Hit> {
        let ray = self.ray(origin, direction, distance);
        let mut nearest = RayHit::none();
        let against = if sides == Sides::Front { -1.0 } else { 1.0 };
        let meets = |ray: &Ray, place: usize| {
            let Some(met) = intersect(&self.corners[place], ray) else { return f32::INFINITY };
            let wrong_side = met.along * against < 0.0;
            if wrong_side && !self.surface.is_two_sided(self.bvh.primitive_indices[place]) {
                return f32::INFINITY;
            }
            met.t
        };
        if !self.bvh.ray_traverse(ray, &mut nearest, meets) {
            return None;
        }
        let place = nearest.primitive_id as usize;
        let met = intersect(&self.corners[place], &Ray { tmax: f32::INFINITY, ..ray })?;
        let distance = met.t / self.inner_from_metres;
        Some(Hit { triangle: self.bvh.primitive_indices[place], weights: met.weights(), distance })
    }

    /// Whether a ray meets anything, from either side, up to a distance. `direction` is unit.
    pub fn is_hit(&self, origin: Vec3, direction: Vec3, distance: f32) -> bool {
        let ray = self.ray(origin, direction, distance);
        let meets = |ray: &Ray, place: usize| intersect(&self.corners[place], ray).map_or(f32::INFINITY, |met| met.t);
        !self.bvh.ray_traverse_miss(ray, meets)
    }

    /// How far off a surface a ray must start to leave it, metres: some ten times the rounding of coordinates.
    pub fn step_off(&self) -> f32 {
        INNER_SIZE / (1 << 17) as f32 / self.inner_from_metres
    }

    fn ray(&self, origin: Vec3, direction: Vec3, distance: f32) -> Ray {
        let scale = self.inner_from_metres;
        // obvhs takes a direction of −0 for negative in one place and for positive in another, and meets nothing.
        let direction = Vec3A::from(direction) + 0.0;
        Ray::new(Vec3A::from(origin) * scale, direction, 0.0, (distance * scale).min(f32::MAX))
    }
}

/// As obvhs's `build_cwbvh`, but for the checks that panic in debug builds.
fn build(boxes: &[Padded]) -> CwBvh {
    let build = BvhBuildParams::medium_build();
    let order = (0..boxes.len() as u32).collect();
    let mut bvh = PlocBuilder::with_capacity(boxes.len()).build(
        build.ploc_search_distance,
        boxes,
        order,
        build.sort_precision,
        build.search_depth_threshold,
    );
    ReinsertionOptimizer::default().run(&mut bvh, build.reinsertion_batch_ratio, None);
    bvh2_to_cwbvh(&bvh, build.max_prims_per_leaf.clamp(1, 3), true, false)
}

/// Levels of nodes.
fn depth(bvh: &CwBvh) -> usize {
    let mut deepest = 0;
    let mut open = vec![(0usize, 1)];
    while let Some((index, depth)) = open.pop() {
        let Some(node) = bvh.nodes.get(index) else { continue };
        deepest = deepest.max(depth);
        let inner = (0..8).filter(|&child| !node.is_child_empty(child) && !node.is_leaf(child));
        open.extend(inner.map(|child| (node.child_node_index(child) as usize, depth + 1)));
    }
    deepest
}

/// Where a ray meets one triangle.
struct Met {
    t: f32,
    /// The ray along the triangle's normal: below 0, it comes from the front.
    along: f32,
    /// Volumes of the ray with the edges opposite the corners.
    volumes: Vec3A,
}

impl Met {
    fn weights(&self) -> Vec3 {
        let weights = Vec3::from(self.volumes / (self.volumes.x + self.volumes.y + self.volumes.z));
        // Within the slack a weight may lie a little below 0.
        weights.max(Vec3::ZERO) / weights.max(Vec3::ZERO).element_sum()
    }
}

#[inline(always)]
fn intersect(corners: &[Vec3A; 3], ray: &Ray) -> Option<Met> {
    let [a, b, c] = [corners[0] - ray.origin, corners[1] - ray.origin, corners[2] - ray.origin];
    let (ca, ab, bc) = (c - a, a - b, b - c);
    let volumes = Vec3A::new(
        bc.cross(b + c).dot(ray.direction),
        ca.cross(c + a).dot(ray.direction),
        ab.cross(a + b).dot(ray.direction),
    );
    let slack = EDGE_SLACK * (volumes.x + volumes.y + volumes.z).abs();
    if volumes.min_element() < -slack && volumes.max_element() > slack {
        return None;
    }
    let normal = ca.cross(ab);
    let along = normal.dot(ray.direction);
    let t = normal.dot(a) / along;
    // Not a number where the ray lies in the triangle's plane.
    (t >= ray.tmin && t <= ray.tmax).then_some(Met { t, along, volumes })
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
    fn what_has_no_extent_is_refused() {
        let point = soup(vec![[Vec3::ZERO; 3]]);
        assert!(Target::new(&point).is_err());
        // Many times the same triangle: a chain of nodes.
        for (count, is_sound) in [(50, true), (5000, false)] {
            let stacked = soup(vec![[Vec3::ZERO, Vec3::X, Vec3::Y]; count]);
            let target = Target::new(&stacked);
            assert_eq!(target.is_ok(), is_sound, "{count}");
            assert!(target.is_err() || target.is_ok_and(|t| t.is_hit(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z, 2.0)));
        }
    }
}
