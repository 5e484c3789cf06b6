//! Accessors and attributes.

use crate::common::prelude::*;
use crate::support::*;

#[test]
fn sparse_values_replace_and_normalized_integers_become_fractions() {
    let (_, library) = with_triangle(|d| {
        let indices = push_accessor(d, &[2], json!({ "componentType": 5121, "count": 1, "type": "SCALAR" }));
        let values = push_floats(d, &[0.0, 5.0, 0.0], "VEC3");
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
        let delta = push_floats(d, &[0.0, 0.0, 2.0].repeat(3), "VEC3");
        d["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": delta }]);
        d["meshes"][0]["weights"] = json!([0.5]);
    })
    .unwrap();
    assert_eq!(first_mesh(&library).positions[0], Vec3::Z);
}

/// A vertex's place is refused where scenes refuse places, with mesh, vertex and file.
#[test]
fn vertices_that_are_too_far_away_are_refused() {
    let load = |far: f32, scale: f32| {
        with_triangle(|d| {
            let positions = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, far, 0.0]);
            let positions = push_accessor(d, &positions, json!({ "componentType": 5126, "count": 3, "type": "VEC3" }));
            d["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(positions);
            d["nodes"][0]["scale"] = json!([scale, scale, scale]);
        })
    };
    let refused = |far, scale| load(far, scale).err().map(|error| error.to_string()).unwrap_or_default();
    for far in [1e14, 1e20, -1e30, 1e38] {
        assert_has(&refused(far, 1.0), &["made.gltf", "meshes[0].primitives[0].attributes.POSITION", "vertex 2"]);
    }
    for (far, scale) in [(1.5e7, 1.0), (-2.0, 1e7), (1e12, 1.0)] {
        assert_has(&refused(far, scale), &["made.gltf", "nodes[0]", "vertex at [0, ", "10000 km"]);
    }
    // Millimetres, as the node says.
    assert!(load(9e6, 1.0).is_ok() && load(9e9, 1e-3).is_ok());
}

#[test]
fn nodes_and_instances_that_are_too_far_away_are_refused() {
    let told = |change: fn(&mut Value)| with_triangle(change).err().map(|error| error.to_string()).unwrap_or_default();
    let node = told(|d| d["nodes"][0]["translation"] = json!([0, 2e7, 0]));
    assert_has(&node, &["nodes[0]", "2.0e7 m", "10000 km"]);
    let instances = told(|d| {
        let places = floats(&[0.0, 0.0, 0.0, 0.0, 1e20, 0.0]);
        let places = push_accessor(d, &places, json!({ "componentType": 5126, "count": 2, "type": "VEC3" }));
        let attributes = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": places } } });
        d["nodes"][0]["extensions"] = attributes;
        d["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    });
    assert_has(&instances, &["nodes[0]", "10000 km"]);
}
