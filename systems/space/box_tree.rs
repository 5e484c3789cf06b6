//! A tree of boxes for rays: four boxes to a node, tested at once.
//!
//! obvhs makes a binary tree; its nodes are drawn together by fours, and small parts of it become leaves. Boxes are
//! kept as floats, so that what is around others is met wherever they are: rounding is monotonic. A leaf is thus looked
//! at whenever a ray meets the leaf's own box before its end, whatever the tree above is.

use glam::{Vec3A, Vec4};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::PlocBuilder;
use obvhs::{Boundable, BvhBuildParams};

/// Children of a node.
const WIDTH: usize = 4;
/// In a child's number: it is a leaf.
const LEAF: u32 = 1 << 31;
/// A direction's component counts as this at least, that its inverse be finite.
const LEAST_COMPONENT: f32 = 1e-25;
/// Metres, or inner units: sides of boxes count as this at most. The areas of such boxes, and their sums over any tree,
/// are finite, as what compares them needs it.
pub const LARGEST: f32 = 1e15;

/// A box within [`LARGEST`]; what is no number is without end.
pub fn bounded(aabb: Aabb) -> Aabb {
    let side = |side: Vec3A, without_end: f32| {
        let side = Vec3A::select(side.is_nan_mask(), Vec3A::splat(without_end), side);
        side.clamp(Vec3A::splat(-LARGEST), Vec3A::splat(LARGEST))
    };
    Aabb::new(side(aabb.min, -LARGEST), side(aabb.max, LARGEST))
}

/// Boxes in a tree.
#[derive(Default)]
pub struct BoxTree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

/// Two lines of a cache.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Node {
    /// Bounds of its children: the low sides by axis, and the high sides.
    sides: [[Vec4; 3]; 2],
    /// Behind it in the tree: a search comes to each node once at most, whatever the boxes and the ray are.
    children: [u32; WIDTH],
    /// A bit for each child that there is.
    filled: u32,
}

impl Node {
    const EMPTY: Self = Self { sides: [[Vec4::ZERO; 3]; 2], children: [0; WIDTH], filled: 0 };
}

/// The parts of trees that a search has still to look at; searches may be nested. Made once for many searches.
pub type Open = Vec<Part>;

/// A child of a node.
#[derive(Clone, Copy)]
pub struct Part {
    child: u32,
    /// Entry of the ray into its box, in units of the direction.
    near: f32,
}

/// A ray as it is tested against boxes.
pub struct BoxRay {
    /// Reciprocal of the direction, by axis.
    inverse: [Vec4; 3],
    /// Origins for the sides that the ray meets first, and for those that it meets last.
    origins: [[Vec4; 3]; 2],
    /// By axis, which of the sides it meets first.
    first: [usize; 3],
}

impl BoxRay {
    /// `beside`: how far beside a box the ray still meets it.
    #[inline(always)]
    pub fn new(origin: Vec3A, direction: Vec3A, beside: f32) -> Self {
        let negative = direction.cmplt(Vec3A::ZERO);
        let least = Vec3A::select(negative, Vec3A::splat(-LEAST_COMPONENT), Vec3A::splat(LEAST_COMPONENT));
        let direction = Vec3A::select(direction.abs().cmplt(least.abs()), least, direction);
        let back = Vec3A::select(negative, Vec3A::splat(-beside), Vec3A::splat(beside));
        let negative = negative.bitmask() as usize;
        Self {
            inverse: by_axis(direction.recip()),
            origins: [by_axis(origin + back), by_axis(origin - back)],
            first: [negative & 1, negative >> 1 & 1, negative >> 2 & 1],
        }
    }

    /// Finds the ray's entry into a node's children, and a bit for each that it meets up to `far`. Not inline, where
    /// the compiler takes the four apart again.
    #[inline(never)]
    fn enters(&self, node: &Node, far: f32, near: &mut [f32; WIDTH]) -> u32 {
        let side = |axis: usize, last: usize| {
            let side = node.sides[(self.first[axis] ^ last) & 1][axis];
            (side - self.origins[last][axis]) * self.inverse[axis]
        };
        let first = side(0, 0).max(side(1, 0)).max(side(2, 0).max(Vec4::ZERO));
        let end = side(0, 1).min(side(1, 1)).min(side(2, 1).min(Vec4::splat(far)));
        *near = first.to_array();
        first.cmple(end).bitmask() & node.filled
    }
}

/// Effort of building a tree.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Quality {
    /// It is made anew before each use.
    Fast,
    /// It is kept.
    Good,
    /// It is kept, and most of the time goes into it.
    Best,
}

/// Adapter of a box to obvhs.
struct Bounded(Aabb);

impl Boundable for Bounded {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl BoxTree {
    /// Over boxes, which are [bounded]. Up to `group` of them make a leaf.
    pub fn new(boxes: impl Iterator<Item = Aabb>, group: usize, quality: Quality) -> Self {
        let boxes: Vec<Bounded> = boxes.map(|aabb| Bounded(bounded(aabb))).collect();
        if boxes.is_empty() {
            return Self::default();
        }
        let params = match quality {
            Quality::Fast => BvhBuildParams::fastest_build(),
            Quality::Good => BvhBuildParams::medium_build(),
            Quality::Best => BvhBuildParams::very_slow_build(),
        };
        // As obvhs's own functions do it, but for the checks that panic in debug builds.
        let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
            params.ploc_search_distance,
            &boxes,
            (0..boxes.len() as u32).collect(),
            params.sort_precision,
            params.search_depth_threshold,
        );
        ReinsertionOptimizer::default().run(&mut binary, params.reinsertion_batch_ratio, None);
        Self::of_binary(&binary, group)
    }

    fn of_binary(binary: &Bvh2, group: usize) -> Self {
        let counts = counts(binary);
        let mut tree = Self { nodes: vec![Node::EMPTY], order: Vec::with_capacity(binary.primitive_indices.len()) };
        let mut open = vec![(0, 0)];
        while let Some((root, place)) = open.pop() {
            let mut children = vec![root];
            let is_leaf = |node: usize| counts[node] as usize <= group || binary.nodes[node].is_leaf();
            // The largest is opened, as long as there is room.
            let area = |node: usize| binary.nodes[node].aabb().half_area();
            while children.len() < WIDTH {
                let inner = children.iter().enumerate().filter(|(_, node)| !is_leaf(**node));
                let Some((largest, _)) = inner.max_by(|a, b| area(*a.1).total_cmp(&area(*b.1))) else { break };
                let first = binary.nodes[children[largest]].first_index as usize;
                children[largest] = first;
                children.push(first + 1);
            }
            for (i, child) in children.into_iter().enumerate() {
                let number = if is_leaf(child) {
                    tree.add_leaf(binary, child, group)
                } else {
                    open.push((child, tree.nodes.len()));
                    tree.nodes.push(Node::EMPTY);
                    tree.nodes.len() as u32 - 1
                };
                let (aabb, node) = (binary.nodes[child].aabb(), &mut tree.nodes[place]);
                for axis in 0..3 {
                    (node.sides[0][axis][i], node.sides[1][axis][i]) = (aabb.min[axis], aabb.max[axis]);
                }
                node.children[i] = number;
                node.filled |= 1 << i;
            }
        }
        tree
    }

    fn add_leaf(&mut self, binary: &Bvh2, root: usize, group: usize) -> u32 {
        let number = (self.order.len() / group) as u32;
        let mut open = vec![root];
        while let Some(node) = open.pop() {
            let node = &binary.nodes[node];
            let first = node.first_index as usize;
            if node.is_leaf() {
                self.order.extend(&binary.primitive_indices[first..first + node.prim_count as usize]);
            } else {
                open.extend([first, first + 1]);
            }
        }
        self.order.resize((number as usize + 1) * group, u32::MAX);
        number | LEAF
    }

    /// The boxes' numbers by leaf, in each as many as there may be; `u32::MAX` where there are fewer.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Calls with the leaves whose boxes a ray meets up to `far`, nearer ones first by and large: a leaf's number,
    /// where the ray enters its box, and the end of the ray. What is returned is the end from then on.
    #[inline(always)]
    pub fn traverse(
        &self,
        ray: &BoxRay,
        mut far: f32,
        open: &mut Open,
        mut meet: impl FnMut(usize, [f32; 2], &mut Open) -> f32,
    ) {
        let Some(mut node) = self.nodes.first() else { return };
        let (floor, mut near) = (open.len(), [0.0; WIDTH]);
        loop {
            let mut met = ray.enters(node, far, &mut near);
            let mut next = || {
                let i = (met != 0).then_some(met.trailing_zeros() as usize % WIDTH)?;
                met &= met - 1;
                Some(Part { child: node.children[i], near: near[i] })
            };
            let mut first = next();
            if let Some(first) = &mut first {
                let start = open.len();
                while let Some(mut part) = next() {
                    if part.near < first.near {
                        std::mem::swap(&mut part, first);
                    }
                    open.push(part);
                }
                // The nearest comes last.
                for end in start + 1..open.len() {
                    for place in (start..end).rev() {
                        if open[place].near < open[place + 1].near {
                            open.swap(place, place + 1);
                        }
                    }
                }
            }
            node = loop {
                let part = match first.take() {
                    Some(part) => part,
                    None if open.len() == floor => return,
                    None => open.pop().unwrap_or(Part { child: 0, near: f32::INFINITY }),
                };
                if part.near > far {
                    continue;
                }
                if part.child & LEAF == 0 {
                    break &self.nodes[part.child as usize];
                }
                far = meet((part.child & !LEAF) as usize, [part.near, far], open);
            };
        }
    }
}

/// For four at once.
#[inline(always)]
pub fn by_axis(v: Vec3A) -> [Vec4; 3] {
    [Vec4::splat(v.x), Vec4::splat(v.y), Vec4::splat(v.z)]
}

/// Boxes below each node.
fn counts(binary: &Bvh2) -> Vec<u32> {
    let mut counts: Vec<u32> = binary.nodes.iter().map(|node| node.prim_count).collect();
    let (mut open, mut order) = (vec![0], Vec::with_capacity(counts.len()));
    while let Some(node) = open.pop() {
        if !binary.nodes[node].is_leaf() {
            let first = binary.nodes[node].first_index as usize;
            order.push(node);
            open.extend([first, first + 1]);
        }
    }
    // Parents come before their children.
    for node in order.into_iter().rev() {
        let first = binary.nodes[node].first_index as usize;
        counts[node] = counts[first] + counts[first + 1];
    }
    counts
}
