//! Rigs: entities from files of their own, below those that take them.

use super::*;
use relief::sense::sensor_names;

const RIG: &str = r#"[
    (name: "front", transform: (translation: (0, 1, 2)), sensor: camera(size: (8, 8))),
    (name: "mast", children: [(name: "top", transform: (translation: (0, 3, 0)), sensor: lidar())]),
]"#;

#[test]
fn each_that_takes_a_rig_has_its_sensors_below_it() {
    let folder = Folder::with_model();
    std::fs::create_dir(folder.at("rigs")).expect("made");
    let path = folder.file("rigs/a.rig.ron", RIG);
    let (mut simulation, scene) = folder.load(
        r#"(entities: [
            (name: "a", rig: "rigs/a.rig.ron", transform: (translation: (10, 0, 0))),
            (name: "b", children: [(name: "arm", rig: "rigs/a.rig.ron", transform: (translation: (20, 0, 0)))]),
            (name: "part", instance: false, rig: "rigs/a.rig.ron"),
        ], generators: [(
            name: "copy", place: grid(counts: (2, 1, 1)), entity: (rig: "rigs/a.rig.ron"),
        )])"#,
    );
    assert!(scene.warnings.is_empty() && scene.files.contains(&path), "{:?}", scene.files);
    let world = &mut simulation.world;
    let sensors = sensor_names(world);
    let mut names: Vec<&str> = sensors.iter().map(|(name, _)| name.as_str()).collect();
    names.sort_unstable();
    let expected = ["a", "arm", "copy 0", "copy 1"].map(|of| [format!("{of}/front"), format!("{of}/top")]).concat();
    assert_eq!(names[..8], expected);
    // What is no thing by itself gives no name.
    assert_eq!(names[8..], ["front", "top"]);
    let at = |name: &str| {
        let entity = sensors.iter().find(|(known, _)| known == name).map(|(_, entity)| *entity).expect("there");
        assert!(world.get::<Sensor>(entity).is_some());
        world.get::<GlobalTransform>(entity).expect("placed").translation()
    };
    assert_eq!([at("a/front"), at("arm/top")], [Vec3::new(10.0, 1.0, 2.0), Vec3::new(20.0, 3.0, 0.0)]);
    let (a, part) = (named(world, "a"), named(world, "part"));
    assert!(world.get::<Instance>(a).is_some() && world.get::<Instance>(part).is_none());
}

/// Problems of a scene with such a rig.
fn problems_with(rig: &str) -> Vec<String> {
    let folder = Folder::with_model();
    folder.file("a.rig.ron", rig);
    folder.problems("(entities: [\n    (name: \"a\", rig: \"a.rig.ron\"),\n    (rig: \"a.rig.ron\"),\n])")
}

/// Faults of rigs.
const FAULTS: &str = r##"
    [
    (name: "x", sensor: camera(size: (0, 9)))]
    → a.rig.ron:2:35: [0].sensor.size[0]: expected pixels from 1
    [
    (name: "x", sensor: camera(siz: (9, 9)))]
    → a.rig.ron:2:28: unknown field "siz"; did you mean "size"?
    [(),
    (nam: "x")]
    → a.rig.ron:2:2: unknown field "nam"; did you mean "name"?
    [(sensor: lidar())] → a.rig.ron:1:11: [0].sensor: expected the entity to have a name
    [(children: [(sensor: lidar())])] → a.rig.ron:1:23: [0].children[0].sensor: expected the entity to have a name
    [(rig: "b.rig.ron")] → a.rig.ron:1:8: [0].rig: not allowed within a rig
    [(children: [(rig: "b.rig.ron")])] → a.rig.ron:1:20: [0].children[0].rig: not allowed within a rig
    [(camera: ())] → a.rig.ron:1:11: [0].camera: not allowed within a rig
    [(vehicle: (type: "car"))]
    → a.rig.ron:1:12: [0].vehicle: not allowed within a rig: vehicles move by themselves
    [(mesh: "box")] → a.rig.ron:1:9: [0].mesh: unknown mesh "box"; none are defined
    [(class: "caar")] → a.rig.ron:1:10: [0].class: unknown class "caar"; did you mean "car"?
    (name: "x") → a.rig.ron:1:1: expected a list in brackets
    [] → a.rig.ron: expected at least one entity
    [(name: "x" → a.rig.ron:1:
"##;

#[test]
fn faults_of_a_rig_are_told_once_with_its_own_place() {
    for (rig, expected) in cases(FAULTS) {
        let problems = problems_with(&rig);
        assert_eq!(problems.len(), 1, "{rig}: {problems:?}");
        let expected = format!("2:22: entities[0].rig: {expected}");
        assert!(problems[0].starts_with(&expected), "{}\nis not {expected}", problems[0]);
    }
    let missing = Folder::with_model().problems("(entities: [(rig: \"b.rig.ron\")])");
    assert_eq!(missing.len(), 1);
    assert!(missing[0].starts_with("1:19: entities[0].rig: b.rig.ron: "), "{missing:?}");
}

#[test]
fn a_rig_is_checked_by_itself_but_for_what_only_a_scene_knows() {
    let folder = Folder::with_model();
    let check = |rig: &str| {
        let problems = scene::check(&folder.file("a.rig.ron", rig), Simulation::new);
        problems.iter().map(|problem| format!("{:?} {}", problem.line_column, problem.message)).collect::<Vec<_>>()
    };
    assert_eq!(check(RIG), Vec::<String>::new());
    assert_eq!(check("[(mesh: \"box\", material: \"red\", class: \"weed\")]"), Vec::<String>::new());
    let faults = check("[(sensor: camera(samples: 3)),\n(rig: \"b\")]");
    assert_eq!(faults.len(), 3, "{faults:?}");
    assert!(faults[2].starts_with("Some((2, 7)) not allowed within a rig"), "{faults:?}");
    // Nor is it a scene.
    let error = scene::load(&folder.file("a.rig.ron", RIG), &mut Simulation::new()).expect_err("no scene");
    assert!(error.to_string().ends_with("expected a scene, found a rig, which entities of scenes take by `rig`"));
}

#[test]
fn the_rigs_that_come_with_the_project_are_sound_and_taken() {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    let mut rigs: Vec<PathBuf> =
        std::fs::read_dir(assets.join("rigs")).expect("rigs").map(|entry| entry.expect("a rig").path()).collect();
    rigs.sort();
    for rig in &rigs {
        assert_eq!(scene::check(rig, Simulation::new), Vec::new());
    }
    let mut taken = Vec::new();
    for name in ["sensors.ron", "robot.ron"] {
        let path = assets.join("scenes").join(name);
        let scene = scene::load(&path, &mut Simulation::new()).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(scene.warnings, Vec::<String>::new());
        let files = scene.files.iter().filter_map(|file| file.canonicalize().ok());
        taken.extend(files.filter(|file| rigs.iter().any(|rig| rig.canonicalize().is_ok_and(|rig| rig == *file))));
    }
    assert_eq!((taken.len(), rigs.len()), (3, 3));
}
