//! Ground under vehicles: the triangles of entities that are [`Ground`], in a grid seen from above.

use super::steering;
use crate::assets::library::Library;
use crate::assets::mesh::MeshId;
use crate::draw::pieces::{PieceOf, WholeMesh};
use crate::space::transform::Transform;
use bevy_ecs::prelude::*;
use glam::{Affine3A, Vec3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// The entity's mesh, and those below it, are ground.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Ground;

/// Metres above a point up to which ground counts as below it: a kerb, a steep slope within a step.
const STEP_UP: f32 = 1.0;
/// Triangles per cell that the grid aims at.
const PER_CELL: usize = 2;
/// Entries of the grid, beyond which cells get larger.
const MOST_ENTRIES: usize = 1 << 24;

/// All ground.
#[derive(Resource, Default, Debug)]
pub struct Grounds {
    triangles: Vec<[Vec3; 3]>,
    min: [f32; 2],
    cell: f32,
    size: [usize; 2],
    /// Beginning of the triangles of each cell among `entries`, and the end.
    starts: Vec<u32>,
    entries: Vec<u32>,
    /// The entities that it is of.
    roots: Vec<Entity>,
    /// The slots of their meshes, and the revision of the library's meshes that it is of.
    meshes: (BTreeSet<u32>, u64),
}

impl Grounds {
    /// The ground that consists of triangles in world space; those that are not finite, or upright, are left out.
    pub fn new(triangles: impl IntoIterator<Item = [Vec3; 3]>) -> Self {
        let is_flat = |[a, b, c]: &[Vec3; 3]| (*b - *a).cross(*c - *a).y.abs() > 1e-9;
        let is_finite = |triangle: &[Vec3; 3]| triangle.iter().all(|corner| corner.is_finite());
        let triangles: Vec<_> = triangles.into_iter().filter(|t| is_finite(t) && is_flat(t)).collect();
        let mut grounds = Self { triangles, cell: 1.0, ..Self::default() };
        if grounds.triangles.is_empty() {
            return grounds;
        }
        let corners = || grounds.triangles.iter().flatten();
        let min = corners().copied().reduce(Vec3::min).unwrap_or_default();
        let extent = corners().copied().reduce(Vec3::max).unwrap_or_default() - min;
        grounds.min = [min.x, min.z];
        let cells = (grounds.triangles.len() / PER_CELL).max(1) as f32;
        grounds.cell = (extent.x.max(0.1) * extent.z.max(0.1) / cells).sqrt().max(extent.x.max(extent.z) / 4096.0);
        loop {
            grounds.size = [extent.x, extent.z].map(|length| (length / grounds.cell) as usize + 1);
            let entries: usize = grounds.triangles.iter().map(|t| grounds.cells_of(t).count()).sum();
            if entries <= MOST_ENTRIES || grounds.size == [1, 1] {
                break;
            }
            grounds.cell *= 2.0;
        }
        grounds.fill();
        grounds
    }

    fn cells_of(&self, triangle: &[Vec3; 3]) -> impl Iterator<Item = usize> + use<> {
        let [a, b, c] = *triangle;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let index = |value: f32, axis: usize| {
            (((value - self.min[axis]) / self.cell).max(0.0) as usize).min(self.size[axis] - 1)
        };
        let (x, z, width) = (index(low.x, 0)..=index(high.x, 0), index(low.z, 1)..=index(high.z, 1), self.size[0]);
        z.flat_map(move |z| x.clone().map(move |x| z * width + x))
    }

    fn fill(&mut self) {
        let mut starts = vec![0u32; self.size[0] * self.size[1] + 1];
        for triangle in &self.triangles {
            self.cells_of(triangle).for_each(|cell| starts[cell] += 1);
        }
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        let mut entries = vec![0; sum as usize];
        for (index, triangle) in self.triangles.iter().enumerate().rev() {
            for cell in self.cells_of(triangle) {
                starts[cell] -= 1;
                entries[starts[cell] as usize] = index as u32;
            }
        }
        (self.starts, self.entries) = (starts, entries);
    }

    /// Tells if there is none.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// The height of the ground below a point, or at most so many metres above it.
    pub fn height(&self, point: Vec3, step_up: f32) -> Option<f32> {
        let index = |value: f32, axis: usize| {
            let scaled = (value - self.min[axis]) / self.cell;
            (scaled >= 0.0 && scaled < self.size[axis] as f32).then_some(scaled as usize)
        };
        if self.is_empty() {
            return None;
        }
        let cell = index(point.z, 1)? * self.size[0] + index(point.x, 0)?;
        let triangles = &self.entries[self.starts[cell] as usize..self.starts[cell + 1] as usize];
        let heights = triangles.iter().map(|&index| height_in(&self.triangles[index as usize], point, step_up));
        Some(heights.fold(NOWHERE, f32::max)).filter(|height| *height > NOWHERE)
    }

    /// Height, pitch (up ahead) and roll (up to the left) of something on two axles: the reference point is under the
    /// middle of the rear one. `None` where there is no ground under one of the axles.
    pub fn posture(&self, at: Vec3, yaw: f32, wheelbase: f32, track: f32) -> Option<(f32, f32, f32)> {
        if self.is_empty() {
            return None;
        }
        let forward = steering::flat(steering::forward(yaw));
        let left = Vec3::new(forward.z, 0.0, -forward.x);
        let half = 0.5 * track;
        // The farther ahead, the higher it may be: half as high as far.
        let step_up = |ahead: f32| STEP_UP.max(0.5 * ahead);
        let below = |ahead: f32, aside: f32| self.height(at + forward * ahead + left * aside, step_up(ahead));
        if half < 0.05 {
            let (rear, front) = (below(0.0, 0.0)?, below(wheelbase, 0.0)?);
            return Some((rear, ((front - rear) / wheelbase).atan(), 0.0));
        }
        let [rl, rr] = [below(0.0, half)?, below(0.0, -half)?];
        let [fl, fr] = [below(wheelbase, half)?, below(wheelbase, -half)?];
        let (rear, front) = (0.5 * (rl + rr), 0.5 * (fl + fr));
        let pitch = ((front - rear) / wheelbase).atan();
        // Across the vehicle, which leans back by the pitch.
        let roll = (0.5 * (rl - rr + fl - fr) / track * pitch.cos()).atan();
        Some((rear, pitch, roll))
    }
}

/// Height where there is no ground.
const NOWHERE: f32 = f32::NEG_INFINITY;

/// The height of a triangle at a point's x and z, if it is there and counts as below the point. Without a branch: which
/// triangles of a cell these are is hard to predict.
fn height_in([a, b, c]: &[Vec3; 3], point: Vec3, step_up: f32) -> f32 {
    let area = (b.x - a.x) * (c.z - a.z) - (c.x - a.x) * (b.z - a.z);
    let u = ((b.x - point.x) * (c.z - point.z) - (c.x - point.x) * (b.z - point.z)) / area;
    let v = ((c.x - point.x) * (a.z - point.z) - (a.x - point.x) * (c.z - point.z)) / area;
    let w = 1.0 - u - v;
    let height = u * a.y + v * b.y + w * c.y;
    // Points on edges belong to both sides.
    let is_there = (u >= -1e-5) & (v >= -1e-5) & (w >= -1e-5);
    if is_there & (height <= point.y + step_up) { height } else { NOWHERE }
}

type NewGround = Or<(Added<Ground>, (With<Ground>, Changed<Transform>))>;

/// Rebuilds the grid when an entity became ground, ceased to be it, or was moved itself, and when one of the meshes was
/// replaced or removed.
#[allow(clippy::type_complexity, clippy::too_many_arguments)]
pub fn update_grounds(
    new: Query<(), NewGround>,
    all: Query<Entity, With<Ground>>,
    children: Query<&Children>,
    parents: Query<&ChildOf>,
    transforms: Query<&Transform>,
    meshes: Query<(Option<&MeshId>, Option<&WholeMesh>), Without<PieceOf>>,
    library: Res<Library>,
    mut grounds: ResMut<Grounds>,
) {
    let (slots, seen) = &mut grounds.bypass_change_detection().meshes;
    let since = std::mem::replace(seen, library.revisions().meshes);
    let same_meshes =
        library.meshes_edited() <= since || !library.changed_meshes(since).any(|slot| slots.contains(&slot));
    if same_meshes && new.is_empty() && all.iter().eq(grounds.roots.iter().copied()) {
        return;
    }
    let roots: Vec<Entity> = all.iter().collect();
    let world_from = |entity: Entity| {
        let own = std::iter::once(entity).chain(parents.iter_ancestors(entity));
        own.filter_map(|entity| transforms.get(entity).ok())
            .fold(Affine3A::IDENTITY, |below, transform| transform.compute_affine() * below)
    };
    let (mut triangles, mut slots) = (Vec::new(), BTreeSet::new());
    for root in &all {
        for entity in std::iter::once(root).chain(children.iter_descendants(root)) {
            let Ok((mesh, whole)) = meshes.get(entity) else { continue };
            let Some(mesh) = whole.map(|whole| whole.mesh).or(mesh.copied()) else { continue };
            slots.insert(mesh.slot());
            let Some(entry) = library.mesh(mesh) else { continue };
            let place = world_from(entity);
            let corner = |index: u32| {
                entry.mesh.positions.get(index as usize).map_or(Vec3::NAN, |corner| place.transform_point3(*corner))
            };
            triangles.extend(entry.mesh.indices.chunks_exact(3).map(|t| [corner(t[0]), corner(t[1]), corner(t[2])]));
        }
    }
    *grounds = Grounds { roots, meshes: (slots, library.revisions().meshes), ..Grounds::new(triangles) };
}
