//! The files of these sensors: the same for any threads and parts of a run, and read by others.

use crate::common::{self, prelude::*, relief, scene_folder, succeeds, text};

/// A car that drives round and round, with all of these sensors, and noise.
const SCENE: &str = r#"(
    seed: 5,
    geo_origin: (latitude_degrees: 48.1, longitude_degrees: 11.5, altitude: 500),
    meshes: { "post": cube(size: (1, 1, 1)) },
    routes: {
        "ring": (points: [(10, 0, 0), (0, 0, 10), (-10, 0, 0), (0, 0, -10)], shape: spline, closed: true),
    },
    entities: [
        (name: "ego", vehicle: (type: "box", route: "ring"), children: [
            (name: "unit", transform: (translation: (0.1, 0.5, 1)), sensor: imu(every: 2, noise: (
                accelerometer_density: 0.02, gyroscope_density: 0.002, accelerometer_bias: (0.1, 0, 0),
            ))),
            (name: "mast", sensor: gnss(every: 3, phase: 1, noise: (horizontal_sigma: 2, velocity_sigma: 0.1))),
            (name: "lane", sensor: lane()),
            (name: "bumper", sensor: collision(margin: 0.5)),
        ]),
        (name: "still", vehicle: (type: "box", manual: true), transform: (translation: (12.2, 0, 0))),
    ],
)"#;

/// The files of the sensors of a run, by their paths.
fn rendered(folder: &Path, args: &[&str]) -> BTreeMap<PathBuf, Vec<u8>> {
    let whole = ["render", "scene.ron", "-o", "out", "--sensors", "all", "--format", "npy,npz"];
    succeeds(&[&whole[..], args].concat(), folder);
    let out = folder.join("out");
    let mut found = BTreeMap::new();
    for name in ["unit", "mast", "lane", "bumper"] {
        for entry in fs::read_dir(out.join("ego").join(name)).expect("a folder") {
            let path = entry.expect("a file").path();
            found.insert(path.strip_prefix(&out).expect("below").to_owned(), fs::read(&path).expect("read"));
        }
    }
    fs::remove_dir_all(out).expect("removed");
    found
}

#[test]
fn threads_parts_and_snapshots_of_a_run_make_the_bytes_of_the_run() {
    let Some(folder) = with_gpu(|| scene_folder(SCENE)) else { return };
    let expected = rendered(folder.path(), &["--frames", "20"]);
    assert_eq!(expected.len(), 2 * (10 + 7 + 20 + 20));
    assert!(rendered(folder.path(), &["--frames", "20", "--threads", "1"]) == expected);
    assert!(rendered(folder.path(), &["--frames", "20", "--threads", "2"]) == expected);
    let is_expected = |found: BTreeMap<PathBuf, Vec<u8>>, from: u64| {
        let is_from = |path: &Path| {
            let digits: String = path.to_string_lossy().chars().filter(char::is_ascii_digit).collect();
            digits.parse::<u64>().is_ok_and(|step| step >= from)
        };
        let compared: Vec<_> = found.iter().filter(|(path, _)| is_from(path)).collect();
        assert!(compared.len() > 20);
        compared.into_iter().for_each(|(path, bytes)| assert!(expected[path] == *bytes, "{}", path.display()));
    };
    is_expected(rendered(folder.path(), &["--frames", "9..20"]), 0);
    // After a snapshot, once two captures of the IMU are known: it is due after steps 10, 12 and 14.
    let saved = rendered(folder.path(), &["--frames", "10", "--save-snapshot", "at.snapshot"]);
    is_expected(saved, 0);
    let later = rendered(folder.path(), &["--frames", "10..20", "--from-snapshot", "at.snapshot"]);
    let unknown = Path::new("ego/unit/imu_00010.npy");
    assert_ne!(later[unknown], expected[unknown], "the poses before the snapshot are not known");
    is_expected(later, 14);
}

#[test]
fn others_read_the_files_and_the_log() {
    let Some(folder) = with_gpu(|| scene_folder(SCENE)) else { return };
    let log = ["render", "scene.ron", "-o", "run", "--sensors", "ego/unit,ego/mast", "--format", "npy,npz,mcap"];
    succeeds(&[&log[..], &["--frames", "9"]].concat(), folder.path());
    let modules = ["numpy", "mcap", "mcap_ros2"];
    let run = folder.path().join("run");
    let Some(output) = common::python("motion_sensors.py", &modules, &[run.as_os_str()]) else { return };
    // 5 captures of the IMU, of which the first two are not valid, and 3 of GNSS.
    assert_eq!(text(&output.stdout).trim(), "3 of imu, 3 of fix");
    let refused = ["render", "scene.ron", "-o", "no", "--sensors", "ego/lane", "--format", "mcap"];
    common::assert_fails(&relief(&refused, folder.path()), 2, &["sensor \"ego/lane\"", "lane"]);
    let refused = ["render", "scene.ron", "-o", "no", "--sensors", "ego/unit", "--format", "png,exr"];
    common::assert_fails(&relief(&refused, folder.path()), 2, &["sensor \"ego/unit\"", "imu"]);
}

#[test]
fn sensors_that_need_no_picture_need_no_adapter() {
    // A lidar sees a wall, whose texture it reads, and a camera is beside it.
    let wall = "(name: \"wall\", mesh: \"post\", material: \"red\", transform: (scale: (6, 6, 6))),";
    let scene = SCENE
        .replace("routes:", "materials: { \"red\": (base_map: \"red.png\") }, routes:")
        .replace("entities: [", &format!("entities: [ {wall}"))
        .replace(
            "children: [",
            "children: [ (name: \"top\", sensor: lidar(hz: 60, columns: 180)), (name: \"eye\", sensor: camera()),",
        );
    let folder = scene_folder(&scene);
    image::RgbImage::from_pixel(4, 4, image::Rgb([200, 10, 10])).save(folder.path().join("red.png")).expect("written");
    let render = |sensors: &str, out: &str, drivers: Option<&str>| {
        let args = ["render", "scene.ron", "-o", out, "--sensors", sensors, "--format", "npy", "--frames", "5"];
        let mut command = common::command(&args, folder.path());
        // Vulkan's loader finds no driver there.
        drivers.iter().for_each(|file| _ = command.env("VK_DRIVER_FILES", file));
        command.output().expect("the binary runs")
    };
    let none = Some("/nonexistent");
    let all = "ego/unit,ego/mast,ego/lane,ego/bumper,ego/top";
    let output = render(all, "without", none);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let without = common::files(&folder.path().join("without"));
    let points = Path::new("ego/top/points_00003.npy");
    assert!(without.keys().any(|path| path.ends_with(points)), "{:?}", without.keys());
    common::assert_fails(&render("ego/eye", "no", none), 3, &["no graphics adapter found"]);
    assert!(!folder.path().join("no").exists(), "nothing is written");
    if common::gpu().is_some() {
        assert!(render(all, "with", None).status.success());
        assert!(common::files(&folder.path().join("with")) == without, "the same bytes");
    }
}

#[test]
fn faults_of_these_sensors_name_their_place() {
    let earth = "geo_origin: (latitude_degrees: 48, longitude_degrees: 11),";
    let cases = [
        (earth, "imu(every: 0)", "sensor.every: expected steps from 1"),
        (
            earth,
            "imu(noise: (gyroscope_density: -1))",
            "sensor.noise.gyroscope_density: expected a number from 0 to 100, found -1",
        ),
        (
            earth,
            "imu(noise: (accelerometer_bias: (0, 1e9, 0)))",
            "noise.accelerometer_bias[1]: expected a number from -100 to 100",
        ),
        (earth, "imu(rate: 3)", "rate"),
        (
            earth,
            "gnss(noise: (vertical_sigma: -0.5))",
            "noise.vertical_sigma: expected a number from 0 to 10000, found -0.5",
        ),
        (earth, "gnss(every: 2, phase: 2)", "sensor.phase: expected less than every"),
        ("", "gnss()", "sensor: expected the scene to have a geo_origin"),
        (earth, "collision(margin: -1)", "margin: expected a number from 0 to 10, found -1"),
        (earth, "lane(reach: 0)", "reach: expected a number above 0, at most 15, found 0"),
        ("geo_origin: (latitude_degrees: 91, longitude_degrees: 0),", "imu()", "geo_origin.latitude_degrees: expected"),
        ("geo_origin: (latitude_degrees: 1),", "imu()", "longitude_degrees"),
        (
            "geo_origin: (latitude_degrees: 1, longitude_degrees: 1, at: (0, 1e9, 0)),",
            "imu()",
            "geo_origin.at[1]: expected a number from",
        ),
    ];
    for (of_scene, sensor, expected) in cases {
        let folder = scene_folder(&format!("({of_scene} entities: [(name: \"eye\", sensor: {sensor})])"));
        common::assert_fails_to_check(folder.path(), expected);
    }
    succeeds(&["check", "scene.ron"], scene_folder(SCENE).path());
}
