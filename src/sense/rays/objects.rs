//! Drawn objects as rays meet them, in a tree of their boxes.

use super::meshes::{RayMaterial, RayMesh};
use glam::{DMat3, DVec3, Mat3A, Vec3, Vec3A};
use obvhs::aabb::Aabb;
use std::sync::Arc;
use systems::assets::{AlphaMode, Library, MeshId};
use systems::draw::{BatchKey, InstanceRecord};
use systems::space::box_tree::{BoxTree, LARGEST, Open, Quality};
use systems::space::triangle_tree::{INNER_SIZE, TreeRay};

/// Error of a place that was computed with floats from a distance, as a share of it: the difference, its move along the
/// ray and its sum round by 2⁻²⁴ each, along three axes.
pub(super) const ROUNDING: f32 = 1.0 / (1 << 22) as f32;
/// Metres that the boxes of objects are wider than these, beside [`ROUNDING`].
const BOX_ROOM: f64 = 1e-5;

/// A ray in world space.
pub(super) struct WorldRay {
    /// Metres.
    pub origin: DVec3,
    /// Unit.
    pub direction: DVec3,
    /// The same.
    pub along: Vec3A,
    /// Metres from the origin, of its beginning and end.
    pub near: f32,
    pub far: f32,
}

impl WorldRay {
    pub fn new(origin: DVec3, direction: DVec3, (near, far): (f32, f32)) -> Self {
        Self { origin, direction, along: direction.as_vec3a(), near, far }
    }
}

/// Meeting of a ray with something.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Meeting {
    /// From the ray's origin, metres.
    pub range: f64,
    /// Cosine of the angle between the ray and the triangle's normal, 0 to 1.
    pub cosine: f32,
    /// The luminance of the base colour there, 0 to 1.
    pub albedo: f32,
    /// The entity's index, of a piece its object's: [`InstanceRecord::entity`].
    pub entity: u32,
}

/// Meeting of a ray with an object.
#[derive(Clone, Copy)]
pub(super) struct Met {
    triangle: u32,
    /// Weights of the triangle's corners.
    weights: Vec3,
    /// Metres, rounded.
    pub range: f32,
}

/// Contents of a slot, as far as rays see it.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Drawn {
    world_from_object: [[f32; 4]; 3],
    entity: u32,
    /// Slot in the material table.
    pub material: u32,
    pub mesh: MeshId,
    /// Number of times that the mesh had been replaced.
    edits: u32,
    double_sided: bool,
    is_mask: bool,
}

impl Drawn {
    /// `None` where the library has no such mesh.
    pub fn new(record: &InstanceRecord, key: &BatchKey, library: &Library) -> Option<Self> {
        let &InstanceRecord { world_from_object, entity, material, .. } = record;
        let (edits, is_mask) = (library.mesh_edits(key.mesh)?, key.pipeline.alpha == AlphaMode::Mask);
        let double_sided = key.pipeline.double_sided;
        Some(Self { world_from_object, entity, material, mesh: key.mesh, edits, double_sided, is_mask })
    }
}

/// A drawn object, as rays look for it: two lines of a cache.
#[derive(Clone)]
#[repr(align(64))]
pub(super) struct Placed {
    /// Directions to the units of the mesh's tree.
    inner_from_world: Mat3A,
    /// The middle of its box, in the units of the mesh's tree, and in world space, metres.
    inner_middle: Vec3A,
    middle: DVec3,
    mesh: Arc<RayMesh>,
    pub material: Arc<RayMaterial>,
    /// The most units of the tree in a metre.
    inner_per_metre: f32,
    /// No part of it is further from its middle, metres.
    radius: f32,
    /// Metres by which the mesh's own coordinates round, beside those of rays.
    rounding: f32,
    double_sided: bool,
    pub is_mask: bool,
    /// Rays pass over what is gone.
    pub is_gone: bool,
}

/// Exact place of a drawn object; read of what is met alone: a line of a cache.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(super) struct Exact {
    /// Rows.
    world_from_object: [[f32; 4]; 3],
    /// Numbers of the entity and the slot, by which things in one place are told apart.
    pub entity: u32,
    pub slot: u32,
}

/// A box in world space, metres.
#[derive(Clone, Copy)]
pub(super) struct Bounds {
    middle: DVec3,
    /// Half its extent along the world's axes.
    half: DVec3,
}

impl Placed {
    /// `None` where it has no extent, or its mesh no tree, or it reaches beyond [`LARGEST`].
    pub fn new(mesh: Arc<RayMesh>, material: Arc<RayMaterial>, drawn: &Drawn, bounds: &Bounds) -> Option<Self> {
        let inner_from_metres = f64::from(mesh.tree.as_ref()?.inner_from_metres());
        let &Bounds { middle, half } = bounds;
        let (world_from_object, _) = exact_place(&drawn.world_from_object);
        let inner_from_world = world_from_object.inverse() * inner_from_metres;
        // The longest side of a unit cube bounds how much the inverse stretches.
        let inner_per_metre = (0..3).map(|i| inner_from_world.col(i).length_squared()).sum::<f64>().sqrt() as f32;
        let object_from_inner = 1.0 / inner_from_metres;
        let largest = (0..3).map(|i| world_from_object.col(i).length_squared()).sum::<f64>().sqrt()
            * f64::from(INNER_SIZE)
            * object_from_inner;
        // Not by their largest, which passes over what is no number.
        let is_bounded = |size: DVec3| size.abs().cmple(DVec3::splat(LARGEST.into())).all();
        let fits = is_bounded(middle) && is_bounded(half) && largest <= f64::from(LARGEST);
        (inner_per_metre.is_normal() && fits).then(|| Self {
            inner_middle: Vec3A::from(mesh.aabb.center()) * inner_from_metres as f32,
            inner_from_world: Mat3A::from(inner_from_world.as_mat3()),
            inner_per_metre,
            // A little more, so that no corner lies before where rays begin.
            radius: 1.01 * half.length() as f32,
            rounding: ROUNDING * largest as f32,
            mesh,
            material,
            double_sided: drawn.double_sided,
            is_mask: drawn.is_mask,
            middle,
            is_gone: false,
        })
    }

    /// The nearest triangle that a ray meets up to `far` metres, and a little beyond. Where that is does not depend on
    /// `far`.
    #[inline(always)]
    pub fn nearest(&self, ray: &WorldRay, far: f32, open: &mut Open) -> Option<Met> {
        let tree = self.mesh.tree.as_ref().filter(|_| !self.is_gone)?;
        let from_middle = (ray.origin - self.middle).as_vec3a();
        // Begin where the ray comes near, so that coordinates are no larger than the object.
        let skipped = (-from_middle.dot(ray.along) - self.radius).max(ray.near);
        if skipped > far {
            return None;
        }
        let start = self.inner_middle + self.inner_from_world * (from_middle + ray.along * skipped);
        let along = self.inner_from_world * ray.along;
        // By a power of two, which makes the largest component from 1 to 2: what is computed from it stays finite.
        let scale = f32::from_bits(along.abs().max_element().to_bits() & 0x7F80_0000);
        let beside = (ROUNDING * (from_middle.length() + self.radius) + self.rounding) * self.inner_per_metre;
        let inner = TreeRay::new(start, along * scale.recip(), beside);
        let inner_far = ((far - skipped) + ROUNDING * far) * scale;
        let (triangle, met) = tree.nearest(&inner, inner_far, open, |triangle, met| {
            let is_drawn = self.double_sided || met.along < 0.0;
            let is_seen = |cutoff| self.material.color(&self.mesh, triangle, met.weights()).w >= cutoff;
            is_drawn && self.material.cutoff.is_none_or(is_seen)
        })?;
        Some(Met { triangle, weights: met.weights(), range: skipped + met.t / scale })
    }

    /// Meeting of a ray with a triangle that is known to be met.
    pub fn meeting(&self, exact: &Exact, ray: &WorldRay, met: Met) -> Meeting {
        let (world_from_object, translation) = exact_place(&exact.world_from_object);
        let to_object = translation - ray.origin;
        let placed = |corner: Vec3| world_from_object * corner.as_dvec3() + to_object;
        let [a, b, c] = self.mesh.corners(met.triangle).map(placed);
        let normal = (b - a).cross(c - a);
        let along = normal.dot(ray.direction);
        let in_plane = normal.dot(a) / along;
        let range = f64::from(met.range);
        // A triangle seen from its edge has no place of its own.
        let is_near = (in_plane - range).abs() <= 1e-3 * range + f64::from(self.rounding);
        Meeting {
            range: if is_near { in_plane } else { range },
            cosine: (along / normal.length()).abs().min(1.0) as f32,
            albedo: self.material.albedo(&self.mesh, met.triangle, met.weights),
            entity: exact.entity,
        }
    }
}

/// From object to world space, and where object space's origin is.
fn exact_place(world_from_object: &[[f32; 4]; 3]) -> (DMat3, DVec3) {
    let rows = world_from_object.map(|[x, y, z, _]| DVec3::new(x.into(), y.into(), z.into()));
    let translation = DVec3::from(world_from_object.map(|row| row[3].into()));
    (DMat3::from_cols(rows[0], rows[1], rows[2]).transpose(), translation)
}

impl Exact {
    pub fn new(drawn: &Drawn, slot: u32) -> Self {
        Self { world_from_object: drawn.world_from_object, entity: drawn.entity, slot }
    }
}

impl Bounds {
    /// `aabb`: of its mesh.
    pub fn new(drawn: &Drawn, aabb: &systems::space::Aabb) -> Self {
        let (world_from_object, translation) = exact_place(&drawn.world_from_object);
        let half = (aabb.max.as_dvec3() - aabb.min.as_dvec3()) * 0.5;
        let sizes = DMat3::from_cols_array(&world_from_object.to_cols_array().map(f64::abs));
        Self { middle: world_from_object * aabb.center().as_dvec3() + translation, half: sizes * half }
    }

    /// A little wider, as floats.
    fn aabb(&self) -> Aabb {
        let room = BOX_ROOM + f64::from(ROUNDING) * (self.middle.abs() + self.half).max_element();
        let half = self.half + room;
        Aabb::new((self.middle - half).as_vec3a(), (self.middle + half).as_vec3a())
    }
}

/// Some of the drawn objects.
#[derive(Default)]
pub(super) struct Objects {
    /// By leaf of the tree.
    pub placed: Vec<Placed>,
    /// Places of these.
    pub exact: Vec<Exact>,
    pub tree: BoxTree,
    /// Number of them that are gone.
    pub gone: usize,
    /// Slots of others that no ray meets.
    pub left_out: Vec<u32>,
}

impl Objects {
    pub fn new(objects: impl Iterator<Item = (Option<Placed>, Exact, Bounds)>, quality: Quality) -> Self {
        let (mut there, mut left_out) = (Vec::new(), Vec::new());
        for (placed, exact, bounds) in objects {
            match placed {
                Some(placed) => there.push((placed, exact, bounds.aabb())),
                None => left_out.push(exact.slot),
            }
        }
        let tree = BoxTree::new(there.iter().map(|(.., aabb)| *aabb), 1, quality);
        let in_order = tree.order().iter().map(|&object| &there[object as usize]);
        let (placed, exact) = in_order.map(|(placed, exact, _)| (placed.clone(), *exact)).unzip();
        Self { placed, exact, tree, gone: 0, left_out }
    }
}
