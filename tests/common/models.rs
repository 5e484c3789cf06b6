//! Meshes to bake from and to, and glTF files of meshes.

#![allow(dead_code)]

use crate::common::prelude::*;

/// A torus of few triangles, 1 m and 0.4 m.
pub fn coarse_torus() -> Mesh {
    shapes::torus(1.0, 0.4, 48, 24)
}

/// The same torus of `2 · segments · sides` triangles, with scales and grooves up to 0.05 m high.
pub fn fine_torus(segments: u32, sides: u32) -> Mesh {
    displaced(shapes::torus(1.0, 0.4, segments, sides), |uv| {
        let (u, v) = (uv.x * std::f32::consts::TAU, uv.y * std::f32::consts::TAU);
        0.03 * (24.0 * u).sin() * (10.0 * v).sin() + 0.02 * ((7.0 * u + 5.0 * v).sin() * 4.0).clamp(-1.0, 1.0)
    })
}

/// A mesh moved along its normals by metres that depend on the UV, with normals to match. Vertices in the same place
/// stay together if heights agree there.
pub fn displaced(mut mesh: Mesh, height: impl Fn(Vec2) -> f32) -> Mesh {
    for ((position, normal), uv) in mesh.positions.iter_mut().zip(&mesh.normals).zip(&mesh.uvs[0]) {
        *position += *normal * height(*uv);
    }
    let key = |p: Vec3| (p * 8192.0).round().as_ivec3();
    let mut sums = std::collections::HashMap::<_, Vec3>::new();
    for triangle in mesh.indices.as_chunks::<3>().0 {
        let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
        [a, b, c].into_iter().for_each(|p| *sums.entry(key(p)).or_default() += (b - a).cross(c - a));
    }
    for (normal, position) in mesh.normals.iter_mut().zip(&mesh.positions) {
        *normal = sums.get(&key(*position)).and_then(|sum| sum.try_normalize()).unwrap_or(*normal);
    }
    mesh
}

/// A sheet of the XZ plane, as [`shapes::plane`], moved up by metres that depend on x and z.
pub fn landscape(size: f32, segments: u32, height: impl Fn(f32, f32) -> f32) -> Mesh {
    let mut mesh = shapes::plane(Vec2::splat(size), UVec2::splat(segments));
    mesh.positions.iter_mut().for_each(|p| p.y = height(p.x, p.z));
    displaced(mesh, |_| 0.0)
}

/// A binary glTF file of meshes, each at a node of its own, named after its mesh, with a scale.
pub fn glb(meshes: &[(&Mesh, [f32; 3])]) -> Vec<u8> {
    let mut file = File::default();
    let primitives: Vec<Value> = meshes.iter().map(|(mesh, _)| file.mesh(mesh)).collect();
    let nodes: Vec<Value> = meshes
        .iter()
        .enumerate()
        .map(|(i, (mesh, scale))| json!({"mesh": i, "name": mesh.name, "scale": scale}))
        .collect();
    let document = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": (0..nodes.len()).collect::<Vec<_>>()}],
        "nodes": nodes,
        "meshes": primitives,
        "accessors": file.accessors,
        "bufferViews": file.views,
        "buffers": [{"byteLength": file.bytes.len()}],
    });
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + text.len() + 8 + file.bytes.len();
    let word = |number: usize| (number as u32).to_le_bytes();
    let mut glb = [b"glTF".as_slice(), &word(2), &word(total)].concat();
    glb.extend([&word(text.len()), b"JSON".as_slice(), &text].concat());
    glb.extend([&word(file.bytes.len()), b"BIN\0".as_slice(), &file.bytes].concat());
    glb
}

#[derive(Default)]
struct File {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl File {
    fn mesh(&mut self, mesh: &Mesh) -> Value {
        let low = mesh.positions.iter().fold(Vec3::INFINITY, |a, &b| a.min(b));
        let high = mesh.positions.iter().fold(Vec3::NEG_INFINITY, |a, &b| a.max(b));
        let bounds = json!({"min": low.to_array(), "max": high.to_array()});
        let mut attributes = json!({
            "POSITION": self.accessor(bytemuck::cast_slice(&mesh.positions), 5126, "VEC3", mesh.positions.len(), bounds),
            "NORMAL": self.accessor(bytemuck::cast_slice(&mesh.normals), 5126, "VEC3", mesh.normals.len(), json!({})),
        });
        for (set, uvs) in mesh.uvs.iter().enumerate().filter(|(_, uvs)| !uvs.is_empty()) {
            let id = self.accessor(bytemuck::cast_slice(uvs), 5126, "VEC2", uvs.len(), json!({}));
            attributes[format!("TEXCOORD_{set}")] = json!(id);
        }
        if !mesh.tangents.is_empty() {
            let tangents: &[Vec4] = &mesh.tangents;
            attributes["TANGENT"] =
                json!(self.accessor(bytemuck::cast_slice(tangents), 5126, "VEC4", tangents.len(), json!({})));
        }
        let indices = self.accessor(bytemuck::cast_slice(&mesh.indices), 5125, "SCALAR", mesh.indices.len(), json!({}));
        json!({"name": mesh.name, "primitives": [{"attributes": attributes, "indices": indices}]})
    }

    fn accessor(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize, more: Value) -> usize {
        self.views.push(json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()}));
        self.bytes.extend_from_slice(bytes);
        let mut accessor = json!({
            "bufferView": self.views.len() - 1, "componentType": component, "type": kind, "count": count,
        });
        for (name, value) in more.as_object().into_iter().flatten() {
            accessor[name] = value.clone();
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }
}
