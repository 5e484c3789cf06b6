//! Scene files from text to entities: what loads, what is refused and in which words.

use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::{Quat, Vec3};
use proptest::prelude::*;
use relief::scene::{self, LoadedScene};
use std::path::{Path, PathBuf};
use systems::Simulation;
use systems::clock::Clock;
use systems::components::{Camera, Environment, Figure, Light, LightKind, Projection, Spin, ToneMap};
use systems::hidden::{Hidden, InheritedHidden};
use systems::images::ImageKind;
use systems::library::{Library, MaterialId, MeshId, Shading, Technique, Wrap};
use systems::origin::Origin;
use systems::transform::{GlobalTransform, Transform};

/// A 1×1 m quad (`panel`), and below the rotated, doubled node `arm` a node `lamp`, 1 m up.
const MODEL: &str = r#"{
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
    "nodes": [
        {"name": "panel", "mesh": 0, "translation": [0, 0, 3]},
        {"name": "arm", "children": [2], "scale": [2, 2, 2], "rotation": [0, 0.70710678, 0, 0.70710678]},
        {"name": "lamp", "translation": [0, 1, 0], "mesh": 0}
    ],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-0.5, -0.5, 0], "max": [0.5, 0.5, 0]},
        {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}
    ],
    "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
    "buffers": [{"byteLength": 60, "uri": "data:application/octet-stream;base64,AAAAvwAAAL8AAAAAAAAAPwAAAL8AAAAAAAAAPwAAAD8AAAAAAAAAvwAAAD8AAAAAAAABAAIAAAACAAMA"}]
}"#;

/// A folder with a scene in it, and the model beside it.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::write(folder.path().join("model.gltf"), MODEL).expect("written");
        Self(folder)
    }

    fn file(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, content).expect("written");
        path
    }

    fn load(&self, text: &str) -> (Simulation, LoadedScene) {
        let mut simulation = Simulation::new();
        let scene = scene::load(&self.file("scene.ron", text), &mut simulation).unwrap_or_else(|e| panic!("{e}"));
        simulation.frame();
        (simulation, scene)
    }

    /// Everything wrong with a scene, without the path.
    fn problems(&self, text: &str) -> Vec<String> {
        let path = self.file("scene.ron", text);
        let start = format!("{}:", path.display());
        let folder = format!("{}/", self.0.path().display());
        let texts = scene::check(&path).into_iter().map(|p| p.to_string());
        texts.map(|t| t.strip_prefix(&start).expect("starts with the path").trim().replace(&folder, "")).collect()
    }
}

fn load(text: &str) -> (Simulation, LoadedScene) {
    Folder::new().load(text)
}

fn named(world: &mut World, name: &str) -> Entity {
    let mut entities = world.query::<(Entity, &Name)>();
    let found = entities.iter(world).find(|(_, n)| n.as_str() == name).map(|(entity, _)| entity);
    found.unwrap_or_else(|| panic!("no entity {name:?}"))
}

fn all<C: Component + Clone>(world: &mut World) -> Vec<C> {
    world.query::<&C>().iter(world).cloned().collect()
}

fn generated(simulation: &mut Simulation, prefix: &str) -> Vec<(String, Transform, MeshId, MaterialId)> {
    let world = &mut simulation.world;
    let mut query = world.query::<(&Name, &Transform, &MeshId, &MaterialId)>();
    let found = query.iter(world).filter(|(name, ..)| name.starts_with(prefix));
    found.map(|(name, transform, mesh, material)| (name.to_string(), *transform, *mesh, *material)).collect()
}

#[test]
fn wrong_names_and_types_are_told_with_place_and_nearest_name() {
    let folder = Folder::new();
    for (text, expected) in [
        (
            "(\n  entities: [\n    (name: \"x\", trasform: (scale: 2)),\n  ],\n)",
            "3:17: unknown field \"trasform\"; did you mean \"transform\"?",
        ),
        ("(entities: [(light: pont())])", "1:21: unknown choice \"pont\"; did you mean \"point\"?"),
        ("(entities: [(light: spot(rang: 2))])", "1:26: unknown field \"rang\"; did you mean \"range\"?"),
        (
            "(entities: [(light: point(attenuation: cubic))])",
            "1:45: expected (constant, linear, quadratic) or inverse_square",
        ),
        ("(materials: {\"m\": (base_map: (fil: \"a.png\"))})", "1:31: unknown field \"fil\"; did you mean \"file\"?"),
        (
            "(environment: (ambient: red))",
            "1:28: expected a colour: (red, green, blue), srgb(\"#ffcc88\") or kelvin(2700)",
        ),
        ("(entities: [(transform: (scale: \"big\"))])", "1:34: expected a number or (x, y, z)"),
        ("(seed: 1, seed: 2)", "1:11: the field \"seed\" stands twice"),
        ("(generators: [()])", "1:16: the field \"place\" is missing"),
        (
            "(vehicle_types: [], entities: [(vehicle: (type: \"car\"), piece_metres: 2)])",
            "1:71: entities[0].piece_metres: expected none beside a vehicle, which is drawn whole",
        ),
        // What loading warns of.
        (
            "(generators: [(place: along(spacing: 5))])",
            "warning: generator 1: nothing is placed: there is no route with room for it",
        ),
        (
            "(entities: [(vehicle: (type: \"car\"))])",
            "warning: no vehicle type \"car\"; there are \"box\"; a box stands in",
        ),
    ] {
        assert_eq!(folder.problems(text), [expected], "{text}");
    }
    // With the mark that some editors put first.
    assert_eq!(folder.problems("\u{feff}(seed: 1)"), [] as [String; 0]);
}

#[test]
fn text_that_is_no_ron_is_told_with_its_field_and_what_to_write() {
    let folder = Folder::new();
    let exposure = |value: &str| format!("(environment: (exposure: {value}))");
    for (value, expected) in [
        ("1,5", "found `1,5`; numbers have a point and no comma: 1.5"),
        ("0,05, ambient: (0, 0, 0)", "found `0,05`; numbers have a point and no comma: 0.05"),
        ("1,500", "found `1,500`; numbers have a point and no comma: 1.500 or 1500"),
        ("1.000,5", "found `1.000,5`; numbers have a point and no comma: 1000.5"),
        ("0x10", "expected a decimal number, found `0x10`; write 16"),
        ("0b101", "expected a decimal number, found `0b101`; write 5"),
        ("5m", "expected a number and nothing behind it, found `5m`; write 5"),
        ("50%", "expected a number and nothing behind it, found `50%`; write 50"),
        ("1/4", "expected a number, found the fraction `1/4`; write 0.25"),
        ("\"1.5\"", "expected a number, found `\"1.5\"`; a number has no quotes: 1.5"),
        ("1e", "expected a number, found `1e`"),
        ("1.000.5", "expected a number, found `1.000.5`"),
        ("- 1", "expected a number, found `-`; a sign stands at its number"),
        ("−1", "expected a number, found `−1`; a minus is -"),
        ("null", "expected a number, found `null`; what is not given is left out"),
        ("true", "expected a number, found `true`"),
        ("", "expected a number, found `)`"),
        ("(1)", "expected a number, found `(`"),
    ] {
        let column = if value.is_empty() { 26 } else { 26 + value.len() - value.trim_start().len() };
        let expected = format!("1:{column}: environment.exposure: {expected}");
        assert_eq!(folder.problems(&exposure(value)), [expected], "{value}");
    }
    for value in [".5", "1.", "+1", "1_000", "1e2", "1.0f32"] {
        assert_eq!(folder.problems(&exposure(value)), [] as [String; 0], "{value}");
    }
    for value in ["inf", "NaN"] {
        let expected = format!("1:26: environment.exposure: expected a number from 0 to 1000000, found {value}");
        assert_eq!(folder.problems(&exposure(value)), [expected]);
    }
    let (around, name) = ("expected ( … ) around all fields of the file, found", "expected the name of a field, found");
    for (text, expected) in [
        (
            "(\n environment: (exposure: 1,5),\n)\n",
            "2:26: environment.exposure: found `1,5`; numbers have a point and no comma: 1.5",
        ),
        (
            "(entities: [(transform: (scale: 0,5))])",
            "1:33: entities[0].transform.scale: found `0,5`; numbers have a point and no comma: 0.5",
        ),
        (
            "(entities: [(), (light: point(range: 2,5))])",
            "1:38: entities[1].light.range: found `2,5`; numbers have a point and no comma: 2.5",
        ),
        (
            "(meshes: {\"a\": cube(size: 1,5)})",
            "1:27: meshes[\"a\"].size: found `1,5`; numbers have a point and no comma: 1.5",
        ),
        (
            "(entities: [(light: point(range: \"2\"))])",
            "1:34: entities[0].light.range: expected a number, found `\"2\"`; a number has no quotes: 2",
        ),
        (
            "(entities: [(transform: (translation: (0,5, 1, 2)))])",
            "1:39: entities[0].transform.translation: expected 3 values, found more; numbers have a point and no comma: 0.5",
        ),
        (
            "(entities: [(transform: (translation: (0, 5)))])",
            "1:44: entities[0].transform.translation: expected 3 values, found 2",
        ),
        (
            "(entities: [(transform: (translation: [0, 5, 1]))])",
            "1:39: entities[0].transform.translation: expected ( … ), found `[`",
        ),
        (
            "(entities: [(transform: (translation: (x: 0, y: 1)))])",
            "1:40: entities[0].transform.translation: expected a number, found `x`",
        ),
        ("(seed: 1.5)", "1:8: seed: expected a whole number, found `1.5`"),
        ("(seed: 1e3)", "1:8: seed: expected a whole number, found `1e3`; write 1000"),
        ("(seed: -1)", "1:8: seed: expected a whole number of 0 or more, found `-1`"),
        ("(seed: 99999999999999999999)", "1:8: seed: expected a smaller whole number, found `99999999999999999999`"),
        ("(clock: (paused: True))", "1:18: clock.paused: expected true or false, found `True`"),
        (
            "(clock: (paused: \"true\"))",
            "1:18: clock.paused: expected true or false, found `\"true\"`; it has no quotes: true",
        ),
        ("(environment: (tone_map: \"agx\"))", "1:26: environment.tone_map: a choice has no quotes: agx"),
        (
            "(entities: [(name: 'a')])",
            "1:20: entities[0].name: expected text in quotes, found `'`; text has double quotes",
        ),
        (
            "(entities: [(name: “a”)])",
            "1:20: entities[0].name: expected text in quotes, found `“` (U+201C); quotes are straight: \"",
        ),
        ("(entities: [(name: \"a\" mesh: \"b\")])", "1:24: entities[0].name: expected a comma or `)`, found `mesh`"),
        (
            "(environment: (exposure: 1; ambient: (0, 0, 0)))",
            "1:27: environment.exposure: expected a comma or `)`, found `;`",
        ),
        (
            "(environment: (exposure = 1))",
            "1:25: environment: expected a colon after exposure, found `=`; a colon stands after a name",
        ),
        ("(environment: {exposure: 1})", "1:15: environment: expected fields in parentheses, ( … ), found `{`"),
        ("(entities: {})", "1:12: entities: expected a list in brackets, [ … ], found `{`"),
        ("(materials: [])", "1:13: materials: expected named entries in braces, { \"name\": … }, found `[`"),
        ("(\"environment\": (exposure: 1))", "1:2: the name of a field has no quotes: environment"),
        ("{ \"environment\": {} }", &format!("1:1: {around} `{{`")),
        ("environment: (exposure: 1)", &format!("1:1: {around} `environment`")),
        ("", &format!("1:1: {around} the end of the file")),
        ("(seed: 1,, piece_metres: 2)", "1:10: expected the name of a field, found a second comma"),
        ("(seed: 1, # one\n)", &format!("1:11: {name} `#`; comments begin with //")),
        ("(seed: 1, -- one\n)", &format!("1:11: {name} `--`; comments begin with //")),
        ("(seed: 1, /* one\n)", "1:11: a comment that begins with /* has no */"),
        ("(environment: (exposure: 1)", "1:28: expected `)`, which closes the `(` of 1:1, found the end of the file"),
        (
            "(environment: (exposure: 1]",
            "1:27: environment.exposure: expected `)`, which closes the `(` of 1:15, found `]`",
        ),
        ("(seed: 1))", "1:10: expected nothing more after the last bracket, found `)`"),
        ("(seed: 1) more", "1:11: expected nothing more after the last bracket, found `more`"),
        ("(entities: [(name: \"a)])", "1:20: entities[0].name: the text that begins here has no closing quote"),
        ("(seed:\u{a0}1)", "1:7: seed: expected a plain blank, found the blank U+00A0"),
    ] {
        assert_eq!(folder.problems(text), [expected], "{text}");
    }
    assert_eq!(folder.problems("(\r\n\tseed: 1,\r\n)\r\n"), [] as [String; 0]);
    let utf16: Vec<u8> = "\u{feff}(seed: 1)".encode_utf16().flat_map(u16::to_le_bytes).collect();
    for bytes in [&utf16[..], &utf16[2..]] {
        let problem = scene::check(&folder.file("wide.ron", bytes))[0].to_string();
        assert!(problem.ends_with("wide.ron: expected UTF-8 text, found UTF-16; save it as UTF-8"), "{problem}");
    }
    let types = folder.file("vehicles.ron", "(types: {\"car\": (model: \"model.gltf\", mass: 1,5)})");
    let problem = scene::check(&types)[0].to_string();
    let expected = ":1:45: types[\"car\"].mass: found `1,5`; numbers have a point and no comma: 1.5";
    assert!(problem.ends_with(expected), "{problem}");
}

#[test]
fn names_that_two_things_have_and_ranges_that_run_backward_are_told() {
    let folder = Folder::new();
    let reach = "reaches that one only; expected another name";
    let cameras = "(entities: [(name: \"a\"), (name: \"cam\", camera: ()), (children: [(name: \"cam\", camera: ())])])";
    let vehicle = "(vehicle_types: [], entities: [(name: \"v\", vehicle: (type: \"box\")), \
        (name: \"v\", vehicle: (type: \"box\"), transform: (translation: (9, 0, 0)))])";
    for (text, expected) in [
        (
            cameras,
            format!(
                "warning: entities[2].children[0] (line 1, column 65): entities[1] is a camera named \"cam\", too: \
                 --camera \"cam\" {reach}"
            ),
        ),
        (
            vehicle,
            format!(
                "warning: entities[1] (line 1, column 69): entities[0] is a vehicle named \"v\", too: \
                 --camera \"chase v\" {reach}"
            ),
        ),
        (
            "(generators: [(place: grid(counts: (1, 1, 1)), random_scale: (3, 1))])",
            "1:62: generators[0].random_scale: expected (least, most), found (3, 1); write (1, 3)".to_owned(),
        ),
    ] {
        assert_eq!(folder.problems(text), [expected], "{text}");
    }
    let other = "(entities: [(name: \"cam\", camera: ()), (name: \"cam\"), (name: \"a\", camera: ())])";
    assert_eq!(folder.problems(other), [] as [String; 0]);
    let camera = MODEL.replace("\"name\": \"lamp\",", "\"name\": \"lamp\", \"camera\": 0,");
    let perspective =
        "\"cameras\": [{\"type\": \"perspective\", \"perspective\": {\"yfov\": 1, \"znear\": 0.1}}],\n    \"meshes\"";
    folder.file("seen.gltf", camera.replace("\"meshes\"", perspective));
    let twice =
        "(meshes: {\"m\": model(file: \"seen.gltf\")}, entities: [(mesh: \"m\"), (mesh: \"m\"), (mesh: \"m\")])";
    let expected =
        "warning: a model has a camera named \"lamp\", as an earlier one is: --camera reaches the first only";
    assert_eq!(folder.problems(twice), [expected]);
}

#[test]
fn every_fault_is_told_with_its_place() {
    let text = r#"(
    clock: (step_seconds: 0),
    materials: {
        "brick": (base_map: "absent.png", shininess: NaN, base_factor: kelvin(10)),
    },
    meshes: {
        "wall": cube(size: (1, 0, 1)),
        "wall": plane(segments: (0, 1)),
        "van": model(file: "absent.glb"),
    },
    entities: [
        (mesh: "wal", material: "brik"),
        (light: spot(range: -2, outer_degrees: 86, attenuation: (0, 0, 0))),
        (light: spot(cutoff_degrees: 30, inner_degrees: 3)),
        (transform: (rotation_degrees: (0, 0, 0), look_at: (0, 0, 0), scale: 0)),
        (camera: (near: 1, far: 0.5), spin: (axis: (0, 0, 0)), node: "lamp"),
    ],
    generators: [
        (place: scatter(region: box(min: (1, 0, 0), max: (0, 0, 0)), count: 0), random_scale: (1, inf)),
    ],
)"#;
    let expected = [
        "2:27: clock.step_seconds: expected a number from 0.000001 to 1000, found 0",
        "4:29: materials[\"brick\"].base_map: absent.png: file: No such file or directory (os error 2)",
        "4:54: materials[\"brick\"].shininess: expected a number from 0 to 100000, found NaN",
        "4:72: materials[\"brick\"].base_factor: expected a temperature from 1667 to 25000 kelvin",
        "7:32: meshes[\"wall\"].size[1]: expected a number from 0.00001 to 1000000, found 0",
        "8:17: meshes[\"wall\"]: the name \"wall\" is taken: it stands twice",
        "8:33: meshes[\"wall\"].segments: expected counts from 1 to 1024, found [0, 1]",
        "9:28: meshes[\"van\"].file: absent.glb: file: No such file or directory (os error 2)",
        "12:16: entities[0].mesh: no mesh \"wal\"; did you mean \"wall\"?",
        "12:33: entities[0].material: no material \"brik\"; did you mean \"brick\"?",
        "13:29: entities[1].light.range: expected a number from 0.001 to 10000000, found -2",
        "13:48: entities[1].light.outer_degrees: expected a number from 0.1 to 85, found 86",
        "13:65: entities[1].light.attenuation: expected at least one of the three to be more than 0",
        "14:17: entities[2].light: expected either cutoff_degrees (and exponent) or outer_degrees (and inner_degrees)",
        "15:21: entities[3].transform: expected one of rotation_degrees, quaternion and look_at",
        "15:60: entities[3].transform.look_at: expected another point than the translation",
        "15:78: entities[3].transform.scale: expected a number from 0.00001 to 1000000, found 0",
        "16:33: entities[4].camera.far: expected a number from 1.001 to 10000000, found 0.5",
        "16:52: entities[4].spin.axis: expected a direction, found one of length 0",
        "16:70: entities[4].node: only what stands in `attach` is at a node",
        "19:33: generators[0].place.region: expected min to be at most max on every axis, found [1.0, 0.0, 0.0] and [0.0, 0.0, 0.0]",
        "19:77: generators[0].place.count: expected a count from 1 to 4000000, found 0",
        "19:99: generators[0].random_scale[1]: expected a number from 0.00001 to 1000000, found inf",
    ];
    let problems = Folder::new().problems(text);
    for (problem, expected) in problems.iter().zip(expected) {
        assert_eq!(problem, expected);
    }
    assert_eq!(problems.len(), expected.len());
    let error = scene::load(&Folder::new().file("a.ron", text), &mut Simulation::new()).expect_err("refused");
    assert!(error.to_string().ends_with("found 0 (and 22 more problems)"), "{error}");
}

#[test]
fn hostile_files_are_refused_quickly() {
    let folder = Folder::new();
    let start = std::time::Instant::now();
    let crowd = "(place: grid(counts: (1000, 1000, 1000)))";
    let problems = folder.problems(&format!("(generators: [{crowd}])"));
    let most = "expected from 1 to 4000000 copies in all, found 1000000000";
    assert_eq!(problems, [format!("1:36: generators[0].place.counts: {most}")]);
    let crowds = "(place: grid(counts: (1000, 1, 1000))),".repeat(5);
    let too_many = "1:14: generators: the scene has 5000000 entities; at most 4000000 are possible";
    assert_eq!(folder.problems(&format!("(generators: [{crowds}])")), [too_many]);
    let deep = format!("(entities: [{}{}])", "(children: [".repeat(100_000), "])".repeat(100_000));
    assert!(folder.problems(&deep)[0].ends_with("nested too deeply"), "{:?}", folder.problems(&deep));
    let name = "x".repeat(1 << 20);
    assert_eq!(folder.problems(&format!("(meshes: {{\"{name}\": cube()}}, entities: [(mesh: \"{name}y\")])")).len(), 1);
    let broken = folder.file("broken.ron", b"(\xff)");
    assert!(scene::check(&broken)[0].to_string().ends_with("expected UTF-8 text; byte 1 is none"));
    std::fs::create_dir(folder.0.path().join("folder.ron")).expect("made");
    assert!(scene::check(&folder.0.path().join("folder.ron"))[0].to_string().ends_with(": expected a file"));
    assert!(scene::check(Path::new("absent.ron"))[0].to_string().starts_with("absent.ron: No such file"));
    let other = scene::check(Path::new("scene.txt"))[0].to_string();
    assert_eq!(other, "scene.txt: expected a scene (.ron) or a model (.gltf, .glb)");
    assert!(start.elapsed().as_secs() < 5);
}

#[test]
fn a_scene_that_fails_leaves_the_world_as_it_was() {
    let folder = Folder::new();
    let mut simulation = Simulation::new();
    simulation.world.insert_resource(Environment { exposure: 7.0, ..Environment::default() });
    simulation.world.spawn(Light::point(1.0, 1.0));
    let before = (simulation.library().sizes(), all::<Light>(&mut simulation.world));
    let text = "(environment: (exposure: 2), materials: {\"m\": ()},
        meshes: {\"model\": model(file: \"model.gltf\"), \"cube\": cube()},
        entities: [(mesh: \"model\", light: point()), (mesh: \"absent\")])";
    assert!(scene::load(&folder.file("scene.ron", text), &mut simulation).is_err());
    assert_eq!((simulation.library().sizes(), all::<Light>(&mut simulation.world)), before);
    assert_eq!(simulation.world.resource::<Environment>().exposure, 7.0);
    let fine = text.replace("absent", "cube");
    assert!(scene::load(&folder.file("scene.ron", fine), &mut simulation).is_ok());
    assert_eq!(all::<Light>(&mut simulation.world).len(), 2);
}

#[test]
fn an_empty_scene_has_all_defaults_and_a_camera() {
    let (mut simulation, scene) = load("()");
    assert_eq!((scene.name.as_str(), scene.cameras.len(), scene.warnings.len()), ("scene", 1, 0));
    assert_eq!(*simulation.world.resource::<Environment>(), Environment::default());
    assert_eq!(*simulation.world.resource::<Clock>(), Clock::default());
    assert!(all::<Light>(&mut simulation.world).is_empty());
}

#[test]
fn values_reach_their_components() {
    let (mut simulation, scene) = load(
        r##"(
        environment: (ambient: srgb("#fff"), exposure: 2, tone_map: clamp),
        clock: (step_seconds: 0.5, speed: 3, paused: true),
        entities: [
            (name: "a", light: point()),
            (name: "b", light: spot(cutoff_degrees: 30, exponent: 4, range: 9, on: false)),
            (name: "c", light: spot(outer_degrees: 30, ambient: (1, 2, 3), attenuation: (1, 2, 3))),
            (name: "c2", light: point(color: kelvin(2700), attenuation: inverse_square, range: 9)),
            (name: "d", light: directional(color: (1, 0, 0), intensity: 2)),
            (name: "e", camera: (orthographic_half_height: 3, aspect: 2, near: 1)),
            (name: "f", camera: (fov_y_degrees: 90, far: 50, aspect: 2), transform: (look_at: (5, 0, 0))),
            (name: "g", transform: (rotation_degrees: (0, 90, 0), translation: (1, 2, 3), scale: (1, -2, 3)),
             spin: (axis: (0, 0, 9), degrees_per_second: 180)),
            (name: "h", hidden: true, children: [(name: "i")]),
        ])"##,
    );
    let world = &mut simulation.world;
    let environment = world.resource::<Environment>();
    assert_eq!((environment.ambient, environment.exposure), (Vec3::ONE, 2.0));
    assert_eq!(environment.tone_map, ToneMap::Clamp);
    let clock = world.resource::<Clock>();
    assert_eq!((clock.step_seconds, clock.speed, clock.paused), (0.5, 3.0, true));
    let a = named(world, "a");
    assert_eq!(world.get::<Light>(a), Some(&Light::point(1.0, f32::INFINITY)));
    let light = |world: &mut World, name| {
        let entity = named(world, name);
        world.get::<Light>(entity).expect("a light").clone()
    };
    let b = light(world, "b");
    let classic = LightKind::Spot { outer: 30f32.to_radians(), inner: None, exponent: 4.0 };
    assert_eq!((b.kind, b.range, b.enabled), (classic, 9.0, false));
    let c = light(world, "c");
    let cone = LightKind::Spot { outer: 30f32.to_radians(), inner: Some(24f32.to_radians()), exponent: 0.0 };
    assert_eq!((c.kind, c.ambient, c.attenuation), (cone, Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 2.0, 3.0)));
    let lamp = Light::point(1.0, 9.0).with_kelvin(2700.0).with_attenuation(Light::INVERSE_SQUARE);
    assert_eq!(light(world, "c2"), lamp);
    assert_eq!(lamp.attenuation, Vec3::Z, "1 / d²");
    assert_eq!(light(world, "d"), Light::directional(2.0).with_color(Vec3::X));
    let cameras: Vec<&str> = scene.cameras.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(cameras, ["e", "f"]);
    let parallel =
        Camera { projection: Projection::Orthographic { half_height: 3.0, aspect: Some(2.0) }, near: 1.0, far: 1001.0 };
    assert_eq!(world.get::<Camera>(scene.cameras[0].1), Some(&parallel));
    let projection = Projection::Perspective { fov_y: 90f32.to_radians(), aspect: Some(2.0) };
    assert_eq!(world.get::<Camera>(scene.cameras[1].1), Some(&Camera { projection, near: 0.1, far: 50.0 }));
    let looking = world.get::<Transform>(scene.cameras[1].1).expect("placed");
    assert!((looking.rotation * Vec3::NEG_Z).distance(Vec3::X) < 1e-6);
    let g = named(world, "g");
    let at = *world.get::<Transform>(g).expect("placed");
    assert_eq!((at.translation, at.scale), (Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, -2.0, 3.0)));
    assert!((at.rotation * Vec3::Z).distance(Vec3::X) < 1e-6);
    let spin = world.get::<Spin>(g).expect("spins");
    assert_eq!((spin.axis, spin.rate, spin.start), (Vec3::Z, std::f32::consts::PI, at.rotation));
    let (h, i) = (named(world, "h"), named(world, "i"));
    assert!(world.entity(h).contains::<Hidden>() && !world.entity(i).contains::<Hidden>());
    simulation.frame();
    let is_hidden = |entity: Entity| simulation.world.entity(entity).contains::<InheritedHidden>();
    assert_eq!([a, h, i].map(is_hidden), [false, true, true]);
}

/// Roll, then pitch, then yaw, as a camera on a tripod is turned.
#[test]
fn angles_are_applied_z_then_x_then_y() {
    let (mut simulation, _) = load("(entities: [(name: \"a\", transform: (rotation_degrees: (20, 30, 40)))])");
    let a = named(&mut simulation.world, "a");
    let [x, y, z] = [20f32, 30.0, 40.0].map(f32::to_radians);
    let expected = Quat::from_rotation_y(y) * Quat::from_rotation_x(x) * Quat::from_rotation_z(z);
    let found = simulation.world.get::<Transform>(a).expect("placed").rotation;
    // An arccosine knows small angles to √(2 · 2⁻²⁴), and half of them are taken.
    assert!(found.angle_between(expected) < 1e-3, "{found}");
}

#[test]
fn materials_and_their_maps_arrive() {
    let textures = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/textures");
    let map = |name: &str| format!("{:?}", textures.join(name).display().to_string());
    let (base, normal, height) = (map("brick_base.jpg"), map("brick_normal.png"), map("brick_height.png"));
    let (simulation, _) = load(&format!(
        "(materials: {{
            \"a\": (base_map: {base}, normal_map: {normal}, height_map: (file: {height}, uv: (set: 1, scale: (2, 3))),
                uv: (offset: (0.5, 0)), sampler: (wrap: clamp, wrap_u: None), shading: blinn,
                technique: perturbed_normal, base_factor: (1, 2, 3), base_alpha: 0.5, height_scale_uv: 0.1),
            \"b\": (base_map: {base}, emissive_map: {base}, specular_map: {base}),
        }})"
    ));
    let library = simulation.library();
    let [a, b] = [1, 2].map(|id| library.material(MaterialId(id)).expect("in file order"));
    assert_eq!((a.name.as_str(), a.shading, a.technique), ("a", Shading::Blinn, Technique::PerturbedNormal));
    assert_eq!((a.base_factor, a.height_scale_uv), (glam::Vec4::new(1.0, 2.0, 3.0, 0.5), 0.1));
    let (base_map, height_map) = (a.base_map.expect("has it"), a.height_map.expect("has it"));
    assert_eq!(base_map.image_from_mesh_uv.translation, glam::Vec2::new(0.5, 0.0));
    assert_eq!((base_map.sampler.wrap_u, base_map.sampler.wrap_v), (Wrap::Clamp, Wrap::Clamp));
    assert_eq!((height_map.uv_set, height_map.image_from_mesh_uv.translation), (1, glam::Vec2::ZERO));
    assert_eq!(height_map.image_from_mesh_uv.matrix2.col(1), glam::Vec2::new(0.0, 3.0));
    let kind = |map: systems::library::Map| library.image(map.image).expect("in the library").kind;
    assert_eq!(kind(base_map), ImageKind::Color);
    assert_eq!(a.normal_map.map(kind), Some(ImageKind::Normal));
    assert_eq!(kind(height_map), ImageKind::Height);
    // Once as colour and once as data, however many materials and fields name it.
    assert_eq!(b.base_map.map(|m| m.image), Some(base_map.image));
    assert_eq!(b.emissive_map.map(|m| m.image), Some(base_map.image));
    assert_eq!(library.images().len(), 5 + 4);
}

#[test]
fn a_technique_brings_its_maps_and_factors_or_a_word_about_them() {
    let textures = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/textures");
    let map = format!("{:?}", textures.join("brick_height.png").display().to_string());
    let (simulation, scene) = load(&format!(
        "(materials: {{
            \"all\": (technique: combined, height_map: {map}, horizon_map_0: {map}, horizon_map_1: {map}, height_rest: 0.5,
                self_shadow: 0.75, emboss_step_texels: 3, offset_map: {map}, offset_matrix: ((1, 2), (3, 4)),
                environment_map: {map}),
            \"plain\": (technique: relief_horizon),
            \"default\": (),
        }})"
    ));
    let library = simulation.library();
    let [all, plain] = [1, 2].map(|id| library.material(MaterialId(id)).expect("in file order"));
    assert_eq!((all.height_rest, all.self_shadow, all.emboss_step_texels), (0.5, 0.75, 3.0));
    // Rows in the file, and in what it does.
    assert_eq!(all.offset_matrix * glam::Vec2::X, glam::Vec2::new(1.0, 3.0));
    let kind = |map: Option<systems::library::Map>| library.image(map.expect("given").image).expect("there").kind;
    assert_eq!([all.horizon_maps[0], all.horizon_maps[1], all.offset_map].map(kind), [ImageKind::Data; 3]);
    assert_eq!(kind(all.environment_map), ImageKind::Color);
    assert_eq!(plain.technique, Technique::ReliefHorizon);
    let word =
        "material \"plain\" is smooth: technique relief_horizon goes by height_map and horizon_map_0 and horizon_map_1";
    assert_eq!(scene.warnings, [word]);
}

#[test]
fn maps_that_are_hardly_what_they_should_be_are_told() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, side: u32, texel: fn(u32) -> [u8; 3]| {
        image::RgbImage::from_fn(side, side, |x, _| image::Rgb(texel(x)))
            .save(folder.path().join(name))
            .expect("saved");
    };
    write("colour.png", 4, |x| [x as u8 * 60, 10, 200]);
    write("grey.png", 4, |x| [x as u8 * 60; 3]);
    write("small.png", 2, |_| [0; 3]);
    let path = folder.path().join("s.ron");
    let load = |material: &str| {
        std::fs::write(&path, format!("(materials: {{ \"m\": ({material}) }})")).expect("written");
        scene::load(&path, &mut Simulation::new())
    };
    let words = |material: &str| load(material).map(|scene| scene.warnings).expect("a scene");
    assert_eq!(words("height_map: \"grey.png\", normal_map: \"colour.png\""), Vec::<String>::new());
    assert_eq!(words("height_map: \"colour.png\"").len(), 1);
    assert_eq!(words("normal_map: \"grey.png\"").len(), 1);
    let unlike =
        load("horizon_map_0: \"grey.png\", horizon_map_1: \"small.png\"").expect_err("of two sizes").to_string();
    assert!(unlike.contains("expected 4×4 texels, as horizon_map_0 has, found 2×2"), "{unlike}");
    let alone = load("horizon_map_1: \"grey.png\"").expect_err("one of two").to_string();
    assert!(alone.contains("expected horizon_map_0 too"), "{alone}");
}

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
    let library_meshes = simulation.library().meshes().len();
    assert_eq!(library_meshes, 2, "the model's mesh once, and the cube");
    let world = &mut simulation.world;
    assert_eq!(all::<MeshId>(world).len(), 2 + 2 + 1 + 1);
    let below = |world: &World, root: Entity| -> Vec<Entity> {
        world.get::<Children>(root).map(|children| children.iter().collect()).unwrap_or_default()
    };
    let red = named(world, "red");
    assert!(below(world, red).iter().filter_map(|&e| world.get::<MaterialId>(e)).all(|m| *m == MaterialId(2)));
    let whole = named(world, "whole");
    let panel = below(world, whole)[0];
    assert_eq!(world.get::<GlobalTransform>(panel).expect("placed").translation(), Vec3::new(10.0, 0.0, 3.0));
    let part = named(world, "part");
    let lamp = world.get::<GlobalTransform>(below(world, part)[0]).expect("placed").affine();
    assert!((lamp.translation - glam::Vec3A::new(5.0, 0.0, 0.0)).length() < 1e-5, "moved to the entity");
    let expected = Vec3::new(0.0, 0.0, -2.0);
    assert!(lamp.transform_vector3(Vec3::X).distance(expected) < 1e-5, "turned and doubled as in the model");
    let figure = named(world, "figure");
    let meshes = world.get::<Figure>(figure).expect("a figure").meshes.clone();
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
    let folder = Folder::new();
    let wrong = folder.problems(&scene.replace("\"lamp\"", "\"lampe\""));
    assert_eq!(wrong, ["3:16: entities[0].attach[0].node: no node \"lampe\"; did you mean \"lamp\"?"]);
    let cube = folder.problems(&scene.replace("(mesh: \"model\"", "(mesh: \"cube\""));
    assert_eq!(cube, ["3:9: entities[0].attach[0]: mesh \"cube\" is no model, so it has no nodes"]);
}

#[test]
fn grids_have_their_counts_and_every_pair_of_alternatives() {
    let scene = r#"(materials: {"a": (), "b": (), "c": (), "d": ()}, meshes: {"x": cube(), "y": sphere()}, generators: [(
        name: "thing", place: grid(counts: (4, 2, 3), spacing: (2, 3, 4), center: (100, 0, 0)),
        entity: (transform: (translation: (0, 1, 0)), mesh: "x"), meshes: ["x", "y"], materials: ["a", "b", "c", "d"],
    )])"#;
    let (mut simulation, _) = load(scene);
    let things = generated(&mut simulation, "thing");
    assert_eq!(things.len(), 24);
    let place = |i: usize| things[i].1.translation;
    assert_eq!(place(0), Vec3::new(97.0, -0.5, -4.0));
    assert_eq!(place(1) - place(0), Vec3::new(2.0, 0.0, 0.0));
    assert_eq!(place(4) - place(0), Vec3::new(0.0, 0.0, 4.0));
    assert_eq!(place(12) - place(0), Vec3::new(0.0, 3.0, 0.0));
    for mesh in [MeshId(0), MeshId(1)] {
        for material in [1, 2, 3, 4] {
            let count = things.iter().filter(|t| t.2 == mesh && t.3 == MaterialId(material)).count();
            assert_eq!(count, 3, "{mesh:?} with material {material}");
        }
    }
}

#[test]
fn the_seed_alone_decides_what_is_generated() {
    let scene = |seed: u32| {
        format!(
            r#"(seed: {seed}, materials: {{"a": (), "b": ()}}, meshes: {{"x": cube(), "y": sphere()}}, generators: [
            (name: "grid", place: grid(counts: (5, 1, 5), spacing: (3, 3, 3), jitter: (1, 0, 1)), meshes: ["x", "y"],
             materials: ["a", "b"], choose: random, random_yaw: true, random_scale: (0.5, 2)),
            (name: "own", place: scatter(region: box(min: (-1, -2, -3), max: (1, 2, 3)), count: 50),
             entity: (mesh: "x"), seed: 9),
        ])"#
        )
    };
    let things = |seed, name: &str| generated(&mut load(&scene(seed)).0, name);
    let (first, again, other) = (things(1, "grid"), things(1, "grid"), things(2, "grid"));
    assert_eq!(first, again);
    assert!(first != other);
    assert_eq!(things(1, "own"), things(2, "own"), "a seed of its own");
    for (i, (_, at, ..)) in first.iter().enumerate() {
        let cell = Vec3::new((i % 5) as f32, 0.0, (i / 5) as f32) * 3.0 - Vec3::new(6.0, 0.0, 6.0);
        assert!((at.translation - cell).abs().max_element() <= 1.0 && at.translation.y == 0.0);
        assert!((0.5..=2.0).contains(&at.scale.x) && at.scale == Vec3::splat(at.scale.x));
    }
    assert!(first.iter().any(|t| t.1.rotation.y.abs() > 0.5) && first.iter().any(|t| t.2 != first[0].2));
    let inside = |t: &Transform| t.translation.abs().cmple(Vec3::new(1.0, 2.0, 3.0)).all();
    assert!(things(1, "own").iter().all(|t| inside(&t.1)));
    // The same on every platform: SplitMix64's first three numbers from 9, computed by another program.
    let place = things(1, "own")[0].1.translation.to_array().map(f32::to_bits);
    assert_eq!(place, PINNED_PLACE);
}

const PINNED_PLACE: [u32; 3] = [1_052_425_544, 1_065_376_532, 3_216_259_967];

#[test]
fn scattered_things_keep_their_distance_and_say_when_there_is_no_room() {
    let scene = |count: u32| {
        format!(
            "(generators: [(name: \"lamp\", place: scatter(region: disc(center: (5, 1, 0), radius: 4), count: {count},
                min_distance: 1), lights: [point(intensity: 1), point(intensity: 2)])])"
        )
    };
    let (mut simulation, scene_10) = load(&scene(10));
    let lights: Vec<f32> = all::<Light>(&mut simulation.world).iter().map(|l| l.intensity).collect();
    assert_eq!(lights, [1.0, 2.0].repeat(5));
    let mut places = simulation.world.query_filtered::<&Transform, With<Light>>();
    let places: Vec<Vec3> = places.iter(&simulation.world).map(|t| t.translation).collect();
    for (i, a) in places.iter().enumerate() {
        assert!(a.distance(Vec3::new(5.0, 1.0, 0.0)) <= 4.0 && a.y == 1.0);
        assert!(places[..i].iter().all(|b| a.distance(*b) >= 1.0));
    }
    assert!(scene_10.warnings.is_empty());
    let (mut simulation, crowded) = load(&scene(1000));
    let placed = all::<Light>(&mut simulation.world).len();
    assert!((20..64).contains(&placed), "{placed}");
    assert_eq!(crowded.warnings, [format!("lamp: {placed} of 1000 placed: min_distance leaves no room")]);
}

#[test]
fn a_bare_model_gets_a_neutral_rig_and_a_camera_that_sees_all_of_it() {
    let folder = Folder::new();
    let mut simulation = Simulation::new();
    let path = folder.0.path().join("model.gltf");
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
    let folder = Folder::new();
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
    let folder = Folder::new();
    let path = folder.file("broken.gltf", MODEL.replace("\"count\": 4", "\"count\": 4000"));
    let error = scene::load(&path, &mut Simulation::new()).expect_err("refused").to_string();
    assert!(error.contains("broken.gltf: ") && error.contains("accessors[0]"), "{error}");
    let text = "(meshes: {\"m\": model(file: \"broken.gltf\")})";
    let problems = folder.problems(text);
    assert!(problems[0].starts_with("1:28: meshes[\"m\"].file: broken.gltf: "), "{problems:?}");
}

#[test]
fn the_example_scenes_load_without_a_warning() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes");
    for name in ["shapes", "lights"] {
        let mut simulation = Simulation::new();
        let path = folder.join(name).with_extension("ron");
        let scene = scene::load(&path, &mut simulation).unwrap_or_else(|e| panic!("{e}"));
        simulation.frame();
        assert_eq!(scene.warnings, Vec::<String>::new());
        assert!(!simulation.draw_list().batches.is_empty());
    }
}

#[test]
fn the_whole_scenes_of_the_documentation_load() {
    let docs = include_str!("../docs/scenes.md");
    let folder = Folder::new();
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets").display().to_string();
    let scenes: Vec<&str> = docs.split("```ron scene\n").skip(1).filter_map(|s| s.split("```").next()).collect();
    assert!(!scenes.is_empty());
    for text in scenes {
        let (_, scene) = folder.load(&text.replace("\"../", &format!("\"{assets}/")));
        assert!(scene.warnings.is_empty());
    }
}

/// Mostly sane, so that many scenes load and some of them nearly did not.
fn any_number() -> impl Strategy<Value = f32> {
    prop_oneof![
        60 => 0.01f32..10.0,
        1 => any::<f32>(),
        1 => proptest::sample::select(vec![0.0, -1.0, 1e6, 1e7, f32::MAX, f32::MIN_POSITIVE, f32::NAN, f32::INFINITY]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_number_in_a_transform_panics(n in proptest::array::uniform32(any_number()), way in 0..4) {
        let vector = |i: usize| format!("({:?}, {:?}, {:?})", n[i], n[i + 1], n[i + 2]);
        let rotation = match way {
            0 => format!("rotation_degrees: {}", vector(0)),
            1 => format!("quaternion: ({:?}, {:?}, {:?}, {:?})", n[0], n[1], n[2], n[3]),
            2 => format!("look_at: {}", vector(0)),
            _ => String::new(),
        };
        let transform = format!("(translation: {}, scale: {}, {rotation})", vector(4), vector(7));
        let spin = format!("(axis: {}, degrees_per_second: {:?})", vector(10), n[13]);
        let text = format!(
            "(meshes: {{\"m\": cube(size: {})}}, entities: [(mesh: \"m\", transform: {transform}, spin: {spin},
                children: [(mesh: \"m\", transform: {transform}, light: point(range: {:?}), camera: (near: {:?}))])],
              generators: [(place: grid(counts: (2, 1, 2), spacing: {}, jitter: {}), entity: (mesh: \"m\"))])",
            vector(14), n[17], n[18], vector(19), vector(22),
        );
        let folder = Folder::new();
        let mut simulation = Simulation::new();
        if scene::load(&folder.file("scene.ron", text), &mut simulation).is_ok() {
            simulation.step();
            simulation.frame();
            let transforms = all::<GlobalTransform>(&mut simulation.world);
            prop_assert!(transforms.iter().all(|t| t.affine().is_finite()));
        }
    }

    #[test]
    fn no_damage_to_a_scene_panics(cut in 0usize..4000, length in 0usize..40, byte in any::<char>()) {
        let text = include_str!("../assets/scenes/lights.ron");
        let end = |i: usize| (0..=i.min(text.len())).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0);
        let damaged = format!("{}{byte}{}", &text[..end(cut)], &text[end(cut + length)..]);
        let folder = Folder::new();
        scene::check(&folder.file("scene.ron", damaged));
    }
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

/// A scene with everything that has places, moved by that much.
fn on_a_map(x: f64, z: f64) -> String {
    let at = |dx: f64, y: f64, dz: f64| format!("({}, {y}, {})", decimal(x, dx), decimal(z, dz));
    format!(
        r#"(
    meshes: {{ "cube": cube(), "land": plane(size: (300, 300)) }},
    routes: {{
        "r": (points: [{}, {}, {}], shape: spline, then: ["s"]),
        "s": (points: [{}, {}], then: ["s"]),
    }},
    entities: [
        (light: directional(), transform: (look_at: (1, -2, 0.5))),
        (mesh: "land", ground: true, transform: (translation: {})),
        (name: "cube", mesh: "cube", transform: (translation: {}, look_at: {}),
            children: [(mesh: "cube", transform: (translation: (0, 1.1, 0)))]),
        (vehicle: (type: "box", route: "r", at: 5.3, speed_kmh: 30)),
        (vehicle: (type: "box", route: "r", at: 40, physical: ())),
        (vehicle: (type: "box", by_hand: true, speed_kmh: 9), transform: (translation: {})),
        (name: "eye", camera: (), transform: (translation: {}, look_at: {})),
    ],
    generators: [
        (place: grid(counts: (3, 1, 3), spacing: (2, 0, 2), center: {}, jitter: (0.3, 0, 0.3)), meshes: ["cube"]),
        (place: scatter(region: disc(center: {}, radius: 9), count: 9), meshes: ["cube"]),
        (place: scatter(region: box(min: {}, max: {}), count: 9), meshes: ["cube"]),
        (place: along(routes: ["r"], spacing: 20, beside: 4), meshes: ["cube"]),
    ],
)"#,
        at(0.0, 0.0, 0.0),
        at(12.3, 0.0, 60.7),
        at(-3.1, 0.0, 120.003),
        at(-3.1, 0.0, 120.003),
        at(-3.1, 0.0, 240.1),
        at(0.0, 0.0, 100.0),
        at(-4.7, 1.25, 0.1),
        at(0.001, 0.3, 77.7),
        at(20.2, 0.1, 30.4),
        at(-14.6, 9.0, -11.9),
        at(0.0, 0.0, 20.0),
        at(40.9, 0.5, 7.7),
        at(-40.9, 0.5, 7.7),
        at(30.1, 1.0, 60.6),
        at(39.9, 2.0, 71.3),
    )
}

/// The sum of a whole number and one of three decimals, as one would write it.
fn decimal(whole: f64, part: f64) -> f64 {
    let thousandths = (whole as i64) * 1000 + (part * 1e3).round() as i64;
    format!("{thousandths}e-3").parse().expect("a number")
}

/// All places that are kept, of what is drawn, what drives and what looks.
fn places(simulation: &mut Simulation) -> Vec<[u32; 10]> {
    let mut all = simulation.world.query::<&Transform>();
    let bits = |at: &Transform| {
        let mut bits = [0; 10];
        let values = at.translation.to_array().into_iter().chain(at.rotation.to_array()).chain(at.scale.to_array());
        bits.iter_mut().zip(values).for_each(|(bits, value)| *bits = value.to_bits());
        bits
    };
    all.iter(&simulation.world).map(bits).collect()
}

#[test]
fn a_scene_on_a_map_is_the_same_scene_at_zero_to_the_bit() {
    let (mut here, scene) = load(&on_a_map(0.0, 0.0));
    assert_eq!(scene.warnings, Vec::<String>::new());
    for (x, z, explicit) in [(5e5, 5e6, false), (512e3, -5403e3, false), (-9_990_017.0, 123_456.0, true)] {
        let text = on_a_map(x, z);
        let text = if explicit { text.replacen('(', &format!("(origin: ({x}, 0, {z}),"), 1) } else { text };
        let (mut there, scene) = load(&text);
        assert_eq!(there.world.resource::<Origin>().0, glam::DVec3::new(x, 0.0, z));
        match &scene.warnings[..] {
            [] if explicit => {}
            [one] if !explicit => assert!(one.contains(&format!("origin: ({x}, 0, {z})")), "{one}"),
            warnings => panic!("{warnings:?}"),
        }
        let (mut at_zero, _) = load(&on_a_map(0.0, 0.0));
        assert!(places(&mut at_zero).len() > 40);
        for step in 0..300 {
            assert!(places(&mut there) == places(&mut at_zero), "({x}, {z}), step {step}");
            [&mut there, &mut at_zero].into_iter().for_each(Simulation::step);
        }
    }
    let before = places(&mut here);
    (0..300).for_each(|_| here.step());
    assert!(places(&mut here) != before, "it drives");
}

#[test]
fn what_is_far_from_the_origin_is_a_warning_with_the_error_to_expect() {
    let warnings = |text: &str| load(text).1.warnings;
    let far = warnings(
        r#"(meshes: { "c": cube() }, origin: (0, 0, 0), entities: [
            (mesh: "c", transform: (translation: (0, 0, 19999))),
            (mesh: "c", transform: (translation: (0, 0, 50000))),
            (mesh: "c", transform: (translation: (1000000, 0, 0))),
        ])"#,
    );
    assert_eq!(far.len(), 1, "{far:?}");
    // From 2^19 to 2^20 m numbers of 24 bits are 2^−4 m apart.
    for part in ["entities[2]", "1 other places", "1000.0 km", "(0, 0, 0)", "6.2e-2 m", "20 km"] {
        assert!(far[0].contains(part), "{part}: {far:?}");
    }
    let near =
        warnings(r#"(meshes: { "c": cube() }, entities: [(mesh: "c", transform: (translation: (0, 0, 19999)))])"#);
    assert_eq!(near, Vec::<String>::new());
    // A child's place is its own.
    let child = r#"(children: [(transform: (translation: (0, 0, 50000)))])"#;
    assert_eq!(warnings(&format!("(entities: [{child}])")), Vec::<String>::new());
}

#[test]
fn a_model_that_reaches_far_from_its_own_origin_is_a_warning() {
    let folder = Folder::new();
    let far = MODEL.replace("[0, 0, 3]", "[500000, 0, 5000000]");
    folder.file("far.gltf", &far);
    for problems in [
        folder.problems(r#"(meshes: { "m": model(file: "far.gltf") }, entities: [(mesh: "m")])"#),
        scene::check(&folder.file("far.gltf", &far)).iter().map(ToString::to_string).collect(),
    ] {
        assert_eq!(problems.len(), 1, "{problems:?}");
        for part in ["5000.0 km", "5.0e-1 m"] {
            assert!(problems[0].contains(part), "{part}: {problems:?}");
        }
    }
}
