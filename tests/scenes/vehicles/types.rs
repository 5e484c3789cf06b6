//! Files of types: what a model becomes, what is refused and in which words; vehicles in scenes.

use super::*;

#[test]
fn a_model_stands_on_its_wheels_whatever_its_origin() {
    let (mut simulation, warnings) = Folder::with_cart().types(TYPES);
    assert_eq!(warnings, [] as [String; 0]);
    let (kind, cart) = find(&simulation, "cart");
    assert!((cart.wheelbase - 2.5).abs() < 1e-5 && (cart.track - 1.2).abs() < 1e-5, "{cart:?}");
    assert_eq!(cart.limits.speed, 10.0);
    // The front wheels are the larger ones: the ground is under them.
    let radii: Vec<f32> = cart
        .parts
        .iter()
        .filter_map(|part| match part.movement {
            Some(Movement::Wheel { radius, .. }) => Some(radius),
            _ => None,
        })
        .collect();
    assert_eq!(radii, [0.5, 0.5, 0.4, 0.4]);
    let vehicle = simulation.world.spawn((Vehicle::of(kind), Transform::from_xyz(100.0, 0.0, 0.0))).id();
    simulation.frame();
    let world = &mut simulation.world;
    let place = |world: &World, entity| world.get::<GlobalTransform>(entity).expect("placed").translation();
    let mut wheels: Vec<Vec3> =
        world.query_filtered::<&GlobalTransform, With<MovingPart>>().iter(world).map(|at| at.translation()).collect();
    wheels.sort_by(|a, b| (a.z, a.x).partial_cmp(&(b.z, b.x)).expect("numbers"));
    near(wheels[0], Vec3::new(99.4, 0.5, 0.0));
    near(wheels[3], Vec3::new(100.7, 0.5, 2.5));
    // Under a node that turns it round: at +3.5, shining ahead.
    let (lamp, at) = world.query_filtered::<(&Lamp, &GlobalTransform), With<MeshId>>().single(world).expect("a glass");
    assert_eq!((lamp.vehicle, lamp.kind), (vehicle, LampKind::Head));
    near(at.translation(), Vec3::new(100.0, 1.5, 3.5));
    near(at.forward(), Vec3::Z);
    assert_eq!(place(world, vehicle), Vec3::new(100.0, 0.0, 0.0));
    // Body, four wheels, the glass, its light: nothing that has no purpose.
    assert_eq!(world.query::<&ChildOf>().iter(world).count(), 7);
    assert_eq!(world.query::<&Light>().single(world).expect("one light").intensity, 9.0);
}

#[test]
fn paint_and_glow_are_materials_of_their_own() {
    let (mut simulation, _) = Folder::with_cart().types(TYPES);
    let (kind, cart) = find(&simulation, "cart");
    assert_eq!(cart.paints, [Vec3::X, Vec3::Z]);
    let blue = simulation.world.spawn(Vehicle::of(kind).painted(1)).id();
    let world = &simulation.world;
    let of = |entity: Entity| {
        let material = *world.get::<MaterialId>(entity)?;
        world.resource::<Library>().material(material).cloned()
    };
    let parts: Vec<_> = world.get::<Children>(blue).expect("parts").iter().filter_map(of).collect();
    let coat = parts.iter().find(|m| m.name == "coat").expect("painted");
    assert_eq!(coat.base_factor.truncate(), Vec3::Z);
    let glowing: Vec<_> = parts.iter().filter(|m| m.emissive_factor != Vec3::ZERO).collect();
    assert!(
        matches!(glowing.as_slice(), [glass] if glass.name == "rubber" && glass.emissive_factor == Vec3::splat(2.0))
    );
}

#[test]
fn everything_wrong_with_types_is_said_with_its_place() {
    let folder = Folder::with_cart();
    let text = r#"(types: {
    "a": (model: "cart.gltf", wheelbase: 0, wheels: [(nodes: ["front lft"], radius: -1)], mass: 1e30),
    "b": (model: "missing.gltf", wheels: [(nodes: ["x"])]),
    "box": (model: "cart.gltf"),
    "c": (model: "cart.gltf", lamps: [(nodes: ["lamp"], kind: head, glow: inf, color: srgb("red"))], paint: (materials: ["cat"], colors: [])),
    "c": (model: "cart.gltf", limits: (braking: 0, steering_degrees: 90), driver: (headway_seconds: -1)),
    "d": (model: "cart.gltf", swings: [(node: "body", degrees: 30, stride_metres: 0)], trailer: (node: "bdy", length: 0), forks: [""]),
})"#;
    let problems = folder.problems_of(text);
    let expected = [
        r#"2:42: types["a"].wheelbase: expected a number from 0.05 to 100, found 0"#,
        r#"2:63: types["a"].wheels[0].nodes[0]: unknown node "front lft"; did you mean "front left"?"#,
        r#"2:85: types["a"].wheels[0].radius: expected a number from 0.01 to 10, found -1"#,
        r#"2:97: types["a"].mass: expected a number from 1 to 1000000"#,
        r#"3:18: types["b"].model: missing.gltf"#,
        r#"4:12: types["box"]: reserved name "box": the placeholder vehicle type has it"#,
        r#"5:75: types["c"].lamps[0].glow: expected a number from 0 to 1000000000, found inf"#,
        r#"5:87: types["c"].lamps[0].color: expected a colour like"#,
        r#"5:122: types["c"].paint.materials[0]: unknown material "cat"; did you mean "coat"?"#,
        r#"6:10: types["c"]: duplicate name "c""#,
        r#"6:49: types["c"].limits.braking: expected a number from 0.01 to 100, found 0"#,
        r#"6:70: types["c"].limits.steering_degrees: expected a number from 0.1 to 85, found 90"#,
        r#"6:101: types["c"].driver.headway_seconds: expected a number from 0 to 60, found -1"#,
        r#"7:83: types["d"].swings[0].stride_metres: expected a number from 0.01"#,
        r#"7:104: types["d"].trailer.node: unknown node "bdy"; did you mean "body"?"#,
        r#"7:119: types["d"].trailer.length: expected a number from 0.05 to 100, found 0"#,
        r#"7:131: types["d"].forks[0]: unknown node """#,
    ];
    assert_eq!(problems.len(), expected.len(), "{problems:#?}");
    for (problem, expected) in problems.iter().zip(expected) {
        assert!(problem.starts_with(expected), "{problem}\nis not\n{expected}");
    }
}

#[test]
fn a_file_that_is_refused_leaves_everything_as_it_was() {
    let folder = Folder::with_cart();
    let mut simulation = Simulation::new();
    let sizes = simulation.library().sizes();
    for text in
        ["(types: {\"a\": (model: \"cart.gltf\", forks: [\"nowhere\"])})", "(types: {\"a\": ())})", "(type: {})", ""]
    {
        let path = folder.file("vehicles.ron", text);
        let error = load_vehicle_types(&path, &mut simulation).expect_err("refused");
        assert!(error.to_string().contains("vehicles.ron:1:"), "{error}");
    }
    assert_eq!(simulation.library().sizes(), sizes);
    assert_eq!(simulation.world.resource::<VehicleTypes>().iter().count(), 1);
}

#[test]
fn a_scene_names_types_and_has_vehicles_of_them() {
    let folder = Folder::with_cart();
    folder.file("vehicles.ron", TYPES);
    let text = r#"(
        vehicle_types: ["vehicles.ron"],
        entities: [
            (name: "mine", vehicle: (type: "cart", paint: 1, headlights: high, manual: true), transform: (translation: (1, 2, 3)),
             children: [(name: "seat", camera: ())]),
            (vehicle: (type: "cart")),
            (vehicle: (type: "crt"), transform: (translation: (9, 0, 0))),
            (vehicle: (type: "crt"), transform: (translation: (18, 0, 0))),
        ],
    )"#;
    let mut simulation = Simulation::new();
    let loaded = scene::load(&folder.file("scene.ron", text), &mut simulation).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(loaded.warnings, [r#"unknown vehicle type "crt"; did you mean "cart"?; a box is drawn instead"#]);
    assert_eq!(loaded.cameras.first().map(|(name, _)| name.as_str()), Some("seat"));
    let world = &mut simulation.world;
    let mut vehicles = world.query::<(&Name, &Vehicle, &Controls, &Transform, Has<ManualControl>, &VehicleNumber)>();
    let mut all: Vec<_> = vehicles.iter(world).collect();
    all.sort_by_key(|vehicle| vehicle.5);
    let names: Vec<&str> = all.iter().map(|v| v.0.as_str()).collect();
    assert_eq!(names, ["mine", "cart 2", "crt 3", "crt 4"]);
    let (_, mine, controls, at, manual, _) = all[0];
    assert_eq!(
        (mine.paint, controls.headlights, at.translation, manual),
        (1, Headlights::High, Vec3::new(1.0, 2.0, 3.0), true)
    );
    assert!(!all[1].4 && all[1].1.kind == mine.kind && all[2].1.kind == VehicleTypeId::STAND_IN);
}

#[test]
fn the_old_name_of_manual_is_read_with_a_warning() {
    let folder = Folder::with_cart();
    folder.file("vehicles.ron", TYPES);
    let text = r#"(vehicle_types: ["vehicles.ron"], entities: [
        (vehicle: (type: "cart")),
        (vehicle: (type: "cart", by_hand: true), transform: (translation: (9, 0, 0))),
    ])"#;
    let mut simulation = Simulation::new();
    let loaded = scene::load(&folder.file("scene.ron", text), &mut simulation).unwrap_or_else(|e| panic!("{e}"));
    let place = "entities[1].vehicle.by_hand (line 3, column 43)";
    assert_eq!(loaded.warnings, [format!("{place}: deprecated name; use manual")]);
    let mut manual = simulation.world.query_filtered::<(), (With<Vehicle>, With<ManualControl>)>();
    assert_eq!(manual.iter(&simulation.world).count(), 1);
}

#[test]
fn a_scenes_problems_include_those_of_its_types() {
    let folder = Folder::with_cart();
    folder.file("vehicles.ron", "(types: {\"a\": (model: \"cart.gltf\", mass: 0)})");
    let problems = folder.problems(
        r#"(vehicle_types: ["vehicles.ron", "gone.ron"],
        meshes: {"m": cube()}, entities: [(vehicle: (type: "a"), mesh: "m")])"#,
    );
    assert_eq!(problems.len(), 3, "{problems:#?}");
    assert!(
        problems[0].starts_with("1:18: vehicle_types[0]: vehicles.ron:1:42: types[\"a\"].mass: expected a number"),
        "{}",
        problems[0]
    );
    assert!(problems[1].starts_with("1:34: vehicle_types[1]: gone.ron: "), "{}", problems[1]);
    assert!(
        problems[2].contains("expected either a vehicle, which has a model of its own, or a mesh"),
        "{}",
        problems[2]
    );
}

/// A model that knows nothing of Relief becomes a vehicle by naming its nodes; this one's have no names.
#[test]
fn the_milk_truck_drives() {
    let Some(data) = common::test_data() else { return };
    let folder = Folder::with_cart();
    let model = data.join("models/CesiumMilkTruck/CesiumMilkTruck.glb").display().to_string();
    let of_nodes = |front: &str, rear: &str| {
        let wheels = format!("wheels: [(nodes: [{front:?}], steers: true), (nodes: [{rear:?}])]");
        format!("(types: {{\"truck\": (model: {model:?}, transform: (rotation_degrees: (0, 90, 0)), {wheels})}})")
    };
    let wrong = folder.problems_of(&of_nodes("nod 2", "node 4"));
    assert!(wrong.len() == 1 && wrong[0].contains("unknown node \"nod 2\"; did you mean \"node 2\"?"), "{wrong:?}");
    let (mut simulation, _) = folder.types(&of_nodes("node 2", "node 4"));
    let (kind, truck) = find(&simulation, "truck");
    assert!((truck.wheelbase - 2.785).abs() < 1e-3 && (4.0..6.0).contains(&truck.size.z), "{truck:?}");
    simulation.world.spawn(Vehicle::of(kind));
    simulation.frame();
    let mut wheels = simulation.world.query_filtered::<&GlobalTransform, With<MovingPart>>();
    let mut axles: Vec<Vec3> = wheels.iter(&simulation.world).map(|at| at.translation()).collect();
    axles.sort_by(|a, b| a.z.total_cmp(&b.z));
    assert!(axles[0].z.abs() < 1e-4 && (axles[1].z - 2.785).abs() < 1e-3 && axles[0].y > 0.3, "{axles:?}");
}
