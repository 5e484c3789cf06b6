//! Files of vehicle types: what a model becomes, what is refused and in which words; vehicles in scenes.

mod common;

use base64::Engine;
use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::{Affine3A, Quat, Vec3};
use relief::scene::{self, load_vehicle_types};
use serde_json::{Value, json};
use std::f32::consts::PI;
use std::path::PathBuf;
use systems::Simulation;
use systems::components::Light;
use systems::library::{Library, MaterialId, Mesh, MeshId};
use systems::physics;
use systems::selected_lights::SelectedLights;
use systems::shapes;
use systems::transform::{GlobalTransform, Transform};
use systems::vehicles::lamps::{Lamp, LampKind};
use systems::vehicles::parts::{Movement, MovingPart, Part};
use systems::vehicles::{
    ByHand, Controls, Headlights, Motion, Vehicle, VehicleNumber, VehicleType, VehicleTypeId, VehicleTypes,
};

/// A cart: four wheels of half a metre's radius whose middle is far from the model's origin, a lamp below the turned
/// node `arm`, and a body in the material `coat`. Each mesh is a quad of 1 m across the X axis.
const CART: &str = r#"{
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
    "nodes": [
        {"name": "root", "children": [1, 2, 3, 4, 5, 6], "translation": [5, 1, 7]},
        {"name": "body", "mesh": 0, "translation": [0, 1.5, 1.5], "scale": [1, 1, 4]},
        {"name": "front left", "mesh": 1, "translation": [0.7, 0, 2.5]},
        {"name": "front right", "mesh": 1, "translation": [-0.7, 0, 2.5]},
        {"name": "rear left", "mesh": 1, "translation": [0.6, 0, 0]},
        {"name": "rear right", "mesh": 1, "translation": [-0.6, 0, 0]},
        {"name": "arm", "children": [7], "rotation": [0, 1, 0, 0]},
        {"name": "lamp", "mesh": 1, "translation": [0, 1, -3.5]}
    ],
    "materials": [{"name": "coat"}, {"name": "rubber"}],
    "meshes": [
        {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]},
        {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 1}]}
    ],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, -0.5, -0.5], "max": [0, 0.5, 0.5]},
        {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}
    ],
    "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
    "buffers": [{"byteLength": 60, "uri": "data:application/octet-stream;base64,AAAAAAAAAL8AAAC/AAAAAAAAAD8AAAC/AAAAAAAAAD8AAAA/AAAAAAAAAL8AAAA/AAABAAIAAAACAAMA"}]
}"#;

const TYPES: &str = r#"(types: {
    "cart": (
        model: "cart.gltf",
        wheels: [(nodes: ["front left", "front right"], steers: true, radius: 0.5), (nodes: ["rear left", "rear right"], radius: 0.4)],
        lamps: [(nodes: ["lamp"], kind: head, light: spot(intensity: 9, range: 20, outer_degrees: 30))],
        paint: (materials: ["coat"], colors: [(1, 0, 0), (0, 0, 1)]),
        limits: (speed_kmh: 36),
    ),
})"#;

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let folder = Self(tempfile::tempdir().expect("a temporary folder"));
        folder.file("cart.gltf", CART);
        folder
    }

    fn file(&self, name: &str, content: &str) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, content).expect("written");
        path
    }

    fn types(&self, text: &str) -> (Simulation, Vec<String>) {
        let mut simulation = Simulation::new();
        let warnings = load_vehicle_types(&self.file("vehicles.ron", text), &mut simulation);
        (simulation, warnings.unwrap_or_else(|e| panic!("{e}")))
    }

    /// Everything wrong with a file, without the path.
    fn problems(&self, name: &str, text: &str) -> Vec<String> {
        let path = self.file(name, text);
        let start = format!("{}:", path.display());
        let folder = format!("{}/", self.0.path().display());
        let texts = scene::check(&path).into_iter().map(|p| p.to_string());
        texts.map(|t| t.strip_prefix(&start).expect("starts with the path").trim().replace(&folder, "")).collect()
    }
}

fn find(simulation: &Simulation, name: &str) -> (VehicleTypeId, VehicleType) {
    let types = simulation.world.resource::<VehicleTypes>();
    let id = types.find(name).expect("a type");
    (id, types.get(id).clone())
}

fn near(a: Vec3, b: Vec3) {
    assert!(a.distance(b) < 1e-4, "{a} is not {b}");
}

#[test]
fn a_model_stands_on_its_wheels_whatever_its_origin() {
    let (mut simulation, warnings) = Folder::new().types(TYPES);
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
fn lamps_shine_ahead_and_not_on_their_own_vehicle() {
    let (mut simulation, _) = Folder::new().types(TYPES);
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
    let reached: Vec<Entity> = world
        .query::<(Entity, &SelectedLights)>()
        .iter(world)
        .filter(|(_, selected)| selected.unpack().reaching > 0)
        .map(|(entity, _)| entity)
        .collect();
    assert_eq!(reached, [wall]);
}

#[test]
fn paint_and_glow_are_materials_of_their_own() {
    let (mut simulation, _) = Folder::new().types(TYPES);
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
    let folder = Folder::new();
    let text = r#"(types: {
    "a": (model: "cart.gltf", wheelbase: 0, wheels: [(nodes: ["front lft"], radius: -1)], mass: 1e30),
    "b": (model: "missing.gltf", wheels: [(nodes: ["x"])]),
    "box": (model: "cart.gltf"),
    "c": (model: "cart.gltf", lamps: [(nodes: ["lamp"], kind: head, glow: inf, color: srgb("red"))], paint: (materials: ["cat"], colors: [])),
    "c": (model: "cart.gltf", limits: (braking: 0, steering_degrees: 90), driver: (headway_seconds: -1)),
    "d": (model: "cart.gltf", swings: [(node: "body", degrees: 30, stride_metres: 0)], trailer: (node: "bdy", length: 0), forks: [""]),
})"#;
    let problems = folder.problems("vehicles.ron", text);
    let expected = [
        r#"2:42: types["a"].wheelbase: expected a number from 0.05 to 100, found 0"#,
        r#"2:63: types["a"].wheels[0].nodes[0]: no node "front lft"; did you mean "front left"?"#,
        r#"2:85: types["a"].wheels[0].radius: expected a number from 0.01 to 10, found -1"#,
        r#"2:97: types["a"].mass: expected a number from 1 to 1000000"#,
        r#"3:18: types["b"].model: missing.gltf"#,
        r#"4:12: types["box"]: the name "box" is that of the stand-in; expected another"#,
        r#"5:75: types["c"].lamps[0].glow: expected a number from 0 to 1000000000, found inf"#,
        r#"5:87: types["c"].lamps[0].color: expected a colour like"#,
        r#"5:122: types["c"].paint.materials[0]: no material "cat"; did you mean "coat"?"#,
        r#"6:10: types["c"]: the name "c" is taken: it stands twice"#,
        r#"6:49: types["c"].limits.braking: expected a number from 0.01 to 100, found 0"#,
        r#"6:70: types["c"].limits.steering_degrees: expected a number from 0.1 to 85, found 90"#,
        r#"6:101: types["c"].driver.headway_seconds: expected a number from 0 to 60, found -1"#,
        r#"7:83: types["d"].swings[0].stride_metres: expected a number from 0.01"#,
        r#"7:104: types["d"].trailer.node: no node "bdy"; did you mean "body"?"#,
        r#"7:119: types["d"].trailer.length: expected a number from 0.05 to 100, found 0"#,
        r#"7:131: types["d"].forks[0]: no node """#,
    ];
    assert_eq!(problems.len(), expected.len(), "{problems:#?}");
    for (problem, expected) in problems.iter().zip(expected) {
        assert!(problem.starts_with(expected), "{problem}\nis not\n{expected}");
    }
}

#[test]
fn a_file_that_is_refused_leaves_everything_as_it_was() {
    let folder = Folder::new();
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
    let folder = Folder::new();
    folder.file("vehicles.ron", TYPES);
    let text = r#"(
        vehicle_types: ["vehicles.ron"],
        entities: [
            (name: "mine", vehicle: (type: "cart", paint: 1, headlights: high, by_hand: true), transform: (translation: (1, 2, 3)),
             children: [(name: "seat", camera: ())]),
            (vehicle: (type: "cart")),
            (vehicle: (type: "crt"), transform: (translation: (9, 0, 0))),
            (vehicle: (type: "crt"), transform: (translation: (18, 0, 0))),
        ],
    )"#;
    let mut simulation = Simulation::new();
    let loaded = scene::load(&folder.file("scene.ron", text), &mut simulation).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(loaded.warnings, [r#"no vehicle type "crt"; did you mean "cart"?; a box stands in"#]);
    assert_eq!(loaded.cameras.first().map(|(name, _)| name.as_str()), Some("seat"));
    let world = &mut simulation.world;
    let mut vehicles = world.query::<(&Name, &Vehicle, &Controls, &Transform, Has<ByHand>, &VehicleNumber)>();
    let mut all: Vec<_> = vehicles.iter(world).collect();
    all.sort_by_key(|vehicle| vehicle.5);
    let names: Vec<&str> = all.iter().map(|v| v.0.as_str()).collect();
    assert_eq!(names, ["mine", "cart 2", "crt 3", "crt 4"]);
    let (_, mine, controls, at, by_hand, _) = all[0];
    assert_eq!(
        (mine.paint, controls.headlights, at.translation, by_hand),
        (1, Headlights::High, Vec3::new(1.0, 2.0, 3.0), true)
    );
    assert!(!all[1].4 && all[1].1.kind == mine.kind && all[2].1.kind == VehicleTypeId::STAND_IN);
}

#[test]
fn a_scenes_problems_include_those_of_its_types() {
    let folder = Folder::new();
    folder.file("vehicles.ron", "(types: {\"a\": (model: \"cart.gltf\", mass: 0)})");
    let problems = folder.problems(
        "scene.ron",
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
    let folder = Folder::new();
    let model = data.join("models/CesiumMilkTruck/CesiumMilkTruck.glb").display().to_string();
    let of_nodes = |front: &str, rear: &str| {
        let wheels = format!("wheels: [(nodes: [{front:?}], steers: true), (nodes: [{rear:?}])]");
        format!("(types: {{\"truck\": (model: {model:?}, transform: (rotation_degrees: (0, 90, 0)), {wheels})}})")
    };
    let wrong = folder.problems("vehicles.ron", &of_nodes("nod 2", "node 4"));
    assert!(wrong.len() == 1 && wrong[0].contains("no node \"nod 2\"; did you mean \"node 2\"?"), "{wrong:?}");
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

// ---- Models made here: wheels and lamps as other people leave them ----

/// A model of meshes, each of some primitives in a material of its own, `tyre` the first. Nodes name meshes by number.
fn model(meshes: &[Vec<Mesh>], nodes: Value) -> String {
    let (mut bytes, mut views, mut accessors) = (Vec::<u8>::new(), Vec::new(), Vec::new());
    let mut accessor = |data: &[u8], component: u32, kind: &str, count: usize, low: Vec3, high: Vec3| {
        views.push(json!({ "buffer": 0, "byteOffset": bytes.len(), "byteLength": data.len() }));
        bytes.extend_from_slice(data);
        let mut accessor =
            json!({ "bufferView": views.len() - 1, "componentType": component, "type": kind, "count": count });
        if kind == "VEC3" {
            (accessor["min"], accessor["max"]) = (json!(low.to_array()), json!(high.to_array()));
        }
        accessors.push(accessor);
        accessors.len() - 1
    };
    let mut primitive = |(number, mesh): (usize, &Mesh)| {
        let low = mesh.positions.iter().fold(Vec3::INFINITY, |a, &b| a.min(b));
        let high = mesh.positions.iter().fold(Vec3::NEG_INFINITY, |a, &b| a.max(b));
        let (positions, indices) = (bytemuck::cast_slice(&mesh.positions), bytemuck::cast_slice(&mesh.indices));
        json!({
            "attributes": { "POSITION": accessor(positions, 5126, "VEC3", mesh.positions.len(), low, high) },
            "indices": accessor(indices, 5125, "SCALAR", mesh.indices.len(), low, high),
            "material": number.min(1),
        })
    };
    let meshes: Vec<Value> = meshes
        .iter()
        .map(|mesh| json!({ "primitives": mesh.iter().enumerate().map(&mut primitive).collect::<Vec<_>>() }))
        .collect();
    let children = nodes.as_array().expect("nodes").iter().filter_map(|node| node["children"].as_array()).flatten();
    let below: Vec<u64> = children.filter_map(Value::as_u64).collect();
    let count = nodes.as_array().map_or(0, Vec::len) as u64;
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    json!({
        "asset": { "version": "2.0" }, "scene": 0,
        "scenes": [{ "nodes": (0..count).filter(|node| !below.contains(node)).collect::<Vec<_>>() }],
        "nodes": nodes, "meshes": meshes, "accessors": accessors, "bufferViews": views,
        "materials": [{ "name": "tyre" }, { "name": "rim" }],
        "buffers": [{ "byteLength": bytes.len(), "uri": format!("data:application/octet-stream;base64,{data}") }],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "spot", "spot": {} }] } },
    })
    .to_string()
}

/// A disc about the X axis.
fn disc(radius: f32) -> Mesh {
    moved(shapes::cylinder(radius, 0.2, 24), Affine3A::from_rotation_z(std::f32::consts::FRAC_PI_2))
}

fn block(size: Vec3, at: Vec3) -> Mesh {
    moved(shapes::cube(size), Affine3A::from_translation(at))
}

fn moved(mut mesh: Mesh, by: Affine3A) -> Mesh {
    mesh.positions.iter_mut().for_each(|p| *p = by.transform_point3(*p));
    mesh
}

/// World positions of the vertices of each wheel's tyre, in the order in which these were spawned.
fn tyres(world: &mut World) -> Vec<Vec<Vec3>> {
    let mut drawn = world.query::<(Entity, &MeshId, &MaterialId, &GlobalTransform)>();
    let mut drawn: Vec<_> =
        drawn.iter(world).map(|(entity, &mesh, &material, &at)| (entity, mesh, material, at)).collect();
    drawn.sort_by_key(|(entity, ..)| *entity);
    let library = world.resource::<Library>();
    let is_tyre = |material: MaterialId| library.material(material).is_some_and(|material| material.name == "tyre");
    let vertices = |mesh: MeshId, at: GlobalTransform| {
        let entry = library.mesh(mesh).expect("a mesh");
        entry.mesh.positions.iter().map(|&p| at.transform_point(p)).collect()
    };
    drawn.into_iter().filter(|d| is_tyre(d.2)).map(|(_, mesh, _, at)| vertices(mesh, at)).collect()
}

fn middle(points: &[Vec3]) -> Vec3 {
    let low = points.iter().fold(Vec3::INFINITY, |a, &b| a.min(b));
    (low + points.iter().fold(Vec3::NEG_INFINITY, |a, &b| a.max(b))) / 2.0
}

/// Four wheels of half a metre, as in many models: whatever their nodes are like, they stand on the road, turn about their
/// hubs and steer about them.
#[test]
fn wheels_of_every_make_stand_on_the_road_and_turn_about_their_hubs() {
    let hubs = [("fl", 0.8, 2.0), ("fr", -0.8, 2.0), ("rl", 0.8, 0.0), ("rr", -0.8, 0.0)];
    let turn = |degrees: f32| json!([(degrees.to_radians() / 2.0).sin(), 0.0, 0.0, (degrees.to_radians() / 2.0).cos()]);
    let flat = |nodes: Vec<Value>| Value::Array(nodes);
    let tyre = || vec![disc(0.5)];
    let each = |node: &dyn Fn(&str, f32, f32) -> Value| flat(hubs.iter().map(|&(n, x, z)| node(n, x, z)).collect());
    let at = |x: f32, z: f32| json!([x, 0.5, z]);
    // Hubs as they are in the model; the meshes of wheels whose nodes have their origins elsewhere.
    let baked =
        |by: Vec3| hubs.map(|(_, x, z)| vec![moved(disc(0.5), Affine3A::from_translation(Vec3::new(x, 0.5, z) - by))]);
    let caliper = block(Vec3::new(0.1, 0.2, 0.1), Vec3::new(0.0, 0.3, 0.1));
    let below = |parent: Value, children: Value| {
        let mut nodes = vec![parent];
        nodes.extend(children.as_array().expect("nodes").iter().cloned());
        nodes[0]["children"] = json!([1, 2, 3, 4]);
        Value::Array(nodes)
    };
    let plain = each(&|n, x, z| json!({ "name": n, "mesh": 0, "translation": at(x, z) }));
    let mut makes: Vec<(&str, Vec<Vec<Mesh>>, Value)> = Vec::new();
    for degrees in [0.0, 10.0, 33.0, 45.0] {
        let nodes =
            each(&|n, x, z| json!({ "name": n, "mesh": 0, "translation": at(x, z), "rotation": turn(degrees) }));
        makes.push(("turned about the axle", vec![tyre()], nodes));
    }
    let number = |n: &str| hubs.iter().position(|hub| hub.0 == n);
    let nodes = each(&|n, _, _| json!({ "name": n, "mesh": number(n) }));
    makes.push(("origins at the model's", baked(Vec3::ZERO).to_vec(), nodes));
    let nodes = each(
        &|n, _, _| json!({ "name": n, "mesh": number(n), "translation": [0.1, 0.2, -0.3], "rotation": turn(0.0) }),
    );
    makes.push(("origins beside the hub", baked(Vec3::new(0.1, 0.2, -0.3)).to_vec(), nodes));
    let mirrored = each(
        &|n, x, z| json!({ "name": n, "mesh": 0, "translation": at(x, z), "scale": [x.signum(), 1, 1], "rotation": turn(20.0) }),
    );
    makes.push(("mirrored", vec![tyre()], mirrored));
    let scaled = each(
        &|n, x, z| json!({ "name": n, "mesh": 0, "translation": at(x, z), "scale": [3.0, 2.5, 2.5], "rotation": turn(15.0) }),
    );
    makes.push(("scaled unevenly", vec![vec![disc(0.2)]], scaled));
    let parent = json!({ "scale": [0.01, 0.01, 0.01], "rotation": [0, 1, 0, 0] });
    let small = each(&|n, x, z| json!({ "name": n, "mesh": 0, "translation": [-x * 100.0, 50.0, -z * 100.0] }));
    makes.push(("below a turned parent in centimetres", vec![vec![disc(50.0)]], below(parent, small)));
    let parent = json!({ "scale": [-1, 1, 2] });
    let squeezed =
        each(&|n, x, z| json!({ "name": n, "mesh": 0, "translation": [-x, 0.5, z / 2.0], "scale": [1.0, 1.0, 0.5] }));
    makes.push(("below a mirrored parent of uneven scale", vec![tyre()], below(parent, squeezed)));
    makes.push(("tyre and rim in one mesh", vec![vec![disc(0.5), disc(0.3), caliper.clone()]], plain.clone()));
    // A rim with its tyre below it.
    let nested = flat(
        (0..4)
            .flat_map(|i| {
                let (n, x, z) = hubs[i];
                let tyre = json!({ "name": format!("tyre {n}"), "mesh": 0, "rotation": turn(12.0) });
                [json!({ "name": n, "mesh": 1, "translation": at(x, z), "children": [2 * i + 1] }), tyre]
            })
            .collect(),
    );
    makes.push(("tyre below the rim", vec![tyre(), vec![block(Vec3::ONE * 0.01, Vec3::ZERO), disc(0.3)]], nested));
    for (make, meshes, nodes) in makes {
        let folder = Folder::new();
        folder.file("made.gltf", &model(&meshes, nodes));
        let types = r#"(types: { "made": (model: "made.gltf", wheels: [(nodes: ["fl", "fr"], steers: true), (nodes: ["rl", "rr"])]) })"#;
        let (mut simulation, warnings) = folder.types(types);
        assert_eq!(warnings, [] as [String; 0], "{make}");
        let (kind, made) = find(&simulation, "made");
        assert!((made.wheelbase - 2.0).abs() < 1e-3 && (made.track - 1.6).abs() < 1e-3, "{make}: {made:?}");
        let radii: Vec<f32> = made.parts.iter().filter_map(|part| part.movement.map(|_| radius(part))).collect();
        assert!(radii.len() == 4 && radii.iter().all(|r| (r - 0.5).abs() < 1e-3), "{make}: {radii:?}");
        let vehicle = simulation.world.spawn(Vehicle::of(kind)).id();
        simulation.frame();
        let before: Vec<Vec<Vec3>> = tyres(&mut simulation.world).into_iter().filter(|t| t.len() > 40).collect();
        assert_eq!(before.len(), 4, "{make}");
        let mut motion = simulation.world.get_mut::<Motion>(vehicle).expect("moves");
        (motion.rolled, motion.steering) = (0.4, 0.3);
        simulation.frame();
        let after = tyres(&mut simulation.world).into_iter().filter(|t| t.len() > 40);
        for (before, after) in before.into_iter().zip(after) {
            let hub = middle(&before);
            let lowest = before.iter().map(|p| p.y).fold(f32::MAX, f32::min);
            // A corner of the disc is at most half a corner's angle from the lowest place.
            assert!((-1e-3..0.5 * (1.0 - 7.5f32.to_radians().cos()) + 1e-3).contains(&lowest), "{make}: {lowest}");
            let steers = if hub.z > 1.0 { Quat::from_rotation_y(0.3) } else { Quat::IDENTITY };
            let turned = steers * Quat::from_rotation_x(0.4 / 0.5);
            for (&from, to) in before.iter().zip(after) {
                let expected = hub + turned * (from - hub);
                assert!(to.distance(expected) < 3e-3, "{make}: {from} came to {to}, expected {expected}");
            }
        }
    }
}

fn radius(part: &Part) -> f32 {
    match part.movement {
        Some(Movement::Wheel { radius, .. }) => radius,
        _ => 0.0,
    }
}

/// Rim and tyre are nodes beside each other: one wheel, as large as the tyre, that physics counts once.
#[test]
fn nodes_with_one_hub_are_one_wheel() {
    let node =
        |name: &str, mesh: u32, x: f32, z: f32| json!({ "name": name, "mesh": mesh, "translation": [x, 0.5, z] });
    let names = ["fl", "fr", "rl", "rr"];
    let places = [(0.8, 2.0), (-0.8, 2.0), (0.8, 0.0), (-0.8, 0.0)];
    let of = |kind: &str, mesh| {
        names.iter().zip(places).map(|(n, (x, z))| node(&format!("{kind} {n}"), mesh, x, z)).collect::<Vec<_>>()
    };
    let folder = Folder::new();
    let nodes = [of("rim", 0), of("tyre", 1)].concat();
    folder.file("made.gltf", &model(&[vec![disc(0.3)], vec![disc(0.5)]], Value::Array(nodes)));
    let wheels = r#"(nodes: ["rim fl", "rim fr", "tyre fl", "tyre fr"], steers: true), (nodes: ["rim rl", "rim rr", "tyre rl", "tyre rr"])"#;
    let (simulation, warnings) =
        folder.types(&format!(r#"(types: {{ "made": (model: "made.gltf", wheels: [{wheels}]) }})"#));
    assert_eq!(warnings, [] as [String; 0]);
    let (_, made) = find(&simulation, "made");
    let wheels = physics::wheels(&made);
    assert_eq!(wheels.iter().map(|wheel| wheel.steers).collect::<Vec<_>>(), [true, true, false, false]);
    assert!(wheels.iter().all(|wheel| (wheel.radius - 0.5).abs() < 1e-5), "{wheels:?}");
    assert!(
        wheels.iter().all(|wheel| (wheel.hub.y - 0.5).abs() < 1e-5 && (wheel.hub.x.abs() - 0.8).abs() < 1e-5),
        "{wheels:?}"
    );
    let drawn = made.parts.iter().filter(|part| part.drawn.is_some());
    assert!(drawn.clone().count() == 8 && drawn.clone().all(|part| part.parent.is_some() && part.movement.is_none()));
}

/// The trailer's node and a fork's are turned and scaled: what turns in them turns about the vehicle's axles.
#[test]
fn wheels_below_moving_parts_turn_about_the_vehicles_axles() {
    let folder = Folder::new();
    let half = (0.4f32 / 2.0).sin_cos();
    let nodes = json!([
        { "name": "trailer", "rotation": [0, 1, 0, 0], "scale": [2, 2, 2], "children": [1] },
        { "name": "tl", "mesh": 1, "translation": [0.4, 0.25, 2.0] },
        // A rake of 23° about X.
        { "name": "fork", "rotation": [half.0, 0, 0, half.1], "translation": [0.0, 0.9, 2.0], "children": [3] },
        { "name": "front", "mesh": 0, "translation": [0, -0.4, 0] },
        { "name": "rear", "mesh": 0, "translation": [0, 0.5, 0] },
    ]);
    folder.file("made.gltf", &model(&[vec![disc(0.5)], vec![disc(0.25)]], nodes));
    let (mut simulation, _) = folder.types(
        r#"(types: { "made": (model: "made.gltf", wheels: [(nodes: ["tl", "front", "rear"])], forks: ["fork"], trailer: (node: "trailer", length: 4)) })"#,
    );
    let (kind, _) = find(&simulation, "made");
    let vehicle = simulation.world.spawn(Vehicle::of(kind)).id();
    simulation.frame();
    let before = tyres(&mut simulation.world);
    simulation.world.get_mut::<Motion>(vehicle).expect("moves").rolled = 0.4;
    simulation.frame();
    assert_eq!(before.len(), 3);
    for (before, after) in before.into_iter().zip(tyres(&mut simulation.world)) {
        let hub = middle(&before);
        for (from, to) in before.into_iter().zip(after) {
            let expected = hub + Quat::from_rotation_x(0.4 / 0.5) * (from - hub);
            assert!(to.distance(expected) < 3e-3, "{hub}: {from} came to {to}, expected {expected}");
        }
    }
}

#[test]
fn what_is_no_round_wheel_is_said_with_what_was_measured() {
    let folder = Folder::new();
    let body = || block(Vec3::new(1.8, 1.2, 4.0), Vec3::new(0.0, 1.0, 1.2));
    let wheel = |x: f32, z: f32| moved(disc(0.5), Affine3A::from_translation(Vec3::new(x, 0.5, z)));
    let whole = [(0.8, 0.0), (-0.8, 0.0), (0.8, 2.5), (-0.8, 2.5)].map(|(x, z)| wheel(x, z));
    let sticks_out = vec![disc(0.5), block(Vec3::splat(0.1), Vec3::new(0.0, 0.0, 0.6))];
    let nodes = json!([
        { "name": "car", "mesh": 0 },
        { "name": "square", "mesh": 1, "translation": [0, 0.5, 0] },
        { "name": "empty", "translation": [0, 0.4, 0] },
        { "name": "brake", "mesh": 2, "translation": [0, 0.5, 1] },
    ]);
    let mut car = vec![body()];
    car.extend(whole);
    folder.file("made.gltf", &model(&[car, vec![block(Vec3::ONE, Vec3::ZERO)], sticks_out], nodes));
    let of = |wheels: &str| format!(r#"(types: {{ "t": (model: "made.gltf", wheels: [{wheels}]) }})"#);
    let said = |wheels: &str| folder.problems("vehicles.ron", &of(wheels));
    let cases = [
        (
            r#"(nodes: ["car"])"#,
            r#"node "car" is no wheel and is not turned: what is drawn there, 1.60 m high and 4.00 m long, is not round about the vehicle's X; a wheel has to be a node of its own, apart from the body"#,
        ),
        (r#"(nodes: ["car"], radius: 0.5)"#, r#"node "car" is no wheel and is not turned"#),
        (
            r#"(nodes: ["square"])"#,
            r#"wheel "square" is not round about the vehicle's X: its outline is 0.50 to 0.71 m from its middle; its radius is half its height, 0.50 m"#,
        ),
        (
            r#"(nodes: ["empty"])"#,
            r#"nothing is drawn at wheel "empty": its radius is its height above the lowest point, 0.40 m; expected a radius"#,
        ),
        (
            r#"(nodes: ["brake"])"#,
            r#"what sticks out of wheel "brake" turns with it, up to 0.65 m from the axle; the wheel's own radius is 0.50 m"#,
        ),
    ];
    for (wheels, expected) in cases {
        let found = said(wheels);
        let message = format!("vehicle type \"t\": {expected}");
        assert!(found.len() == 1 && found[0].contains(&message), "{found:?} is not {expected}");
        // As a person hears when it is loaded, too.
        let (simulation, warnings) = folder.types(&of(wheels));
        assert!(warnings.len() == 1 && warnings[0].starts_with(&message), "{warnings:?}");
        let turning = find(&simulation, "t").1.parts.iter().filter(|part| part.movement.is_some()).count();
        assert_eq!(turning, usize::from(!wheels.contains("car")), "{wheels}");
    }
    // A radius that is given stays as it is, and nothing more is to be said.
    for (wheel, radius) in [("square", 0.6f32), ("empty", 0.3)] {
        let (simulation, warnings) = folder.types(&of(&format!("(nodes: [{wheel:?}], radius: {radius})")));
        assert_eq!(warnings, [] as [String; 0]);
        let parts = find(&simulation, "t").1.parts;
        assert_eq!(parts.iter().map(self::radius).fold(0.0, f32::max), radius);
    }
}

#[test]
fn nodes_of_one_name_are_said_to_be_ambiguous() {
    let nodes = json!([
        { "name": "lamp", "mesh": 0 }, { "name": "lamp", "mesh": 0 }, { "name": "lamp", "mesh": 0 },
        { "name": "other", "mesh": 0 }, { "name": "other", "mesh": 0 },
    ]);
    let (_, warnings) = ways("(nodes: [\"lamp\"], kind: head), (nodes: [\"lamp\"], kind: tail)", nodes);
    assert_eq!(warnings, ["vehicle type \"t\": 3 nodes are called \"lamp\": the first of them is meant"]);
}

/// The way of each lamp's light while the vehicle stands at the origin, by the name of its node, and what is said of them.
fn ways(lamps: &str, nodes: Value) -> (Vec<(String, Vec3)>, Vec<String>) {
    let folder = Folder::new();
    folder.file("made.gltf", &model(&[vec![block(Vec3::splat(0.1), Vec3::ZERO)]], nodes));
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
    // Nobody turned the node, or turned it somewhere; scaled and mirrored parents.
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
    assert!(warnings.len() == 1 && warnings[0].contains("direction of lamp \"lamp\" changes nothing"), "{warnings:?}");
    let text =
        r#"(types: { "t": (model: "cart.gltf", lamps: [(nodes: ["lamp"], kind: head, direction: (0, 0, 0))]) })"#;
    let problems = Folder::new().problems("vehicles.ron", text);
    assert!(problems.len() == 1 && problems[0].contains("lamps[0].direction: expected a direction"), "{problems:?}");
}
