//! glTF models and images of every kind, against facts known from elsewhere.

mod common;

use base64::Engine;
use bevy_ecs::prelude::*;
use glam::{Mat4, Quat, Vec2, Vec3, Vec4};
use relief::import::{ImportError, Model, load_image, load_images, load_model, load_models};
use serde_json::{Value, json};
use std::f32::consts::PI;
use std::path::{Path, PathBuf};
use systems::components::{LightKind, Projection};
use systems::images::{ImageKind, Texels};
use systems::library::{AlphaMode, Filter, Library, Material, Mesh, MeshId, MipFilter, Shading, Wrap};
use systems::transform::{GlobalTransform, Transform};
use systems::view::View;

/// Refused, each for its reason; everything else loads.
const REFUSED: [(&str, &str); 3] = [
    ("models/BoxMeshopt/BoxMeshopt.glb", "EXT_meshopt_compression"),
    ("asset-generator/Compatibility/Compatibility_04.gltf", "needs glTF 2.1"),
    ("asset-generator/Compatibility/Compatibility_05.gltf", "FAKE_materials_quantumRendering"),
];

fn files_below(folder: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let (mut files, mut open) = (Vec::new(), vec![folder.to_owned()]);
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| extensions.contains(&e.to_str().unwrap())) {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

fn load(path: &str) -> Option<(Model, Library)> {
    let mut library = Library::default();
    let model = load_model(&common::test_data()?.join(path), &mut library).unwrap();
    Some((model, library))
}

fn node<'a>(model: &'a Model, name: &str) -> &'a relief::import::Node {
    model.nodes.iter().find(|n| n.name == name).unwrap()
}

fn material<'a>(library: &'a Library, name: &str) -> &'a Material {
    library.materials().iter().find(|m| m.name == name).unwrap()
}

#[test]
fn every_model_loads_or_is_refused_for_a_named_reason() {
    let Some(data) = common::test_data() else { return };
    let mut files = files_below(&data.join("models"), &["gltf", "glb"]);
    files.extend(files_below(&data.join("asset-generator"), &["gltf", "glb"]));
    assert!(files.len() >= 120, "only {} models", files.len());
    for file in files {
        let name = file.strip_prefix(&data).unwrap().to_str().unwrap();
        let loaded = load_model(&file, &mut Library::default());
        match (REFUSED.iter().find(|(refused, _)| *refused == name), loaded) {
            (Some((_, reason)), Err(error)) => assert!(error.to_string().contains(reason), "{error}"),
            (Some(_), Ok(_)) => panic!("{name} loads"),
            (None, loaded) => {
                let model = loaded.unwrap();
                let points_or_lines = model.warnings.iter().any(|w| w.message.contains("points and lines"));
                let draws = model.nodes.iter().any(|n| !n.parts.is_empty());
                assert!(draws || points_or_lines, "{name} draws nothing");
            }
        }
    }
}

#[test]
fn lights_keep_kind_colour_and_cone() {
    let Some((model, _)) = load("models/Lights/Lights.glb") else { return };
    assert!(model.has_lights());
    let light = |name: &str| node(&model, name).light.clone().unwrap();
    let point = light("Light_Orientation");
    assert_eq!((point.kind, point.color, point.attenuation), (LightKind::Point, Vec3::X, Vec3::Z));
    assert_eq!((point.intensity, point.range), (5.0 / PI, f32::INFINITY));
    let spot = LightKind::Spot { outer: PI / 8.0, inner: Some(0.33379424), exponent: 0.0 };
    assert_eq!(light("Spot_Orientation").kind, spot);
    assert_eq!(light("Sun_Orientation").kind, LightKind::Directional);
}

#[test]
fn texture_transforms_turn_counter_clockwise() {
    let Some((_, library)) = load("models/TextureTransformTest/TextureTransformTest.gltf") else { return };
    let of = |name: &str| material(&library, name).base_map.unwrap().image_from_mesh_uv;
    assert_eq!(of("Offset UV").transform_point2(Vec2::ZERO), Vec2::splat(0.5));
    assert_eq!(of("Scale").transform_point2(Vec2::ONE), Vec2::splat(1.5));
    let angle = PI / 8.0;
    let turned = of("Rotation").transform_point2(Vec2::X);
    assert!(turned.abs_diff_eq(Vec2::new(angle.cos(), -angle.sin()), 1e-6), "{turned}");
    let all = of("All").transform_point2(Vec2::Y);
    assert!(all.abs_diff_eq(Vec2::new(1.5 * 0.3f32.sin() - 0.2, 1.5 * 0.3f32.cos() - 0.1), 1e-6), "{all}");
}

#[test]
fn instances_become_entities_under_their_node() {
    let Some((model, _)) = load("models/SimpleInstancing/simple-instancing.glb") else { return };
    assert_eq!(model.nodes[0].instances.len(), 125);
    let mut world = World::new();
    let root = model.spawn(&mut world, Transform::IDENTITY);
    assert_eq!(world.query::<&MeshId>().iter(&world).count(), 125);
    world.despawn(root);
    assert_eq!(world.query::<&MeshId>().iter(&world).count(), 0, "the model is one hierarchy");
}

#[test]
fn names_uris_and_files_may_be_unicode() {
    let Some((model, library)) = load("models/EncodingTest-Unicode/Unicode ❤♻ Test.gltf") else { return };
    assert_eq!(model.nodes.len(), 1);
    assert_eq!(library.images().len(), Library::default().images().len() + 1);
    let Some((_, library)) = load("models/BoxWithSpaces/Box With Spaces.gltf") else { return };
    assert_eq!(library.images().iter().filter(|i| i.kind == ImageKind::Normal).count(), 2);
}

#[test]
fn cameras_keep_their_lens() {
    let Some((model, _)) = load("models/Cameras/Cameras.gltf") else { return };
    let projections: Vec<_> = model.cameras().iter().map(|(_, camera, _)| camera.projection).collect();
    let perspective = Projection::Perspective { fov_y: 0.7, aspect: Some(1.0) };
    assert_eq!(projections, [perspective, Projection::Orthographic { half_height: 1.0, aspect: Some(1.0) }]);
}

#[test]
fn vertex_colours_are_read() {
    let Some((_, library)) = load("models/BoxVertexColors/BoxVertexColors.glb") else { return };
    let colors = &library.meshes()[0].mesh.colors;
    assert_eq!(colors.len(), 24);
    assert!(colors.iter().any(|c| *c != colors[0]));
}

#[test]
fn copies_of_a_mesh_are_one_mesh() {
    let Some((model, library)) = load("models/ManyCubes/many-cubes.gltf") else { return };
    assert_eq!((model.nodes.len(), library.meshes().len()), (506, 1));
}

#[test]
fn specular_glossiness_and_specular_are_read() {
    let Some((_, library)) = load("models/BoxTextured-SpecGloss/BoxTextured.gltf") else { return };
    let shaded = |l: &Library, s| l.materials().iter().filter(|m| m.shading == s).count();
    assert_eq!(shaded(&library, Shading::SpecularGlossiness), 1);
    let Some((_, library)) = load("models/SpecularTest/SpecularTest.glb") else { return };
    assert_eq!(shaded(&library, Shading::MetallicRoughness), 24);
    assert!(library.materials().iter().any(|m| m.specular_strength < 1.0));
    let maps = library.materials().iter().filter_map(|m| m.specular_map);
    assert!(maps.into_iter().all(|map| library.image(map.image).unwrap().kind == ImageKind::Color));
}

#[test]
fn samplers_are_those_of_the_generators_table() {
    let sampler = |number: usize| {
        let (_, library) = load(&format!("asset-generator/Texture_Sampler/Texture_Sampler_{number:02}.gltf"))?;
        Some(library.materials().iter().find_map(|m| m.base_map).unwrap().sampler)
    };
    let Some(plain) = sampler(0) else { return };
    assert_eq!((plain.wrap_u, plain.wrap_v, plain.mip), (Wrap::Repeat, Wrap::Repeat, MipFilter::Linear));
    let get = |number| sampler(number).unwrap();
    assert_eq!((get(1).wrap_v, get(1).wrap_u), (Wrap::Clamp, Wrap::Repeat));
    assert_eq!(get(4).wrap_u, Wrap::Mirror);
    assert_eq!((get(5).mag, get(6).mag), (Filter::Nearest, Filter::Linear));
    let minifications: Vec<_> = (7..13).map(|n| (get(n).min, get(n).mip)).collect();
    let (nearest, linear) = (Filter::Nearest, Filter::Linear);
    assert_eq!(minifications[..2], [(nearest, MipFilter::None), (linear, MipFilter::None)]);
    assert_eq!(minifications[2..4], [(nearest, MipFilter::Nearest), (linear, MipFilter::Nearest)]);
    assert_eq!(minifications[4..], [(nearest, MipFilter::Linear), (linear, MipFilter::Linear)]);
}

#[test]
fn a_matrix_and_its_parts_place_a_node_alike() {
    let Some((parts, _)) = load("asset-generator/Node_Attribute/Node_Attribute_07.gltf") else { return };
    let (matrix, _) = load("asset-generator/Node_Attribute/Node_Attribute_08.gltf").unwrap();
    for ((_, a), (_, b)) in parts.placed().iter().zip(matrix.placed()) {
        assert!(a.abs_diff_eq(b, 1e-5), "{a} {b}");
    }
}

#[test]
fn strips_and_fans_cover_the_same_square_as_lists() {
    for number in [4, 5, 6, 11, 12, 13, 14, 15] {
        let path = format!("asset-generator/Mesh_PrimitiveMode/Mesh_PrimitiveMode_{number:02}.gltf");
        let Some((_, library)) = load(&path) else { return };
        let mesh = &library.meshes()[0].mesh;
        let corners = |t: &[u32]| [0, 1, 2].map(|i| mesh.positions[t[i] as usize]);
        let areas = mesh.indices.chunks_exact(3).map(corners).map(|[a, b, c]| (b - a).cross(c - a) * 0.5);
        let area: Vec3 = areas.inspect(|a| assert!(a.z > 0.0, "{path}: a triangle faces away")).sum();
        assert!(area.abs_diff_eq(Vec3::Z, 1e-6), "{path}: {area}");
    }
}

#[test]
fn alpha_modes_are_read() {
    let Some((_, library)) = load("models/AlphaBlendModeTest/AlphaBlendModeTest.glb") else { return };
    for mode in [AlphaMode::Opaque, AlphaMode::Mask, AlphaMode::Blend] {
        assert!(library.materials().iter().any(|m| m.alpha == mode), "{mode:?}");
    }
    assert!(library.materials().iter().any(|m| m.alpha == AlphaMode::Mask && m.alpha_cutoff != 0.5));
}

#[test]
fn a_skinned_model_stands_as_its_joints_do() {
    let Some((model, library)) = load("models/SimpleSkin/SimpleSkin.gltf") else { return };
    let bounds = model.bounds(&library);
    assert_eq!((bounds.min, bounds.max), (Vec3::new(-0.5, 0.0, 0.0), Vec3::new(0.5, 2.0, 0.0)));
    assert_eq!(model.warnings.iter().filter(|w| w.message.contains("skins")).count(), 1);
}

// ---- Small files made here, for what no sample shows alone ----

/// A glTF document of one triangle; `change` edits it before it is written.
fn with_triangle(change: impl FnOnce(&mut Value)) -> Result<(Model, Library), ImportError> {
    let positions = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut document = json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                        "min": [0, 0, 0], "max": [1, 1, 0] }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [buffer(&floats(positions.as_flattened()))],
    });
    change(&mut document);
    load_document(&document)
}

fn load_document(document: &Value) -> Result<(Model, Library), ImportError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("made.gltf");
    std::fs::write(&path, document.to_string()).unwrap();
    let mut library = Library::default();
    load_model(&path, &mut library).map(|model| (model, library))
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn buffer(bytes: &[u8]) -> Value {
    let data = base64::engine::general_purpose::STANDARD.encode(bytes);
    json!({ "byteLength": bytes.len(), "uri": format!("data:application/octet-stream;base64,{data}") })
}

fn push(document: &mut Value, array: &str, item: Value) -> usize {
    let array = document.as_object_mut().unwrap().entry(array).or_insert(json!([])).as_array_mut().unwrap();
    array.push(item);
    array.len() - 1
}

/// Adds a buffer, its view and an accessor of it.
fn push_accessor(document: &mut Value, bytes: &[u8], mut accessor: Value) -> usize {
    let buffer = push(document, "buffers", buffer(bytes));
    let view = push(document, "bufferViews", json!({ "buffer": buffer, "byteLength": bytes.len() }));
    accessor["bufferView"] = json!(view);
    push(document, "accessors", accessor)
}

fn first_mesh(library: &Library) -> &Mesh {
    &library.meshes()[0].mesh
}

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

/// Whatever the matrices above them do: uneven scale, mirrors, and shear, of which transforms can keep nothing.
#[test]
fn cameras_and_lights_look_where_their_z_axes_point() {
    let shear = Mat4::from_cols_array_2d(&[
        [1.0, 0.0, 0.0, 0.0],
        [0.6, 1.0, 0.2, 0.0],
        [-0.5, 0.3, 1.0, 0.0],
        [1.0, 2.0, 3.0, 1.0],
    ]);
    let uneven = Mat4::from_scale(Vec3::new(4.0, 1.0, 0.5));
    let mirrored = Mat4::from_scale(Vec3::new(1.0, 1.0, -2.0));
    let turn = Quat::from_euler(glam::EulerRot::YXZ, 0.7, -0.4, 0.3);
    let turned = Mat4::from_rotation_translation(turn, Vec3::new(0.5, -1.0, 0.25));
    let none = Mat4::IDENTITY;
    for (above, below) in
        [(uneven, none), (shear, none), (mirrored, none), (uneven, shear), (shear, mirrored), (none, shear)]
    {
        // The last node's matrix shears, too, in one of two documents.
        for own in [turned, turned * shear] {
            let (model, _) = with_triangle(|d| {
                d["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 1, "znear": 0.1 } }]);
                d["extensionsUsed"] = json!(["KHR_lights_punctual"]);
                d["extensions"]["KHR_lights_punctual"] = json!({ "lights": [{ "type": "spot", "spot": {} }] });
                let [above, below, own] = [above, below, own].map(|matrix| json!(matrix.to_cols_array()));
                d["nodes"] = json!([{ "matrix": above, "children": [1] }, { "matrix": below, "children": [2, 3] },
                    { "matrix": own, "camera": 0 },
                    { "matrix": own, "extensions": { "KHR_lights_punctual": { "light": 0 } } }]);
            })
            .unwrap();
            let exact = above * below * own;
            let (ahead, up) = (exact.transform_vector3(Vec3::NEG_Z).normalize(), exact.transform_vector3(Vec3::Y));
            let placed = model.placed();
            for index in [2, 3] {
                let place = placed.iter().find(|(node, _)| *node == index).unwrap().1;
                let found = GlobalTransform::from(place);
                assert!(found.forward().abs_diff_eq(ahead, 1e-5), "{above} {below} {own}: {} {ahead}", found.forward());
                assert!(found.translation().abs_diff_eq(exact.transform_point3(Vec3::ZERO), 1e-5));
            }
            let (_, camera, place) = model.cameras()[0];
            let view = View::new(&place, camera, 64, 64);
            let right = Vec3::from(view.world_from_view.matrix3.x_axis);
            assert!(view.direction().abs_diff_eq(ahead, 1e-5) && right.dot(up).abs() < 1e-4, "{above} {below} {own}");
        }
    }
}

#[test]
fn a_cone_narrower_or_wider_than_is_drawn_is_said() {
    for (outer, drawn, said) in
        [(1e-4, 1e-3, "narrower than 0.06"), (1.55, 85f32.to_radians(), "wider than 85"), (1e-3, 1e-3, "")]
    {
        let (model, _) = with_triangle(|d| {
            d["extensionsUsed"] = json!(["KHR_lights_punctual"]);
            let spot = json!({ "type": "spot", "spot": { "innerConeAngle": 0, "outerConeAngle": outer } });
            d["extensions"]["KHR_lights_punctual"] = json!({ "lights": [spot] });
            d["nodes"][0]["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
        })
        .unwrap();
        let Some(LightKind::Spot { outer, .. }) = model.nodes[0].light.as_ref().map(|light| light.kind) else {
            panic!("a spot")
        };
        assert!((outer - drawn).abs() < 1e-6, "{outer} {drawn}");
        let warnings: Vec<_> = model.warnings.iter().map(|warning| &warning.message).collect();
        assert!(
            if said.is_empty() { warnings.is_empty() } else { warnings.len() == 1 && warnings[0].contains(said) },
            "{warnings:?}"
        );
    }
}

#[test]
fn a_parallel_camera_has_the_shape_of_its_box() {
    let (model, _) = with_triangle(|d| {
        let camera = |xmag, ymag| json!({ "type": "orthographic", "orthographic": { "xmag": xmag, "ymag": ymag, "znear": 0.1, "zfar": 9 } });
        d["cameras"] = json!([camera(2.0, 1.0), camera(-3.0, 6.0)]);
        d["nodes"] = json!([{ "camera": 0 }, { "camera": 1 }]);
        d["scenes"][0]["nodes"] = json!([0, 1]);
    })
    .unwrap();
    let projections: Vec<_> = model.cameras().iter().map(|(_, camera, _)| camera.projection).collect();
    let shaped = |half_height, aspect| Projection::Orthographic { half_height, aspect: Some(aspect) };
    assert_eq!(projections, [shaped(1.0, 2.0), shaped(6.0, 0.5)]);
    let signs = model.warnings.iter().filter(|w| w.message.contains("without their signs")).count();
    assert_eq!(signs, 1, "{:?}", model.warnings);
}

#[test]
fn joints_move_the_vertices_that_they_own() {
    let (model, library) = with_triangle(|d| {
        let joints = push_accessor(
            d,
            &[[0u8; 4], [1, 0, 0, 0], [0, 1, 0, 0]].concat(),
            json!({ "componentType": 5121, "count": 3, "type": "VEC4" }),
        );
        let weights = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0];
        let weights = push_accessor(d, &floats(&weights), json!({ "componentType": 5126, "count": 3, "type": "VEC4" }));
        let attributes = &mut d["meshes"][0]["primitives"][0]["attributes"];
        (attributes["JOINTS_0"], attributes["WEIGHTS_0"]) = (json!(joints), json!(weights));
        d["nodes"] = json!([{ "mesh": 0, "skin": 0, "translation": [7, 7, 7], "scale": [2, 2, 2] },
            { "children": [2] }, { "translation": [0, 0, 4] }]);
        d["scenes"][0]["nodes"] = json!([0, 1]);
        d["skins"] = json!([{ "joints": [1, 2] }]);
    })
    .unwrap();
    let placed = model.placed();
    let model_from_mesh = placed.iter().find(|(node, _)| *node == 0).unwrap().1;
    let shown: Vec<Vec3> =
        first_mesh(&library).positions.iter().map(|&p| model_from_mesh.transform_point3(p)).collect();
    let expected = [Vec3::ZERO, Vec3::new(1.0, 0.0, 4.0), Vec3::new(0.0, 1.0, 2.0)];
    assert!(
        shown.iter().zip(expected).all(|(a, b)| a.abs_diff_eq(b, 1e-5)),
        "{shown:?}: the node's own place has no say"
    );
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

#[test]
fn a_mirrored_matrix_is_exact_and_a_sheared_one_warns() {
    let matrix = |m: [[f32; 4]; 4]| with_triangle(|d| d["nodes"][0]["matrix"] = json!(m.as_flattened())).unwrap().0;
    let turn =
        glam::Mat4::from_scale_rotation_translation(Vec3::new(-2.0, 3.0, 0.5), Quat::from_rotation_y(0.8), Vec3::ONE);
    let mirrored = matrix(turn.to_cols_array_2d());
    assert!(mirrored.nodes[0].transform.to_matrix().abs_diff_eq(turn, 1e-5));
    assert!(mirrored.warnings.is_empty(), "{:?}", mirrored.warnings);
    let sheared = matrix([[1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]);
    assert!(sheared.warnings[0].to_string().contains("nodes[0].matrix: shears"), "{:?}", sheared.warnings);
    let flat = matrix([[0.0; 4], [0.0, 2.0, 0.0, 0.0], [0.0, 0.0, 3.0, 0.0], [0.0, 0.0, 0.0, 1.0]]);
    assert_eq!(flat.nodes[0].transform.scale, Vec3::new(0.0, 2.0, 3.0));
    assert!(flat.nodes[0].transform.is_finite());
}

#[test]
fn specular_textures_are_combined_into_one() {
    let png = |rgba: [u8; 4], side: u32| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image::RgbaImage::from_pixel(side, side, image::Rgba(rgba))
            .write_to(&mut bytes, image::ImageFormat::Png)
            .unwrap();
        let data = base64::engine::general_purpose::STANDARD.encode(bytes.into_inner());
        json!({ "uri": format!("data:image/png;base64,{data}") })
    };
    let (_, library) = with_triangle(|d| {
        d["images"] = json!([png([200, 100, 50, 7], 2), png([1, 2, 3, 90], 4)]);
        d["textures"] = json!([{ "source": 0 }, { "source": 1 }]);
        let uvs = push_accessor(d, &floats(&[0.0; 6]), json!({ "componentType": 5126, "count": 3, "type": "VEC2" }));
        d["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uvs);
        d["meshes"][0]["primitives"][0]["material"] = json!(0);
        d["extensionsUsed"] = json!(["KHR_materials_specular"]);
        let extension = json!({ "specularColorTexture": { "index": 0 }, "specularTexture": { "index": 1 } });
        d["materials"] = json!([{ "extensions": { "KHR_materials_specular": extension } }]);
    })
    .unwrap();
    let map = material(&library, "material 0").specular_map.unwrap();
    let image = library.image(map.image).unwrap();
    assert_eq!((image.width, image.kind), (4, ImageKind::Color));
    assert_eq!(image.levels[0][..4], [200, 100, 50, 90]);
}

fn uri_of(bytes: &[u8]) -> Value {
    let data = base64::engine::general_purpose::STANDARD.encode(bytes);
    json!({ "uri": format!("data:application/octet-stream;base64,{data}") })
}

fn png_of(rgb: [u8; 3]) -> Value {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_pixel(4, 4, image::Rgb(rgb)).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    uri_of(&bytes.into_inner())
}

#[test]
fn an_image_of_an_extension_that_cannot_be_decoded_gives_way_to_the_source() {
    let webp = uri_of(b"RIFF\x10\0\0\0WEBPVP8 \0\0\0\0");
    let mut dds = vec![0u8; 148];
    dds[..8].copy_from_slice(b"DDS \x7c\0\0\0");
    (dds[12], dds[16], dds[80]) = (4, 4, 4);
    // BC6H.
    dds[84..88].copy_from_slice(b"DX10");
    dds[128] = 95;
    let load = |extensions: &[(&str, Value)], required: bool| {
        with_triangle(|d| {
            d["images"] = json!([png_of([0, 200, 0])]);
            d["textures"] = json!([{ "source": 0, "extensions": {} }]);
            for (name, image) in extensions {
                let id = push(d, "images", image.clone());
                d["textures"][0]["extensions"][*name] = json!({ "source": id });
            }
            let names: Vec<&str> = extensions.iter().map(|(name, _)| *name).collect();
            d["extensionsUsed"] = json!(names);
            if required {
                d["extensionsRequired"] = json!(names);
            }
            d["materials"] = json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
            d["meshes"][0]["primitives"][0]["material"] = json!(0);
        })
    };
    let gone = json!({ "uri": "gone.webp" });
    for extensions in [
        vec![("EXT_texture_webp", webp.clone())],
        vec![("EXT_texture_webp", gone)],
        vec![("MSFT_texture_dds", uri_of(&dds))],
        vec![("EXT_texture_webp", webp.clone()), ("MSFT_texture_dds", uri_of(&dds))],
    ] {
        let (model, library) = load(&extensions, false).unwrap();
        let map = material(&library, "material 0").base_map.unwrap();
        assert_eq!(library.image(map.image).unwrap().levels[0][..4], [0, 200, 0, 255]);
        let said = model.warnings.iter().filter(|w| w.message.contains("the source beside it is drawn")).count();
        assert_eq!(said, extensions.len(), "{:?}", model.warnings);
        assert!(load(&extensions, true).is_err(), "a file that requires the extension cannot do without");
    }
    // One that can be decoded is preferred.
    let (_, library) = load(&[("EXT_texture_webp", png_of([1, 2, 3]))], false).unwrap();
    let map = material(&library, "material 0").base_map.unwrap();
    assert_eq!(library.image(map.image).unwrap().levels[0][..3], [1, 2, 3]);
}

#[test]
fn base_maps_are_of_the_kind_that_their_alpha_asks_for() {
    let kind = |mode: &str, base_alpha: f32, vertex_alpha: f32, alpha: u8| {
        let (_, library) = with_triangle(|d| {
            let mut bytes = std::io::Cursor::new(Vec::new());
            let image = image::RgbaImage::from_pixel(4, 4, image::Rgba([9, 9, 9, alpha]));
            image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
            d["images"] = json!([uri_of(&bytes.into_inner())]);
            d["textures"] = json!([{ "source": 0 }]);
            let base = json!({ "baseColorTexture": { "index": 0 }, "baseColorFactor": [1, 1, 1, base_alpha] });
            d["materials"] = json!([{ "alphaMode": mode, "alphaCutoff": 0.2, "pbrMetallicRoughness": base }]);
            let vec4 = json!({ "componentType": 5126, "count": 3, "type": "VEC4" });
            let colors = push_accessor(d, &floats(&[1.0, 1.0, 1.0, vertex_alpha].repeat(3)), vec4);
            let primitive = &mut d["meshes"][0]["primitives"][0];
            (primitive["material"], primitive["attributes"]["COLOR_0"]) = (json!(0), json!(colors));
        })
        .unwrap();
        library.image(material(&library, "material 0").base_map.unwrap().image).unwrap().kind
    };
    assert_eq!(kind("OPAQUE", 1.0, 1.0, 100), ImageKind::Color);
    assert_eq!(kind("BLEND", 1.0, 1.0, 100), ImageKind::Blended);
    assert_eq!(kind("MASK", 1.0, 1.0, 100), ImageKind::Masked { least: 51 });
    // Half of the texel's alpha is compared.
    assert_eq!(kind("MASK", 0.5, 1.0, 100), ImageKind::Masked { least: 102 });
    // Vertices have a say in what passes.
    assert_eq!(kind("MASK", 1.0, 0.5, 100), ImageKind::Blended);
    // Nothing is hidden.
    assert_eq!([kind("BLEND", 1.0, 1.0, 255), kind("MASK", 1.0, 1.0, 255)], [ImageKind::Color; 2]);
}

#[test]
fn what_a_file_can_do_without_does_not_refuse_it() {
    let light = |light: Value| {
        move |d: &mut Value| {
            d["extensionsUsed"] = json!(["KHR_lights_punctual"]);
            d["extensions"] = json!({ "KHR_lights_punctual": { "lights": [light] } });
            d["nodes"][0]["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
        }
    };
    let camera = |camera: Value| {
        move |d: &mut Value| {
            d["cameras"] = json!([camera, { "type": "perspective", "perspective": { "yfov": 0.5, "znear": 1 } }]);
            d["nodes"][0]["camera"] = json!(0);
            d["scenes"][0]["nodes"] = json!([0, 1]);
            push(d, "nodes", json!({ "camera": 1 }));
        }
    };
    let lens = |key: &str, value: Value| {
        let mut lens = json!({ "yfov": 0.5, "znear": 1, "zfar": 2 });
        lens[key] = value;
        camera(json!({ "type": "perspective", "perspective": lens }))
    };
    let material = |material: Value| {
        move |d: &mut Value| {
            d["materials"] = json!([material]);
            d["meshes"][0]["primitives"][0]["material"] = json!(0);
        }
    };
    type Change = Box<dyn FnOnce(&mut Value)>;
    let changes: Vec<(&str, Change)> = vec![
        ("extensions.KHR_lights_punctual.lights[0].type", Box::new(light(json!({ "color": [1, 1, 1] })))),
        (
            "extensions.KHR_lights_punctual.lights[0].intensity",
            Box::new(light(json!({ "type": "point", "intensity": -1 }))),
        ),
        (
            "nodes[0].extensions.KHR_lights_punctual.light",
            Box::new(|d| d["nodes"][0]["extensions"] = json!({ "KHR_lights_punctual": { "light": 7 } })),
        ),
        ("cameras[0].perspective.aspectRatio", Box::new(lens("aspectRatio", json!(0)))),
        ("cameras[0].perspective.yfov", Box::new(lens("yfov", json!("wide")))),
        ("cameras[0].perspective.yfov", Box::new(lens("yfov", json!(4)))),
        ("cameras[0].perspective.zfar", Box::new(lens("zfar", json!(0.5)))),
        ("cameras[0]", Box::new(camera(json!({ "type": "perspective" })))),
        ("cameras[0]", Box::new(camera(json!(7)))),
        (
            "materials[0].extensions.KHR_materials_specular.specularFactor",
            Box::new(material(json!({ "extensions": { "KHR_materials_specular": { "specularFactor": "much" } } }))),
        ),
        (
            "materials[0].extensions.KHR_materials_emissive_strength",
            Box::new(material(json!({ "extensions": { "KHR_materials_emissive_strength": [] } }))),
        ),
        ("materials[0].name", Box::new(material(json!({ "name": 5 })))),
        ("asset.generator", Box::new(|d| d["asset"]["generator"] = json!(["a", "b"]))),
        ("accessors[0].min", Box::new(|d| d["accessors"][0]["min"] = json!("low"))),
        (
            "nodes[0].extensions.EXT_mesh_gpu_instancing.attributes.SCALE",
            Box::new(|d| {
                let two =
                    push_accessor(d, &floats(&[1.0; 6]), json!({ "componentType": 5126, "count": 2, "type": "VEC3" }));
                let attributes = json!({ "TRANSLATION": 0, "SCALE": two });
                d["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
            }),
        ),
        (
            "nodes[0].skin",
            Box::new(|d| {
                let whole = json!({ "componentType": 5123, "count": 3, "type": "VEC4" });
                let joints = push_accessor(d, &[0; 24], whole);
                let weights = json!({ "componentType": 5126, "count": 3, "type": "VEC4" });
                let weights = push_accessor(d, &floats(&[1.0, 0.0, 0.0, 0.0].repeat(3)), weights);
                d["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(joints);
                d["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(weights);
                d["skins"] = json!([{ "joints": [0] }]);
                (d["nodes"][0]["skin"], d["nodes"][0]["scale"]) = (json!(0), json!([0, 1, 1]));
            }),
        ),
        (
            "images[0].uri",
            Box::new(|d| {
                d["images"] = json!([{ "uri": "https://example.com/a.png" }]);
                d["textures"] = json!([{ "source": 0 }]);
                d["materials"] = json!([{ "emissiveTexture": { "index": 0 } }]);
                d["meshes"][0]["primitives"][0]["material"] = json!(0);
            }),
        ),
        (
            "animations",
            Box::new(|d| d["animations"] = json!([{ "channels": "none", "samplers": [{ "input": 99 }] }, 3])),
        ),
    ];
    for (place, change) in changes {
        let (model, library) = with_triangle(change).unwrap_or_else(|error| panic!("{place}: {error}"));
        assert!(model.warnings.iter().any(|w| w.place == place), "{place}: {:?}", model.warnings);
        assert_eq!((model.nodes[0].parts.len(), library.meshes().len()), (1, 1), "{place}");
        if place.starts_with("cameras") {
            assert_eq!(model.cameras().len(), 1, "{place}: the other camera stays");
        }
    }
    // Not where the file says that it cannot do without.
    let required = with_triangle(|d| {
        light(json!({ "color": [1, 1, 1] }))(d);
        d["extensionsRequired"] = json!(["KHR_lights_punctual"]);
    });
    assert!(required.unwrap_err().to_string().contains("lights[0].type"));
    // Rounded to 32 bits, and a byte order mark.
    with_triangle(|d| d["nodes"][0]["rotation"] = json!([0, 0, 0, 1.0000001192092896])).unwrap();
}

#[test]
fn files_above_a_model_are_read_where_the_file_that_names_it_spans_them() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("project");
    for sub in ["models", "textures", "scenes"] {
        std::fs::create_dir_all(root.join(sub)).unwrap();
    }
    let red = |path: &Path| image::RgbImage::from_pixel(4, 4, image::Rgb([250, 0, 0])).save(path).unwrap();
    red(&root.join("textures/wood.png"));
    red(&folder.path().join("secret.png"));
    let load = |uri: &str, named_in: Option<&str>| -> Result<Vec<relief::import::Warning>, String> {
        let path = root.join("models/chair.gltf");
        let positions = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let document = json!({
            "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }] }],
            "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                            "min": [0, 0, 0], "max": [1, 1, 0] }],
            "bufferViews": [{ "buffer": 0, "byteLength": 36 }], "buffers": [buffer(&floats(positions.as_flattened()))],
            "images": [{ "uri": uri }], "textures": [{ "source": 0 }],
            "materials": [{ "emissiveTexture": { "index": 0 } }],
        });
        std::fs::write(&path, document.to_string()).unwrap();
        let mut library = Library::default();
        let model = match named_in {
            None => load_model(&path, &mut library),
            Some(named_in) => load_models(&[path], &root.join(named_in), &mut library).remove(0),
        };
        // The triangle has no texture coordinates, which is of no account here.
        let told = |model: Model| model.warnings.into_iter().filter(|w| !w.message.contains("TEXCOORD_0")).collect();
        model.map(told).map_err(|error| error.to_string())
    };
    for named_in in [".", "scenes", "scenes/.."] {
        assert_eq!(load("../textures/wood.png", Some(named_in)), Ok(vec![]), "{named_in}");
        let warnings = load("..\\textures\\wood.png", Some(named_in)).unwrap();
        assert!(warnings.len() == 1 && warnings[0].message.contains("backslashes"), "{warnings:?}");
    }
    let alone = load("../textures/wood.png", None).unwrap_err();
    assert!(alone.contains("images[0].uri") && alone.contains("scene file"), "{alone}");
    for uri in ["../../secret.png", "..%2f..%2fsecret.png", "../textures/../../secret.png"] {
        let error = load(uri, Some("scenes")).unwrap_err();
        assert!(error.contains("leads outside") && error.contains("project"), "{error}");
    }
    // Whether there is such a file is not found out.
    assert_eq!(
        load("../../none", None).unwrap_err().replace("none", "secret.png"),
        load("../../secret.png", None).unwrap_err()
    );
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(folder.path().join("secret.png"), root.join("models/link.png")).unwrap();
        let error = load("link.png", Some(".")).unwrap_err();
        assert!(error.contains("it is a link to"), "{error}");
        // Links within are followed.
        std::os::unix::fs::symlink(root.join("textures"), root.join("models/textures")).unwrap();
        assert_eq!(load("textures/wood.png", Some(".")), Ok(vec![]));
    }
}

#[test]
fn nesting_is_limited_and_the_limit_can_be_spawned_and_despawned() {
    let nested = |depth: usize| {
        with_triangle(|d| {
            let chain =
                (0..depth).map(|i| if i + 1 < depth { json!({ "children": [i + 1] }) } else { json!({ "mesh": 0 }) });
            d["nodes"] = chain.collect();
        })
    };
    let (model, _) = nested(512).unwrap();
    let mut world = World::new();
    let root = model.spawn(&mut world, Transform::IDENTITY);
    world.despawn(root);
    assert_eq!(world.query::<&bevy_ecs::name::Name>().iter(&world).count(), 0);
    for deeper in [513, 100_000] {
        let error = nested(deeper).unwrap_err().to_string();
        assert!(error.contains("nested deeper"), "{error}");
    }
}

#[test]
fn refusals_name_the_place() {
    let refusal = |change: fn(&mut Value)| with_triangle(change).unwrap_err().to_string();
    let expect = |change: fn(&mut Value), part: &str| {
        let error = refusal(change);
        assert!(error.contains("made.gltf: ") && error.contains(part), "{error}\nexpected: {part}");
    };
    expect(|d| d["accessors"][0]["count"] = json!(4), "accessors[0]: 4 elements from byte 0 run past bufferViews[0]");
    expect(|d| d["accessors"][0]["bufferView"] = json!(1u64 << 32), "accessors[0].bufferView: bufferViews[4294967296]");
    expect(
        |d| d["nodes"] = json!([{ "children": [1] }, { "children": [0], "mesh": 0 }]),
        "nodes[0]: is its own ancestor",
    );
    expect(|d| d["nodes"] = json!([{ "children": [2] }, { "children": [2] }, {}]), "nodes[1].children[0]");
    expect(|d| d["buffers"][0]["uri"] = json!("/etc/passwd"), "buffers[0].uri");
    expect(|d| d["buffers"][0]["uri"] = json!("..%2Fsecret.bin"), "outside the model's folder");
    expect(|d| d["buffers"][0]["uri"] = json!("https://example.com/a.bin"), "https: URIs are not read");
    expect(|d| d["buffers"][0]["uri"] = json!("none.bin"), "none.bin");
    expect(|d| d["nodes"][0]["mesh"] = json!("0"), "nodes[0].mesh: expected an index into meshes");
    expect(|d| d["nodes"][0]["scale"] = json!([1, 1]), "nodes[0].scale: expected 3 numbers, has 2");
    expect(|d| d["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]), "KHR_draco_mesh_compression");
    expect(
        |d| d["buffers"][0] = buffer(&floats(&[0.0, 0.0, f32::NAN, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])),
        "meshes[0].primitives[0].attributes.POSITION: expected finite numbers, element 0",
    );
    let sparse = |d: &mut Value| {
        let index = push_accessor(d, &[3], json!({ "componentType": 5121, "count": 1, "type": "SCALAR" }));
        let view = &d["accessors"][index]["bufferView"];
        d["accessors"][0]["sparse"] = json!({ "count": 1,
            "indices": { "bufferView": view, "componentType": 5121 }, "values": { "bufferView": 0 } });
    };
    expect(sparse, "accessors[0].sparse.indices: element 0 replaces element 3 of 3");
    // Legal, but nothing in the file justifies the size.
    expect(
        |d| d["accessors"][0] = json!({ "componentType": 5126, "count": 1u64 << 40, "type": "VEC3" }),
        "accessors[0].count: far more elements",
    );
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
        d["extensionsUsed"] = json!(["KHR_lights_punctual"]);
        d["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "area" }, { "type": "spot" }] } });
        d["nodes"][0]["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
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
        d["materials"] = json!([{ "emissiveTexture": { "index": 0 }, "normalTexture": { "index": 0 } }]);
        d["meshes"][0]["primitives"][0]["material"] = json!(0);
    });
    let error = error.err().unwrap().to_string();
    assert!(error.contains("images[0]: too many texels in all"), "{error}");
    let objects = with_triangle(|d| d["extras"] = vec![json!({ "a": 1 }); 1 << 19].into());
    let error = objects.err().unwrap().to_string();
    assert!(error.contains("made.gltf: JSON: "), "{error}");
}

// ---- Images ----

#[test]
fn every_valid_image_loads_with_its_levels() {
    let Some(data) = common::test_data() else { return };
    let mut files = files_below(&data.join("textures"), &["png", "tga", "jpg", "TGA"]);
    files.retain(|f| !f.to_str().unwrap().contains("REPO"));
    assert!(files.len() > 150, "only {} images", files.len());
    let requests: Vec<_> = files.iter().map(|f| (f.clone(), ImageKind::Color)).collect();
    for (file, image) in files.iter().zip(load_images(&requests)) {
        let image = image.unwrap().image;
        assert_eq!(image.name, file.file_stem().unwrap().to_str().unwrap(), "the order is kept");
        assert_eq!(image.levels.last().unwrap().len(), image.texels.level_bytes(1, 1));
    }
}

#[test]
fn interlaced_images_equal_their_plain_twins() {
    let Some(data) = common::test_data() else { return };
    let folder = data.join("textures/pngsuite-valid");
    let mut pairs = 0;
    for plain in files_below(&folder, &["png"]) {
        let name = plain.file_name().unwrap().to_str().unwrap();
        let Some(rest) = name.strip_prefix("basn") else { continue };
        let (a, b) =
            (load_image(&plain, ImageKind::Data), load_image(&folder.join(format!("basi{rest}")), ImageKind::Data));
        let (a, b) = (a.unwrap(), b.unwrap());
        assert!(a.levels == b.levels, "{name}");
        assert_eq!(a.texels, if rest.contains("16.png") { Texels::Rgba16Float } else { Texels::Rgba8 }, "{name}");
        pairs += 1;
    }
    assert!(pairs >= 10, "only {pairs} pairs");
}

#[test]
fn sixteen_bits_are_linear_light_for_colour_and_as_they_are_for_data() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deep.png");
    image::ImageBuffer::<image::Rgba<u16>, _>::from_pixel(1, 1, image::Rgba([32768u16, 0, 65535, 16384]))
        .save(&path)
        .unwrap();
    let texel = |kind| {
        let image = load_image(&path, kind).unwrap();
        let halves = image.levels[0].as_chunks::<2>().0.iter().map(|&b| half::f16::from_le_bytes(b).to_f32());
        Vec4::from_slice(&halves.collect::<Vec<_>>())
    };
    let data = texel(ImageKind::Data);
    assert!(data.abs_diff_eq(Vec4::new(0.5, 0.0, 1.0, 0.25), 1e-3), "{data}");
    let color = texel(ImageKind::Color);
    assert!(color.abs_diff_eq(Vec4::new(0.2140, 0.0, 1.0, 0.25), 1e-3), "{color}");
}

#[test]
fn heights_of_sixteen_bits_stay_apart() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ramp.png");
    // The greys between which half floats have no other: their steps there are 32 of 65535.
    let ramp = image::ImageBuffer::from_fn(64, 1, |x, _| image::Luma([60_000 + x as u16]));
    ramp.save(&path).unwrap();
    let image = load_image(&path, ImageKind::Height).unwrap();
    assert_eq!((image.texels, image.levels[0].len()), (Texels::R32Float, 4 * 64));
    for (x, &bytes) in image.levels[0].as_chunks::<4>().0.iter().enumerate() {
        assert_eq!((f32::from_le_bytes(bytes) * 65535.0).round(), 60_000.0 + x as f32);
    }
    // The mean of a ramp is the mean of its ends.
    let last = image.levels.last().unwrap();
    let mean = f32::from_le_bytes(last[..].try_into().unwrap()) * 65535.0;
    assert!((mean - 60_031.5).abs() < 0.1, "{mean}");
    // Eight bits stay eight.
    let shallow = folder.path().join("shallow.png");
    image::GrayImage::from_pixel(4, 4, image::Luma([7])).save(&shallow).unwrap();
    assert_eq!(load_image(&shallow, ImageKind::Height).unwrap().texels, Texels::Rgba8);
}

#[test]
fn images_of_one_channel_are_grey_in_every_map() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let [eight, alpha, sixteen] = ["l8.png", "la8.png", "l16.png"].map(file);
    image::GrayImage::from_pixel(2, 2, image::Luma([100])).save(&eight).unwrap();
    image::GrayAlphaImage::from_pixel(2, 2, image::LumaA([100, 50])).save(&alpha).unwrap();
    image::ImageBuffer::from_pixel(2, 2, image::Luma([25_700u16])).save(&sixteen).unwrap();
    let others = [file("l8.tga"), file("l8.bmp"), file("one.exr"), file("two.exr")];
    image::GrayImage::from_pixel(2, 2, image::Luma([100])).save(&others[0]).unwrap();
    image::GrayImage::from_pixel(2, 2, image::Luma([100])).save(&others[1]).unwrap();
    let value = 100.0f32 / 255.0;
    write_exr(&others[2], &[("depth.Z", value)]);
    write_exr(&others[3], &[("A", 50.0 / 255.0), ("Y", value)]);
    for (path, expected) in [
        (&eight, [100, 100, 100, 255]),
        (&alpha, [100, 100, 100, 50]),
        (&sixteen, [100, 100, 100, 255]),
        (&others[0], [100, 100, 100, 255]),
        (&others[1], [100, 100, 100, 255]),
        (&others[2], [100, 100, 100, 255]),
        (&others[3], [100, 100, 100, 50]),
    ] {
        let data = load_image(path, ImageKind::Data).unwrap();
        let texel: Vec<f32> = match data.texels {
            Texels::Rgba8 => data.levels[0][..4].iter().map(|&v| f32::from(v) / 255.0).collect(),
            _ => data.levels[0][..8].as_chunks::<2>().0.iter().map(|&v| half::f16::from_le_bytes(v).to_f32()).collect(),
        };
        let expected = expected.map(|v: u8| f32::from(v) / 255.0);
        // Half floats round to 11 bits.
        assert!(texel.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 1.0 / 4096.0), "{path:?}: {texel:?}");
        let height = load_image(path, ImageKind::Height).unwrap();
        let first = match height.texels {
            Texels::Rgba8 => f32::from(height.levels[0][0]) / 255.0,
            _ => f32::from_le_bytes(height.levels[0][..4].try_into().unwrap()),
        };
        assert!((first - value).abs() < 1e-6, "{path:?}: {first}");
    }
    let path = file("xyz.exr");
    write_exr(&path, &[("X", 0.5), ("Y", 0.5), ("Z", 0.5)]);
    let error = load_image(&path, ImageKind::Data).unwrap_err().to_string();
    assert!(error.contains("R, G and B") && error.contains("X, Y, Z"), "{error}");
}

/// 2 × 2 texels of so many channels, each of one value.
fn write_exr(path: &Path, channels: &[(&str, f32)]) {
    use exr::prelude::*;
    let channels = channels.iter().map(|&(name, value)| AnyChannel::new(name, FlatSamples::F32(vec![value; 4])));
    let channels = AnyChannels::sort(channels.collect());
    let layer = Layer::new((2, 2), LayerAttributes::default(), Encoding::UNCOMPRESSED, channels);
    Image::from_layer(layer).write().to_file(path).unwrap();
}

#[test]
fn normal_maps_of_two_channels_get_their_z() {
    let folder = tempfile::tempdir().unwrap();
    // Leans by 37° in four directions, and none: x and y are 0.6 or 0.
    let xy = [[204, 128], [51, 128], [128, 204], [128, 51], [128, 128]];
    let read = |name: &str, texel: &dyn Fn([u8; 2]) -> [u8; 4]| {
        let path = folder.path().join(name);
        image::RgbaImage::from_fn(5, 1, |x, _| image::Rgba(texel(xy[x as usize]))).save(&path).unwrap();
        let read = load_images(&[(path, ImageKind::Normal)]).remove(0).unwrap();
        let texels: Vec<[u8; 4]> = read.image.levels[0].as_chunks::<4>().0.to_vec();
        (texels, read.notes)
    };
    // z is 0.8 where x or y is 0.6, stored 0.9; 128 is 1/255 beyond none.
    let whole: Vec<[u8; 4]> = xy.map(|[x, y]| [x, y, if [x, y] == [128, 128] { 255 } else { 229 }, 255]).to_vec();
    let alike =
        |a: &[[u8; 4]], b: &[[u8; 4]]| a.iter().zip(b).all(|(a, b)| a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) <= 1));
    for (name, blue) in [("none.png", 0), ("half.png", 128), ("full.png", 255)] {
        let (texels, notes) = read(name, &|[x, y]| [x, y, blue, 255]);
        assert!(alike(&texels, &whole), "{name}: {texels:?}");
        assert!(notes.len() == 1 && notes[0].contains("made from red and green"), "{name}: {notes:?}");
    }
    for (name, red) in [("dxt5nm_0.png", 0), ("dxt5nm_255.png", 255)] {
        let (texels, notes) = read(name, &|[x, y]| [red, y, y, x]);
        assert!(alike(&texels, &whole), "{name}: {texels:?}");
        assert!(notes.len() == 1 && notes[0].contains("x in alpha"), "{name}: {notes:?}");
    }
    let (texels, notes) = read("whole.png", &|[x, y]| [x, y, if x == y { 255 } else { 229 }, 255]);
    assert!(texels == whole && notes.is_empty(), "{texels:?} {notes:?}");
    // A gentle map may well have the same blue all over.
    let (texels, notes) = read("gentle.png", &|[x, y]| [128 + x / 20, 128 + y / 20, 254, 255]);
    assert!(texels[0] == [138, 134, 254, 255] && notes.is_empty(), "{texels:?} {notes:?}");
    type Texel<'a> = &'a dyn Fn([u8; 2]) -> [u8; 4];
    let grey: Texel = &|[x, _]: [u8; 2]| [x, x, x, 255];
    for (name, texel, word) in [
        ("grey.png", grey, "is grey: expected a normal map"),
        ("grey_alpha.png", &|[x, y]| [x, x, x, y], "is grey with alpha"),
        ("inward.png", &|[x, y]| [x, y, if x == y { 0 } else { 26 }, 255], "points into the surface"),
    ] {
        let (_, notes) = read(name, texel);
        assert!(notes.len() == 1 && notes[0].contains(word), "{name}: {notes:?}");
    }
}

#[test]
fn a_header_that_promises_too_much_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("huge.bmp");
    let mut bytes = b"BM\0\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0".to_vec();
    bytes.extend(20_000i32.to_le_bytes().repeat(2));
    bytes.extend([1, 0, 24, 0]);
    bytes.resize(200, 0);
    std::fs::write(&path, bytes).unwrap();
    let error = load_image(&path, ImageKind::Color).unwrap_err().to_string();
    assert!(error.contains("huge.bmp") && error.contains("large"), "{error}");
    let missing = load_image(&folder.path().join("none.png"), ImageKind::Color).unwrap_err();
    assert!(matches!(missing, ImportError::Unreadable { .. }), "{missing}");
}

#[test]
fn models_read_in_parallel_join_the_library_in_order() {
    let names = ["van", "barrel", "missing", "crate"];
    let file = |name: &str| {
        let name = if name == "van" { "vehicle_van" } else { name };
        Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/models").join(format!("{name}.glb"))
    };
    let paths: Vec<PathBuf> = names.iter().map(|name| file(name)).collect();
    let (mut one_by_one, mut together) = (Library::default(), Library::default());
    let (before, _) = relief::import::progress::counts();
    let expected: Vec<_> = paths.iter().map(|path| load_model(path, &mut one_by_one)).collect();
    let models = load_models(&paths, Path::new("."), &mut together);
    assert_eq!(models.iter().map(Result::is_ok).collect::<Vec<_>>(), [true, true, false, true]);
    for (model, expected) in models.iter().zip(&expected) {
        let parts = |model: &Result<Model, ImportError>| match model {
            Ok(model) => model.nodes.iter().map(|node| node.parts.clone()).collect::<Vec<_>>(),
            Err(_) => Vec::new(),
        };
        assert_eq!(parts(model), parts(expected));
    }
    let meshes = |library: &Library| library.meshes().iter().map(|m| m.mesh.name.clone()).collect::<Vec<_>>();
    assert_eq!(meshes(&together), meshes(&one_by_one));
    assert_eq!(together.materials(), one_by_one.materials());
    assert!(together.images() == one_by_one.images());
    let (done, wanted) = relief::import::progress::counts();
    assert!(done >= before + 2 * (together.images().len() - Library::default().images().len()) && wanted >= done);
}
