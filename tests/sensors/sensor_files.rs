//! `relief render --sensors`: the files of a data set, read by others' programs, resumed, and refused.

use crate::common::{self, assert_fails, assert_fails_to_check, files, prelude::*, relief, scene_folder, succeeds};

/// A car that turns on a road, seen by a camera with a lens of its own, and by a lidar that a post carries.
const SCENE: &str = r#"(
    materials: { "red": (base_factor: (0.8, 0.2, 0.2)), "grey": (base_factor: (0.5, 0.5, 0.5)) },
    meshes: { "box": cube(size: (1.8, 1.5, 4)), "ground": plane(size: (200, 200)) },
    entities: [
        (name: "ground", mesh: "ground", material: "grey", class: "road"),
        (name: "car", mesh: "box", material: "red", class: "car", transform: (translation: (0, 0.75, -12))),
        (light: directional(intensity: 1), transform: (rotation_degrees: (-50, 20, 0))),
        (
            name: "front", spin: (degrees_per_second: 9), transform: (translation: (0, 1.6, 0), rotation_degrees: (-3, 4, 1)),
            sensor: camera(
                size: (97, 64), lens: pinhole(fx: 90, fy: 80, cx: 45, cy: 30), every: 2,
                outputs: [color, linear, depth, range, normal, instance, part, class, panoptic, boxes, flow, flow_back],
            ),
        ),
        (
            name: "post", spin: (degrees_per_second: 30), transform: (rotation_degrees: (0, 180, 0), scale: (1, 1, 0.5)),
            children: [(name: "top", transform: (translation: (0, 1.8, 0), rotation_degrees: (0, 45, 0)), sensor: lidar(every: 6, range: (0.5, 80), sweep: true))],
        ),
    ],
)"#;

const ALL: [&str; 7] = ["render", "scene.ron", "--sensors", "all", "--format", "png,npy,npz,exr", "-o"];

#[test]
fn a_data_set_is_read_by_others_and_is_the_same_each_time() {
    let Some(folder) = with_gpu(|| scene_folder(SCENE)) else { return };
    succeeds(&[&ALL[..], &["whole", "--frames", "7"]].concat(), folder.path());
    let whole = folder.path().join("whole");
    let modules = ["cv2", "numpy", "OpenEXR"];
    common::python("sensor_files.py", &modules, &[whole.as_os_str()]);
    let expected = files(&whole);
    let run = |threads: &str| {
        succeeds(&[&ALL[..], &["again", "--frames", "7", "--threads", threads]].concat(), folder.path());
        let again = files(&folder.path().join("again"));
        fs::remove_dir_all(folder.path().join("again")).expect("removed");
        again
    };
    assert!(run("1") == expected && run("3") == expected);
    // A part of the run, by itself: what is captured then is what the whole run captures then.
    succeeds(&[&ALL[..], &["part", "--frames", "5..7"]].concat(), folder.path());
    let part = files(&folder.path().join("part"));
    assert!(part.len() > 15);
    let described = [Path::new("sensors.json"), Path::new("manifest.json")];
    for (name, bytes) in part.iter().filter(|(name, _)| !described.contains(&name.as_path())) {
        assert!(expected[name] == *bytes, "{}", name.display());
    }
}

#[test]
fn an_interrupted_run_is_resumed_by_what_is_missing() {
    let Some(folder) = with_gpu(|| scene_folder(SCENE)) else { return };
    let run = [&ALL[..], &["out", "--frames", "5", "--resume"]].concat();
    succeeds(&run, folder.path());
    let out = folder.path().join("out");
    let expected = files(&out);
    let [gone, cut, flow] =
        ["front/depth_00002.npy", "front/color_00004.png", "front/flow_00002.npy"].map(|name| out.join(name));
    let stays = out.join("front/color_00000.png");
    fs::remove_file(gone).expect("removed");
    fs::remove_file(flow).expect("removed");
    fs::write(&cut, &expected[Path::new("front/color_00004.png")][..100]).expect("written");
    let written_at = |path: &Path| fs::metadata(path).and_then(|found| found.modified()).expect("a time");
    let before = written_at(&stays);
    succeeds(&run, folder.path());
    assert!(files(&out) == expected);
    assert_eq!(written_at(&stays), before);
}

/// Boxes have velocities, from one capture to the next. So the capture before belongs to them, though it may be written
/// already, or before the first frame.
#[test]
fn boxes_alone_are_the_same_in_a_part_of_a_run_and_where_it_is_resumed() {
    let Some(_) = common::gpu() else { return };
    let scene = r#"(
        meshes: { "box": cube(size: (1.8, 1.5, 4)) },
        entities: [
            (spin: (degrees_per_second: 30), children: [
                (name: "car", mesh: "box", class: "car", instance: true, transform: (translation: (0, 0, -12))),
            ]),
            (name: "front", sensor: camera(size: (40, 30), every: 2, outputs: [boxes])),
        ],
    )"#;
    let folder = scene_folder(scene);
    let run = |out: &str, frames: &str, more: &[&str]| {
        let args = ["render", "scene.ron", "--sensors", "all", "--format", "npy", "-o", out, "--frames", frames];
        succeeds(&[&args[..], more].concat(), folder.path());
        files(&folder.path().join(out))
    };
    let whole = run("whole", "7", &[]);
    let boxes = |step: u64| PathBuf::from(format!("front/boxes_{step:05}.npy"));
    assert!(whole[&boxes(2)] != whole[&boxes(4)], "it moves");
    let part = run("part", "3..7", &[]);
    assert_eq!(part.keys().filter(|path| path.starts_with("front")).count(), 2);
    assert!([4, 6].iter().all(|&step| part[&boxes(step)] == whole[&boxes(step)]));
    fs::remove_file(folder.path().join("whole").join(boxes(4))).expect("removed");
    assert!(run("whole", "7", &["--resume"]) == whole);
}

#[test]
fn what_cannot_be_captured_is_refused_before_anything_is_written() {
    let Some(folder) = with_gpu(|| scene_folder(SCENE)) else { return };
    let refused = |args: &[&str], needles: &[&str]| {
        assert_fails(&relief(&[&["render", "scene.ron", "-o", "out"], args].concat(), folder.path()), 2, needles);
        assert!(!folder.path().join("out").exists(), "{args:?}");
    };
    refused(&["--sensors", "front,tip"], &["unknown sensor \"tip\"", "did you mean \"top\"?", "front, top"]);
    refused(&["--sensors", "front"], &["sensor \"front\"", "linear"]);
    refused(&["--sensors", "top", "--format", "exr"], &["sensor \"top\"", "points"]);
    refused(&["--sensors", "all", "--size", "64x64"], &["--size"]);
    refused(&["--sensors", "all", "--format", "jpg"], &["jpg"]);
    refused(&["--format", "npy"], &["--sensors"]);
    let plain = scene_folder("(entities: [(name: \"eye\", camera: ())])");
    let output = relief(&["render", "scene.ron", "-o", "out", "--sensors", "all"], plain.path());
    assert_fails(&output, 2, &["scene.ron: no entity has a sensor"]);
    let twice = "(entities: [(name: \"a\", sensor: camera()), (name: \"a\", sensor: camera())])";
    let output = relief(&["render", "scene.ron", "-o", "out", "--sensors", "all"], scene_folder(twice).path());
    assert_fails(&output, 2, &["duplicate sensor name \"a\""]);
}

#[test]
fn no_name_of_a_sensor_leads_elsewhere() {
    let Some(_) = common::gpu() else { return };
    let long = "n".repeat(300);
    for name in ["../evil", "..", "/evil", "a/../../evil", ".", "", "sensors.json", "a//b", "a:b", "tab\\tname", &long]
    {
        let scene = format!("(entities: [(name: \"{name}\", sensor: camera(size: (4, 4)))])");
        let folder = scene_folder(&scene);
        let output = relief(&["render", "scene.ron", "-o", "out", "--sensors", "all"], folder.path());
        assert_fails(&output, 2, &["scene.ron: invalid sensor name"]);
        assert!(!folder.path().join("out").exists() && !folder.path().join("evil").exists(), "{name}");
    }
    let alike = "(entities: [(name: \"eye\", sensor: camera()), (name: \"Eye\", sensor: camera())])";
    let output = relief(&["render", "scene.ron", "-o", "out", "--sensors", "all"], scene_folder(alike).path());
    assert_fails(&output, 2, &["differs from another in its case alone"]);
    let things =
        "(classes: { \"a\": (id: 70, thing: true) }, entities: [(name: \"eye\", sensor: camera(outputs: [panoptic]))])";
    let output = relief(&["render", "scene.ron", "-o", "out", "--sensors", "all"], scene_folder(things).path());
    assert_fails(&output, 2, &["sensor \"eye\"", "id 70"]);
}

#[test]
fn faults_of_sensors_name_their_place() {
    let cases = [
        ("sensor: camera(size: (0, 9))", "sensor.size[0]: expected pixels from 1 to 16384, found 0"),
        ("sensor: camera(lens: pinhole(fx: 0, fy: 1, cx: 0, cy: 0))", "sensor.lens.fx: expected pixels from 0.001"),
        ("sensor: camera(lens: field_of_view())", "sensor.lens: expected one of x_degrees and y_degrees"),
        ("sensor: camera(lens: field_of_view(y_degrees: 180))", "sensor.lens.y_degrees: expected a number from 0.01"),
        (
            "sensor: camera(lens: brown_conrady(fx: 300, fy: 300, cx: 320, cy: 240, k1: -1))",
            "sensor.lens: folds at a radius of 0.5774 times the distance, 115.5 pixels from the principal point",
        ),
        (
            "sensor: camera(lens: brown_conrady(fx: 1, fy: 1, cx: 0, cy: 0, p1: nan))",
            "sensor.lens.p1: expected a number",
        ),
        (
            "sensor: camera(lens: kannala_brandt(fx: 1, fy: 0, cx: 0, cy: 0))",
            "sensor.lens.fy: expected pixels from 0.001",
        ),
        (
            "sensor: camera(lens: kannala_brandt(fx: 1, fy: 1, cx: 0, cy: 0, largest_degrees: 181))",
            "sensor.lens.largest_degrees: expected a number from 0.01 to 180",
        ),
        ("sensor: camera(near: 2, far: 1)", "sensor.far: expected more than near"),
        ("sensor: camera(outputs: [])", "sensor.outputs: expected at least one output"),
        ("sensor: camera(outputs: [deph])", "deph"),
        ("sensor: camera(samples: 2)", "sensor.samples: expected 1 or 4, found 2"),
        ("sensor: camera(exposure: fixed(-1))", "sensor.exposure: expected a number from 0 to 1000000, found -1"),
        ("sensor: camera(exposure: metered(key: 0))", "sensor.exposure.key: expected a number above 0"),
        ("sensor: camera(noise: (bits: 10))", "sensor.noise.bits: expected 8 or 12, found 10"),
        ("sensor: camera(noise: (blak: 3))", "blak"),
        ("sensor: camera(every: 0)", "sensor.every: expected steps from 1"),
        ("sensor: camera(every: 3, phase: 3)", "sensor.phase: expected less than every, which is 3, found 3"),
        ("sensor: lidar(hz: 0)", "hz"),
        ("sensor: lidar(range: (5, 4))", "range"),
        ("sensor: camera(), class: \"caar\"", "class: unknown class \"caar\"; did you mean \"car\"?"),
    ];
    for (fields, expected) in cases {
        let folder = scene_folder(&format!("(entities: [(name: \"eye\", {fields})])"));
        assert_fails_to_check(folder.path(), expected);
    }
    let unnamed = scene_folder("(entities: [(sensor: camera())])");
    assert_fails_to_check(unnamed.path(), "sensor: expected the entity to have a name");
    let classes = scene_folder("(classes: { \"a\": (id: 1), \"b\": (id: 1), \"c\": (id: 0) })");
    assert_fails_to_check(classes.path(), "duplicate id 1: class \"a\" has it");
    assert_fails_to_check(classes.path(), "id: expected a whole number from 1 to 255, found 0");
}
