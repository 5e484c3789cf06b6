//! Recordings and snapshots by the binary: pictures, hashes, and files that stay as they are.

use super::*;

#[test]
fn the_binary_records_and_replays_the_same_pictures_and_hashes() {
    let Some(place) = with_gpu(place) else { return };
    let size = ["--size", "48x27", "--no-cache"];
    let run = |args: &[&str]| text(&place.succeeds(&[args, &size].concat()).stderr);
    run(&["render", "scene.ron", "-o", "a", "--frames", "120..123", "--record", "a.rec", "--hash", "a.txt"]);
    run(&["replay", "a.rec", "-o", "b", "--frames", "120..123", "--hash", "b.txt"]);
    let pictures = ["color_00120.png", "color_00121.png", "color_00122.png"];
    for name in pictures {
        assert!(place.read(&format!("a/{name}")) == place.read(&format!("b/{name}")), "{name}");
    }
    let (whole, part) = (text(&place.read("a.txt")), text(&place.read("b.txt")));
    assert!(whole.starts_with("0 ") && part.starts_with("100 ") && whole.ends_with(&part), "{part}");
    assert_eq!(whole.lines().count(), 123);
    run(&["replay", "a.rec", "-o", "c", "--outputs", "id"]);
    assert_eq!(fs::read_dir(place.at("c")).expect("a folder").count(), 124, "all frames, and the names");
    let beyond = ["replay", "a.rec", "-o", "d", "--frames", "120..124"];
    place.is_refused(&beyond, &["120..124", "ends with frame 122"]);

    run(&["render", "scene.ron", "-o", "e", "--frames", "100", "--save-snapshot", "at 99"]);
    run(&["render", "scene.ron", "-o", "f", "--frames", "122..123", "--from-snapshot", "at 99"]);
    assert!(place.read("a/color_00122.png") == place.read("f/color_00122.png"));
    let before = ["render", "scene.ron", "-o", "g", "--frames", "98..101", "--from-snapshot", "at 99"];
    place.is_refused(&before, &["98..101", "begins with frame 99"]);
    assert!(!place.at("g").exists());

    let cut = place.read("a.rec");
    place.file("a.rec", &cut[..cut.len() - 9]);
    let said = run(&["replay", "a.rec", "-o", "h", "--frames", "120..121"]);
    assert!(said.contains("truncated") && said.contains("step 121"), "{said}");
}

#[test]
fn a_thousand_steps_hash_the_same_for_any_number_of_threads() {
    let Some(place) = with_gpu(place) else { return };
    let hashes = |threads: &str| {
        let args = ["render", "scene.ron", "-o", "o", "--frames", "1000..1001", "--size", "8x8", "--no-cache"];
        place.succeeds(&[&args[..], &["--hash", "h.txt", "--threads", threads]].concat());
        text(&place.read("h.txt"))
    };
    let one = hashes("1");
    let mut distinct: Vec<&str> = one.lines().filter_map(|line| line.split(' ').nth(1)).collect();
    distinct.sort_unstable();
    distinct.dedup();
    assert_eq!(distinct.len(), 1001);
    assert!(one == hashes("1"), "another run");
    assert!(one == hashes("2"), "two threads");
}

/// A physical car that jumps over a ramp and stands at last, one on the springs beside a signal, a bus that stands on a
/// slope.
const BODIES: &str = r#"(
    vehicle_types: ["ASSETS/vehicles.ron"],
    meshes: {
        "road": plane(size: (300, 300)), "ramp": cube(size: (6, 0.4, 12)), "wall": cube(size: (6, 2, 1)),
        "signal": model(file: "ASSETS/models/town_signal.glb"),
    },
    signals: { "cross": (green_seconds: [1, 1], amber_seconds: 1, red_seconds: 1) },
    routes: { "ring": (points: [(60, 0, 0), (0, 0, 60), (-60, 0, 0), (0, 0, -60)], closed: true, lanes: 2,
        stops: [(at: 30, signal: "cross", group: 0), (at: 2, seconds: 1)]) },
    entities: [
        (mesh: "road", ground: true),
        (mesh: "ramp", ground: true, transform: (translation: (0, 0.7, 24), rotation_degrees: (-12, 0, 0))),
        (mesh: "ramp", ground: true, transform: (translation: (20, 0.7, 0), rotation_degrees: (-12, 0, 0), scale: (1, 1, 3))),
        (mesh: "wall", obstacle: box, transform: (translation: (0, 1, 70))),
        (mesh: "signal", signal_head: (signal: "cross", group: 0), transform: (translation: (3, 0, -4))),
        (vehicle: (type: "car", physical: (), speed_kmh: 60)),
        (vehicle: (type: "van", physical: ()), transform: (translation: (-5, 1, 0))),
        (vehicle: (type: "bus"), transform: (translation: (20, 3, -4))),
        (camera: (), transform: (translation: (9, 3, -12), look_at: (0, 1, 6))),
    ],
    generators: [(place: along(routes: ["ring"], spacing: 15, jitter: 3), vehicles: ["car", "bus", "motorcycle", "truck"])],
)"#;

/// Steps with all that moves: the same hashes for any number of threads and when they go on from a snapshot, and the
/// same picture at the snapshot's own step.
fn assert_repeatable(scene: &str) {
    let place = place();
    let run = |folder: &str, from: u64, more: &[&str]| {
        let frames = format!("{from}..{}", from + 1);
        let args = ["render", scene, "-o", folder, "--frames", &frames, "--size", "64x36", "--hash", "h.txt"];
        place.succeeds(&[&args[..], more].concat());
        text(&place.read("h.txt"))
    };
    let whole = run("a", 1000, &["--threads", "1"]);
    assert!(whole.lines().count() == 1001 && whole == run("b", 1000, &["--threads", "2"]), "two threads");
    run("c", 400, &["--save-snapshot", "s.snapshot"]);
    let continued = run("d", 1000, &["--from-snapshot", "s.snapshot"]);
    assert!(continued.lines().count() > 500 && whole.ends_with(&continued), "from a snapshot");
    run("e", 400, &["--from-snapshot", "s.snapshot"]);
    assert!(place.read("c/color_00400.png") == place.read("e/color_00400.png"), "the picture of the snapshot's step");
    assert!(place.read("a/color_01000.png") == place.read("d/color_01000.png"), "the last picture");
}

#[test]
fn a_town_is_repeatable() {
    if common::gpu().is_some() {
        assert_repeatable(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/scenes/town.ron"));
    }
}

#[test]
fn bodies_signals_and_slopes_are_repeatable() {
    if common::gpu().is_some() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scene = folder.path().join("bodies.ron");
        let assets = concat!(env!("CARGO_MANIFEST_DIR"), "/assets");
        fs::write(&scene, BODIES.replace("ASSETS", assets)).expect("a scene");
        assert_repeatable(&scene.display().to_string());
    }
}

#[test]
fn nothing_that_a_run_reads_is_overwritten() {
    let place = place();
    let before = place.read("scene.ron");
    let args = ["render", "scene.ron", "-o", "o", "--size", "8x8"];
    for more in [["--record", "scene.ron"], ["--hash", "./scene.ron"]] {
        place.is_refused(&[&args[..], &more].concat(), &["scene.ron", "already reads or writes this file"]);
    }
    place.is_refused(&[&args[..], &["--record", "q", "--hash", "q"]].concat(), &["q", "already"]);
    place.is_refused(&[&args[..], &["--record", "q", "--hash", "./q"]].concat(), &["q", "already"]);
    for name in ["scene.ron", "red.png"] {
        place.is_refused(&[&args[..], &["--save-snapshot", name]].concat(), &[name, "already"]);
    }
    assert!(place.read("scene.ron") == before);
}

#[test]
fn what_a_run_begins_from_stays_as_it_is() {
    let Some(place) = with_gpu(place) else { return };
    let size = ["--size", "8x8"];
    let files = ["--frames", "4", "--record", "a.rec", "--save-snapshot", "a.snap"];
    place.succeeds(&[&["render", "scene.ron", "-o", "o"], &size[..], &files].concat());
    for (from, to) in [("a.rec", "color_00002.png"), ("a.rec", "a.apng"), ("a.snap", "color_00004.png")] {
        fs::copy(place.at(from), place.at(to)).expect("a copy");
    }
    let before = ["color_00002.png", "a.apng", "color_00004.png"].map(|name| place.read(name));
    let refused = "an output would overwrite this input file";
    place.is_refused(&[&["replay", "color_00002.png", "-o", "."], &size[..]].concat(), &["color_00002.png", refused]);
    let film = ["replay", "a.apng", "-o", "o", "--video", "a.apng"];
    place.is_refused(&[&film, &size[..]].concat(), &["a.apng", refused]);
    let on = ["render", "scene.ron", "-o", ".", "--from-snapshot", "color_00004.png", "--frames", "2"];
    place.is_refused(&[&on, &size[..]].concat(), &["color_00004.png", refused]);
    assert!(before == ["color_00002.png", "a.apng", "color_00004.png"].map(|name| place.read(name)));
    // A file of the run may be another name of what is read: it gets a file of its own.
    let read = ["scene.ron", "a.rec"].map(|name| place.read(name));
    for (name, link) in [("scene.ron", "link"), ("a.rec", "link.rec")] {
        fs::hard_link(place.at(name), place.at(link)).expect("a link");
    }
    #[cfg(unix)]
    std::os::unix::fs::symlink("link.rec", place.at("soft.rec")).expect("a link");
    #[cfg(not(unix))]
    fs::rename(place.at("link.rec"), place.at("soft.rec")).expect("another name");
    let written = ["-o", "o", "--hash", "link", "--record", "soft.rec"];
    place.succeeds(&[&["render", "scene.ron"], &written[..], &size].concat());
    assert!(read == ["scene.ron", "a.rec"].map(|name| place.read(name)));
    assert!(place.read("link") != read[0] && place.read("soft.rec") != read[1]);
}

#[test]
fn what_a_run_is_kept_in_is_none_of_its_pictures() {
    let place = place();
    let args = ["render", "scene.ron", "--size", "8x8", "--frames", "2", "--outputs", "color,id", "--video", "a.gif"];
    for folder in ["new", "there"] {
        for option in ["--hash", "--record", "--save-snapshot"] {
            for name in ["color_00001.png", "id_00000.png", "ids.json"] {
                let file = format!("./{folder}/{name}");
                let more = ["-o", folder, option, &file];
                place.is_refused(&[&args[..], &more].concat(), &[name, "already reads or writes this file"]);
            }
            place.is_refused(&[&args[..], &["-o", folder, option, "./a.gif"]].concat(), &["a.gif", "already"]);
        }
        fs::create_dir_all(place.at("there")).expect("a folder");
    }
    assert!(!place.at("new").exists(), "nothing is begun");
    let film =
        ["render", "scene.ron", "--size", "8x8", "--frames", "2", "-o", "there", "--video", "there/color_00001.png"];
    place.is_refused(&film, &["color_00001.png", "already"]);
    if common::gpu().is_some() {
        let others = ["-o", "there", "--hash", "there/depth_00000.png", "--save-snapshot", "there/color_1.png"];
        place.succeeds(&[&args[..], &others].concat());
        let again = ["-o", "there", "--from-snapshot", "there/color_1.png", "--save-snapshot", "there/color_1.png"];
        place.succeeds(&[&args[..], &again].concat());
    }
}
