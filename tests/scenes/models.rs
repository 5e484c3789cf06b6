//! Models in scenes, and as scenes.

use super::*;

#[test]
fn models_are_placed_overridden_and_picked_apart() {
    let (mut simulation, _) = load(
        r#"(materials: {"red": (base_factor: (1, 0, 0))},
        meshes: {"whole": model(file: "model.gltf"), "part": model(file: "model.gltf", node: "lamp"), "cube": cube()},
        entities: [
            (name: "whole", mesh: "whole", transform: (translation: (10, 0, 0))),
            (name: "red", mesh: "whole", material: "red"),
            (name: "part", mesh: "part", transform: (translation: (5, 0, 0))),
            (name: "figure", figure: ["cube", "part"], material: "red"),
        ])"#,
    );
    let library_meshes = simulation.library().meshes().count();
    assert_eq!(library_meshes, 2, "the model's mesh once, and the cube");
    let world = &mut simulation.world;
    assert_eq!(all::<MeshId>(world).len(), 2 + 2 + 1 + 1);
    let below = |world: &World, root: Entity| -> Vec<Entity> {
        world.get::<Children>(root).map(|children| children.iter().collect()).unwrap_or_default()
    };
    let red = named(world, "red");
    assert!(
        below(world, red).iter().filter_map(|&e| world.get::<MaterialId>(e)).all(|m| *m == MaterialId::from_slot(2))
    );
    let whole = named(world, "whole");
    let panel = below(world, whole)[0];
    assert_eq!(world.get::<GlobalTransform>(panel).expect("placed").translation(), Vec3::new(10.0, 0.0, 3.0));
    let part = named(world, "part");
    let lamp = world.get::<GlobalTransform>(below(world, part)[0]).expect("placed").affine();
    assert!((lamp.translation - glam::Vec3A::new(5.0, 0.0, 0.0)).length() < 1e-5, "moved to the entity");
    let expected = Vec3::new(0.0, 0.0, -2.0);
    assert!(lamp.transform_vector3(Vec3::X).distance(expected) < 1e-5, "turned and doubled as in the model");
    let figure = named(world, "figure");
    let meshes = world.get::<MeshVariants>(figure).expect("a figure").meshes.clone();
    assert_eq!((meshes.len(), world.get::<MeshId>(figure)), (2, Some(&meshes[0])));
}

#[test]
fn things_are_attached_to_nodes_of_models() {
    let scene = r#"(meshes: {"model": model(file: "model.gltf"), "cube": cube()}, entities: [
    (mesh: "model", transform: (translation: (10, 0, 0)), attach: [
        (node: "lamp", name: "head light", transform: (translation: (0, 0, 1)), light: point()),
    ]),
])"#;
    let (mut simulation, _) = load(scene);
    let light = named(&mut simulation.world, "head light");
    let at = simulation.world.get::<GlobalTransform>(light).expect("placed").translation();
    // Up 1 m and out 1 m, doubled; `arm` turns +Z to +X.
    assert!(at.distance(Vec3::new(12.0, 2.0, 0.0)) < 1e-5, "{at}");
    let folder = Folder::with_model();
    let wrong = folder.problems(&scene.replace("\"lamp\"", "\"lampe\""));
    assert_eq!(wrong, ["3:16: entities[0].attach[0].node: unknown node \"lampe\"; did you mean \"lamp\"?"]);
    let cube = folder.problems(&scene.replace("(mesh: \"model\"", "(mesh: \"cube\""));
    assert_eq!(cube, ["3:9: entities[0].attach[0]: mesh \"cube\" is not a model and has no nodes"]);
}

#[test]
fn a_bare_model_gets_a_neutral_rig_and_a_camera_that_sees_all_of_it() {
    let folder = Folder::with_model();
    let mut simulation = Simulation::new();
    let path = folder.at("model.gltf");
    let scene = scene::load(&path, &mut simulation).unwrap_or_else(|e| panic!("{e}"));
    simulation.frame();
    let world = &mut simulation.world;
    assert_eq!((scene.name.as_str(), scene.cameras.len()), ("model", 1));
    let lights = all::<Light>(world);
    assert_eq!(lights.len(), 2);
    assert!(lights.iter().all(|l| l.kind == LightKind::Directional && l.intensity > 0.0));
    assert!(world.resource::<Environment>().ambient.min_element() > 0.05);
    let eye = scene.cameras[0].1;
    let camera_from_world = world.get::<GlobalTransform>(eye).expect("placed").affine().inverse();
    let Some(&Camera { projection: Projection::Perspective { fov_y, .. }, near, .. }) = world.get(eye) else {
        panic!("a perspective camera")
    };
    let library = world.resource::<Library>();
    let mut sizes = Vec::new();
    let mut drawn = world.try_query::<(&GlobalTransform, &MeshId)>().expect("all registered");
    for (transform, mesh) in drawn.iter(world) {
        for point in &library.mesh(*mesh).expect("in the library").mesh.positions {
            let seen = camera_from_world.transform_point3(transform.transform_point(*point));
            assert!(seen.z < -near, "before the near plane: {seen}");
            sizes.push(seen.truncate().abs().max_element() / -seen.z / (fov_y * 0.5).tan());
        }
    }
    let largest = sizes.iter().copied().fold(0.0, f32::max);
    assert!((0.4..=1.0).contains(&largest), "fills {largest} of the picture");
    let at = world.get::<Transform>(eye).expect("placed").translation;
    assert!(at.x > 0.0 && at.y > 0.0 && at.z > at.x, "from the front right and above: {at}");
}

#[test]
fn a_model_with_light_and_camera_keeps_its_own() {
    let folder = Folder::with_model();
    let text = MODEL
        .replace("\"scene\": 0", "\"extensionsUsed\": [\"KHR_lights_punctual\"], \"scene\": 0, \"extensions\": {\"KHR_lights_punctual\": {\"lights\": [{\"type\": \"point\"}]}}, \"cameras\": [{\"type\": \"perspective\", \"perspective\": {\"yfov\": 1, \"znear\": 0.1}}]")
        .replace("\"name\": \"panel\"", "\"name\": \"panel\", \"camera\": 0")
        .replace("\"name\": \"lamp\"", "\"name\": \"lamp\", \"extensions\": {\"KHR_lights_punctual\": {\"light\": 0}}");
    let mut simulation = Simulation::new();
    let scene = scene::load(&folder.file("own.gltf", text), &mut simulation).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(all::<Light>(&mut simulation.world).len(), 1);
    assert_eq!(scene.cameras.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["panel"]);
    let environment = simulation.world.resource::<Environment>();
    assert_eq!(*environment, Environment { exposure: environment.exposure, ..Environment::default() });
    assert!((0.05..=1.0).contains(&environment.exposure), "{}", environment.exposure);
}

#[test]
fn a_broken_model_is_refused_with_file_and_place() {
    let folder = Folder::with_model();
    let path = folder.file("broken.gltf", MODEL.replace("\"count\": 4", "\"count\": 4000"));
    let error = scene::load(&path, &mut Simulation::new()).expect_err("refused").to_string();
    assert!(error.contains("broken.gltf: ") && error.contains("accessors[0]"), "{error}");
    let text = "(meshes: {\"m\": model(file: \"broken.gltf\")})";
    let problems = folder.problems(text);
    assert!(problems[0].starts_with("1:28: meshes[\"m\"].file: broken.gltf: "), "{problems:?}");
}

#[test]
fn what_is_attached_to_a_node_is_not_attached_to_a_childs_of_the_same_name() {
    let text = r#"(meshes: {"m": model(file: "model.gltf")}, entities: [
        (name: "whole", mesh: "m", children: [(name: "child", mesh: "m")], attach: [(name: "bulb", node: "lamp", light: point())]),
    ])"#;
    let (mut simulation, _) = load(text);
    let world = &mut simulation.world;
    let (bulb, child) = (named(world, "bulb"), named(world, "child"));
    let above = std::iter::successors(Some(bulb), |&entity| world.get::<ChildOf>(entity).map(ChildOf::parent));
    assert!(above.into_iter().all(|entity| entity != child));
}

#[test]
fn extras_of_nodes_meshes_and_materials_say_what_sensors_call_them() {
    let folder = Folder::with_model();
    let model = MODEL
        .replace("\"name\": \"panel\",", "\"name\": \"panel\", \"extras\": {\"class\": \"wall\", \"instance\": true},")
        .replace("\"name\": \"arm\",", "\"name\": \"arm\", \"extras\": {\"class\": \"pole\", \"instance\": 1},");
    let class_of = |world: &World, entity: Entity| {
        let found = std::iter::successors(Some(entity), |&below| world.get::<ChildOf>(below).map(ChildOf::parent))
            .find_map(|above| world.get::<Class>(above).copied());
        found.map(|class| world.resource::<Classes>().get(class).expect("known").name.clone())
    };
    let classes = |model: &str| {
        folder.file("model.gltf", model);
        let (mut simulation, scene) =
            folder.load(r#"(meshes: {"m": model(file: "model.gltf")}, entities: [(mesh: "m", class: "car")])"#);
        assert_eq!(scene.warnings, Vec::<String>::new());
        let world = &mut simulation.world;
        let drawn: Vec<Entity> = world.query_filtered::<Entity, With<MeshId>>().iter(world).collect();
        let mut found: Vec<(String, Option<String>)> = drawn
            .into_iter()
            .map(|entity| (world.get::<Name>(entity).expect("named").to_string(), class_of(world, entity)))
            .collect();
        found.sort();
        let things = world.query_filtered::<&Name, With<Instance>>().iter(world).count();
        (
            found.into_iter().map(|(name, class)| format!("{name}: {}", class.unwrap_or_default())).collect::<Vec<_>>(),
            things,
        )
    };
    // The root, and the panel; 1 is not true.
    assert_eq!(classes(&model), (vec!["lamp: pole".into(), "panel: wall".into()], 2));
    // A mesh's counts before those of its nodes, a material's before a mesh's.
    let mesh = model.replace("\"meshes\": [{", "\"meshes\": [{\"extras\": {\"class\": \"bridge\"}, ");
    assert_eq!(classes(&mesh).0, ["lamp: bridge", "panel: bridge"]);
    let material = mesh
        .replace("\"indices\": 1}", "\"indices\": 1, \"material\": 0}")
        .replace("\"meshes\":", "\"materials\": [{\"extras\": {\"class\": \"road\"}}], \"meshes\":");
    assert_eq!(classes(&material).0, ["lamp: road", "panel: road"]);
    // It is that of the surface, not of what is below its node.
    let below = MODEL
        .replace("\"name\": \"arm\",", "\"name\": \"arm\", \"mesh\": 1, \"extras\": {\"class\": \"pole\"},")
        .replace("\"indices\": 1}]}]", "\"indices\": 1}]}, {\"extras\": {\"class\": \"road\"}, \"primitives\": [{\"attributes\": {\"POSITION\": 0}, \"indices\": 1}]}]");
    assert_eq!(classes(&below).0, ["arm part 0: road", "lamp: pole", "panel: car"]);
    // What no scene has as a class may be another program's.
    let unknown = model.replace("\"wall\"", "\"wal\"").replace("\"pole\"", "{\"a\": 1}");
    assert_eq!(classes(&unknown).0, ["lamp: car", "panel: car"]);
    let said = folder.problems(r#"(meshes: {"m": model(file: "model.gltf")}, entities: [(mesh: "m")])"#);
    let expected = "model.gltf: nodes[0].extras.class: unknown class \"wal\": it is ignored; did you mean \"wall\"?";
    assert_eq!(said, [format!("warning: {expected}")]);
    let own = r#"(classes: {"wal": (id: 1)}, meshes: {"m": model(file: "model.gltf")}, entities: [(mesh: "m")])"#;
    assert_eq!(folder.problems(own), Vec::<String>::new());
    let alone = scene::check(&folder.at("model.gltf"), Simulation::new);
    assert_eq!((alone.len(), alone[0].place.as_str(), alone[0].is_error()), (1, "nodes[0].extras.class", false));
}
