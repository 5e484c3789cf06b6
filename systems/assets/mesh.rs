//! Meshes, and the component that names one.

use super::material::MaterialId;
use super::slots::slot_id;
use crate::space::bounds::{Aabb, Sphere};
use crate::space::transform::Transform;
use bevy_ecs::prelude::*;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3, Vec4};

/// Names a [`Mesh`] of the [`Library`](crate::assets::Library). As a component: this entity is drawn with that mesh.
#[derive(Component, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, serde::Serialize, serde::Deserialize)]
#[require(Transform, MaterialId)]
#[component(summary_tick)]
pub struct MeshId(u32);
slot_id!(MeshId);

/// A triangle list. All filled attribute arrays have one element per vertex.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// For people: panels, warnings, GPU labels.
    pub name: String,
    /// Object space, metres.
    pub positions: Vec<Vec3>,
    /// Object space, unit length.
    pub normals: Vec<Vec3>,
    /// Object space xyz and handedness w = ±1. Empty: the tangents system fills it.
    pub tangents: Vec<Vec4>,
    /// Two sets of texture coordinates, origin at the top left. The first may be empty (no UVs at all), the second
    /// empty (the same as the first).
    pub uvs: [Vec<Vec2>; 2],
    /// Index of the UV set that computed tangents follow, which is that of the normal map: 0 or 1.
    pub tangent_uv_set: usize,
    /// Linear RGBA, multiplied with the base colour. Empty: white.
    pub colors: Vec<Vec4>,
    /// Three per triangle, counter-clockwise seen from the front.
    pub indices: Vec<u32>,
}

impl Mesh {
    /// The axis-aligned box around all positions, object space; empty at the origin where there are none.
    pub fn aabb(&self) -> Aabb {
        Aabb::around(&self.positions)
    }

    /// The UVs that tangents follow; the first set where the second is empty.
    pub fn tangent_uvs(&self) -> &[Vec2] {
        let second = self.tangent_uv_set == 1 && !self.uvs[1].is_empty();
        &self.uvs[usize::from(second)]
    }

    /// Triangles in the mesh.
    pub fn triangle_count(&self) -> usize {
        self.indices.len() / 3
    }
}

/// One level of detail of a mesh.
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Level {
    /// First of its indices, counted in the mesh's indices followed by [`MeshEntry::level_indices`].
    pub first_index: u32,
    /// Number of indices.
    pub index_count: u32,
    /// Metres in object space: how far the level seems to be from the mesh. Distances of surfaces, and what normals and
    /// texture coordinates differ by in the terms of such. 0 for the mesh itself; never less than the level before.
    pub error: f32,
}

impl Level {
    /// The mesh itself.
    pub fn whole(mesh: &Mesh) -> Self {
        Self { first_index: 0, index_count: mesh.indices.len() as u32, error: 0.0 }
    }
}

/// A mesh with what is derived from it when it is added.
#[derive(Clone, Debug)]
pub struct MeshEntry {
    /// The mesh; once `tangents_ready`, with tangents.
    pub mesh: Mesh,
    /// Encloses all positions, object space.
    pub bounds: Sphere,
    /// [`Mesh::aabb`].
    pub aabb: Aabb,
    /// Set by the tangents system.
    pub tangents_ready: bool,
    /// Levels of detail, the mesh itself first; made by the levels system. Empty until then: the renderer draws only
    /// meshes that have them.
    pub levels: Vec<Level>,
    /// The indices of all levels but the first, which is [`Mesh::indices`].
    pub level_indices: Vec<u32>,
    /// It is drawn as it is at any distance; so is a mesh that replaces it.
    pub without_levels: bool,
    /// Sphere from whose nearest point distances are taken that levels are chosen by, object space. Its bounds, but for
    /// meshes of a model with a [`proxy`](crate::assets::proxy).
    pub level_bounds: Sphere,
    /// Error, metres in object space, where nothing is drawn of it: a proxy is.
    pub ends_at: Option<f32>,
}

impl MeshEntry {
    /// A mesh whose tangents, and levels if it has any, are still to be made.
    pub(super) fn new(mesh: Mesh, without_levels: bool) -> Self {
        let levels = if without_levels { vec![Level::whole(&mesh)] } else { Vec::new() };
        let (bounds, aabb) = (Sphere::around(&mesh.positions), mesh.aabb());
        Self {
            mesh,
            bounds,
            aabb,
            tangents_ready: false,
            levels,
            level_indices: Vec::new(),
            without_levels,
            level_bounds: bounds,
            ends_at: None,
        }
    }

    /// A mesh with tangents, of which there are only levels: all but the first, which is empty, in these indices.
    pub(super) fn of_levels(mesh: Mesh, levels: Vec<Level>, level_indices: Vec<u32>, level_bounds: Sphere) -> Self {
        Self { tangents_ready: true, levels, level_indices, level_bounds, ..Self::new(mesh, true) }
    }

    /// Tells if some level has triangles.
    pub fn is_drawn(&self) -> bool {
        !self.mesh.indices.is_empty() || !self.level_indices.is_empty()
    }

    /// CPU memory, bytes.
    pub fn bytes(&self) -> u64 {
        let Mesh { positions, normals, tangents, uvs: [first, second], colors, indices, .. } = &self.mesh;
        let bytes = size_of_val(&positions[..])
            + size_of_val(&normals[..])
            + size_of_val(&tangents[..])
            + size_of_val(&first[..])
            + size_of_val(&second[..])
            + size_of_val(&colors[..])
            + size_of_val(&indices[..])
            + size_of_val(&self.levels[..])
            + size_of_val(&self.level_indices[..]);
        bytes as u64
    }
}

/// An entity that can show one of several meshes in turn; the window's key F cycles it.
#[derive(Component, Clone, PartialEq, Debug, serde::Serialize, serde::Deserialize)]
pub struct MeshVariants {
    /// The meshes, in order; the entity starts with the first.
    pub meshes: Vec<MeshId>,
    /// Index of the mesh that is shown.
    pub shown: usize,
}
