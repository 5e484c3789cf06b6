//! `relief split`, `render --shard` and `merge`: what shards give together is what one process gives, byte for byte.

use crate::common::{self, assert_fails, files, prelude::*, relief, scene_folder, text};
use std::process::Output;

/// A rig that turns, with cameras of two rhythms, a lidar that sweeps, an IMU and a receiver of GNSS; two things, one
/// of which turns too, and is not seen all the time; a lidar by itself.
const SCENE: &str = r#"(
    clock: (step_seconds: 0.0166667),
    geo_origin: (latitude_degrees: 49, longitude_degrees: 8.4, altitude: 110),
    materials: { "grey": (base_factor: (0.5, 0.45, 0.4)) },
    meshes: { "ground": plane(size: (200, 200)), "box": cube(size: (1.8, 1.5, 4)) },
    entities: [
        (name: "sun", transform: (rotation_degrees: (-60, 20, 0)), light: directional(intensity: 1, shadows: true)),
        (name: "ground", mesh: "ground", material: "grey", class: "road"),
        (name: "near", mesh: "box", material: "grey", class: "car", instance: true, spin: (degrees_per_second: 200),
         transform: (translation: (0.5, 0.75, 10))),
        (name: "far", mesh: "box", material: "grey", class: "truck", instance: true,
         transform: (translation: (6, 0.75, 9))),
        (name: "ego", instance: true, spin: (axis: (0.1, 1, 0), degrees_per_second: 400), children: [
            (name: "front", transform: (translation: (0.1, 1.4, 0.3), rotation_degrees: (-4, 180, 1)),
             sensor: camera(size: (24, 16), lens: pinhole(fx: 20, fy: 21, cx: 11, cy: 8), every: 2, phase: 1,
                            outputs: [color, linear, depth, instance, class, boxes, flow, flow_back],
                            noise: (full_well: 4000))),
            (name: "rear", transform: (translation: (0, 1.4, 0)),
             sensor: camera(size: (16, 12), outputs: [color, flow])),
            (name: "top", transform: (translation: (-0.2, 1.8, 0), rotation_degrees: (1, 2, 3)),
             sensor: lidar(beams: vlp16, hz: 30, every: 3, sweep: true)),
            (name: "imu", sensor: imu(every: 2)),
            (name: "mast", sensor: gnss(every: 2)),
        ]),
        (name: "post", transform: (translation: (5, 2, 5)), sensor: lidar(beams: vlp16, hz: 60, every: 4)),
        (name: "late", sensor: lidar(beams: vlp16, hz: 60, every: 60)),
        (name: "view", camera: (), transform: (translation: (0, 4, -6), rotation_degrees: (-20, 180, 0))),
    ],
)"#;

#[track_caller]
fn done(args: &[&str], folder: &Path) -> String {
    text(&common::succeeds(args, folder).stdout)
}

#[track_caller]
fn render_shards(numbers: &[usize], folder: &Path) {
    for number in numbers {
        done(&["render", "--shard", &format!("job/shards.json:{number}")], folder);
    }
}

/// Asserts that two folders hold the same files, and returns them.
#[track_caller]
fn assert_same(found: &Path, expected: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let (found, expected) = (files(found), files(expected));
    assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
    for (name, bytes) in &expected {
        assert!(found[name] == *bytes, "{} differs", name.display());
    }
    expected
}

#[test]
fn shards_of_sensors_are_together_what_one_process_writes() {
    let Some(home) = with_gpu(|| scene_folder(SCENE)) else { return };
    let folder = home.path();
    let has_ffmpeg = common::has_ffmpeg();
    let formats = ["png,npy,npz,exr,mcap,coco,kitti,nuscenes", ",video"];
    let formats = formats[..=usize::from(has_ffmpeg)].concat();
    let options = ["--sensors", "all", "--format", &formats, "--frames", "3..12"];
    done(&[&["render", "scene.ron", "-o", "one"], &options[..]].concat(), folder);
    done(&[&["split", "scene.ron", "-o", "job", "--shards", "4"], &options[..]].concat(), folder);
    // In any order; the scene is found from elsewhere.
    render_shards(&[2, 0, 1], folder);
    let elsewhere = tempfile::tempdir().expect("a temporary folder");
    let last = format!("{}:3", folder.join("job/shards.json").display());
    done(&["render", "--shard", &last], elsewhere.path());
    done(&["merge", "job", "-o", "merged"], folder);
    let expected = assert_same(&folder.join("merged"), &folder.join("one"));
    let counted = |part: &str| expected.keys().filter(|name| name.to_string_lossy().contains(part)).count();
    // Flow from each capture but the last of its camera to the next: those of 3, 5, 7, 9, and of 3 to 10.
    assert_eq!((counted("front/flow_0"), counted("front/kitti/flow"), counted("rear/flow_0")), (8, 4, 16));
    assert_eq!((counted("top/kitti"), counted("kitti/velodyne"), counted("sensors.mcap")), (0, 7, 1));
    assert_eq!(counted("nuscenes/"), 13 + 1);
    assert_eq!(counted(".mp4"), if has_ffmpeg { 7 } else { 0 });
    // A sensor that is not due in these frames has an empty folder.
    assert!(["one", "merged"].iter().all(|name| folder.join(name).join("late").is_dir()));
    // What was rendered already stays, and so does what was put together.
    let said = done(&["render", "--shard", "job/shards.json:2", "--resume"], folder);
    assert_eq!(said.trim(), "nothing to do: job/02 is whole");
    assert_fails(&relief(&["merge", "job", "-o", "merged"], folder), 2, &["merged: is not empty"]);
}

/// A job of three shards, and what one process makes of it, with an animation.
fn frames() -> (common::Folder, PathBuf) {
    let home = scene_folder(SCENE);
    let options = ["scene.ron", "--frames", "2..7", "--size", "32x20", "--outputs", "color,depth,id", "--threads", "2"];
    done(&[&["render", "-o", "one", "--video", "one.apng"], &options[..]].concat(), home.path());
    done(&[&["split", "-o", "job", "--shards", "3"], &options[..]].concat(), home.path());
    render_shards(&[0, 1, 2], home.path());
    let folder = home.path().to_owned();
    (home, folder)
}

#[test]
fn shards_of_frames_are_together_what_one_process_writes_and_what_is_amiss_is_said() {
    let Some((_home, folder)) = with_gpu(frames) else { return };
    let folder = folder.as_path();
    let merge = |more: &[&str]| relief(&[&["merge", "job", "-o", "merged"], more].concat(), folder);
    let refused = |output: &Output, code, needles: &[&str]| {
        assert_fails(output, code, needles);
        assert!(!folder.join("merged").exists());
    };
    // A shard that is not there, and a file that was cut short.
    fs::rename(folder.join("job/01"), folder.join("gone")).expect("moved");
    let cut = folder.join("job/02/data/color_00006.png");
    let whole = fs::read(&cut).expect("read");
    fs::write(&cut, &whole[..whole.len() / 2]).expect("written");
    let missing = "shard 1: not rendered";
    let damaged = "shard 2: data/color_00006.png is damaged";
    refused(&merge(&[]), 4, &["2 of 3 shards are missing", missing, damaged, "--shard job/shards.json:1\n"]);
    done(&["render", "--shard", "job/shards.json:2", "--resume"], folder);
    assert_eq!(fs::read(&cut).expect("read"), whole);
    fs::rename(folder.join("gone"), folder.join("job/01")).expect("moved");
    // Of another machine.
    let manifest = folder.join("job/01/manifest.json");
    let own = fs::read_to_string(&manifest).expect("text");
    let edit = |from: &str, to: &str| {
        assert!(own.contains(from), "{own}");
        fs::write(&manifest, own.replacen(from, to, 1)).expect("written");
    };
    edit("\"driver\": \"", "\"driver\": \"other ");
    refused(&merge(&[]), 2, &["rendered by 2 kinds of machines", "--mixed"]);
    let output = relief(&["merge", "job", "-o", "mixed", "--mixed"], folder);
    assert!(output.status.success() && text(&output.stderr).contains("2 kinds of machines"));
    // Of another run, by its last state, and by the file that it was made for.
    let last = own.split("\"last\"").nth(1).and_then(|rest| rest.split('"').nth(5)).expect("a hash");
    edit(last, "00000000000000000000000000000001");
    refused(&merge(&[]), 2, &["after step 5, the state of shard 1 is not that with which shard 2 begins"]);
    edit("\"job\": \"", "\"job\": \"0");
    refused(&merge(&[]), 4, &["shard 1: rendered for another shards.json"]);
    edit("\"data/color_00003.png\"", "\"data/../../../scene.ron\"");
    refused(&merge(&[]), 4, &["shard 1: manifest.json is damaged: \"data/../../../scene.ron\" is no file"]);
    fs::write(&manifest, "{}").expect("written");
    refused(&merge(&[]), 4, &["shard 1: manifest.json is damaged"]);
    fs::write(&manifest, &own).expect("written");
    // By default into the job's folder.
    done(&["merge", "job", "--video", "merged.apng"], folder);
    let expected = assert_same(&folder.join("job/merged"), &folder.join("one"));
    assert_eq!(expected.len(), 5 * 3 + 1);
    assert!(fs::read(folder.join("merged.apng")).expect("read") == fs::read(folder.join("one.apng")).expect("read"));
    let entries = fs::read_dir(folder.join("job")).expect("a folder");
    assert_eq!(entries.count(), 6, "nothing unfinished is left beside three shards, shards.json, snapshots and merged");
}

#[test]
fn what_cannot_be_split_or_rendered_is_refused() {
    let Some(home) = with_gpu(|| scene_folder(SCENE)) else { return };
    let folder = home.path();
    let split = |more: &[&str]| {
        let args = ["split", "scene.ron", "-o", "job", "--frames", "4", "--size", "16x12"];
        relief(&[&args[..], more].concat(), folder)
    };
    assert_fails(&split(&["--shards", "5"]), 2, &["expected 1 to 4 shards for frames 0..4"]);
    assert_fails(&split(&["--shards", "0"]), 2, &["--shards", "from 1"]);
    assert_fails(&split(&["--shards", "2", "--video", "a.mp4"]), 2, &["--video", "relief merge --video"]);
    assert_fails(&split(&["--shards", "2", "--resume"]), 2, &["--resume: not of shards"]);
    assert_fails(&split(&["--shards", "2", "--camera", "no"]), 2, &["unknown camera \"no\""]);
    assert!(!folder.join("job").exists());
    assert!(split(&["--shards", "2"]).status.success());
    let shard = |name: &str, more: &[&str]| relief(&[&["render", "--shard", name], more].concat(), folder);
    assert_fails(&shard("job/shards.json:2", &[]), 2, &["job/shards.json: shard 2: expected 0 to 1"]);
    assert_fails(&shard("job/shards.json", &[]), 2, &["like job/shards.json:7"]);
    assert_fails(&shard("scene.ron:0", &[]), 2, &["scene.ron: not a file of relief split"]);
    assert_fails(&shard("job/shards.json:0", &["--size", "8x8"]), 2, &["--shard", "--size"]);
    let job = folder.join("job/shards.json");
    let own = fs::read_to_string(&job).expect("text");
    let edited = |from: &str, to: &str, code, needles: &[&str]| {
        assert!(own.contains(from), "{own}");
        fs::write(&job, own.replacen(from, to, 1)).expect("written");
        assert_fails(&shard("job/shards.json:0", &[]), code, needles);
        fs::write(&job, &own).expect("written");
    };
    edited("\"version\": \"", "\"version\": \"9", 2, &["job/shards.json: made by version \"9"]);
    edited("\"first\": 2", "\"first\": 3", 2, &["corrupt: shard 1: expected frames from 2 on, found 3..4"]);
    edited(
        "\"size\": [\n        16,",
        "\"size\": [\n        0,",
        2,
        &["corrupt: size: expected 1 to 16384 each, found 0x12"],
    );
    edited("\"samples\": 4", "\"samples\": 3", 2, &["corrupt: samples: expected 1 or 4, found 3"]);
    edited("\"shadow_maps\"", "\"shadows\"", 2, &["job/shards.json: not a file of relief split", "`shadows`"]);
    // As splits were before jobs were data.
    edited("\"work\": {", "\"options\": [], \"work\": {", 2, &["job/shards.json: made by an earlier", "split again"]);
    // The state with which the next begins is another: the end of this one is not it.
    let state = own.split("\"state\": \"").nth(2).and_then(|rest| rest.get(..32)).expect("a hash");
    edited(state, &"0".repeat(32), 1, &["step 2: the state is not that of relief split"]);
    fs::write(folder.join("scene.ron"), SCENE.replacen("0.45", "0.46", 1)).expect("written");
    assert_fails(&shard("job/shards.json:1", &[]), 2, &["01.snapshot: scene.ron has changed"]);
    fs::write(folder.join("moved.ron"), SCENE).expect("written");
    done(&["render", "moved.ron", "--shard", "job/shards.json:1"], folder);
    fs::write(folder.join("job/snapshots/00.snapshot"), "x").expect("written");
    assert_fails(&shard("job/shards.json:0", &["--resume"]), 2, &["00.snapshot: not a Relief snapshot"]);
    let left = fs::read_dir(folder.join("job")).expect("a folder").count();
    assert_eq!(left, 3, "shards.json, snapshots and shard 1");
}
