//! Models of others, against what is known of them.

use crate::common::{self, prelude::*};
use crate::support::*;
use std::f32::consts::PI;
use systems::assets::{Filter, MipFilter, Wrap};

/// Refused, each for its reason; everything else loads.
const REFUSED: [(&str, &str); 3] = [
    ("models/BoxMeshopt/BoxMeshopt.glb", "EXT_meshopt_compression"),
    ("asset-generator/Compatibility/Compatibility_04.gltf", "needs glTF 2.1"),
    ("asset-generator/Compatibility/Compatibility_05.gltf", "FAKE_materials_quantumRendering"),
];

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
    assert_eq!(library.images().count(), Library::default().images().count() + 1);
    let Some((_, library)) = load("models/BoxWithSpaces/Box With Spaces.gltf") else { return };
    assert_eq!(library.images().filter(|(_, i)| i.kind == ImageKind::Normal).count(), 2);
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
    let colors = &first_mesh(&library).colors;
    assert_eq!(colors.len(), 24);
    assert!(colors.iter().any(|c| *c != colors[0]));
}

#[test]
fn copies_of_a_mesh_are_one_mesh() {
    let Some((model, library)) = load("models/ManyCubes/many-cubes.gltf") else { return };
    assert_eq!((model.nodes.len(), library.meshes().count()), (506, 1));
}

#[test]
fn specular_glossiness_and_specular_are_read() {
    let Some((_, library)) = load("models/BoxTextured-SpecGloss/BoxTextured.gltf") else { return };
    let shaded = |l: &Library, s| l.materials().filter(|(_, m)| m.shading == s).count();
    assert_eq!(shaded(&library, Shading::SpecularGlossiness), 1);
    let Some((_, library)) = load("models/SpecularTest/SpecularTest.glb") else { return };
    assert_eq!(shaded(&library, Shading::MetallicRoughness), 24);
    assert!(library.materials().any(|(_, m)| m.specular_strength < 1.0));
    let mut maps = library.materials().filter_map(|(_, m)| m.specular_map);
    assert!(maps.all(|map| library.image(map.image).unwrap().kind == ImageKind::Color));
}

#[test]
fn samplers_are_those_of_the_generators_table() {
    let sampler = |number: usize| {
        let (_, library) = load(&format!("asset-generator/Texture_Sampler/Texture_Sampler_{number:02}.gltf"))?;
        Some(library.materials().find_map(|(_, m)| m.base_map).unwrap().sampler)
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
        let mesh = first_mesh(&library);
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
        assert!(library.materials().any(|(_, m)| m.alpha == mode), "{mode:?}");
    }
    assert!(library.materials().any(|(_, m)| m.alpha == AlphaMode::Mask && m.alpha_cutoff != 0.5));
}

#[test]
fn a_skinned_model_stands_as_its_joints_do() {
    let Some((model, library)) = load("models/SimpleSkin/SimpleSkin.gltf") else { return };
    let bounds = model.bounds(&library);
    assert_eq!((bounds.min, bounds.max), (Vec3::new(-0.5, 0.0, 0.0), Vec3::new(0.5, 2.0, 0.0)));
    assert_eq!(model.warnings.iter().filter(|w| w.message.contains("skins")).count(), 1);
}
