//! Triangles as rays meet them: a compressed wide BVH (obvhs) that no ray slips through.
//!
//! The boxes are a little larger than the triangles, to make up for the rounding in obvhs's box test. A triangle is
//! tested by the volumes that the ray spans with its edges, which two triangles compute of a common edge from the same
//! numbers in the same way (Plücker coordinates, as Embree's robust mode does it).
//!
//! Inside, lengths are multiplied by a power of two that brings the mesh to [`INNER_SIZE`]: obvhs leaves out what is
//! nearer than 0.0001 to the origin of a ray, whatever the unit. Rays are given in these inner units.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::ploc::PlocBuilder;
use obvhs::ray::{Ray, RayHit};
use obvhs::{Boundable, BvhBuildParams};

/// The largest coordinate in inner units is above half of this, and at most this.
pub const INNER_SIZE: f32 = 1024.0;
/// How much larger boxes are than what is in them, as a share of the largest coordinate.
const PADDING: f32 = 1.0 / (1 << 16) as f32;
/// How far outside a triangle, as a share of its size, a ray still meets it.
const EDGE_SLACK: f32 = 1.0 / (1 << 22) as f32;
/// obvhs's traversal stack has 32 places, and goes wrong silently beyond.
const MAX_DEPTH: usize = 30;

/// So many triangles are tested without the BVH, which takes longer.
const FEW: usize = 4;

/// Why there is no tree over some triangles.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Unfit {
    /// There are none, or all are at the origin.
    Empty,
    /// Their largest coordinate is beyond what floats can be scaled by.
    Size(f32),
    /// They are distributed too unevenly: the tree would be too deep.
    Uneven,
}

/// Triangles in a BVH.
pub struct TriangleTree {
    bvh: CwBvh,
    /// In the order of the BVH's leaves.
    triangles: Vec<Triangle>,
    inner_from_metres: f32,
}

/// In inner units.
struct Triangle {
    corners: [Vec3A; 3],
    longest_edge: f32,
}

/// A box while a BVH is built.
pub struct Padded(pub Aabb);

impl Boundable for Padded {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    /// Along the ray, in units of its direction.
    pub t: f32,
    /// The ray along the triangle's normal: below 0, it comes from the front.
    pub along: f32,
    /// Volumes of the ray with the edges opposite the corners.
    volumes: Vec3A,
}

impl Met {
    /// Of the triangle's corners, 1 together.
    pub fn weights(&self) -> Vec3 {
        let weights = Vec3::from(self.volumes / (self.volumes.x + self.volumes.y + self.volumes.z));
        // Within the slack a weight may lie a little below 0.
        weights.max(Vec3::ZERO) / weights.max(Vec3::ZERO).element_sum()
    }
}

impl TriangleTree {
    /// Builds one. `corners`: of each triangle, metres.
    ///
    /// # Errors
    /// [`Unfit`].
    pub fn new(corners: impl ExactSizeIterator<Item = [Vec3; 3]> + Clone) -> Result<Self, Unfit> {
        let coordinates = corners.clone().flatten().map(|corner| corner.abs().max_element());
        let largest = coordinates.fold(0.0f32, f32::max);
        if corners.len() == 0 || largest == 0.0 {
            return Err(Unfit::Empty);
        }
        let inner_from_metres = (INNER_SIZE / largest).log2().floor().exp2();
        if !(inner_from_metres > 1e-30 && inner_from_metres < 1e30) {
            return Err(Unfit::Size(largest));
        }
        let padding = Vec3A::splat(PADDING * INNER_SIZE);
        let inner = corners.map(|corners| corners.map(|corner| Vec3A::from(corner) * inner_from_metres));
        let inner: Vec<[Vec3A; 3]> = inner.collect();
        let boxed = |&[a, b, c]: &[Vec3A; 3]| Padded(Aabb::new(a.min(b).min(c) - padding, a.max(b).max(c) + padding));
        let bvh = build(&inner.iter().map(boxed).collect::<Vec<_>>(), BvhBuildParams::medium_build());
        let bvh = bvh.ok_or(Unfit::Uneven)?;
        let triangles = bvh.primitive_indices.iter().map(|&triangle| Triangle::new(inner[triangle as usize]));
        Ok(Self { triangles: triangles.collect(), bvh, inner_from_metres })
    }

    /// Times metres: inner units. A power of two.
    pub fn inner_from_metres(&self) -> f32 {
        self.inner_from_metres
    }

    /// The nearest triangle that a ray meets, of those that `accept` takes. `beyond`: how far beside a triangle a ray
    /// still meets it, inner units; no more than the boxes' room is of use.
    #[inline]
    pub fn nearest(&self, ray: Ray, beyond: f32, mut accept: impl FnMut(u32, &Met) -> bool) -> Option<(u32, Met)> {
        let mut nearest = None;
        let mut meet = |ray: &Ray, place: usize| {
            let Some(met) = self.triangles[place].intersect(ray, beyond) else { return f32::INFINITY };
            let triangle = self.bvh.primitive_indices[place];
            if met.t >= ray.tmax || !accept(triangle, &met) {
                return f32::INFINITY;
            }
            nearest = Some((triangle, met));
            met.t
        };
        if self.triangles.len() > FEW {
            self.bvh.ray_traverse(ray, &mut RayHit::none(), meet);
        } else {
            let mut ray = ray;
            (0..self.triangles.len()).for_each(|place| ray.tmax = ray.tmax.min(meet(&ray, place)));
        }
        nearest
    }

    /// Whether a ray meets anything, from either side.
    pub fn is_hit(&self, ray: Ray) -> bool {
        let meets =
            |ray: &Ray, place: usize| self.triangles[place].intersect(ray, 0.0).map_or(f32::INFINITY, |met| met.t);
        !self.bvh.ray_traverse_miss(ray, meets)
    }
}

/// As obvhs's `build_cwbvh`, but for the checks that panic in debug builds. `None`: too deep to traverse.
pub fn build(boxes: &[Padded], build: BvhBuildParams) -> Option<CwBvh> {
    let order = (0..boxes.len() as u32).collect();
    let mut bvh = PlocBuilder::with_capacity(boxes.len()).build(
        build.ploc_search_distance,
        boxes,
        order,
        build.sort_precision,
        build.search_depth_threshold,
    );
    ReinsertionOptimizer::default().run(&mut bvh, build.reinsertion_batch_ratio, None);
    let bvh = bvh2_to_cwbvh(&bvh, build.max_prims_per_leaf.clamp(1, 3), true, false);
    (depth(&bvh) <= MAX_DEPTH).then_some(bvh)
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

impl Triangle {
    fn new([a, b, c]: [Vec3A; 3]) -> Self {
        let longest_edge = (a - b).length().max((b - c).length()).max((c - a).length());
        Self { corners: [a, b, c], longest_edge }
    }

    #[inline(always)]
    fn intersect(&self, ray: &Ray, beyond: f32) -> Option<Met> {
        let [a, b, c] = self.corners.map(|corner| corner - ray.origin);
        let (ca, ab, bc) = (c - a, a - b, b - c);
        let volumes = Vec3A::new(
            bc.cross(b + c).dot(ray.direction),
            ca.cross(c + a).dot(ray.direction),
            ab.cross(a + b).dot(ray.direction),
        );
        // A ray at a distance from an edge spans twice its product with the edge's length; directions are shorter than 2√3.
        let slack = EDGE_SLACK * (volumes.x + volumes.y + volumes.z).abs() + 7.0 * beyond * self.longest_edge;
        if volumes.min_element() < -slack && volumes.max_element() > slack {
            return None;
        }
        let normal = ca.cross(ab);
        let along = normal.dot(ray.direction);
        let t = normal.dot(a) / along;
        // Not a number where the ray lies in the triangle's plane.
        (t >= ray.tmin && t <= ray.tmax).then_some(Met { t, along, volumes })
    }
}
