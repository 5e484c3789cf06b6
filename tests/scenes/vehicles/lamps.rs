//! Directions of lamps.

use super::*;

#[test]
fn lamps_shine_ahead_and_not_on_their_own_vehicle() {
    let (mut simulation, _) = Folder::with_cart().types(TYPES);
    let (kind, _) = find(&simulation, "cart");
    simulation.world.spawn(Vehicle::of(kind));
    let wall = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE));
    let wall = simulation.world.spawn((wall, Transform::from_xyz(0.0, 1.0, 12.0))).id();
    simulation.frame();
    let world = &mut simulation.world;
    let (light, at) = world.query::<(&Light, &GlobalTransform)>().single(world).expect("one light");
    assert!(light.enabled && at.forward().dot(Vec3::Z) > 0.999);
    // The body's sphere, of 2.83 m about 1.5, reaches 4.33.
    assert!((4.33..4.35).contains(&at.translation().z), "{}", at.translation());
    let mut objects = world.query::<(Entity, &SelectedLights)>();
    let reached: Vec<Entity> = objects
        .iter(world)
        .filter(|(_, selected)| selected.unpack(world.resource()).reaching > 0)
        .map(|(entity, _)| entity)
        .collect();
    assert_eq!(reached, [wall]);
}

/// The way of each lamp's light while the vehicle stands at the origin, by the name of its node, and what is said of
/// them.
fn ways(lamps: &str, nodes: Value) -> (Vec<(String, Vec3)>, Vec<String>) {
    let folder = Folder::with_cart();
    folder.file("made.gltf", model(&[vec![block(Vec3::splat(0.1), Vec3::ZERO)]], nodes));
    let (simulation, warnings) =
        folder.types(&format!(r#"(types: {{ "t": (model: "made.gltf", lamps: [{lamps}]) }})"#));
    let parts = find(&simulation, "t").1.parts;
    let mut found = Vec::new();
    for part in parts.iter().filter(|part| part.lamp.as_ref().is_some_and(|lamp| lamp.light.is_some())) {
        let (mut place, mut above) = (part.rest.compute_affine(), part.parent);
        while let Some(part) = above.map(|index| &parts[index]) {
            place = part.rest.compute_affine() * place;
            above = part.parent;
        }
        found.push((part.name.clone(), GlobalTransform::from(place).forward()));
    }
    (found, warnings)
}

#[test]
fn a_lamp_shines_the_way_its_kind_says() {
    let left = Vec3::X;
    let kinds = [
        ("head", Vec3::Z),
        ("fog", Vec3::Z),
        ("daytime", Vec3::Z),
        ("tail", -Vec3::Z),
        ("brake", -Vec3::Z),
        ("reverse", -Vec3::Z),
        ("indicator_left", left),
        ("indicator_right", -left),
    ];
    // The node is not turned, or is turned somewhere; scaled and mirrored parents.
    let turns =
        [Quat::IDENTITY, Quat::from_rotation_y(PI), Quat::from_rotation_y(PI / 2.0), Quat::from_rotation_x(-1.5)];
    for (kind, way) in kinds {
        for turn in turns {
            for scale in [Vec3::ONE, Vec3::new(-1.0, 1.0, 1.0), Vec3::new(0.01, 0.02, 0.005)] {
                let nodes =
                    json!([{ "name": "lamp", "mesh": 0, "rotation": turn.to_array(), "scale": scale.to_array() }]);
                let lamps = format!("(nodes: [\"lamp\"], kind: {kind}, light: spot(outer_degrees: 30))");
                let (found, warnings) = ways(&lamps, nodes);
                assert_eq!(warnings, [] as [String; 0]);
                assert!(found.len() == 1 && found[0].1.abs_diff_eq(way, 1e-5), "{kind} {turn} {scale}: {found:?}");
            }
        }
    }
}

#[test]
fn a_lamp_follows_its_node_its_light_and_its_direction() {
    let turned = |x: f32, y: f32| (Quat::from_rotation_y(y) * Quat::from_rotation_x(x)).to_array();
    let node = |rotation: [f32; 4], own: bool| {
        let mut node = json!({ "name": "lamp", "mesh": 0, "rotation": rotation });
        if own {
            node["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
        }
        json!([node])
    };
    let spot = "light: spot(outer_degrees: 30)";
    let dipped = Vec3::new(0.0, -(0.1f32.sin()), 0.1f32.cos());
    let cases = [
        // A dipped beam, on a node that was turned for it.
        (format!("kind: head, {spot}"), node(turned(-0.1, PI), false), dipped, None),
        (format!("kind: interior, {spot}"), node(turned(-PI / 2.0, 0.0), false), Vec3::NEG_Y, None),
        (
            format!("kind: head, {spot}, direction: (0, -3, 4)"),
            node(turned(0.3, 0.0), false),
            Vec3::new(0.0, -0.6, 0.8),
            None,
        ),
        ("kind: head".into(), node(turned(0.0, PI), true), Vec3::Z, None),
        ("kind: indicator_left".into(), node(turned(0.0, PI), true), Vec3::Z, None),
        // What is probably not meant.
        (
            "kind: head".into(),
            node(turned(0.0, 0.0), true),
            -Vec3::Z,
            Some(r#"head lamp "lamp" shines to the rear, as the light at its node is turned"#),
        ),
        (
            format!("kind: head, {spot}"),
            node(turned(0.0, 0.0), true),
            -Vec3::Z,
            Some(r#"head lamp "lamp" shines to the rear"#),
        ),
        (
            format!("kind: head, {spot}, direction: (0, 0, -1)"),
            node(turned(0.0, PI), true),
            -Vec3::Z,
            Some(r#"head lamp "lamp" shines to the rear, as its direction says"#),
        ),
        (
            format!("kind: tail, {spot}, direction: (0.1, 0, 1)"),
            node(turned(0.0, 0.0), false),
            Vec3::new(0.1, 0.0, 1.0).normalize(),
            Some(r#"tail lamp "lamp" shines ahead, as its direction says"#),
        ),
        (
            format!("kind: indicator_right, {spot}, direction: (1, 0, 0)"),
            node(turned(0.0, 0.0), false),
            Vec3::X,
            Some(r#"right indicator lamp "lamp" shines to the left"#),
        ),
    ];
    for (lamp, nodes, way, expected) in cases {
        let (found, warnings) = ways(&format!("(nodes: [\"lamp\"], {lamp})"), nodes);
        assert!(found.len() == 1 && found[0].1.abs_diff_eq(way, 1e-5), "{lamp}: {found:?}");
        assert_eq!(warnings.len(), usize::from(expected.is_some()), "{lamp}: {warnings:?}");
        let said = warnings.iter().zip(expected).all(|(w, e)| w.starts_with(&format!("vehicle type \"t\": {e}")));
        assert!(said, "{lamp}: {warnings:?}");
    }
    let nodes = node(turned(0.0, 0.0), false);
    let (_, warnings) = ways("(nodes: [\"lamp\"], kind: head, light: point(), direction: (0, 0, 1))", nodes);
    assert!(warnings.len() == 1 && warnings[0].contains("direction of lamp \"lamp\" has no effect"), "{warnings:?}");
    let text =
        r#"(types: { "t": (model: "cart.gltf", lamps: [(nodes: ["lamp"], kind: head, direction: (0, 0, 0))]) })"#;
    let problems = Folder::with_cart().problems_of(text);
    assert!(problems.len() == 1 && problems[0].contains("lamps[0].direction: expected a direction"), "{problems:?}");
}

/// Nothing points anywhere in what has no volume.
#[test]
fn a_lamp_at_a_flat_node_has_no_light_and_is_named() {
    let lamp = "(nodes: [\"lamp\"], kind: head, light: spot(outer_degrees: 30))";
    for flat in [[0, 1, 1], [1, 0, 1], [1, 1, 0], [0, 0, 1], [0, 0, 0]] {
        for nodes in [
            json!([{ "name": "lamp", "mesh": 0, "rotation": [0, 0.6, 0, 0.8], "scale": flat }]),
            json!([{ "children": [1], "scale": flat }, { "name": "lamp", "mesh": 0, "rotation": [0, 0.6, 0, 0.8] }]),
        ] {
            let (found, warnings) = ways(lamp, nodes);
            assert!(found.is_empty(), "{flat:?}: {found:?}");
            let expected = "lamp \"lamp\" has a scale of 0 at its node or above: its light is left out";
            let said = warnings.iter().filter(|warning| warning.contains(expected)).count();
            assert_eq!(said, 1, "{flat:?}: {warnings:?}");
        }
    }
    // What is drawn there is where it was.
    let folder = Folder::with_cart();
    let nodes = json!([{ "name": "plate", "mesh": 0, "scale": [1, 1, 0], "rotation": [0, 0.6, 0, 0.8] }]);
    folder.file("made.gltf", model(&[vec![block(Vec3::ONE, Vec3::ZERO)]], nodes));
    let (simulation, warnings) = folder.types(r#"(types: { "t": (model: "made.gltf") })"#);
    assert_eq!(warnings, [] as [String; 0]);
    let parts = find(&simulation, "t").1.parts;
    let turned = Quat::from_array([0.0, 0.6, 0.0, 0.8]) * Vec3::new(0.5, 0.5, 0.0);
    let place = parts[0].rest.compute_affine().transform_point3(Vec3::new(0.5, 0.5, 0.5));
    assert!(place.abs_diff_eq(turned, 1e-5), "{place} is not {turned}");
}

#[test]
fn nodes_of_one_name_are_said_to_be_ambiguous() {
    let nodes = json!([
        { "name": "lamp", "mesh": 0 }, { "name": "lamp", "mesh": 0 }, { "name": "lamp", "mesh": 0 },
        { "name": "other", "mesh": 0 }, { "name": "other", "mesh": 0 },
    ]);
    let (_, warnings) = ways("(nodes: [\"lamp\"], kind: head), (nodes: [\"lamp\"], kind: tail)", nodes);
    assert_eq!(warnings, ["vehicle type \"t\": 3 nodes are named \"lamp\": the first is used"]);
}

#[test]
fn a_lamp_casts_shadows_as_its_light_or_its_entry_says() {
    let node = json!([{ "name": "lamp", "mesh": 0, "extensions": { "KHR_lights_punctual": { "light": 0 } } }]);
    let folder = Folder::with_cart();
    folder.file("made.gltf", model(&[vec![block(Vec3::splat(0.1), Vec3::ZERO)]], node));
    let shadows = |lamp: &str| {
        let text =
            format!(r#"(types: {{ "t": (model: "made.gltf", lamps: [(nodes: ["lamp"], kind: head, {lamp})]) }})"#);
        let (simulation, _) = folder.types(&text);
        let parts = find(&simulation, "t").1.parts;
        let light = parts.iter().find_map(|part| part.lamp.as_ref()?.light.clone()).expect("a light");
        (light.shadows, light.shadow_near)
    };
    assert_eq!(shadows("light: spot(outer_degrees: 30, shadows: true, shadow_near: 0.3)"), (true, 0.3));
    assert!(!shadows("light: spot(outer_degrees: 30)").0 && !shadows("").0);
    assert_eq!(shadows("shadows: true"), (true, 0.15));
    let text = r#"(types: { "t": (model: "cart.gltf", lamps: [(nodes: ["lamp"], kind: head, light: point(), shadows: true)]) })"#;
    let problems = folder.problems_of(text);
    assert!(problems.len() == 1 && problems[0].contains("lamps[0].shadows: not allowed with `light`"), "{problems:?}");
}
