//! Levels of detail: each mesh with fewer triangles, for where it is small in the picture.
//!
//! [`update_levels`] runs [`simplify`] once per mesh, after its tangents, the meshes of a frame in parallel. All levels
//! share the vertices of the mesh; a level is a range of indices and an error ([`Level`]). Which one is drawn depends
//! on how large that error would be in the picture: the renderer chooses it for each object in the pass that culls, and
//! [`LevelOfDetail::choose`] is the same choice in words that can be tested.
//!
//! An open border stays as it is in every level, vertex by vertex. So nothing gapes where meshes meet: pieces of a mesh
//! that was cut ([`crate::assets::split`]), parts of a model with a material each.

use super::library::Library;
use super::mesh::{Level, Mesh, MeshEntry};
use super::tangents::{bits, crowded_vertices};
use crate::ecs::parallel::in_parallel;
use bevy_ecs::prelude::*;
use glam::{DVec2, DVec3, Vec2, Vec4};
use meshopt::{SimplifyOptions, SimplifyVertex, VertexDataAdapter, simplify_scale, simplify_with_attributes_and_locks};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Levels of a mesh, with the mesh itself.
pub const MOST_LEVELS: usize = 8;

/// Meshes of fewer triangles have no other level: a draw costs more than they do.
const FEWEST_TO_SIMPLIFY: usize = 128;

/// No level has fewer triangles.
const FEWEST_IN_A_LEVEL: usize = 32;

/// A level that keeps more than this part of the one before is not worth its memory.
const WORTHWHILE: f64 = 0.8;

/// Levels further from the mesh than this, as a part of its longest side, are of no use.
const MOST_ERROR: f32 = 0.25;

/// Farthest error over the mean error around a vertex, which is the one that the simplifier reports. On round shapes
/// the farthest point of a level was measured up to 1.4 times as far.
const FARTHEST: f32 = 1.5;

/// Weight of a difference of normals: one of 1 over a patch is as bad as a distance of half the patch's length.
const NORMAL_WEIGHT: f32 = 0.5;

/// The same for colours.
const COLOR_WEIGHT: f32 = 0.5;

/// Settings of the choice of levels.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct LevelOfDetail {
    /// Off: every mesh as it is.
    pub enabled: bool,
    /// Pixels that a level's error may cover.
    pub max_error_pixels: f32,
}

impl Default for LevelOfDetail {
    fn default() -> Self {
        Self { enabled: true, max_error_pixels: 1.0 }
    }
}

impl LevelOfDetail {
    /// Every mesh as it is.
    pub const OFF: Self = Self { enabled: false, max_error_pixels: 0.0 };

    /// Metres that a level may be off at a distance of one metre, or anywhere in a parallel view; 0 where every mesh is
    /// drawn as it is. `pixels_at_1m`: see [`Self::choose`].
    pub fn allowed_error(&self, pixels_at_1m: f32) -> f32 {
        if self.enabled { self.max_error_pixels.max(0.0) / pixels_at_1m } else { 0.0 }
    }

    /// The coarsest level whose error covers no more pixels than it may: `error · world_scale · pixels_at_1m /
    /// distance`.
    ///
    /// `world_scale` is the longest that an object-space unit is in the world. `distance` is metres from the eye to the
    /// nearest point of the object's bounds; where it is not above 0 the eye is inside and the mesh is drawn as it is.
    /// `pixels_at_1m` is how many pixels a metre covers at a distance of one: half the picture's height over
    /// tan(half the vertical field of view).
    ///
    /// Depends on nothing else, so there is nothing that it could hang on to: the same place gives the same level.
    ///
    /// ```
    /// use systems::assets::{Level, levels::LevelOfDetail};
    /// let level = |error| Level { first_index: 0, index_count: 3, error };
    /// let levels = [level(0.0), level(0.01), level(0.02)];
    /// let choose = |distance| LevelOfDetail::default().choose(&levels, 1.0, distance, 1000.0);
    /// assert_eq!([choose(5.0), choose(15.0), choose(25.0)], [0, 1, 2]);
    /// ```
    pub fn choose(&self, levels: &[Level], world_scale: f32, distance: f32, pixels_at_1m: f32) -> usize {
        if !self.enabled || self.max_error_pixels.is_nan() || self.max_error_pixels <= 0.0 {
            return 0;
        }
        let pixels_per_unit = world_scale * pixels_at_1m;
        let fits = |level: &Level| level.error * pixels_per_unit <= self.max_error_pixels * distance;
        if distance > 0.0 { levels.iter().rposition(fits).unwrap_or(0) } else { 0 }
    }
}

/// Simplifies meshes that were added since the last frame.
pub fn update_levels(mut library: ResMut<Library>, mut seen: Local<u64>) {
    let meshes = library.revisions().meshes;
    if std::mem::replace(&mut *seen, meshes) == meshes || library.meshes().all(|(_, entry)| !entry.levels.is_empty()) {
        return;
    }
    let pending = library.meshes_mut(|entry| entry.levels.is_empty());
    in_parallel(pending.collect::<Vec<_>>().into_iter(), MeshEntry::make_levels);
}

impl MeshEntry {
    /// Tells if tangents and levels are there.
    pub fn is_finished(&self) -> bool {
        self.tangents_ready && !self.levels.is_empty()
    }

    /// Makes missing tangents and levels, where that is not to be left to the systems.
    pub fn finish(&mut self) {
        if !self.tangents_ready {
            self.make_tangents();
        }
        if self.levels.is_empty() {
            self.make_levels();
        }
    }

    fn make_levels(&mut self) {
        (self.levels, self.level_indices) =
            if self.without_levels { (vec![Level::whole(&self.mesh)], Vec::new()) } else { simplify(&self.mesh) };
        let Some(error) = self.ends_at else { return };
        self.levels.retain(|level| level.error < error);
        self.levels.truncate(MOST_LEVELS - 1);
        let end = self.mesh.indices.len() + self.level_indices.len();
        self.levels.push(Level { first_index: end as u32, index_count: 0, error });
    }
}

/// The levels of a mesh whose tangents are there, finest first, and the indices of all but the first.
///
/// Each has about half the triangles of the one before, as far as borders and seams allow.
pub fn simplify(mesh: &Mesh) -> (Vec<Level>, Vec<u32>) {
    let mut levels = vec![Level::whole(mesh)];
    let mut indices = Vec::new();
    let Some(simplifier) = Simplifier::new(mesh) else { return (levels, indices) };
    let mut finer = mesh.indices.clone();
    let mut error = 0.0;
    while levels.len() < MOST_LEVELS && finer.len() >= 2 * 3 * FEWEST_IN_A_LEVEL {
        let (coarser, added) = simplifier.halve(&finer);
        // Each level is made from the one before, so errors add up.
        error += added;
        let is_worth_it = coarser.len() as f64 <= WORTHWHILE * finer.len() as f64;
        if !is_worth_it || coarser.len() < 3 * FEWEST_IN_A_LEVEL || !error.is_finite() {
            break;
        }
        let first_index = (mesh.indices.len() + indices.len()) as u32;
        levels.push(Level { first_index, index_count: coarser.len() as u32, error });
        indices.extend_from_slice(&coarser);
        finer = coarser;
    }
    (levels, indices)
}

/// Input of the simplifier, made once for all levels of a mesh.
struct Simplifier<'a> {
    vertices: VertexDataAdapter<'a>,
    /// Numbers of the vertices, one per weight and vertex.
    attributes: Vec<f32>,
    weights: Vec<f32>,
    /// Vertices that may not be moved across a seam.
    locks: Vec<SimplifyVertex>,
    /// Metres.
    most_error: f32,
}

impl<'a> Simplifier<'a> {
    /// `None` for a mesh that is to stay as it is: too small, or nothing that could be simplified.
    fn new(mesh: &'a Mesh) -> Option<Self> {
        let count = mesh.positions.len();
        let is_valid = mesh.indices.len().is_multiple_of(3)
            && mesh.indices.iter().all(|&index| (index as usize) < count)
            && mesh.normals.len() == count
            && mesh.positions.iter().all(|p| p.is_finite());
        if !is_valid || mesh.triangle_count() < FEWEST_TO_SIMPLIFY || mesh.indices.len() > u32::MAX as usize / 4 {
            return None;
        }
        // Simplifying walks around vertices, too, and takes quadratic time in the number of triangles there.
        if crowded_vertices(mesh).contains(&true) {
            return None;
        }
        let vertices =
            VertexDataAdapter::new(bytemuck::cast_slice(&mesh.positions), size_of::<glam::Vec3>(), 0).ok()?;
        let scale = simplify_scale(&vertices);
        if !scale.is_normal() || !(scale * scale).is_normal() {
            return None;
        }
        let (attributes, weights) = attributes(mesh, scale);
        Some(Self { vertices, attributes, weights, locks: protected(mesh), most_error: MOST_ERROR * scale })
    }

    /// About half the triangles, and the error of that in metres.
    fn halve(&self, indices: &[u32]) -> (Vec<u32>, f32) {
        let half = indices.len() / 6 * 3;
        let stride = self.weights.len() * size_of::<f32>();
        let mut error = 0.0;
        let options = SimplifyOptions::LockBorder
            | SimplifyOptions::Permissive
            | SimplifyOptions::Sparse
            | SimplifyOptions::ErrorAbsolute;
        let coarser = simplify_with_attributes_and_locks(
            indices,
            &self.vertices,
            &self.attributes,
            &self.weights,
            stride,
            &self.locks,
            half,
            self.most_error,
            options,
            Some(&mut error),
        );
        (coarser, error * FARTHEST)
    }
}

/// Vertices that are one of several at their place because their texture coordinates or tangents differ: a triangle
/// from one side of such a seam to the other would show what neither shows. Edges that are hard in their normals alone
/// may go.
fn protected(mesh: &Mesh) -> Vec<SimplifyVertex> {
    let same = |a: usize, b: usize| {
        let uvs = mesh.uvs.iter().all(|uvs| uvs.get(a) == uvs.get(b));
        let sign = |vertex: usize| mesh.tangents.get(vertex).map(|t| t.w);
        uvs && sign(a) == sign(b)
    };
    let mut first_at = HashMap::with_capacity(mesh.positions.len());
    let mut flags = vec![SimplifyVertex::None; mesh.positions.len()];
    for (vertex, position) in mesh.positions.iter().enumerate() {
        let first = *first_at.entry(bits(*position)).or_insert(vertex);
        if !same(first, vertex) {
            flags[first] = SimplifyVertex::Protect;
        }
    }
    flags
}

/// Vertex attributes that simplification preserves, and the weight of each number.
fn attributes(mesh: &Mesh, scale: f32) -> (Vec<f32>, Vec<f32>) {
    let (count, uvs) = (mesh.positions.len(), mesh.tangent_uvs());
    let has_uvs = uvs.len() == count && uvs.iter().all(|uv| uv.is_finite());
    let uv_weight = if has_uvs { metres_per_uv(mesh, uvs) / scale } else { 0.0 };
    let uv_weight = if uv_weight.is_normal() { uv_weight } else { 0.0 };
    let has_colors = mesh.colors.len() == count && mesh.colors.iter().all(|color| color.is_finite());
    let mut weights = vec![NORMAL_WEIGHT; 3];
    if uv_weight > 0.0 {
        weights.extend([uv_weight; 2]);
    }
    if has_colors {
        weights.extend([COLOR_WEIGHT; 4]);
    }
    let mut attributes = Vec::with_capacity(count * weights.len());
    for (vertex, normal) in mesh.normals.iter().enumerate() {
        attributes.extend(normal.normalize_or_zero().to_array());
        if uv_weight > 0.0 {
            attributes.extend(uvs[vertex].to_array());
        }
        if has_colors {
            attributes.extend(mesh.colors[vertex].clamp(Vec4::ZERO, Vec4::ONE).to_array());
        }
    }
    (attributes, weights)
}

/// Mean length of a UV unit on the surface, metres: converts a texture's slide to a distance.
fn metres_per_uv(mesh: &Mesh, uvs: &[Vec2]) -> f32 {
    let (mut area, mut uv_area) = (0.0, 0.0);
    for triangle in mesh.indices.as_chunks::<3>().0 {
        let [a, b, c]: [DVec3; 3] = triangle.map(|i| mesh.positions[i as usize].as_dvec3());
        let [u, v, w]: [DVec2; 3] = triangle.map(|i| uvs[i as usize].as_dvec2());
        area += (b - a).cross(c - a).length();
        uv_area += (v - u).perp_dot(w - u).abs();
    }
    (area / uv_area).sqrt() as f32
}
