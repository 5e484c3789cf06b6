//! Refusals, omissions, and files that are sound however they are written.

use crate::common::prelude::*;
use crate::support::*;
use base64::Engine;

#[test]
fn what_a_file_can_do_without_does_not_refuse_it() {
    type Change = Box<dyn FnOnce(&mut Value)>;
    fn by(change: impl FnOnce(&mut Value) + 'static) -> Change {
        Box::new(change)
    }
    let light = |light: Value| by(move |d| set_lights(d, json!([light])));
    let camera = |camera: Value| {
        by(move |d| {
            d["cameras"] = json!([camera, { "type": "perspective", "perspective": { "yfov": 0.5, "znear": 1 } }]);
            d["nodes"][0]["camera"] = json!(0);
            d["scenes"][0]["nodes"] = json!([0, 1]);
            push(d, "nodes", json!({ "camera": 1 }));
        })
    };
    let lens = |key: &str, value: Value| {
        let mut lens = json!({ "yfov": 0.5, "znear": 1, "zfar": 2 });
        lens[key] = value;
        camera(json!({ "type": "perspective", "perspective": lens }))
    };
    let material = |material: Value| by(move |d| set_material(d, material));
    let extended = |extension: &str, value: Value| material(json!({ "extensions": { extension: value } }));
    let lights = "extensions.KHR_lights_punctual.lights[0]";
    let changes = [
        (&*format!("{lights}.type"), light(json!({ "color": [1, 1, 1] }))),
        (&format!("{lights}.intensity"), light(json!({ "type": "point", "intensity": -1 }))),
        (
            "nodes[0].extensions.KHR_lights_punctual.light",
            by(|d| d["nodes"][0]["extensions"] = json!({ "KHR_lights_punctual": { "light": 7 } })),
        ),
        ("cameras[0].perspective.aspectRatio", lens("aspectRatio", json!(0))),
        ("cameras[0].perspective.yfov", lens("yfov", json!("wide"))),
        ("cameras[0].perspective.yfov", lens("yfov", json!(4))),
        ("cameras[0].perspective.zfar", lens("zfar", json!(0.5))),
        ("cameras[0]", camera(json!({ "type": "perspective" }))),
        ("cameras[0]", camera(json!(7))),
        (
            "materials[0].extensions.KHR_materials_specular.specularFactor",
            extended("KHR_materials_specular", json!({ "specularFactor": "much" })),
        ),
        (
            "materials[0].extensions.KHR_materials_emissive_strength",
            extended("KHR_materials_emissive_strength", json!([])),
        ),
        ("materials[0].name", material(json!({ "name": 5 }))),
        ("asset.generator", by(|d| d["asset"]["generator"] = json!(["a", "b"]))),
        ("accessors[0].min", by(|d| d["accessors"][0]["min"] = json!("low"))),
        (
            "nodes[0].extensions.EXT_mesh_gpu_instancing.attributes.SCALE",
            by(|d| {
                let two = push_floats(d, &[1.0; 6], "VEC3");
                let attributes = json!({ "TRANSLATION": 0, "SCALE": two });
                d["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
            }),
        ),
        (
            "nodes[0].skin",
            by(|d| {
                let whole = json!({ "componentType": 5123, "count": 3, "type": "VEC4" });
                let joints = push_accessor(d, &[0; 24], whole);
                let weights = push_floats(d, &[1.0, 0.0, 0.0, 0.0].repeat(3), "VEC4");
                d["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(joints);
                d["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(weights);
                d["skins"] = json!([{ "joints": [0] }]);
                (d["nodes"][0]["skin"], d["nodes"][0]["scale"]) = (json!(0), json!([0, 1, 1]));
            }),
        ),
        (
            "images[0].uri",
            by(|d| {
                d["images"] = json!([{ "uri": "https://example.com/a.png" }]);
                d["textures"] = json!([{ "source": 0 }]);
                set_material(d, json!({ "emissiveTexture": { "index": 0 } }));
            }),
        ),
        ("animations", by(|d| d["animations"] = json!([{ "channels": "none", "samplers": [{ "input": 99 }] }, 3]))),
    ];
    for (place, change) in changes {
        let (model, library) = with_triangle(change).unwrap_or_else(|error| panic!("{place}: {error}"));
        assert!(model.warnings.iter().any(|w| w.place == place), "{place}: {:?}", model.warnings);
        assert_eq!((model.nodes[0].parts.len(), library.meshes().count()), (1, 1), "{place}");
        if place.starts_with("cameras") {
            assert_eq!(model.cameras().len(), 1, "{place}: the other camera stays");
        }
    }
    // Not where the file says that it cannot do without.
    let required = with_triangle(|d| {
        set_lights(d, json!([{ "color": [1, 1, 1] }]));
        d["extensionsRequired"] = json!(["KHR_lights_punctual"]);
    });
    assert!(required.unwrap_err().to_string().contains("lights[0].type"));
    // Rounded to 32 bits, and a byte order mark.
    with_triangle(|d| d["nodes"][0]["rotation"] = json!([0, 0, 0, 1.0000001192092896])).unwrap();
}

#[test]
fn refusals_name_the_place() {
    let sparse = |d: &mut Value| {
        let index = push_accessor(d, &[3], json!({ "componentType": 5121, "count": 1, "type": "SCALAR" }));
        let view = &d["accessors"][index]["bufferView"];
        d["accessors"][0]["sparse"] = json!({ "count": 1,
            "indices": { "bufferView": view, "componentType": 5121 }, "values": { "bufferView": 0 } });
    };
    let nowhere = floats(&[0.0, 0.0, f32::NAN, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    // A place in the document, what is put there, and what is said of it.
    for (place, value, part) in [
        ("/accessors/0/count", json!(4), "accessors[0]: 4 elements from byte 0 run past bufferViews[0]"),
        ("/accessors/0/bufferView", json!(1u64 << 32), "accessors[0].bufferView: bufferViews[4294967296]"),
        ("/nodes", json!([{ "children": [1] }, { "children": [0], "mesh": 0 }]), "nodes[0]: is its own ancestor"),
        ("/nodes", json!([{ "children": [2] }, { "children": [2] }, {}]), "nodes[1].children[0]"),
        ("/buffers/0/uri", json!("/etc/passwd"), "buffers[0].uri"),
        ("/buffers/0/uri", json!("..%2Fsecret.bin"), "outside the model's directory"),
        ("/buffers/0/uri", json!("https://example.com/a.bin"), "https: URIs are not read"),
        ("/buffers/0/uri", json!("none.bin"), "none.bin"),
        ("/nodes/0", json!({ "mesh": "0" }), "nodes[0].mesh: expected an index into meshes"),
        ("/nodes/0", json!({ "mesh": 0, "scale": [1, 1] }), "nodes[0].scale: expected 3 numbers, found 2"),
        (
            "/buffers/0",
            buffer(&nowhere),
            "meshes[0].primitives[0].attributes.POSITION: expected finite numbers, element 0",
        ),
        // Legal, but nothing in the file justifies the size.
        (
            "/accessors/0",
            json!({ "componentType": 5126, "count": 1u64 << 40, "type": "VEC3" }),
            "accessors[0].count: more elements",
        ),
    ] {
        let error = with_triangle(|d| *d.pointer_mut(place).unwrap() = value).unwrap_err().to_string();
        assert_has(&error, &["made.gltf: ", part]);
    }
    let draco = with_triangle(|d| d["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]));
    assert_has(&draco.unwrap_err().to_string(), &["made.gltf: ", "KHR_draco_mesh_compression"]);
    let replaced = "accessors[0].sparse.indices: element 0 replaces element 3 of 3";
    assert_has(&with_triangle(sparse).unwrap_err().to_string(), &["made.gltf: ", replaced]);
}

#[test]
fn what_gltf_allows_loads_however_it_is_written() {
    let (model, library) = with_triangle(|d| {
        d["scene"] = json!(1.0);
        // Neither `nodes` here nor `source` in a texture are required; `extras` may be anything.
        d["scenes"] = json!([{ "extras": "text" }, { "nodes": [0.0, 1] }]);
        d["nodes"] = json!([{ "mesh": 0.0, "extras": [1, "two"], "extensions": { "VENDOR_a": { "b": 1 } } },
            { "extensions": { "KHR_lights_punctual": { "light": 0 } } }]);
        d["extensionsUsed"] = json!(["KHR_lights_punctual", "VENDOR_a"]);
        let lights = json!([{ "type": "point", "extensions": { "VENDOR_a": {} }, "extras": 7 }]);
        d["extensions"] = json!({ "KHR_lights_punctual": { "lights": lights }, "VENDOR_a": { "c": [] } });
        d["textures"] = json!([{ "extensions": { "VENDOR_a": { "source": 9 } } }]);
        d["materials"] = json!([{ "normalTexture": { "index": 0 }, "extras": null }]);
        let feature = push_accessor(d, &[7, 8, 9], json!({ "componentType": 5121, "count": 3, "type": "SCALAR" }));
        let primitive = &mut d["meshes"][0]["primitives"][0];
        (primitive["material"], primitive["attributes"]["_FEATURE"]) = (json!(0), json!(feature));
        // Pointers name no node.
        let channel = json!({ "sampler": 0, "target": { "path": "pointer" } });
        let sampler = json!({ "input": feature, "output": feature });
        d["animations"] = json!([{ "channels": [channel], "samplers": [sampler] }]);
    })
    .unwrap();
    assert_eq!((model.roots.as_slice(), model.nodes[0].parts.len()), ([0, 1].as_slice(), 1));
    assert!(model.has_lights() && first_mesh(&library).positions.len() == 3);
    assert_eq!(material(&library, "material 0").normal_map, None);
}

#[test]
fn unknown_values_read_as_the_default_with_a_warning() {
    let (model, library) = with_triangle(|d| {
        d["samplers"] = json!([{ "wrapS": 5, "wrapT": 33071, "minFilter": 6, "magFilter": 7 }]);
        d["images"] = json!([{ "bufferView": 0, "mimeType": "image/x-new" }]);
        d["textures"] = json!([{ "sampler": 0, "source": 0 }]);
        let base = json!({ "baseColorTexture": { "index": 0 } });
        d["materials"] = json!([{ "alphaMode": "DITHER", "pbrMetallicRoughness": base }]);
        let mut other = d["meshes"][0]["primitives"][0].clone();
        // As many bits lower it would be a triangle list.
        other["mode"] = json!((1u64 << 32) + 4);
        d["meshes"][0]["primitives"][0]["material"] = json!(0);
        d["meshes"][0]["primitives"].as_array_mut().unwrap().push(other);
        d["bufferViews"][0]["target"] = json!(8);
        d["accessors"].as_array_mut().unwrap().push(json!({ "componentType": 5124, "count": 1, "type": "VEC9" }));
        set_lights(d, json!([{ "type": "area" }, { "type": "spot" }]));
    })
    .unwrap();
    let light = model.nodes[0].light.as_ref().unwrap();
    assert_eq!((light.kind, model.nodes[0].parts.len()), (LightKind::Point, 1));
    assert_eq!(material(&library, "material 0").alpha, AlphaMode::Opaque);
    let places: Vec<&str> = model.warnings.iter().map(|w| w.place.as_str()).collect();
    for place in [
        "samplers[0].wrapS",
        "samplers[0].minFilter",
        "images[0].mimeType",
        "materials[0].alphaMode",
        "meshes[0].primitives[1].mode",
        "bufferViews[0].target",
        "accessors[1].componentType",
        "accessors[1].type",
        "extensions.KHR_lights_punctual.lights[0].type",
        "extensions.KHR_lights_punctual.lights[1].spot",
    ] {
        assert!(places.contains(&place), "{place} is not among {places:#?}");
    }
}

#[test]
fn small_files_that_would_fill_the_memory_are_refused() {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::GrayImage::new(8192, 8000).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    let data = base64::engine::general_purpose::STANDARD.encode(bytes.into_inner());
    let error = with_triangle(|d| {
        d["images"] = json!([{ "uri": format!("data:image/png;base64,{data}") }]);
        d["textures"] = json!([{ "source": 0 }]);
        set_material(d, json!({ "emissiveTexture": { "index": 0 }, "normalTexture": { "index": 0 } }));
    });
    let error = error.err().unwrap().to_string();
    assert!(error.contains("images[0]: too many texels in all"), "{error}");
    let objects = with_triangle(|d| d["extras"] = vec![json!({ "a": 1 }); 1 << 19].into());
    let error = objects.err().unwrap().to_string();
    assert!(error.contains("made.gltf: JSON: "), "{error}");
}
