//! Tangents of meshes: MikkTSpace where there are UVs, a frame from the normal alone where there are none.
//!
//! [`update_tangents`] runs [`compute_tangents`] once per mesh, the meshes of a frame in parallel. A mesh that brings
//! tangents keeps them. For the others `corner_tangents` gives every triangle corner its own tangent, as MikkTSpace
//! defines it, and `split_vertices` makes vertices of them: a vertex on a mirror seam of the UVs becomes two.
//!
//! The UV set that the normal map is placed by counts ([`Mesh::tangent_uv_set`]). T.w is glTF's sign, B = cross(N, T)·w
//! toward image-up: the negative of the sign of the reference implementation, whose V axis points the other way.

use super::library::Library;
use super::mesh::{Mesh, MeshEntry};
use crate::ecs::parallel::in_parallel;
use bevy_ecs::prelude::*;
use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec2, Vec3, Vec4};
use std::collections::HashMap;

/// Triangles at a point that more corners than this share get the fallback frame: MikkTSpace takes quadratic time and
/// linear stack in the number of triangles around a point.
const MAX_CORNERS_AT_A_POINT: u32 = 1024;

/// Origin of a mesh's tangents.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct TangentReport {
    /// The mesh brought them.
    pub supplied: bool,
    /// Vertices of the finished mesh whose frame comes from the normal alone, because its UVs are missing or
    /// degenerate or its supplied tangent was unusable.
    pub fallbacks: usize,
}

/// Computes the tangents of meshes that were added since the last frame.
pub fn update_tangents(mut library: ResMut<Library>, mut seen: Local<u64>) {
    let meshes = library.revisions().meshes;
    if std::mem::replace(&mut *seen, meshes) == meshes || library.meshes().all(|(_, entry)| entry.tangents_ready) {
        return;
    }
    let pending = library.meshes_mut(|entry| !entry.tangents_ready);
    in_parallel(pending.collect::<Vec<_>>().into_iter(), MeshEntry::make_tangents);
}

impl MeshEntry {
    pub(crate) fn make_tangents(&mut self) {
        compute_tangents(&mut self.mesh);
        self.tangents_ready = true;
    }
}

/// Fills `tangents` so that every vertex has a finite unit tangent across its normal and a sign of ±1.
///
/// Supplied tangents stay as they are, except those that no frame can be made of. Computed ones may split vertices,
/// merge equal ones and change their order; all attributes follow. What would make the mesh unusable is mended on the
/// way: triangles that index beyond the vertices go, attributes of the wrong length go, normals without a direction
/// are taken from the faces around.
pub fn compute_tangents(mesh: &mut Mesh) -> TangentReport {
    mend_arrays(mesh);
    mend_normals(mesh);
    let supplied = !mesh.tangents.is_empty();
    if supplied || mesh.tangent_uvs().is_empty() || mesh.indices.is_empty() {
        mesh.tangents.resize(mesh.positions.len(), Vec4::ZERO);
    } else {
        let corners = corner_tangents(mesh);
        split_vertices(mesh, &corners);
    }
    let mut fallbacks = 0;
    for (tangent, &normal) in mesh.tangents.iter_mut().zip(&mesh.normals) {
        if !is_usable(*tangent, normal) {
            *tangent = fallback_tangent(normal);
            fallbacks += 1;
        }
    }
    TangentReport { supplied, fallbacks }
}

/// Makes all filled arrays as long as the positions and all indices valid.
fn mend_arrays(mesh: &mut Mesh) {
    let count = mesh.positions.len();
    fn drop_mismatched<T>(values: &mut Vec<T>, count: usize) {
        if values.len() != count {
            values.clear();
        }
    }
    drop_mismatched(&mut mesh.normals, count);
    mesh.normals.resize(count, Vec3::ZERO);
    drop_mismatched(&mut mesh.tangents, count);
    drop_mismatched(&mut mesh.colors, count);
    for uvs in &mut mesh.uvs {
        drop_mismatched(uvs, count);
    }
    let is_valid = |triangle: &[u32]| triangle.iter().all(|&index| (index as usize) < count);
    if !mesh.indices.len().is_multiple_of(3) || !is_valid(&mesh.indices) {
        mesh.indices = mesh.indices.as_chunks::<3>().0.iter().filter(|t| is_valid(*t)).flatten().copied().collect();
    }
}

/// Gives normals that are zero or not finite the direction of the faces around them, weighted by area; +Y where there
/// are none.
fn mend_normals(mesh: &mut Mesh) {
    let is_bad = |normal: Vec3| normal.try_normalize().is_none();
    if !mesh.normals.iter().any(|&normal| is_bad(normal)) {
        return;
    }
    let mut sums = vec![Vec3::ZERO; mesh.positions.len()];
    for triangle in mesh.indices.as_chunks::<3>().0 {
        let [a, b, c] = triangle.map(|index| mesh.positions[index as usize]);
        let face = (b - a).cross(c - a);
        if face.is_finite() {
            triangle.iter().for_each(|&index| sums[index as usize] += face);
        }
    }
    for (normal, sum) in mesh.normals.iter_mut().zip(sums) {
        if is_bad(*normal) {
            *normal = sum.try_normalize().unwrap_or(Vec3::Y);
        }
    }
}

/// Tells if a tangent and a normal make a frame: finite, neither zero nor parallel, with a sign.
fn is_usable(tangent: Vec4, normal: Vec3) -> bool {
    let across = normal.normalize_or_zero().cross(tangent.truncate());
    tangent.is_finite() && tangent.w != 0.0 && across.length_squared() > 1e-6
}

/// A tangent from the normal alone: Duff et al., Building an Orthonormal Basis, Revisited (JCGT 2017), which is what
/// glam computes. It has one seam, where z changes its sign.
fn fallback_tangent(normal: Vec3) -> Vec4 {
    normal.try_normalize().unwrap_or(Vec3::Y).any_orthonormal_pair().0.extend(1.0)
}

/// The tangent of each triangle corner, in index order; zero where MikkTSpace has none.
fn corner_tangents(mesh: &Mesh) -> Vec<Vec4> {
    let triangles = mesh.indices.as_chunks::<3>().0;
    let crowded = crowded_vertices(mesh);
    let is_valid = |triangle: &[u32; 3]| {
        let p = triangle.map(|index| mesh.positions[index as usize]);
        let has_area = p[0] != p[1] && p[1] != p[2] && p[2] != p[0];
        let is_finite = |&i: &u32| mesh.positions[i as usize].is_finite() && mesh.tangent_uvs()[i as usize].is_finite();
        has_area && triangle.iter().all(|i| is_finite(i) && !crowded[*i as usize])
    };
    let (sound, degenerate): (Vec<usize>, Vec<usize>) = (0..triangles.len()).partition(|&t| is_valid(&triangles[t]));
    let mut corners = SoundTriangles { mesh, sound: &sound, tangents: vec![Vec4::ZERO; mesh.indices.len()] };
    // No error exists today; one would leave tangents at zero, where the fallback takes over.
    let _ = generate_tangents(&mut corners);
    let mut tangents = corners.tangents;
    borrow_tangents(mesh, &sound, &degenerate, &mut tangents);
    tangents
}

/// For each vertex whether more than `MAX_CORNERS_AT_A_POINT` corners lie where it lies.
pub(crate) fn crowded_vertices(mesh: &Mesh) -> Vec<bool> {
    let mut corners = vec![0u32; mesh.positions.len()];
    mesh.indices.iter().for_each(|&index| corners[index as usize] += 1);
    let mut corners_at = HashMap::<[u32; 3], u32>::new();
    for (position, count) in mesh.positions.iter().zip(corners) {
        *corners_at.entry(bits(*position)).or_default() += count;
    }
    mesh.positions.iter().map(|p| corners_at[&bits(*p)] > MAX_CORNERS_AT_A_POINT).collect()
}

/// Corners of degenerate triangles take the tangent of the first sound corner with the same position, normal and UV.
/// The library would do it too, in quadratic time.
fn borrow_tangents(mesh: &Mesh, sound: &[usize], degenerate: &[usize], tangents: &mut [Vec4]) {
    if degenerate.is_empty() {
        return;
    }
    let key = |corner: usize| {
        let vertex = mesh.indices[corner] as usize;
        (bits(mesh.positions[vertex]), bits(mesh.normals[vertex]), bits(mesh.tangent_uvs()[vertex].extend(0.0)))
    };
    let corners_of = |triangles: &[usize]| triangles.iter().flat_map(|t| [t * 3, t * 3 + 1, t * 3 + 2]).collect();
    let (sound, degenerate): (Vec<usize>, Vec<usize>) = (corners_of(sound), corners_of(degenerate));
    let mut lenders = HashMap::new();
    for corner in sound {
        lenders.entry(key(corner)).or_insert(tangents[corner]);
    }
    for corner in degenerate {
        tangents[corner] = lenders.get(&key(corner)).copied().unwrap_or_default();
    }
}

/// The bits of a vector, the same for both zeros.
pub(crate) fn bits(v: Vec3) -> [u32; 3] {
    (v + 0.0).to_array().map(f32::to_bits)
}

/// View of a mesh for MikkTSpace.
struct SoundTriangles<'a> {
    mesh: &'a Mesh,
    sound: &'a [usize],
    tangents: Vec<Vec4>,
}

impl SoundTriangles<'_> {
    fn corner(&self, face: usize, vert: usize) -> usize {
        self.sound[face] * 3 + vert
    }

    fn vertex(&self, face: usize, vert: usize) -> usize {
        self.mesh.indices[self.corner(face, vert)] as usize
    }
}

impl Geometry for SoundTriangles<'_> {
    fn num_faces(&self) -> usize {
        self.sound.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, vert: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, vert)].to_array()
    }

    fn normal(&self, face: usize, vert: usize) -> [f32; 3] {
        self.mesh.normals[self.vertex(face, vert)].to_array()
    }

    fn tex_coord(&self, face: usize, vert: usize) -> [f32; 2] {
        self.mesh.tangent_uvs()[self.vertex(face, vert)].to_array()
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, vert: usize) {
        let corner = self.corner(face, vert);
        self.tangents[corner] = space.map_or(Vec4::ZERO, |space| {
            let [x, y, z, reference_sign] = space.tangent_encoded();
            Vec4::new(x, y, z, -reference_sign)
        });
    }
}

/// Gives each corner a vertex with its tangent. Corners with the same attributes and the same tangent, bit for bit,
/// share one; vertices stand in the order of their first corner.
fn split_vertices(mesh: &mut Mesh, corner_tangents: &[Vec4]) {
    const NONE: u32 = u32::MAX;
    let merged = merged_vertices(mesh);
    // The new vertices that come from one old vertex are a linked list: `first`, then `next`.
    let mut first = vec![NONE; mesh.positions.len()];
    let mut next: Vec<u32> = Vec::new();
    let mut sources: Vec<usize> = Vec::new();
    let mut tangents: Vec<Vec4> = Vec::new();
    for (index, &tangent) in mesh.indices.iter_mut().zip(corner_tangents) {
        let source = merged[*index as usize] as usize;
        let mut vertex = first[source];
        while vertex != NONE && bytemuck::bytes_of(&tangents[vertex as usize]) != bytemuck::bytes_of(&tangent) {
            vertex = next[vertex as usize];
        }
        if vertex == NONE {
            vertex = sources.len() as u32;
            sources.push(source);
            tangents.push(tangent);
            next.push(std::mem::replace(&mut first[source], vertex));
        }
        *index = vertex;
    }
    fn gather<T: Copy>(values: &mut Vec<T>, sources: &[usize]) {
        if !values.is_empty() {
            *values = sources.iter().map(|&source| values[source]).collect();
        }
    }
    gather(&mut mesh.positions, &sources);
    gather(&mut mesh.normals, &sources);
    gather(&mut mesh.colors, &sources);
    mesh.uvs.iter_mut().for_each(|uvs| gather(uvs, &sources));
    mesh.tangents = tangents;
}

/// For each vertex the first one with the same attributes, bit for bit.
fn merged_vertices(mesh: &Mesh) -> Vec<u32> {
    let mut first_with = HashMap::with_capacity(mesh.positions.len());
    let vertices = 0..mesh.positions.len();
    let attributes = |vertex: usize| {
        let uv = |set: usize| mesh.uvs[set].get(vertex).map_or([0; 2], |uv: &Vec2| uv.to_array().map(f32::to_bits));
        let color = mesh.colors.get(vertex).map_or([0; 4], |color| color.to_array().map(f32::to_bits));
        let position = mesh.positions[vertex].to_array().map(f32::to_bits);
        (position, mesh.normals[vertex].to_array().map(f32::to_bits), uv(0), uv(1), color)
    };
    vertices.map(|vertex| *first_with.entry(attributes(vertex)).or_insert(vertex as u32)).collect()
}
