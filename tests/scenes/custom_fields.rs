//! Fields that a program adds to scene files: what they put into the world, and what is said of them.

use super::*;
use relief::sense::{Measuring, ReadingSensor, Record, add_sensor_kind};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use systems::describe::Described;
use systems::run::{snapshot, state_hash};

#[derive(Component, Deserialize, Clone, PartialEq, Debug)]
#[serde(deny_unknown_fields)]
struct Buoy {
    metres: f32,
    #[serde(default)]
    kind: Kind,
    #[serde(default)]
    marks: Vec<[f32; 3]>,
    label: Option<String>,
    #[serde(default)]
    count: u32,
}

#[derive(Deserialize, Clone, Copy, PartialEq, Debug, Default)]
#[serde(rename_all = "snake_case")]
enum Kind {
    #[default]
    Plain,
    Lit {
        seconds: f32,
    },
}

impl EntityField for Buoy {
    const NAME: &'static str = "buoy";

    fn check(&self) -> Result<(), String> {
        let is_valid = (0.0..=10.0).contains(&self.metres);
        is_valid.then_some(()).ok_or_else(|| format!("expected metres from 0 to 10, found {}", self.metres))
    }

    fn insert(&self, entity: &mut EntityWorldMut) {
        // What the other fields give is there.
        assert!(entity.contains::<Transform>());
        entity.insert(self.clone());
    }
}

#[derive(Resource, Deserialize, Clone, PartialEq, Debug)]
struct Tide(f32);

impl SceneField for Tide {
    const NAME: &'static str = "tide";

    fn check(&self) -> Result<(), String> {
        if self.0.is_finite() { Ok(()) } else { Err("expected a finite number".into()) }
    }

    fn insert(&self, world: &mut World) {
        assert_eq!(world.query::<&Transform>().iter(world).count(), 0, "before all entities");
        world.insert_resource(self.clone());
    }
}

fn simulation() -> Simulation {
    let mut simulation = Simulation::new();
    let mut fields = SceneFields::default();
    fields.register::<Buoy>();
    fields.register_for_scene::<Tide>();
    simulation.world.insert_resource(fields);
    simulation
}

fn buoy(metres: f32) -> Buoy {
    Buoy { metres, kind: Kind::Plain, marks: Vec::new(), label: None, count: 0 }
}

#[test]
fn values_are_on_the_entities_of_the_file() {
    let text = r#"(
        tide: 2.5,
        meshes: { "model": model(file: "model.gltf") },
        entities: [
            (name: "a", buoy: /* of ( two */ Buoy(metres: 1, label: "l)\"", count: 3), children: [
                (name: "below", buoy: (metres: 2, kind: lit(seconds: 0.5), marks: [(1, 2, 3), (4, 5, 6)])),
            ]),
            (name: "m", mesh: "model", attach: [(node: "lamp", name: "on it", buoy: (metres: 3))]),
            (name: "none"),
        ],
        generators: [(name: "g", place: grid(counts: (3, 1, 1)), entity: (buoy: (metres: 4, label: r"raw")))],
    )"#;
    let folder = Folder::with_model();
    let path = folder.file("scene.ron", text);
    let mut simulation = simulation();
    scene::load(&path, &mut simulation).unwrap_or_else(|e| panic!("{e}"));
    let world = &mut simulation.world;
    assert_eq!(world.resource::<Tide>(), &Tide(2.5));
    let of = |world: &mut World, name: &str| {
        let entity = named(world, name);
        world.get::<Buoy>(entity).cloned()
    };
    assert_eq!(of(world, "a"), Some(Buoy { label: Some("l)\"".into()), count: 3, ..buoy(1.0) }));
    let marks = vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
    assert_eq!(of(world, "below"), Some(Buoy { kind: Kind::Lit { seconds: 0.5 }, marks, ..buoy(2.0) }));
    assert_eq!(of(world, "on it"), Some(buoy(3.0)));
    assert_eq!(of(world, "none"), None);
    for copy in ["g 0", "g 1", "g 2"] {
        assert_eq!(of(world, copy), Some(Buoy { label: Some("raw".into()), ..buoy(4.0) }), "{copy}");
    }
    assert_eq!(all::<Buoy>(world).len(), 6);
    assert_eq!(problems(&folder, text), Vec::<String>::new());
}

/// Without the path.
fn problems(folder: &Folder, text: &str) -> Vec<String> {
    folder.problems_in(simulation, "scene.ron", text)
}

/// Faults of fields of a program.
const FAULTS: &str = r##"
    (entities: [(buoy: (metres: "big"))]) → 1:29: entities[0].buoy.metres: expected a number, found `"big"`
    (entities: [
      (),
      (children: [(buoy: (
        metres: 1, count: 2.5,
      ))]),
    ])
    → 4:23: entities[1].children[0].buoy.count: expected a whole number, found `2.5`
    (entities: [(buoy: (metres: 1, count: -1))]) → 1:39: entities[0].buoy.count: expected a whole number
    (entities: [(buoy: 5)]) → 1:20: entities[0].buoy: expected fields in parentheses, ( … ), found `5`
    (entities: [(buoy: (meters: 1))]) → 1:21: unknown field "meters"; did you mean "metres"?
    (entities: [(buoy: (count: 1))]) → missing field "metres"
    (entities: [(buoy: (metres: 1, kind: lid(seconds: 1)))]) → 1:38: unknown variant "lid"; did you mean "lit"?
    (entities: [(buoy: (metres: 1, marks: [(1, 2)]))]) → entities[0].buoy.marks[0]: expected 3 values, found 2
    (entities: [(buoy: (metres: 1,5))])
    → 1:29: entities[0].buoy.metres: found `1,5`; use a decimal point, not a comma: 1.5
    (entities: [(bouy: (metres: 1))]) → 1:14: unknown field "bouy"; did you mean "buoy"?
    (entities: [(name: "x", trasform: ())]) → 1:25: unknown field "trasform"; did you mean "transform"?
    (entities: [(r#bouy: 1)]) → 1:14: unknown field "bouy"; did you mean "buoy"?
    (entities: [(buoy: (metres: 1), name: "x", buoy: (metres: 1))]) → 1:44: duplicate field "buoy"
    (entities: [(name: "x", name: "y")]) → duplicate field "name"
    (entities: [(buoy: (metres: 11))]) → 1:20: entities[0].buoy: expected metres from 0 to 10, found 11
    (generators: [(place: grid(counts: (1, 1, 1)), entity: (buoy: // (
     (metres: -1)))])
    → 2:2: generators[0].entity.buoy: expected metres from 0 to 10, found -1
    (tide: high) → 1:8: tide: expected a number, found `high`
    (tide: inf) → 1:8: tide: expected a finite number
    (tidal: 1) → 1:2: unknown field "tidal"; did you mean "tide"?
    (buoy: (metres: 1)) → 1:2: unknown field "buoy"
"##;

#[test]
fn faults_are_told_with_place_and_nearest_name() {
    let folder = Folder::with_model();
    for (text, expected) in cases(FAULTS) {
        let problems = problems(&folder, &text);
        assert!(problems.len() == 1 && problems[0].contains(&expected), "{text}: {problems:?}");
    }
    let without = folder.problems("(entities: [(buoy: (metres: 1))])");
    assert!(without[0].starts_with("1:14: unknown field \"buoy\""), "{without:?}");
}

#[test]
fn faults_of_all_fields_are_told_together_and_nothing_is_spawned() {
    let text = "(entities: [(buoy: (metres: 11)), (material: \"none\"), (buoy: (metres: 12))])";
    let folder = Folder::with_model();
    let problems = problems(&folder, text);
    assert_eq!(problems.len(), 3, "{problems:?}");
    assert!(problems[0].contains("found 11") && problems[2].contains("found 12"), "{problems:?}");
    let mut simulation = simulation();
    scene::load(&folder.file("scene.ron", text), &mut simulation).expect_err("refused");
    assert_eq!(all::<Buoy>(&mut simulation.world), []);
}

/// Values that are no number, in a field of the format and in one of the program, at the same column.
#[test]
fn what_is_said_of_a_value_is_what_is_said_in_the_fields_of_the_format() {
    let folder = Folder::with_model();
    let both = |value: &str| {
        let built_in = problems(&folder, &format!("(entities: [(camera: ( near : {value}))])"));
        let own = problems(&folder, &format!("(entities: [(buoy:   ( metres:{value}))])"));
        (own.iter().map(|text| text.replace("buoy.metres", "camera.near")).collect::<Vec<_>>(), built_in)
    };
    let values = [
        "\"a\"",
        "\"1.5\"",
        "1,5",
        "1,5,7",
        "tru",
        "true",
        "[1]",
        "(1)",
        "(1, 2)",
        "()",
        "{}",
        "{\"a\": 1}",
        "1.5 m",
        "1.5m",
        "90°",
        "1/2",
        "1'000",
        "'a'",
        "null",
        "None",
        "1 2",
        "1.2.3",
        "srgb(\"#fff\")",
        "-inf-",
        "1..2",
        "1_0_",
        "/* 1",
        "100%",
    ];
    for value in values {
        let (own, built_in) = both(value);
        assert_eq!(own, built_in, "{value}");
    }
    // What is no value at all, whatever is wanted.
    for value in ["“1”", "−1", "- 1", "", ",", "#1", "*", "'ab'", "]", "}"] {
        let (own, built_in) = both(value);
        let place = |problems: &[String]| problems[0].split(": expected ").next().map(str::to_owned);
        assert!(own.len() == 1 && place(&own) == place(&built_in), "{value}: {own:?}, not {built_in:?}");
    }
}

#[test]
#[should_panic(expected = "buoy is a field already")]
fn a_field_is_registered_once() {
    let mut fields = SceneFields::default();
    fields.register::<Buoy>();
    fields.register::<Buoy>();
}

macro_rules! named {
    ($type:ident, $name:literal) => {
        #[derive(Deserialize)]
        struct $type;
        impl EntityField for $type {
            const NAME: &'static str = $name;
            fn insert(&self, _: &mut EntityWorldMut) {}
        }
    };
}
named!(Taken, "transform");
named!(Spaced, "two words");

#[test]
#[should_panic(expected = "transform is a field already, or not an identifier")]
fn a_field_of_the_format_is_not_registered_again() {
    SceneFields::default().register::<Taken>();
}

#[test]
#[should_panic(expected = "two words is a field already, or not an identifier")]
fn a_name_of_a_field_is_an_identifier() {
    SceneFields::default().register::<Spaced>();
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Whatever stands around it.
    #[test]
    fn a_fault_is_told_with_its_line_and_column(
        before in 0usize..4, depth in 0usize..4, after in 0usize..3,
        blanks in proptest::collection::vec(0usize..7, 40),
    ) {
        const BLANKS: [&str; 7] = ["", " ", "\n", "\t", "/* ( ä \" */", "// [x: (\n", "\n\n   "];
        let mut blank = blanks.iter().map(|&i| BLANKS[i]).cycle();
        let entity = "§(§buoy§:§(§metres§:§1§)§,§name§:§\"(é\"§,§)§,";
        let open = "§(§children§:§[".repeat(depth);
        let close = "§]§)".repeat(depth);
        let bad = format!("{open}§(§name§:§\"é\"§,§buoy§:§(§kind§:§plain§,§metres§:§\"bad\"§)§)§{close}§,");
        let text = format!("§(§entities§:§[{}{bad}{}§]§)§", entity.repeat(before), entity.repeat(after));
        let text: String =
            text.split('§').flat_map(|part| [part, blank.next().unwrap_or_default()]).collect();
        let offset = text.find("\"bad\"").expect("there");
        let line = 1 + text[..offset].matches('\n').count();
        let column = 1 + text[..offset].chars().rev().take_while(|&c| c != '\n').count();
        let below = ".children[0]".repeat(depth);
        let expected =
            format!("{line}:{column}: entities[{before}]{below}.buoy.metres: expected a number, found `\"bad\"`");
        prop_assert_eq!(problems(&Folder::with_model(), &text), [expected]);
    }
}

/// A kind of sensor of a program.
#[derive(Component, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Sonar {
    /// Distance that it reaches.
    #[schemars(range(min = 0.0, max = 100.0))]
    reach: f32,
}

/// Depth of water.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize, JsonSchema)]
struct Depth {
    #[schemars(extend("unit" = "metres"))]
    metres: f64,
}

impl Described for Sonar {}
impl Described for Depth {}
impl Record for Depth {}

impl ReadingSensor for Sonar {
    const KIND: &'static str = "sonar";
    type Record = Depth;

    fn measure(&self, at: &mut Measuring<'_>) -> Vec<Depth> {
        vec![Depth { metres: at.pose.translation.y.min(self.reach.into()) }]
    }
}

fn with_sonar() -> Simulation {
    let mut simulation = Simulation::new();
    add_sensor_kind::<Sonar>(&mut simulation.world);
    simulation
}

#[test]
fn sensors_of_a_program_are_checked_as_others_are() {
    let folder = Folder::with_model();
    let problems = |text: &str| folder.problems_in(with_sonar, "scene.ron", text);
    let twice = r#"(entities: [(name: "a", sonar: (reach: 1)), (name: "a", sensor: lane())])"#;
    for (text, expected) in [
        (r#"(entities: [(sonar: (reach: 1))])"#, "entities[0].sonar: expected the entity to have a name"),
        (r#"(entities: [(name: "a", sensor: lane(), sonar: (reach: 1))])"#, "entities[0].sonar: expected one sensor"),
        (
            r#"(entities: [(name: "a", sonar: (reach: 101))])"#,
            "sonar: reach: expected a number from 0 to 100, found 101",
        ),
        (r#"(entities: [(name: "a", sonar: (reach: 1, every: 2, phase: 2))])"#, "phase: expected less than every"),
        (r#"(entities: [(name: "a", sonar: (reach: 1, hz: 2))])"#, "unknown field \"hz\""),
        (twice, "entities[1].sensor: duplicate sensor name \"a\": entities[0].sonar has it, too"),
        (
            r#"(entities: [(name: "a", sensor: custom(name: "sonar", has_messages: false))])"#,
            "expected a kind of the library",
        ),
    ] {
        let found = problems(text);
        assert!(found.len() == 1 && found[0].contains(expected), "{text}: {found:?}");
    }
}

#[test]
fn settings_of_a_program_s_sensor_are_state() {
    let folder = Folder::with_model();
    let text = r#"(entities: [(name: "deep", transform: (translation: (0, 7, 0)), sonar: (reach: 5, every: 2))])"#;
    let path = folder.file("scene.ron", text);
    let load = || {
        let mut simulation = with_sonar();
        scene::load(&path, &mut simulation).expect("a scene");
        simulation
    };
    // No picture is asked for: no device is opened.
    let mut suite = SensorSuite::default();
    let mut metres = |simulation: &mut Simulation| {
        let capture = suite.capture(simulation).expect("captured");
        capture.get("deep").map(|sensor| sensor.reading::<Depth>().expect("a depth").metres)
    };
    let mut simulation = load();
    assert_eq!(metres(&mut simulation), Some(5.0));
    let before = state_hash::hash(&mut simulation.world);
    simulation.world.query::<&mut Sonar>().single_mut(&mut simulation.world).expect("one").reach = 3.0;
    assert_ne!(state_hash::hash(&mut simulation.world), before);
    let saved = snapshot::save(&mut simulation.world);
    let mut other = load();
    snapshot::restore(&mut other.world, &saved).expect("the same scene");
    assert_eq!(metres(&mut other), Some(3.0));
    other.step();
    assert_eq!(metres(&mut other), None, "it is not due");
    simulation.world.query::<&mut Sonar>().single_mut(&mut simulation.world).expect("one").reach = f32::NAN;
    let unsound = snapshot::save(&mut simulation.world);
    assert!(snapshot::restore(&mut load().world, &unsound).is_err(), "settings are checked");
    // What a program takes away is not measured any more.
    let sensor = simulation.world.query_filtered::<Entity, With<Sonar>>().single(&simulation.world).expect("one");
    simulation.world.entity_mut(sensor).remove::<Sonar>();
    assert_eq!(metres(&mut simulation), None);
}
