//! Accessors and attributes.

use crate::support::{first_mesh, floats, push, push_accessor, with_triangle};
use glam::{Vec2, Vec3};
use serde_json::json;

#[test]
fn sparse_values_replace_and_normalized_integers_become_fractions() {
    let (_, library) = with_triangle(|d| {
        let indices = push_accessor(d, &[2], json!({ "componentType": 5121, "count": 1, "type": "SCALAR" }));
        let values =
            push_accessor(d, &floats(&[0.0, 5.0, 0.0]), json!({ "componentType": 5126, "count": 1, "type": "VEC3" }));
        d["accessors"][0]["sparse"] = json!({ "count": 1,
            "indices": { "bufferView": d["accessors"][indices]["bufferView"], "componentType": 5121 },
            "values": { "bufferView": d["accessors"][values]["bufferView"] } });
        let uvs = [0u16, 0, 65535, 0, 0, 32768].iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let uvs =
            push_accessor(d, &uvs, json!({ "componentType": 5123, "count": 3, "type": "VEC2", "normalized": true }));
        d["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uvs);
    })
    .unwrap();
    let mesh = first_mesh(&library);
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y * 5.0]);
    assert_eq!(mesh.uvs[0], [Vec2::ZERO, Vec2::X, Vec2::Y * (32768.0 / 65535.0)]);
    assert_eq!(mesh.normals, [Vec3::Z; 3], "missing normals are flat");
}

#[test]
fn quantized_and_interleaved_attributes_are_read() {
    let vertex = |x: i8, y: i8| [x as u8, y as u8, 0, 0, 0, 0, 127, 0];
    let bytes = [vertex(0, 0), vertex(-100, 0), vertex(0, -128)].concat();
    let (_, library) = with_triangle(|d| {
        let position = push_accessor(d, &bytes, json!({ "componentType": 5120, "count": 3, "type": "VEC3" }));
        let view = d["accessors"][position]["bufferView"].clone();
        d["bufferViews"][view.as_u64().unwrap() as usize]["byteStride"] = json!(8);
        let normal = json!({ "bufferView": view, "byteOffset": 4, "componentType": 5120, "count": 3, "type": "VEC3", "normalized": true });
        let normal = push(d, "accessors", normal);
        d["meshes"][0]["primitives"][0]["attributes"] = json!({ "POSITION": position, "NORMAL": normal });
        d["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
        d["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    })
    .unwrap();
    let mesh = first_mesh(&library);
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X * -100.0, Vec3::Y * -128.0]);
    assert_eq!(mesh.normals, [Vec3::Z; 3]);
}

#[test]
fn morph_targets_stand_at_their_default_weights() {
    let (_, library) = with_triangle(|d| {
        let delta = push_accessor(
            d,
            &floats(&[0.0, 0.0, 2.0].repeat(3)),
            json!({ "componentType": 5126, "count": 3, "type": "VEC3" }),
        );
        d["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": delta }]);
        d["meshes"][0]["weights"] = json!([0.5]);
    })
    .unwrap();
    assert_eq!(first_mesh(&library).positions[0], Vec3::Z);
}
