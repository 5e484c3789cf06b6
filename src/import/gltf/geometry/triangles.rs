//! Triangles out of strips, fans and shared vertices; normals where there are none.

use crate::import::gltf::report::Report;
use glam::{DVec3, Vec3};
use gltf::mesh::Mode;
use systems::assets::Mesh;

/// Three indices per triangle from a triangle list, strip or fan (glTF 2.0, section 3.7.2.1).
pub fn triangles(mode: Mode, indices: Option<&[u32]>, vertices: usize, place: &str, report: &mut Report) -> Vec<u32> {
    let count = indices.map_or(vertices, <[u32]>::len);
    let at = |i: usize| indices.map_or(i as u32, |indices| indices[i]);
    let corners = |i: usize| match mode {
        Mode::TriangleStrip => [i, i + 1 + i % 2, i + 2 - i % 2],
        Mode::TriangleFan => [i + 1, i + 2, 0],
        _ => [3 * i, 3 * i + 1, 3 * i + 2],
    };
    let strip = mode != Mode::Triangles;
    if !strip && !count.is_multiple_of(3) {
        report.warn(place, format!("{count} vertices are not a multiple of 3: the last are ignored"));
    }
    let number = if strip { count.saturating_sub(2) } else { count / 3 };
    let triangles = (0..number).map(|i| corners(i).map(at));
    // Strips are stitched together with triangles of no area.
    let degenerate = |[a, b, c]: &[u32; 3]| a == b || b == c || c == a;
    triangles.filter(|t| !strip || !degenerate(t)).flatten().collect()
}

/// The vertices in use, in order, and the indices into them.
pub fn compact(triangles: &[u32], vertices: usize) -> (Vec<u32>, Vec<u32>) {
    let mut new_from_old = vec![u32::MAX; vertices];
    triangles.iter().for_each(|&v| new_from_old[v as usize] = 0);
    let mut used = Vec::new();
    for (old, new) in new_from_old.iter_mut().enumerate().filter(|(_, new)| **new == 0) {
        *new = used.len() as u32;
        used.push(old as u32);
    }
    let indices = triangles.iter().map(|&v| new_from_old[v as usize]).collect();
    (used, indices)
}

/// One normal per face, so no vertex is shared any more (glTF 2.0, section 3.7.2.1).
pub fn flat_normals(mesh: &mut Mesh) {
    fn unweld<T: Copy>(values: &mut Vec<T>, indices: &[u32]) {
        if !values.is_empty() {
            *values = indices.iter().map(|&i| values[i as usize]).collect();
        }
    }
    unweld(&mut mesh.positions, &mesh.indices);
    unweld(&mut mesh.uvs[0], &mesh.indices);
    unweld(&mut mesh.uvs[1], &mesh.indices);
    unweld(&mut mesh.colors, &mesh.indices);
    mesh.tangents.clear();
    mesh.indices = (0..mesh.positions.len() as u32).collect();
    let faces = mesh.positions.as_chunks::<3>().0;
    mesh.normals = faces.iter().flat_map(|&face| [unit(face_normal(face)).unwrap_or(Vec3::Z); 3]).collect();
}

/// Twice as long as the face is large.
fn face_normal([a, b, c]: [Vec3; 3]) -> DVec3 {
    (b.as_dvec3() - a.as_dvec3()).cross(c.as_dvec3() - a.as_dvec3())
}

/// Unit length; `None` where there is no direction. In 64 bits: the squares of small numbers are none in 32.
pub fn unit(vector: DVec3) -> Option<Vec3> {
    vector.try_normalize().map(|unit| unit.as_vec3())
}

/// Unit length; where a normal has no direction, that of the faces around the vertex.
pub fn unit_normals(mesh: &mut Mesh) {
    let units: Vec<Option<Vec3>> = mesh.normals.iter().map(|n| unit(n.as_dvec3())).collect();
    let mut around = Vec::new();
    if units.contains(&None) {
        around = vec![DVec3::ZERO; mesh.positions.len()];
        for corners in mesh.indices.as_chunks::<3>().0 {
            let normal = face_normal(corners.map(|i| mesh.positions[i as usize]));
            corners.iter().for_each(|&i| around[i as usize] += normal);
        }
    }
    let normals = units.into_iter().enumerate();
    mesh.normals = normals.map(|(i, n)| n.or_else(|| unit(around[i])).unwrap_or(Vec3::Z)).collect();
}
