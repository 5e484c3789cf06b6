//! What a world draws, as rays meet it.
//!
//! Two levels of trees: one over the boxes of the objects within range, made anew for each capture, and one for each
//! mesh, which is kept. A ray is brought into an object's own coordinates, begins where it comes near the object, and
//! is scaled to the units of the mesh's tree. Differences of places are taken in double precision, so that objects and
//! sensors may be far from the world's origin. Where a ray met something is computed once more in double precision.
//!
//! Met are the triangles of meshes without levels of detail and without displaced heights: both sides or the front, as
//! the material says. Masks are asked at the place that is met. A blended surface is met where its alpha is at least ½.

use super::ray_meshes::{RayMaterial, RayMesh, RayMeshes};
use crate::triangle_tree::{INNER_SIZE, Padded, TriangleTree, build};
use glam::{DMat3, DVec3, Mat3A, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::ray::{Ray, RayHit};
use std::sync::Arc;
use systems::Simulation;
use systems::assets::AlphaMode;
use systems::draw::{BatchKey, InstanceRecord};
use systems::ecs::parallel::map_in_parallel;
use systems::ecs::tables::Records;

/// Of a distance, how far off a place may be that was computed with floats from it: the difference, its move along the
/// ray and its sum round by 2⁻²⁴ each, along three axes.
const ROUNDING: f32 = 1.0 / (1 << 22) as f32;
/// Metres that the boxes of objects are wider than these, beside [`ROUNDING`].
const BOX_ROOM: f64 = 1e-5;

/// Objects whose places a thread looks at, at a time.
const OBJECTS_PER_TASK: usize = 2048;

/// Where a ray meets something.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Meeting {
    /// From the ray's origin, metres.
    pub range: f64,
    /// Of the angle between the ray and the triangle's normal, 0 to 1.
    pub cosine: f32,
    /// The luminance of the base colour there, 0 to 1.
    pub albedo: f32,
    /// The entity's index, of a piece its object's: [`InstanceRecord::entity`].
    pub entity: u32,
}

/// What is not met as it is drawn.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct RayWarnings {
    /// Masked objects that are solid for rays: their masks have no texels on the CPU
    /// ([`Library::keep_texels`](systems::assets::Library::keep_texels)).
    pub solid_masks: usize,
    /// Other objects whose base maps have none: their albedo is that of their base colour alone.
    pub plain_maps: usize,
    /// Objects that no ray meets: their mesh has no surface, or triangles too uneven for a tree.
    pub left_out: usize,
}

impl RayWarnings {
    /// Of each kind the more of these and others.
    pub(super) fn with(self, other: Self) -> Self {
        Self {
            solid_masks: self.solid_masks.max(other.solid_masks),
            plain_maps: self.plain_maps.max(other.plain_maps),
            left_out: self.left_out.max(other.left_out),
        }
    }
}

/// What a world's last frame draws, ready for rays.
#[derive(Default)]
pub struct RayScene {
    meshes: RayMeshes,
    /// In the order of the tree's leaves.
    placed: Vec<Placed>,
    /// Where these are, read for what is met alone.
    exact: Vec<Exact>,
    /// `None` where there is nothing.
    tree: Option<CwBvh>,
    /// What the boxes of the tree count from, world space.
    centre: DVec3,
    warnings: RayWarnings,
}

/// A drawn object, as rays look for it.
#[derive(Clone)]
struct Placed {
    mesh: Arc<RayMesh>,
    material: Arc<RayMaterial>,
    double_sided: bool,
    /// The middle of its box, world space, metres, and in the units of the mesh's tree.
    middle: DVec3,
    inner_middle: Vec3A,
    /// Directions to the units of the mesh's tree.
    inner_from_world: Mat3A,
    /// The most units of the tree in a metre.
    inner_per_metre: f32,
    /// No part of it is further from its middle, metres.
    radius: f32,
    /// Metres by which the mesh's own coordinates round, beside those of rays.
    rounding: f32,
}

/// Where a drawn object is, exactly.
#[derive(Clone, Copy)]
struct Exact {
    /// From object to world space; the translation is of object space's origin.
    world_from_object: DMat3,
    translation: DVec3,
    /// Of its box, world space, and half its extent along the world's axes.
    middle: DVec3,
    half: DVec3,
    entity: u32,
}

impl Placed {
    /// `None` where it has no extent, or its mesh no tree.
    fn new(mesh: Arc<RayMesh>, material: Arc<RayMaterial>, double_sided: bool, exact: &Exact) -> Option<Self> {
        let inner_from_metres = f64::from(mesh.tree.as_ref()?.inner_from_metres());
        let &Exact { world_from_object, middle, half, .. } = exact;
        let inner_from_world = world_from_object.inverse() * inner_from_metres;
        // The longest side of a unit cube bounds how much the inverse stretches.
        let inner_per_metre = (0..3).map(|i| inner_from_world.col(i).length_squared()).sum::<f64>().sqrt() as f32;
        let object_from_inner = 1.0 / inner_from_metres;
        let largest = (0..3).map(|i| world_from_object.col(i).length_squared()).sum::<f64>().sqrt()
            * f64::from(INNER_SIZE)
            * object_from_inner;
        (inner_per_metre.is_normal() && middle.is_finite() && largest.is_finite()).then(|| Self {
            inner_middle: Vec3A::from(mesh.aabb.center()) * inner_from_metres as f32,
            inner_from_world: Mat3A::from(inner_from_world.as_mat3()),
            inner_per_metre,
            // A little more, so that no corner lies before where rays begin.
            radius: 1.01 * half.length() as f32,
            rounding: ROUNDING * largest as f32,
            mesh,
            material,
            double_sided,
            middle,
        })
    }

    /// The nearest triangle that a ray meets from `near` to `far` metres, with the corners' weights and the distance.
    #[inline]
    fn nearest(&self, origin: DVec3, direction: Vec3A, near: f32, far: f32) -> Option<(u32, Vec3, f32)> {
        let tree: &TriangleTree = self.mesh.tree.as_ref()?;
        let from_middle = (origin - self.middle).as_vec3a();
        // Begin where the ray comes near, so that coordinates are no larger than the object.
        let skipped = (-from_middle.dot(direction) - self.radius).max(near);
        if skipped >= far {
            return None;
        }
        let start = self.inner_middle + self.inner_from_world * (from_middle + direction * skipped);
        let along = self.inner_from_world * direction;
        // obvhs takes components below 1e-7 for that: scaled by a power of two, the largest is from 1 to 2.
        let scale = f32::from_bits(along.abs().max_element().to_bits() & 0x7F80_0000);
        let beyond = (ROUNDING * (from_middle.length() + self.radius) + self.rounding) * self.inner_per_metre;
        // It takes −0 for negative in one place and for positive in another.
        let ray = Ray::new(start, along / scale + 0.0, 0.0, ((far - skipped) * scale).min(f32::MAX));
        let (triangle, met) = tree.nearest(ray, beyond, |triangle, met| {
            let is_drawn = self.double_sided || met.along < 0.0;
            let is_seen = |cutoff| self.material.color(&self.mesh, triangle, met.weights()).w >= cutoff;
            is_drawn && self.material.cutoff.is_none_or(is_seen)
        })?;
        Some((triangle, met.weights(), skipped + met.t / scale))
    }

    /// What a ray meets in a triangle that is known to be met.
    fn meeting(&self, exact: &Exact, origin: DVec3, direction: DVec3, met: (u32, Vec3, f32)) -> Meeting {
        let (triangle, weights, range) = met;
        let to_object = exact.translation - origin;
        let placed = |corner: Vec3| exact.world_from_object * corner.as_dvec3() + to_object;
        let [a, b, c] = self.mesh.corners(triangle).map(placed);
        let normal = (b - a).cross(c - a);
        let along = normal.dot(direction);
        let in_plane = normal.dot(a) / along;
        // A triangle seen from its edge has no place of its own.
        let is_near = (in_plane - f64::from(range)).abs() <= 1e-3 * f64::from(range) + f64::from(self.rounding);
        Meeting {
            range: if is_near { in_plane } else { range.into() },
            cosine: (along / normal.length()).abs().min(1.0) as f32,
            albedo: self.material.albedo(&self.mesh, triangle, weights),
            entity: exact.entity,
        }
    }
}

impl Exact {
    fn new(record: &InstanceRecord, aabb: &systems::space::Aabb) -> Self {
        let rows = record.world_from_object.map(|[x, y, z, _]| DVec3::new(x.into(), y.into(), z.into()));
        let world_from_object = DMat3::from_cols(rows[0], rows[1], rows[2]).transpose();
        let translation = DVec3::from(record.world_from_object.map(|row| row[3].into()));
        let middle = world_from_object * aabb.center().as_dvec3() + translation;
        let half = (aabb.max.as_dvec3() - aabb.min.as_dvec3()) * 0.5;
        let half = DVec3::from(rows.map(|row| row.abs().dot(half)));
        Self { world_from_object, translation, middle, half, entity: record.entity }
    }

    /// Whether some of it may be within range of one of the sensors.
    fn is_near(&self, sensors: &[DVec3], range: f64) -> bool {
        let reach = range + self.half.length();
        sensors.iter().any(|sensor| sensor.distance_squared(self.middle) <= reach * reach)
    }

    /// Its box, relative to a place.
    fn aabb(&self, centre: DVec3) -> Aabb {
        let middle = self.middle - centre;
        let room = BOX_ROOM + f64::from(ROUNDING) * (middle.abs() + self.half).max_element();
        let half = self.half + room;
        Aabb::new((middle - half).as_vec3a(), (middle + half).as_vec3a())
    }
}

impl RayScene {
    /// Takes over what the world's last frame draws within `range` metres of any of the sensors. Trees of meshes that
    /// it knows are kept.
    pub fn update(&mut self, simulation: &Simulation, sensors: &[DVec3], range: f32) {
        let (library, list, records) = (simulation.library(), simulation.draw_list(), simulation.instance_records());
        let mut room = Vec::new();
        let records = records.read(std::slice::from_ref(&(0..records.slot_count())), &mut room);
        let drawn: Vec<(u32, BatchKey)> = list.drawn().collect();
        let near = map_in_parallel(drawn.chunks(OBJECTS_PER_TASK), |drawn| {
            let placed = drawn.iter().filter_map(|&(slot, key)| {
                let exact = Exact::new(&records[slot as usize], &library.mesh(key.mesh)?.aabb);
                exact.is_near(sensors, range.into()).then_some((slot, key, exact))
            });
            placed.collect::<Vec<_>>()
        });
        let near = near.concat();
        self.meshes.update(library, &near.iter().map(|(_, key, _)| key.mesh).collect());
        self.warnings = RayWarnings::default();
        self.centre = sensors.first().copied().unwrap_or_default();
        let mut placed = Vec::with_capacity(near.len());
        for (slot, key, exact) in near {
            let Some(mesh) = self.meshes.mesh(key.mesh).cloned() else { continue };
            let material = self.meshes.material(library, records[slot as usize].material);
            let is_mask = key.pipeline.alpha == AlphaMode::Mask;
            self.warnings.solid_masks += usize::from(material.lacks_texels && is_mask);
            self.warnings.plain_maps += usize::from(material.lacks_texels && !is_mask);
            match Placed::new(mesh, material, key.pipeline.double_sided, &exact) {
                Some(object) => placed.push((object, exact)),
                None => self.warnings.left_out += 1,
            }
        }
        let boxes: Vec<Padded> = placed.iter().map(|(_, exact)| Padded(exact.aabb(self.centre))).collect();
        self.tree = if boxes.is_empty() { None } else { build(&boxes, BvhBuildParams::fast_build()) };
        self.warnings.left_out += if self.tree.is_none() { placed.len() } else { 0 };
        let order = self.tree.iter().flat_map(|tree| &tree.primitive_indices);
        (self.placed, self.exact) = order.map(|&object| placed[object as usize].clone()).unzip();
    }

    /// What of the last update is not met as it is drawn.
    pub fn warnings(&self) -> RayWarnings {
        self.warnings
    }

    /// How many objects are within range.
    pub fn objects(&self) -> usize {
        self.placed.len()
    }

    /// The nearest thing that a ray meets from `near` to `far` metres. `origin`: world space, metres; `direction`: world
    /// space, unit.
    pub fn nearest(&self, origin: DVec3, direction: DVec3, near: f32, far: f32) -> Option<Meeting> {
        let tree = self.tree.as_ref()?;
        let along = direction.as_vec3a() + 0.0;
        let ray = Ray::new((origin - self.centre).as_vec3a(), along, 0.0, far);
        let mut nearest = None;
        tree.ray_traverse(ray, &mut RayHit::none(), |ray, object| {
            let Some(met) = self.placed[object].nearest(origin, along, near, ray.tmax) else { return f32::INFINITY };
            if met.2 < ray.tmax {
                nearest = Some((object, met));
            }
            met.2
        });
        nearest.map(|(object, met)| self.placed[object].meeting(&self.exact[object], origin, direction, met))
    }
}
