//! Refusals and their words; no text does worse.

use super::*;

/// Wrong names and values.
const NAMES: &str = r##"
    (
      entities: [
        (name: "x", trasform: (scale: 2)),
      ],
    )
    → 3:17: unknown field "trasform"; did you mean "transform"?
    (entities: [(light: pont())]) → 1:21: unknown variant "pont"; did you mean "point"?
    (entities: [(light: spot(rang: 2))]) → 1:26: unknown field "rang"; did you mean "range"?
    (entities: [(light: point(attenuation: cubic))])
    → 1:45: entities[0].light.attenuation: expected (constant, linear, quadratic) or inverse_square
    (materials: {"m": (base_map: (fil: "a.png"))}) → 1:31: unknown field "fil"; did you mean "file"?
    (environment: (ambient: red))
    → 1:28: environment.ambient: expected a colour: (red, green, blue), srgb("#ffcc88") or kelvin(2700)
    (entities: [(transform: (scale: "big"))]) → 1:34: entities[0].transform.scale: expected a number or (x, y, z)
    (seed: 1, seed: 2) → 1:11: duplicate field "seed"
    (entities: [(name: "c", sensor: camera()), (children: [(name: "c", sensor: lidar())])])
    → 1:76: entities[1].children[0].sensor: duplicate sensor name "c": entities[0].sensor has it, too
    (entities: [(name: "a", instance: true, children: [(name: "c", sensor: camera()), (name: "c", sensor: imu())])])
    → 1:103: entities[0].children[1].sensor: duplicate sensor name "a/c": entities[0].children[0].sensor has it, too
    (generators: [(place: grid(counts: (2, 1, 1), spacing: (1, 1, 1)), entity: (children: [(name: "c", sensor: camera())]))])
    → 1:76: generators[0].entity: expected `instance: true`: by names of things the sensors of one copy are told from
      those of another
    (generators: [()]) → 1:16: missing field "place"
    (lights: (tolerance: 1.5)) → 1:22: lights.tolerance: expected a number from 0 to 1, found 1.5
    (entities: [(lights: (policy: three, tolerance: 0.1))])
    → 1:49: entities[0].lights.tolerance: only allowed with the policy enough
    (vehicle_types: [], entities: [(vehicle: (type: "car"), piece_metres: 2)])
    → 1:71: entities[0].piece_metres: not allowed with a vehicle, which is drawn as a whole
    (entities: [(casts_shadows: false, light: point())])
    → 1:29: entities[0].casts_shadows: expected a mesh beside it; whether a light casts shadows is said by its own
      field `shadows`
    (meshes: {"a": cube()}, entities: [(casts_shadows: false, children: [(mesh: "a", casts_shadows: false)])])
    → 1:52: entities[0].casts_shadows: expected a mesh beside it; what is below an entity says so itself
    (vehicle_types: [], entities: [(vehicle: (type: "car"), casts_shadows: false)])
    → 1:72: entities[0].casts_shadows: not allowed with a vehicle, which casts shadows as a whole
    (entities: [(light: point(shadow_near: 0))])
    → 1:40: entities[0].light.shadow_near: expected a number from 0.001 to 10000000, found 0
    (entities: [(light: point(radius: 101))])
    → 1:35: entities[0].light.radius: expected a number from 0 to 100, found 101
    (entities: [(light: spot(outer_degrees: 30, radius: -1))])
    → 1:53: entities[0].light.radius: expected a number from 0 to 100, found -1
    (entities: [(light: directional(angle_degrees: 91))])
    → 1:48: entities[0].light.angle_degrees: expected a number from 0 to 90, found 91
    (meshes: {"m": model(file: "model.gltf", casts_no_shadow: ["glas"])})
    → 1:60: meshes["m"].casts_no_shadow[0]: unknown material "glas"; expected one of "glTF default"
"##;

/// Warnings of loading.
const WARNINGS: &str = r##"
    (entities: [(name: "lamp", light: point(shadows: true))])
    → warning: lamp casts shadows and has no range: whatever is in the scene is drawn for its shadows; set `range`
    (meshes: {"part": model(file: "model.gltf", shadows: true)})
    → warning: mesh "part": shadows has no effect: the model has no lights
    (generators: [(place: along(spacing: 5))])
    → warning: generator 1: nothing is placed: there is no route with room for it
    (entities: [(vehicle: (type: "car"))])
    → warning: unknown vehicle type "car"; expected one of "box"; a box is drawn instead
"##;

#[test]
fn wrong_names_and_types_are_told_with_place_and_nearest_name() {
    let folder = Folder::with_model();
    for (text, expected) in [NAMES, WARNINGS].into_iter().flat_map(cases) {
        assert_eq!(folder.problems(&text), [expected], "{text}");
    }
    // With the mark that some editors put first.
    assert_eq!(folder.problems("\u{feff}(seed: 1)"), [] as [String; 0]);
}

/// Texts that are no RON.
const TEXTS: &str = r##"
    (
     environment: (exposure: 1,5),
    )
    
    → 2:26: environment.exposure: found `1,5`; use a decimal point, not a comma: 1.5
    (entities: [(transform: (scale: 0,5))])
    → 1:33: entities[0].transform.scale: found `0,5`; use a decimal point, not a comma: 0.5
    (entities: [(), (light: point(range: 2,5))])
    → 1:38: entities[1].light.range: found `2,5`; use a decimal point, not a comma: 2.5
    (meshes: {"a": cube(size: 1,5)}) → 1:27: meshes["a"].size: found `1,5`; use a decimal point, not a comma: 1.5
    (entities: [(light: point(range: "2"))])
    → 1:34: entities[0].light.range: expected a number, found `"2"`; write numbers without quotes: 2
    (entities: [(transform: (translation: (0,5, 1, 2)))])
    → 1:39: entities[0].transform.translation: expected 3 values, found more; use a decimal point, not a comma: 0.5
    (entities: [(transform: (translation: (0, 5)))])
    → 1:44: entities[0].transform.translation: expected 3 values, found 2
    (entities: [(transform: (translation: [0, 5, 1]))])
    → 1:39: entities[0].transform.translation: expected ( … ), found `[`
    (entities: [(transform: (translation: (x: 0, y: 1)))])
    → 1:40: entities[0].transform.translation: expected a number, found `x`
    (seed: 1.5) → 1:8: seed: expected a whole number, found `1.5`
    (seed: 1e3) → 1:8: seed: expected a whole number, found `1e3`; write 1000
    (seed: -1) → 1:8: seed: expected a whole number of 0 or more, found `-1`
    (seed: 99999999999999999999) → 1:8: seed: expected a smaller whole number, found `99999999999999999999`
    (clock: (paused: True)) → 1:18: clock.paused: expected true or false, found `True`
    (clock: (paused: "true"))
    → 1:18: clock.paused: expected true or false, found `"true"`; write it without quotes: true
    (environment: (tone_map: "agx")) → 1:26: environment.tone_map: write variants without quotes: agx
    (entities: [(name: 'a')]) → 1:20: entities[0].name: expected a string in quotes, found `'`; use double quotes
    (entities: [(name: “a”)])
    → 1:20: entities[0].name: expected a string in quotes, found `“` (U+201C); use straight quotes: "
    (entities: [(name: "a" mesh: "b")]) → 1:24: entities[0].name: expected a comma or `)`, found `mesh`
    (environment: (exposure: 1; ambient: (0, 0, 0))) → 1:27: environment.exposure: expected a comma or `)`, found `;`
    (environment: (exposure = 1))
    → 1:25: environment: expected a colon after exposure, found `=`; write a colon after a field name
    (environment: {exposure: 1}) → 1:15: environment: expected fields in parentheses, ( … ), found `{`
    (entities: {}) → 1:12: entities: expected a list in brackets, [ … ], found `{`
    (materials: []) → 1:13: materials: expected named entries in braces, { "name": … }, found `[`
    ("environment": (exposure: 1)) → 1:2: write field names without quotes: environment
    { "environment": {} } → 1:1: expected ( … ) around all fields of the file, found `{`
    environment: (exposure: 1) → 1:1: expected ( … ) around all fields of the file, found `environment`
    (environment: (ambient: (0,8, 0,2, 0,1)))
    → 1:25: environment.ambient: expected a colour: (red, green, blue), srgb("#ffcc88") or kelvin(2700), found 6
      numbers; use a decimal point, not a comma: 0.5
    (entities: [(light: point(color: (1, 0,5, 0,)))])
    → 1:34: entities[0].light.color: expected a colour: (red, green, blue), srgb("#ffcc88") or kelvin(2700), found 4
      numbers; use a decimal point, not a comma: 0.5
    (environment: (ambient: (1, 0)))
    → 1:25: environment.ambient: expected a colour: (red, green, blue), srgb("#ffcc88") or kelvin(2700), found 2
      numbers
    (environment: (ambient: (0.1, 0.2, 0.3, 1.0)))
    → 1:25: environment.ambient: expected a colour: (red, green, blue), srgb("#ffcc88") or kelvin(2700), found 4
      numbers
    (environment: (ambient: (0.5)))
    → 1:25: environment.ambient: expected a colour: (red, green, blue), srgb("#ffcc88") or kelvin(2700), found 1
      number
    (entities: [(light: point(attenuation: (1, 0,5, 0)))])
    → 1:40: entities[0].light.attenuation: expected (constant, linear, quadratic) or inverse_square, found 4 numbers;
      use a decimal point, not a comma: 0.5
    (entities: [(transform: (scale: (1,5, 1, 1)))])
    → 1:33: entities[0].transform.scale: expected a number or (x, y, z), found 4 numbers; use a decimal point, not a
      comma: 0.5
    (seed: 1,, piece_metres: 2) → 1:10: expected a field name, found a second comma
    (seed: 1, # one
    )
    → 1:11: expected a field name, found `#`; comments begin with //
    (seed: 1, -- one
    )
    → 1:11: expected a field name, found `--`; comments begin with //
    (seed: 1, /* one
    )
    → 1:11: unterminated comment: missing */
    (environment: (exposure: 1) → 1:28: expected `)`, which closes the `(` of 1:1, found the end of the file
    (environment: (exposure: 1] → 1:27: environment.exposure: expected `)`, which closes the `(` of 1:15, found `]`
    (seed: 1)) → 1:10: expected the end of the file, found `)`
    (seed: 1) more → 1:11: expected the end of the file, found `more`
    (entities: [(name: "a)]) → 1:20: entities[0].name: unterminated string: missing closing quote
"##;

#[test]
#[should_panic(expected = "expected four spaces before")]
fn cases_that_are_not_indented_are_not_left_out() {
    cases("    given\n    → expected\n   given too\n    → expected\n");
}

#[test]
fn text_that_is_no_ron_is_told_with_its_field_and_what_to_write() {
    let folder = Folder::with_model();
    let exposure = |value: &str| format!("(environment: (exposure: {value}))");
    for (value, expected) in [
        ("1,5", "found `1,5`; use a decimal point, not a comma: 1.5"),
        ("0,05, ambient: (0, 0, 0)", "found `0,05`; use a decimal point, not a comma: 0.05"),
        ("1,500", "found `1,500`; use a decimal point, not a comma: 1.500 or 1500"),
        ("1.000,5", "found `1.000,5`; use a decimal point, not a comma: 1000.5"),
        ("0x10", "expected a decimal number, found `0x10`; write 16"),
        ("0b101", "expected a decimal number, found `0b101`; write 5"),
        ("5m", "expected a number without a suffix, found `5m`; write 5"),
        ("50%", "expected a number without a suffix, found `50%`; write 50"),
        ("1/4", "expected a number, found the fraction `1/4`; write 0.25"),
        ("\"1.5\"", "expected a number, found `\"1.5\"`; write numbers without quotes: 1.5"),
        ("1e", "expected a number, found `1e`"),
        ("1.000.5", "expected a number, found `1.000.5`"),
        ("- 1", "expected a number, found `-`; write the sign directly before the number"),
        ("−1", "expected a number, found `−1`; use - for minus"),
        ("null", "expected a number, found `null`; leave out the field instead"),
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
    let around = "expected ( … ) around all fields of the file, found";
    let odd = [
        ("", format!("1:1: {around} the end of the file")),
        ("// nothing yet", format!("1:15: {around} the end of the file")),
        ("// nothing yet\n\n", format!("3:1: {around} the end of the file")),
        ("/* nothing */ ", format!("1:15: {around} the end of the file")),
        ("(seed:\u{a0}1)", "1:7: seed: expected an ordinary space, found the space U+00A0".to_owned()),
    ];
    let odd = odd.map(|(text, expected)| (text.to_owned(), expected));
    for (text, expected) in cases(TEXTS).into_iter().chain(odd) {
        assert_eq!(folder.problems(&text), [expected], "{text}");
    }
    assert_eq!(folder.problems("(\r\n\tseed: 1,\r\n)\r\n"), [] as [String; 0]);
    let utf16: Vec<u8> = "\u{feff}(seed: 1)".encode_utf16().flat_map(u16::to_le_bytes).collect();
    for bytes in [&utf16[..], &utf16[2..]] {
        let problem = scene::check(&folder.file("wide.ron", bytes), Simulation::new)[0].to_string();
        assert!(problem.ends_with("wide.ron: expected UTF-8 text, found UTF-16; save it as UTF-8"), "{problem}");
    }
    let types = folder.file("vehicles.ron", "(types: {\"car\": (model: \"model.gltf\", mass: 1,5)})");
    let problem = scene::check(&types, Simulation::new)[0].to_string();
    let expected = ":1:45: types[\"car\"].mass: found `1,5`; use a decimal point, not a comma: 1.5";
    assert!(problem.ends_with(expected), "{problem}");
}

#[test]
fn names_that_two_things_have_and_ranges_that_run_backward_are_told() {
    let folder = Folder::with_model();
    let reach = "selects that one only";
    let cameras = "(entities: [(name: \"a\"), (name: \"cam\", camera: ()), (children: [(name: \"cam\", camera: ())])])";
    let vehicle = "(vehicle_types: [], entities: [(name: \"v\", vehicle: (type: \"box\")), \
        (name: \"v\", vehicle: (type: \"box\"), transform: (translation: (9, 0, 0)))])";
    for (text, expected) in [
        (
            cameras,
            format!(
                "warning: entities[2].children[0] (line 1, column 65): duplicate camera name \"cam\": entities[1] has \
                 it, too, and \"cam\" {reach}"
            ),
        ),
        (
            vehicle,
            format!(
                "warning: entities[1] (line 1, column 69): duplicate vehicle name \"v\": entities[0] has \
                 it, too, and \"chase v\" {reach}"
            ),
        ),
        (
            "(generators: [(place: grid(counts: (1, 1, 1)), random_scale: (3, 1))])",
            "1:62: generators[0].random_scale: expected (least, most), found (3, 1); write (1, 3)".to_owned(),
        ),
    ] {
        assert_eq!(folder.problems(text), [expected], "{text}");
    }
    // However many there are, so many lines and so many places of each.
    let crowd: String = (0..100)
        .map(|i| {
            format!(
                "(name: \"cam\", camera: ()), (name: \"v {}\", vehicle: (type: \"box\"), \
        transform: (translation: ({i}00, 0, 0))),",
                i % 25
            )
        })
        .collect();
    let found = folder.problems(&format!("(vehicle_types: [], entities: [{crowd}])"));
    assert_eq!(found.len(), 9, "{found:?}");
    assert_eq!(found[0].matches(" (line 1, column ").count(), 8, "{}", found[0]);
    let told = format!(" and 91 more: duplicate camera name \"cam\": entities[0] has it, too, and \"cam\" {reach}");
    assert!(found[0].starts_with("warning: entities[2] (line 1, column ") && found[0].ends_with(&told), "{}", found[0]);
    let three = [51, 101, 151].map(|i| format!("entities[{i}] (line 1"));
    assert!(three.iter().all(|place| found[1].contains(place)) && !found[1].contains("more"), "{}", found[1]);
    // The camera's, and of the vehicles' 25 seven: 18 are left.
    assert_eq!(found[8], "warning: 18 more names are shared by several cameras or vehicles");
    let other = "(entities: [(name: \"cam\", camera: ()), (name: \"cam\"), (name: \"a\", camera: ())])";
    assert_eq!(folder.problems(other), [] as [String; 0]);
    let camera = MODEL.replace("\"name\": \"lamp\",", "\"name\": \"lamp\", \"camera\": 0,");
    let perspective =
        "\"cameras\": [{\"type\": \"perspective\", \"perspective\": {\"yfov\": 1, \"znear\": 0.1}}],\n    \"meshes\"";
    folder.file("seen.gltf", camera.replace("\"meshes\"", perspective));
    let twice =
        "(meshes: {\"m\": model(file: \"seen.gltf\")}, entities: [(mesh: \"m\"), (mesh: \"m\"), (mesh: \"m\")])";
    let expected = "warning: duplicate camera name \"lamp\" in a model: the name selects the first camera only";
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
        "8:17: meshes[\"wall\"]: duplicate name \"wall\"",
        "8:34: meshes[\"wall\"].segments[0]: expected a whole number from 1 to 1024, found 0",
        "9:28: meshes[\"van\"].file: absent.glb: file: No such file or directory (os error 2)",
        "12:16: entities[0].mesh: unknown mesh \"wal\"; did you mean \"wall\"?",
        "12:33: entities[0].material: unknown material \"brik\"; did you mean \"brick\"?",
        "13:29: entities[1].light.range: expected a number from 0.001 to 10000000, found -2",
        "13:48: entities[1].light.outer_degrees: expected a number from 0.05 to 85, found 86",
        "13:65: entities[1].light.attenuation: expected at least one of the three to be more than 0",
        "14:17: entities[2].light: expected either cutoff_degrees (and exponent) or outer_degrees (and inner_degrees)",
        "15:21: entities[3].transform: expected one of rotation_degrees, quaternion and look_at",
        "15:60: entities[3].transform.look_at: expected a point other than the translation",
        "15:78: entities[3].transform.scale: expected a number from 0.00001 to 1000000, found 0",
        "16:33: entities[4].camera.far: expected a number of at least 1.001, found 0.5",
        "16:52: entities[4].spin.axis: expected a direction, found one of length 0",
        "16:70: entities[4].node: only allowed for entities in `attach`",
        "19:33: generators[0].place.region: expected min to be at most max on every axis, found [1.0, 0.0, 0.0] and [0.0, 0.0, 0.0]",
        "19:77: generators[0].place.count: expected a whole number from 1 to 4000000, found 0",
        "19:99: generators[0].random_scale[1]: expected a number from 0.00001 to 1000000, found inf",
    ];
    let folder = Folder::with_model();
    let problems = folder.problems(text);
    for (problem, expected) in problems.iter().zip(expected) {
        assert_eq!(problem, expected);
    }
    assert_eq!(problems.len(), expected.len());
    let error = scene::load(&Folder::with_model().file("a.ron", text), &mut Simulation::new()).expect_err("refused");
    assert!(error.to_string().ends_with("found 0 (and 22 more problems)"), "{error}");
    // Of points that are refused no length is told.
    let far = folder.problems("(routes: { \"r\": (points: [(0, 0, 0), (1e200, 0, 0)]) })");
    assert_eq!(far.len(), 1, "{far:?}");
    assert!(far[0].contains("routes[\"r\"].points[1][0]: expected a number from -10000000 to 10000000"), "{far:?}");
}

#[test]
fn hostile_files_are_refused_quickly() {
    let folder = Folder::with_model();
    let start = std::time::Instant::now();
    let crowd = "(place: grid(counts: (1000, 1000, 1000)))";
    let problems = folder.problems(&format!("(generators: [{crowd}])"));
    let most = "expected from 1 to 4000000 copies in all, found 1000000000";
    assert_eq!(problems, [format!("1:36: generators[0].place.counts: {most}")]);
    let crowds = "(place: grid(counts: (1000, 1, 1000))),".repeat(5);
    let too_many = "1:14: generators: expected at most 4000000 entities, found 5000000";
    assert_eq!(folder.problems(&format!("(generators: [{crowds}])")), [too_many]);
    let deep = format!("(entities: [{}{}])", "(children: [".repeat(100_000), "])".repeat(100_000));
    assert!(folder.problems(&deep)[0].ends_with("nested too deeply"), "{:?}", folder.problems(&deep));
    let name = "x".repeat(1 << 20);
    assert_eq!(folder.problems(&format!("(meshes: {{\"{name}\": cube()}}, entities: [(mesh: \"{name}y\")])")).len(), 1);
    let broken = folder.file("broken.ron", b"(\xff)");
    assert!(scene::check(&broken, Simulation::new)[0].to_string().ends_with("invalid UTF-8 at byte 1"));
    std::fs::create_dir(folder.at("folder.ron")).expect("made");
    assert!(scene::check(&folder.at("folder.ron"), Simulation::new)[0].to_string().ends_with(": expected a file"));
    assert!(
        scene::check(Path::new("absent.ron"), Simulation::new)[0].to_string().starts_with("absent.ron: No such file")
    );
    let other = scene::check(Path::new("scene.txt"), Simulation::new)[0].to_string();
    assert_eq!(other, "scene.txt: expected a scene (.ron) or a model (.gltf, .glb)");
    assert!(start.elapsed().as_secs() < 5);
}

#[test]
fn a_scene_that_fails_leaves_the_world_as_it_was() {
    let folder = Folder::with_model();
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
        let folder = Folder::with_model();
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
        let text = include_str!("../../assets/scenes/lights.ron");
        let end = |i: usize| (0..=i.min(text.len())).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0);
        let damaged = format!("{}{byte}{}", &text[..end(cut)], &text[end(cut + length)..]);
        let folder = Folder::with_model();
        scene::check(&folder.file("scene.ron", damaged), Simulation::new);
    }
}
