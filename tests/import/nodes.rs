//! Nodes and what hangs on them: transforms, cameras, lights, skins.

use crate::common::prelude::*;
use crate::support::*;
use glam::Mat4;

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
            set_lights(d, json!([{ "type": "spot", "spot": { "innerConeAngle": 0, "outerConeAngle": outer } }]));
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

/// The others stay, with their numbers.
#[test]
fn a_faulty_light_is_left_out_by_itself() {
    let load = |lights: Value| {
        with_triangle(|d| {
            set_lights(d, lights);
            let node = |light: usize| json!({ "extensions": { "KHR_lights_punctual": { "light": light } } });
            d["nodes"] = json!([{ "mesh": 0 }, node(0), node(1), node(2)]);
            d["scenes"][0]["nodes"] = json!([0, 1, 2, 3]);
        })
        .unwrap()
        .0
    };
    let sun = json!({ "type": "directional", "color": [1, 0, 0] });
    let lamp = json!({ "type": "point", "color": [0, 0, 1] });
    for faulty in [json!({ "type": "point", "intensity": -1 }), json!({ "name": "no type" }), json!("a light")] {
        let model = load(json!([sun, faulty, lamp]));
        let found = |node: usize| model.nodes[node].light.as_ref().map(|light| (light.kind, light.color));
        let expected = [Some((LightKind::Directional, Vec3::X)), None, Some((LightKind::Point, Vec3::Z))];
        assert_eq!([1, 2, 3].map(found), expected, "{faulty}");
        let left: Vec<_> = model.warnings.iter().filter(|w| w.message == "ignored for this reason").collect();
        let place = "extensions.KHR_lights_punctual.lights[1]";
        assert!(left.len() == 1 && left[0].place == place, "{faulty}: {:?}", model.warnings);
    }
    // A name is no reason to leave a light out.
    let named = load(json!([sun, { "type": "point", "name": 5 }, lamp]));
    assert_eq!(named.nodes.iter().filter(|node| node.light.is_some()).count(), 3, "{:?}", named.warnings);
    // Where there is no list, there are no lights.
    assert!(!load(json!("none")).has_lights());
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
        let weights = push_floats(d, &weights, "VEC4");
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
