//! `relief render --sensors --format coco,kitti,nuscenes,video` as others read it, and what it refuses.

use crate::common::{self, assert_fails, files, prelude::*, scene_folder, succeeds, text};
use std::process::Command;

/// A ground, a wall of no class, two boxes that are things, one before the other; a rig that turns by three degrees a
/// capture, with a camera and a lidar, and a camera with colours alone; and a lidar that stands by itself.
const SCENE: &str = r#"(
    materials: { "grey": (base_factor: (0.5, 0.5, 0.5)) },
    meshes: { "ground": plane(size: (200, 200)), "box": cube(size: (1.8, 1.5, 4)), "wall": cube(size: (30, 4, 1)) },
    entities: [
        (name: "sun", transform: (rotation_degrees: (-60, 20, 0)), light: directional(intensity: 1)),
        (name: "ground", mesh: "ground", material: "grey", class: "road"),
        (name: "wall", mesh: "wall", material: "grey", transform: (translation: (0, 2, 24))),
        (name: "near", mesh: "box", material: "grey", class: "car", instance: true,
         transform: (translation: (0.5, 0.75, 10))),
        (name: "far", mesh: "box", material: "grey", class: "truck", instance: true,
         transform: (translation: (-0.8, 0.75, 16))),
        (name: "ego", instance: true, spin: (axis: (0, 1, 0), degrees_per_second: 90), children: [
            (name: "front", transform: (translation: (0.1, 1.4, 0.3), rotation_degrees: (-4, 180, 1)),
             sensor: camera(size: (97, 60), lens: pinhole(fx: 80, fy: 82, cx: 46.5, cy: 28), every: 2, samples: 1,
                            outputs: [color, depth, instance, class, boxes, flow])),
            (name: "rear", transform: (translation: (0, 1.4, 0)),
             sensor: camera(size: (16, 12), every: 2, samples: 1, outputs: [color])),
            (name: "top", transform: (translation: (-0.2, 1.8, 0), rotation_degrees: (1, 2, 3)),
             sensor: lidar(beams: vlp16, hz: 30, every: 2)),
        ]),
        (name: "post", transform: (translation: (5, 2, 5)), sensor: lidar(beams: vlp16, hz: 15, every: 4, phase: 2)),
    ],
)"#;

/// Renders 5 frames into `out`.
#[track_caller]
fn render(folder: &Path, formats: &str, more: &[&str]) {
    let args = ["render", "scene.ron", "-o", "out", "--sensors", "all", "--frames", "5", "--format", formats];
    succeeds(&[&args[..], more].concat(), folder);
}

#[test]
fn others_read_the_labels_of_coco_the_folders_of_kitti_and_the_tables_of_nuscenes() {
    let Some(folder) = with_gpu(|| scene_folder(SCENE)) else { return };
    render(folder.path(), "npy,coco,kitti,nuscenes", &[]);
    let out = folder.path().join("out");
    let modules = ["cv2", "numpy", "panopticapi.evaluation", "pycocotools"];
    let Some(output) = common::python("sensor_formats.py", &modules, &[out.as_os_str()]) else { return };
    // So that nothing passes for want of being read.
    assert_eq!(text(&output.stdout).trim(), "3 pictures, 6 things, 3 folders of scans, 6 annotations");
}

#[test]
fn what_is_made_of_a_whole_run_is_the_same_where_it_is_resumed() {
    let Some(folder) = with_gpu(|| scene_folder(SCENE)) else { return };
    let out = folder.path().join("out");
    render(folder.path(), "png,npy,coco,kitti", &[]);
    let first = files(&out);
    fs::remove_file(out.join("ego/front/color_00002.png")).expect("there");
    fs::write(out.join("coco/instances.json"), "{}").expect("written");
    render(folder.path(), "png,npy,coco,kitti", &["--resume"]);
    assert!(files(&out) == first);
    // Colours are written for the labels that name them, whatever else is asked for.
    fs::remove_dir_all(&out).expect("there");
    render(folder.path(), "npy,coco", &[]);
    let without = files(&out);
    let color = Path::new("ego/front/color_00002.png");
    assert_eq!(without[color], first[color]);
    assert!(!without.contains_key(Path::new("ego/rear/color_00002.png")));
    let labels = Path::new("coco/instances.json");
    assert_eq!(without[labels], first[labels]);
}

/// Between the scans of its lidar, too: a camera that looks ahead, and a lidar beside it, on what turns.
#[test]
fn the_calibration_of_kitti_stays_where_its_lidar_is_due_less_often() {
    let Some(_) = common::gpu() else { return };
    let scene = r#"(
        meshes: { "ground": plane(size: (200, 200)) },
        entities: [
            (mesh: "ground"),
            (name: "ego", instance: true, spin: (axis: (0, 1, 0), degrees_per_second: 90), children: [
                (name: "front", transform: (translation: (0.1, 1.4, 0.3), rotation_degrees: (0, 180, 0)),
                 sensor: camera(size: (16, 12), every: 2, samples: 1, outputs: [color])),
                (name: "top", transform: (translation: (-0.2, 1.8, 0)),
                 sensor: lidar(beams: vlp16, every: 3, phase: 1)),
            ]),
        ],
    )"#;
    let folder = scene_folder(scene);
    let args = ["render", "scene.ron", "-o", "out", "--sensors", "all", "--format", "kitti", "--frames", "2..9"];
    succeeds(&args, folder.path());
    let home = folder.path().join("out/ego/front/kitti");
    // Both are due after 4 steps alone.
    assert!(
        [2, 4, 6, 8].map(|step| home.join(format!("velodyne/{step:06}.bin")).exists()) == [false, true, false, false]
    );
    for step in [2, 4, 6, 8] {
        let calibration = fs::read_to_string(home.join(format!("calib/{step:06}.txt"))).expect("a calibration");
        let from_lidar = calibration.lines().find_map(|line| line.strip_prefix("Tr_velo_to_cam:")).expect("its line");
        let found: Vec<f64> = from_lidar.split_whitespace().map(|number| number.parse().expect("a number")).collect();
        // x = −y, y = −z, z = x; the lidar is 0.3 m to the camera's right, 0.4 m above and 0.3 m behind.
        let expected = [0.0, -1.0, 0.0, 0.3, 0.0, 0.0, -1.0, -0.4, 1.0, 0.0, 0.0, -0.3];
        // Of the scene's floats.
        let off = found.iter().zip(expected).map(|(found, expected)| (found - expected).abs()).fold(0.0, f64::max);
        assert!(found.len() == 12 && off < 1e-6, "after step {step}: {found:?}");
    }
}

/// Values of fields of a film's only stream, by ffprobe.
fn probe(film: &Path, fields: &str) -> String {
    let entries = format!("stream={fields}");
    let mut command = Command::new("ffprobe");
    command.args(["-loglevel", "error", "-count_frames", "-of", "csv=p=0", "-show_entries", &entries]);
    let output = command.arg(film).output().expect("ffprobe runs");
    text(&output.stdout).trim().to_owned()
}

#[test]
fn each_output_of_a_camera_is_a_film_of_its_captures() {
    if !common::has_ffmpeg() || common::gpu().is_none() {
        return;
    }
    let folder = scene_folder(SCENE);
    render(folder.path(), "npy,video", &[]);
    let out = folder.path().join("out");
    let films: Vec<PathBuf> =
        files(&out).into_keys().filter(|path| path.extension().is_some_and(|ending| ending == "mp4")).collect();
    let front = ["boxes", "class", "color", "depth", "instance"].map(|output| format!("ego/front/{output}.mp4"));
    let expected: Vec<PathBuf> =
        front.iter().map(String::as_str).chain(["ego/rear/color.mp4"]).map(PathBuf::from).collect();
    assert_eq!(films, expected);
    // Even sides; a capture every other step of 1/60 s.
    assert_eq!(probe(&out.join("ego/front/depth.mp4"), "width,height,r_frame_rate,nb_read_frames"), "98,60,30/1,3");
    assert_eq!(probe(&out.join("ego/rear/color.mp4"), "width,height,r_frame_rate,nb_read_frames"), "16,12,30/1,3");
    let manifest = fs::read_to_string(out.join("manifest.json")).expect("a manifest");
    let hash = blake3::hash(&fs::read(out.join("ego/front/class.mp4")).expect("a film"));
    assert!(manifest.contains(&format!("\"ego/front/class.mp4\": \"{hash}\"")));
}

#[test]
fn formats_that_nothing_fits_are_refused_before_anything_is_written() {
    let Some(folder) = with_gpu(|| scene_folder(SCENE)) else { return };
    let run = |args: &[&str], path: &std::ffi::OsStr| {
        let args = [&["render", "scene.ron", "-o", "out"], args].concat();
        common::command(&args, folder.path()).env("PATH", path).output().expect("the binary runs")
    };
    // Whatever programs are there, or none.
    let refused = |args: &[&str], needles: &[&str]| {
        for path in [std::env::var_os("PATH").unwrap_or_default(), folder.path().into()] {
            assert_fails(&run(args, &path), 2, needles);
            assert!(!folder.path().join("out").exists(), "{args:?}");
        }
    };
    let coco = "format coco: expected a camera with color, instance and class; no sensor asked for is one";
    refused(&["--sensors", "ego/rear,post", "--format", "npy,coco"], &[coco]);
    let nuscenes = "format nuscenes: expected a camera with color and boxes and the lens of a pinhole; no sensor";
    refused(&["--sensors", "ego/rear,post", "--format", "npy,nuscenes"], &[nuscenes]);
    refused(
        &["--sensors", "post", "--format", "npy,video"],
        &["format video: expected a camera with an output that is a picture"],
    );
    refused(&["--sensors", "all", "--format", "coco"], &["sensor \"ego/front\"", "holds depth, boxes, flow;"]);
    refused(&["--sensors", "ego/front", "--format", "kitti"], &["sensor \"ego/front\"", "holds instance;"]);
    refused(&["--sensors", "ego/rear,post", "--format", "png,video"], &["sensor \"post\"", "holds points;"]);
    for lens in ["orthographic(half_height: 1)", "brown_conrady(fx: 4, fy: 4, cx: 1.5, cy: 1.5, k1: -0.1)"] {
        let scene = format!("(entities: [(name: \"eye\", sensor: camera(size: (4, 4), lens: {lens}))])");
        fs::write(folder.path().join("scene.ron"), scene).expect("written");
        refused(
            &["--sensors", "all", "--format", "png,kitti"],
            &["format kitti: expected a camera with color and the lens"],
        );
    }
    fs::write(folder.path().join("scene.ron"), SCENE).expect("written");
    let output = run(&["--sensors", "ego/rear", "--format", "video"], folder.path().as_os_str());
    assert_fails(&output, 2, &["cannot run ffmpeg, which encodes videos", "apt-get install ffmpeg"]);
    assert!(!folder.path().join("out").exists());
}
