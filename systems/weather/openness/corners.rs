//! Views of the sky from corners of the grid, by rays.

use super::directions::{Bits, DIRECTIONS, directions};
use super::rooms::Room;
use crate::space::box_tree::Open;
use crate::space::triangle_tree::{TreeRay, TriangleTree};
use glam::{Vec3, Vec3A};
use xxhash_rust::xxh3::Xxh3;

/// Distance beyond which nothing hides the sky, metres.
pub const FAR: f32 = 100.0;
/// One in so many directions is asked from which side it meets what it meets.
const ASKED: usize = 8;

/// A triangle that hides the sky, and the sides from which it can be seen.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Occluder {
    /// World space, metres; counter-clockwise from the front.
    pub corners: [Vec3; 3],
    /// Drawn from behind, too.
    pub is_double_sided: bool,
    /// Belongs to something large, such as ground, on which others stand.
    pub is_large: bool,
}

/// All that hides the sky, ready for rays.
pub struct Occluders {
    triangles: Vec<Occluder>,
    tree: Option<TriangleTree>,
    directions: [Vec3; DIRECTIONS],
}

/// View of a corner.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct View {
    /// Directions that are open.
    pub open: Bits,
    /// Lies within something: over a quarter of what it sees is seen from behind.
    pub is_within: bool,
}

impl Occluders {
    /// Builds the tree.
    pub fn new(triangles: Vec<Occluder>) -> Self {
        let tree = TriangleTree::new(triangles.iter().map(|triangle| triangle.corners)).ok();
        Self { triangles, tree, directions: directions() }
    }

    /// A number for triangles and rooms, by which equal ones are known.
    pub fn hash(triangles: &[Occluder], rooms: &[Room]) -> u128 {
        let mut hash = Xxh3::new();
        for Room { low, size, .. } in rooms {
            hash.update(bytemuck::bytes_of(&[*low, *size]));
        }
        for Occluder { corners, is_double_sided, is_large } in triangles {
            hash.update(bytemuck::bytes_of(corners));
            hash.update(&[u8::from(*is_double_sided), u8::from(*is_large)]);
        }
        hash.digest128()
    }

    /// Looks around from a place of the world.
    pub fn view(&self, place: Vec3, open: &mut Open) -> View {
        let Some(tree) = &self.tree else { return View { open: [u64::MAX; 4], is_within: false } };
        let scale = tree.inner_from_metres();
        let (origin, far) = (Vec3A::from(place) * scale, FAR * scale);
        let (mut view, mut behind) = (View::default(), 0);
        for (number, &direction) in self.directions.iter().enumerate() {
            let ray = TreeRay::new(origin, direction.into(), 0.0);
            let is_hit = if number.is_multiple_of(ASKED) {
                let nearest = tree.nearest(&ray, far, open, |_, _| true);
                if let Some((triangle, hit)) = nearest {
                    let is_solid = !self.triangles[triangle as usize].is_double_sided;
                    behind += usize::from(is_solid && hit.along > 0.0);
                }
                nearest.is_some()
            } else {
                tree.is_hit(&ray, far)
            };
            view.open[number / 64] |= u64::from(!is_hit) << (number % 64);
        }
        view.is_within = behind * 4 > DIRECTIONS / ASKED;
        view
    }
}
