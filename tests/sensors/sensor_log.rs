//! `relief render --sensors --format mcap` as others read it, and what it refuses.

use crate::common::{self, prelude::*};
use relief::data::{DatasetOptions, FileFormat, SensorJob, render_sensors};
use relief::frames::{FrameError, Frames, RunJob};

/// A floor at height 0 (road) and a wall whose face is at z = 8 (wall), a box on the floor (car); a rig that turns by
/// ten degrees a step, with a tilted camera, a lidar that is due every other step, and one that sweeps; a camera with a
/// parallel projection that looks down; and two whose lenses bend.
const SCENE: &str = r#"(
    materials: { "grey": (base_factor: (0.5, 0.5, 0.5)) },
    meshes: { "floor": plane(size: (60, 60)), "wall": cube(size: (40, 6, 0.5)), "box": cube(size: (1, 1.5, 2)) },
    entities: [
        (name: "sun", transform: (rotation_degrees: (-60, 20, 0)), light: directional(intensity: 1)),
        (name: "floor", mesh: "floor", material: "grey", class: "road"),
        (name: "wall", mesh: "wall", material: "grey", class: "wall", transform: (translation: (0, 3, 8.25))),
        (name: "box", mesh: "box", material: "grey", class: "car", instance: true,
         transform: (translation: (1, 0.75, 5), rotation_degrees: (0, 25, 0))),
        (name: "ego", instance: true, transform: (translation: (0.25, 0, -1)),
         spin: (axis: (0, 1, 0), degrees_per_second: 600), children: [
            (name: "front", transform: (translation: (0.5, 1.5, 0.25), rotation_degrees: (-8, 180, 3)),
             sensor: camera(size: (64, 40), lens: pinhole(fx: 50, fy: 48, cx: 30.5, cy: 21), samples: 1,
                            outputs: [color, depth, class, instance, boxes])),
            (name: "top", transform: (translation: (0, 2, 0), rotation_degrees: (2, -20, 1)),
             sensor: lidar(beams: vlp16, hz: 60, columns: 360, every: 2, phase: 1)),
            (name: "swept", transform: (translation: (0, 2, 0), rotation_degrees: (2, -20, 1)),
             sensor: lidar(beams: list([(elevation_degrees: -21), (elevation_degrees: -13), (elevation_degrees: -9),
                                        (elevation_degrees: -5), (elevation_degrees: -1), (elevation_degrees: 5)]),
                           hz: 50, columns: 361, every: 2, phase: 1, sweep: true)),
        ]),
        (name: "2nd eye", transform: (translation: (3, 4, 0), rotation_degrees: (-90, 0, 0)),
         sensor: camera(size: (9, 7), lens: orthographic(half_height: 2), samples: 1,
                        outputs: [depth], phase: 2, every: 3)),
        (name: "bent", sensor: camera(size: (9, 7), samples: 1, outputs: [depth], phase: 2, every: 3,
                                      lens: brown_conrady(fx: 9, fy: 8, cx: 4, cy: 3, k1: 0.1, k2: 0.02, p1: 0.001,
                                                          p2: -0.002, k3: 0.003, k4: 0.04, k5: 0.005, k6: 0.006))),
        (name: "round", sensor: camera(size: (9, 7), samples: 1, outputs: [depth], phase: 2, every: 3,
                                       lens: kannala_brandt(fx: 3, fy: 2, cx: 4, cy: 3, k1: 0.1, k2: 0.02, k3: 0.003, k4: 0.004))),
    ],
)"#;

fn job(scene: &str, home: &Path, folder: &str, formats: &[FileFormat]) -> SensorJob {
    let path = home.join("scene.ron");
    fs::write(&path, scene).expect("written");
    SensorJob {
        run: RunJob { frames: Frames::Range(0..5), ..RunJob::new(path) },
        dataset: DatasetOptions { formats: formats.to_vec(), ..DatasetOptions::new(home.join(folder)) },
    }
}

fn render(job: &SensorJob) -> Vec<PathBuf> {
    render_sensors(job, |_, _| ()).expect("rendered")
}

#[test]
fn others_read_the_log_of_a_run() {
    let Some(home) = with_gpu(Folder::new) else { return };
    let job = job(SCENE, home.path(), "run", &[FileFormat::NPY, FileFormat::MCAP]);
    let written = render(&job);
    assert!(written.contains(&job.dataset.folder.join("sensors.mcap")));
    let manifest = fs::read_to_string(job.dataset.folder.join("manifest.json")).expect("a manifest");
    let hash = blake3::hash(&fs::read(job.dataset.folder.join("sensors.mcap")).expect("a log"));
    assert!(manifest.contains(&format!("\"sensors.mcap\": \"{hash}\"")), "{manifest}");
    let expected = json!({
        // Sensors' names as they are in topics.
        "frames": { "ego/front": "ego/front", "ego/top": "ego/top", "ego/swept": "ego/swept", "2nd eye": "_2nd_eye", "bent": "bent", "round": "round" },
        "messages": {
            "/clock": [0, 1, 2, 3, 4],
            "/tf": [0, 1, 2, 3, 4],
            "/ego/front/image_raw": [0, 1, 2, 3, 4],
            "/ego/front/depth": [0, 1, 2, 3, 4],
            "/ego/front/class": [0, 1, 2, 3, 4],
            "/ego/front/instance": [0, 1, 2, 3, 4],
            "/ego/front/camera_info": [0, 1, 2, 3, 4],
            "/ego/front/boxes": [0, 1, 2, 3, 4],
            "/ego/front/objects": [0, 1, 2, 3, 4],
            "/ego/top/points": [1, 3],
            "/ego/swept/points": [1, 3],
            "/_2nd_eye/depth": [2],
            "/bent/depth": [2],
            "/bent/camera_info": [2],
            "/round/depth": [2],
            "/round/camera_info": [2],
        },
        "distortions": {
            "ego/front": ["plumb_bob", [0.0, 0.0, 0.0, 0.0, 0.0]],
            "bent": ["rational_polynomial", [0.1, 0.02, 0.001, -0.002, 0.003, 0.04, 0.005, 0.006]],
            "round": ["equidistant", [0.1, 0.02, 0.003, 0.004]],
        },
        // Class, and the plane that it lies in: in the world of ROS, points p with normal · p = offset.
        "planes": [[7, [0, 0, 1], 0], [12, [1, 0, 0], 8]],
    });
    fs::write(home.path().join("expected.json"), expected.to_string()).expect("written");
    let modules = ["numpy", "mcap", "mcap_ros2"];
    let Some(output) = common::python("sensor_log.py", &modules, &[home.path().as_os_str()]) else { return };
    // So that nothing passes for want of being read.
    assert_eq!(common::text(&output.stdout).trim(), "54 messages");
}

#[test]
fn a_run_has_the_same_log_twice_and_leaves_no_other_file_of_it() {
    let Some(home) = with_gpu(Folder::new) else { return };
    let mut job = job(SCENE, home.path(), "run", &[FileFormat::MCAP]);
    render(&job);
    let log = |folder: &Path| fs::read(folder.join("sensors.mcap")).expect("a log");
    let first = log(&job.dataset.folder);
    // What is there is written anew where a run is resumed.
    fs::write(job.dataset.folder.join("sensors.mcap"), "another").expect("written");
    job.dataset.resume = true;
    render(&job);
    assert!(log(&job.dataset.folder) == first, "resumed");
    let mut names: Vec<_> =
        fs::read_dir(&job.dataset.folder).expect("a folder").map(|entry| entry.expect("a file").file_name()).collect();
    names.sort();
    assert_eq!(names, ["manifest.json", "sensors.json", "sensors.mcap"]);
    job.dataset.formats.push(FileFormat::NPY);
    job.dataset.folder = home.path().join("other");
    for arrays in ["that are written, too", "that are there"] {
        render(&job);
        assert!(log(&job.dataset.folder) == first, "beside arrays {arrays}");
    }
}

#[test]
fn what_a_log_has_no_place_for_is_refused() {
    let Some(home) = with_gpu(Folder::new) else { return };
    let eye = |name: &str, outputs: &str| {
        format!("(name: \"{name}\", sensor: camera(size: (4, 4), samples: 1, outputs: [{outputs}]))")
    };
    let refusal = |formats: &[FileFormat], eyes: &[String]| {
        let job = job(&format!("(entities: [{}])", eyes.join(", ")), home.path(), "run", formats);
        let error = render_sensors(&job, |_, _| ()).expect_err("refused");
        assert!(!job.dataset.folder.exists());
        error
    };
    let eyes = [eye("a", "color, linear, depth, range, normal, instance, part, class, panoptic")];
    let error = refusal(&[FileFormat::MCAP], &eyes);
    let FrameError::NoFormat { outputs, .. } = error else { panic!("{error}") };
    assert_eq!(outputs, "linear, range, normal, part, panoptic");
    let error = refusal(&[FileFormat::NPY, FileFormat::MCAP], &[eye("a b", "depth"), eye("a_b", "depth")]);
    assert!(error.to_string().contains("its name in MCAP, \"a_b\", is that of sensor \"a b\" already"), "{error}");
}
