//! Triangles as rays meet them: a tree of boxes that no ray slips through.
//!
//! A triangle is tested by the volumes that the ray spans with its edges, which two triangles compute of a common edge
//! from the same numbers in the same way (Plücker coordinates, as Embree's robust mode does it). The boxes are a little
//! larger than the triangles, to make up for rounding.
//!
//! Inside, lengths are multiplied by a power of two that brings the mesh to [`INNER_SIZE`]. Rays are given in these
//! inner units.

use super::box_tree::{BoxRay, BoxTree, Open, Quality, by_axis};
use glam::{Vec3, Vec3A, Vec4};
use obvhs::aabb::Aabb;

/// The largest coordinate in inner units is above half of this, and at most this.
pub const INNER_SIZE: f32 = 1024.0;
/// Margin of boxes around what is in them, as a share of the largest coordinate.
const PADDING: f32 = 1.0 / (1 << 16) as f32;
/// Distance outside a triangle, as a share of its size, at which a ray still meets it.
const EDGE_SLACK: f32 = 1.0 / (1 << 22) as f32;
/// Triangles of a leaf, which are tested at once.
const GROUP: usize = 4;

/// Reasons why there is no tree over some triangles.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Unfit {
    /// There are none, or all are at the origin.
    Empty,
    /// Their largest coordinate is beyond what floats can be scaled by.
    Size(f32),
}

/// Triangles in a tree.
pub struct TriangleTree {
    tree: BoxTree,
    triangles: Vec<Triangles>,
    inner_from_metres: f32,
}

/// Those of a leaf, in inner units. No ray meets those that are not numbers.
struct Triangles {
    /// By corner and axis.
    corners: [[Vec4; 3]; 3],
    longest_edges: Vec4,
}

/// A ray in inner units.
pub struct TreeRay {
    boxes: BoxRay,
    origin: Vec3A,
    direction: Vec3A,
    /// Twice how far beside a triangle's edge the ray still meets it, times the direction's length.
    beside: f32,
}

impl TreeRay {
    /// `beside`: how far beside a triangle the ray still meets it.
    #[inline(always)]
    pub fn new(origin: Vec3A, direction: Vec3A, beside: f32) -> Self {
        Self {
            boxes: BoxRay::new(origin, direction, beside),
            origin,
            direction,
            // The length is at most the components together.
            beside: 2.0 * beside * direction.abs().element_sum(),
        }
    }
}

/// Hit of a ray on a triangle.
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
    /// Barycentric weights of the triangle's corners, 1 together.
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
        let boxed = |&[a, b, c]: &[Vec3A; 3]| Aabb::new(a.min(b).min(c) - padding, a.max(b).max(c) + padding);
        let tree = BoxTree::new(inner.iter().map(boxed), GROUP, Quality::Good);
        let leaves = tree.order().as_chunks::<GROUP>().0.iter();
        let of_leaf = |leaf: &[u32; GROUP]| leaf.map(|i| inner.get(i as usize).copied().unwrap_or([Vec3A::NAN; 3]));
        let triangles = leaves.map(|leaf| Triangles::new(of_leaf(leaf))).collect();
        Ok(Self { tree, triangles, inner_from_metres })
    }

    /// Times metres: inner units. A power of two.
    pub fn inner_from_metres(&self) -> f32 {
        self.inner_from_metres
    }

    /// The nearest triangle that a ray meets up to `far`, of those that `accept` takes; of equally near ones the first.
    /// `open`: room for its search, in which may be something already.
    #[inline(always)]
    pub fn nearest(
        &self,
        ray: &TreeRay,
        far: f32,
        open: &mut Open,
        mut accept: impl FnMut(u32, &Met) -> bool,
    ) -> Option<(u32, Met)> {
        let mut nearest: Option<(u32, Met)> = None;
        self.tree.traverse(&ray.boxes, far, open, |leaf, [near, mut far], _| {
            let all = self.triangles[leaf].meet(ray, near, far);
            for i in (0..GROUP).filter(|&i| all.t[i] < f32::INFINITY) {
                let (triangle, met) = (self.tree.order()[leaf * GROUP + i], all.met(i));
                let is_first = nearest.is_none_or(|(first, known)| (met.t, triangle) < (known.t, first));
                if is_first && accept(triangle, &met) {
                    nearest = Some((triangle, met));
                    far = met.t;
                }
            }
            far
        });
        nearest
    }

    /// Tells if a ray meets anything up to `far`, from either side.
    pub fn is_hit(&self, ray: &TreeRay, far: f32) -> bool {
        let mut is_hit = false;
        self.tree.traverse(&ray.boxes, far, &mut Open::default(), |leaf, [near, far], _| {
            is_hit |= self.triangles[leaf].meet(ray, near, far).t.iter().any(|t| *t < f32::INFINITY);
            // Nothing is nearer than that.
            if is_hit { f32::NEG_INFINITY } else { far }
        });
        is_hit
    }
}

impl Triangles {
    fn new(triangles: [[Vec3A; 3]; GROUP]) -> Self {
        let by_axis = |corner: usize, axis: usize| Vec4::from_array(triangles.map(|corners| corners[corner][axis]));
        let edges = triangles.map(|[a, b, c]| (a - b).length().max((b - c).length()).max((c - a).length()));
        Self {
            corners: [0, 1, 2].map(|corner| [0, 1, 2].map(|axis| by_axis(corner, axis))),
            longest_edges: edges.into(),
        }
    }

    /// Finds the hits of a ray on them up to `far`. `near`: its entry into the leaf's box. Not inline, where the
    /// compiler takes the four apart again.
    #[inline(never)]
    fn meet(&self, ray: &TreeRay, near: f32, far: f32) -> MetInLeaf {
        let (origin, direction) = (by_axis(ray.origin), by_axis(ray.direction));
        // Not by `map`, which the compiler makes a call of.
        let [a, b, c] = &self.corners;
        let (a, b, c) = (minus(*a, origin), minus(*b, origin), minus(*c, origin));
        let (ca, ab, bc) = (minus(c, a), minus(a, b), minus(b, c));
        let volumes = [
            dot(cross(bc, plus(b, c)), direction),
            dot(cross(ca, plus(c, a)), direction),
            dot(cross(ab, plus(a, b)), direction),
        ];
        // A ray at a distance from an edge spans twice its product with the lengths of edge and direction.
        let [x, y, z] = volumes;
        let slack = (x + y + z).abs() * EDGE_SLACK + self.longest_edges * ray.beside;
        let is_outside = x.min(y).min(z).cmplt(-slack) & x.max(y).max(z).cmpgt(slack);
        let normal = cross(ca, ab);
        let along = dot(normal, direction);
        let t = dot(normal, a) / along;
        // Not a number where the ray lies in the triangle's plane. Not before the box, or what is met would depend on
        // what was looked at before.
        let is_there = t.cmpge(Vec4::ZERO) & t.cmple(Vec4::splat(far));
        let is_met = is_there & !is_outside;
        MetInLeaf { t: Vec4::select(is_met, t.max(Vec4::splat(near)), Vec4::INFINITY).to_array(), along, volumes }
    }
}

/// Hits of a ray on a leaf's triangles.
struct MetInLeaf {
    /// Infinity where it meets none.
    t: [f32; GROUP],
    along: Vec4,
    volumes: [Vec4; 3],
}

impl MetInLeaf {
    fn met(&self, i: usize) -> Met {
        let [x, y, z] = self.volumes;
        Met { t: self.t[i], along: self.along[i], volumes: Vec3A::new(x[i], y[i], z[i]) }
    }
}

fn minus(a: [Vec4; 3], b: [Vec4; 3]) -> [Vec4; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn plus(a: [Vec4; 3], b: [Vec4; 3]) -> [Vec4; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Cross product in glam's order. Two triangles compute values of a shared edge that differ in sign alone.
fn cross(a: [Vec4; 3], b: [Vec4; 3]) -> [Vec4; 3] {
    [a[1] * b[2] - b[1] * a[2], a[2] * b[0] - b[2] * a[0], a[0] * b[1] - b[0] * a[1]]
}

fn dot(a: [Vec4; 3], b: [Vec4; 3]) -> Vec4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
