//! The binary as a user meets it: exit codes, messages, files, and the same frames every time.

use crate::common::{self, assert_fails, command, prelude::*, relief, succeeds, text};

const SCENE: &str = r#"(
    materials: { "red": (base_factor: (0.8, 0.1, 0.1)), "glass": (base_factor: (0.2, 0.5, 0.9), base_alpha: 0.4, alpha_mode: blend) },
    meshes: { "ball": sphere(radius: 0.5, segments: 24, rings: 12), "floor": plane(size: (8, 8)) },
    entities: [
        (name: "floor", mesh: "floor"),
        (name: "ball", mesh: "ball", material: "red", transform: (translation: (0, 0.5, 0))),
        (name: "turning", spin: (axis: (0, 1, 0), degrees_per_second: 360), children: [
            (name: "moon", mesh: "ball", material: "glass", transform: (translation: (1.5, 0.8, 0), scale: 0.6)),
            (name: "lamp", light: point(intensity: 3, range: 9), transform: (translation: (-1, 1.6, 1))),
        ]),
        (name: "front", camera: (fov_y_degrees: 45), transform: (translation: (0, 2, 5), look_at: (0, 0.5, 0))),
        (name: "above", camera: (fov_y_degrees: 45), transform: (translation: (0.1, 7, 0.1), look_at: (0, 0, 0))),
    ],
    generators: [
        (name: "sparks", place: scatter(region: disc(center: (0, 1, 0), radius: 3), count: 40),
         lights: [point(color: (0.9, 0.5, 0.2), intensity: 0.3, range: 2)], entity: ()),
    ],
)"#;

fn scene_folder() -> common::Folder {
    common::scene_folder(SCENE)
}

/// Name and contents of every file in a folder.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files: Vec<_> = fs::read_dir(folder)
        .expect("a folder")
        .flatten()
        .filter(|entry| entry.path().is_file())
        .map(|entry| (PathBuf::from(entry.file_name()), fs::read(entry.path()).expect("a file")))
        .collect();
    files.sort();
    files
}

#[test]
fn a_schema_is_printed_by_the_kind_of_file() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (args, inside) in [
        (&["schema"][..], "/properties/entities"),
        (&["schema", "scene"], "/$defs/LightFields/properties/range/description"),
        (&["schema", "rig"], "/items"),
        (&["schema", "vehicle-type"], "/$defs/Driver/properties/gap_metres/minimum"),
    ] {
        let output = relief(args, folder.path());
        let schema: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema", "{args:?}");
        assert!(schema.pointer(inside).is_some(), "{args:?}: {inside}");
    }
    let near = "unknown kind of file \"scnee\" (did you mean \"scene\"?)";
    assert_fails(&relief(&["schema", "scnee"], folder.path()), 2, &[near]);
}

#[test]
fn the_same_frames_bit_for_bit_on_two_runs_and_with_any_number_of_threads() {
    let Some(_) = common::gpu() else { return };
    // More lights with shadows than there are maps.
    let folder = scene_folder();
    let shadowed = SCENE.replace("point(", "point(shadows: true, ");
    fs::write(folder.path().join("shadowed.ron"), shadowed).expect("a scene");
    let render = |out: &str, threads: &str| {
        let args = ["render", "shadowed.ron", "-o", out, "--frames", "8..11", "--size", "96x54", "--threads", threads];
        let all = ["--outputs", "color,depth,normal,id"];
        succeeds(&[&args[..], &all].concat(), folder.path());
        contents(&folder.path().join(out))
    };
    let first = render("a", "1");
    assert_eq!(first.len(), 13, "three frames of four kinds, and the names");
    assert!(first == render("b", "1"), "another run");
    assert!(first == render("c", "2"), "two threads");
    assert!(first == render("d", "8"), "eight threads");
    assert!(first[0].1 != first[1].1, "frames differ: something moves");
}

/// Depth, normal and id have one sample per pixel, whatever the picture has; they lie in one pass with it or another.
#[test]
fn outputs_are_the_same_for_one_sample_and_for_four() {
    let Some(folder) = with_gpu(scene_folder) else { return };
    let render = |out: &str, samples: &str| {
        let args = ["render", "scene.ron", "-o", out, "--frames", "8..10", "--size", "96x54", "--samples", samples];
        succeeds(&[&args[..], &["--outputs", "color,id"]].concat(), folder.path());
        contents(&folder.path().join(out))
    };
    let (one, four) = (render("one", "1"), render("four", "4"));
    let (colors, others): (Vec<_>, Vec<_>) =
        one.iter().zip(&four).partition(|((path, _), _)| path.to_string_lossy().contains("color"));
    assert!(colors.len() == 2 && colors.iter().all(|(one, four)| one.1 != four.1), "pictures have other edges");
    assert!(others.len() == 3 && others.iter().all(|(one, four)| one == four), "ids and their names");
    let output = relief(&["render", "scene.ron", "-o", "two", "--samples", "2"], folder.path());
    assert_fails(&output, 2, &["expected 1 or 4"]);
}

#[test]
fn a_resumed_run_ends_with_what_an_unbroken_one_gives() {
    let Some(folder) = with_gpu(scene_folder) else { return };
    let base = ["render", "scene.ron", "--frames", "4", "--size", "64x36", "-o"];
    for out in ["whole", "part"] {
        succeeds(&[&base[..], &[out]].concat(), folder.path());
    }
    let part = folder.path().join("part");
    fs::remove_file(part.join("color_00002.png")).expect("it was there");
    fs::write(part.join("color_00000.png"), b"").expect("an empty file");
    let cut = fs::read(part.join("color_00003.png")).expect("a frame");
    fs::write(part.join("color_00003.png"), &cut[..cut.len() - 20]).expect("a part of it");
    let kept = fs::metadata(part.join("color_00001.png")).expect("a frame").modified().expect("a time");
    succeeds(&[&base[..], &["part", "--resume"]].concat(), folder.path());
    assert_eq!(contents(&part), contents(&folder.path().join("whole")));
    assert_eq!(fs::metadata(part.join("color_00001.png")).expect("a frame").modified().expect("a time"), kept);
    let larger = ["render", "scene.ron", "--frames", "4", "--size", "80x45", "-o", "part", "--resume"];
    succeeds(&larger, folder.path());
    for frame in 0..4 {
        let size = image::image_dimensions(part.join(format!("color_{frame:05}.png")));
        assert_eq!(size.expect("a picture"), (80, 45), "frame {frame}");
    }
}

#[test]
fn cameras_lights_and_techniques_change_the_picture() {
    let Some(folder) = with_gpu(scene_folder) else { return };
    let picture = |args: &[&str]| {
        succeeds(&[&["render", "scene.ron", "-o", "out", "--size", "64x36"], args].concat(), folder.path());
        fs::read(folder.path().join("out/color_00000.png")).expect("a picture")
    };
    let plain = picture(&[]);
    assert!(plain == picture(&["--camera", "front", "--lights", "enough"]), "the defaults");
    for other in [
        &["--camera", "above"][..],
        &["--lights", "three"],
        &["--lights", "hard"],
        &["--lights", "all"],
        &["--debug", "normal"],
        &["--debug", "light_count"],
        &["--debug", "error_bound"],
    ] {
        assert!(plain != picture(other), "{other:?}");
    }
}

#[test]
fn no_display_renders_pictures_instead_and_says_so() {
    let Some(folder) = with_gpu(scene_folder) else { return };
    let output = succeeds(&["scene.ron", "--size", "64x36"], folder.path());
    assert!(text(&output.stderr).contains("no window"), "{}", text(&output.stderr));
    assert!(folder.path().join("relief-frames/color_00000.png").exists());
}

#[test]
fn bad_usage_exits_with_2_and_says_what_was_expected() {
    let folder = scene_folder();
    let run = |args: &[&str]| relief(args, folder.path());
    assert_fails(&run(&["render", "scene.ron"]), 2, &["--output"]);
    assert_fails(&run(&["render", "scene.ron", "-o", "o", "--size", "64"]), 2, &["WIDTHxHEIGHT"]);
    assert_fails(&run(&["render", "scene.ron", "-o", "o", "--frames", "9..3"]), 2, &["expected 3..9"]);
    assert_fails(&run(&["render", "scene.ron", "-o", "o", "--frames", "-1"]), 2, &["30..60"]);
    assert_fails(&run(&["map", "normal", "h.png", "-o", "n.png", "--height-scale", "-1"]), 2, &["from 0 to 1000"]);
    let near = ["unknown technique \"nomral\"", "did you mean \"normal\"?"];
    assert_fails(&run(&["render", "scene.ron", "-o", "o", "--technique", "nomral"]), 2, &near);
    let cameras = ["unknown camera \"back\"", "front, above"];
    assert_fails(&run(&["render", "scene.ron", "-o", "o", "--camera", "back"]), 2, &cameras);
    assert_fails(&run(&["render", "missing.ron", "-o", "o"]), 2, &["missing.ron"]);
    assert!(!folder.path().join("o").exists(), "nothing is half-written");
}

#[test]
fn numbers_with_commas_are_refused_with_what_was_expected() {
    let folder = scene_folder();
    let render = ["render", "scene.ron", "-o", "o"];
    for (command, option, range) in [
        (&render[..], "--threads", "1 to 256"),
        (&render, "--texture-memory", "1 to 1048576"),
        (&["lights", "scene.ron", "-o", "o"], "--frame", "0 to 999999999"),
        (&["shadows", "scene.ron", "-o", "o"], "--frame", "0 to 999999999"),
        (&["gallery", "-o", "o"], "--frame", "0 to 999999999"),
        (&["replay", "drive.rec"], "--from", "0 to 1000000000"),
        (&["bench"], "--objects", "1 to 10000000"),
        (&["bench"], "--lights", "0 to 1000000"),
        (&["bench"], "--seconds", "1 to 86400"),
        (&["map", "bake", "low.glb", "high.glb", "-o", "o"], "--rays", "1 to 65536"),
        (&["map", "horizon", "h.png", "-o", "o.png"], "--max-distance", "1 to 4294967295"),
    ] {
        let said = format!("expected a whole number from {range}; whole numbers have no comma\n");
        let value = format!("error: invalid value '1,5' for '{option} <");
        assert_fails(&relief(&[command, &[option, "1,5"]].concat(), folder.path()), 2, &[&value, &said]);
    }
    let said = "use a decimal point, not a comma: 0.5";
    for (command, option) in [
        (&["run", "scene.ron"][..], "--speed"),
        (&["bench"], "--moving"),
        (&["compare", "-o", "o"], "--height-scale"),
        (&["compare", "-o", "o"], "--angle"),
        (&["map", "normal", "h.png", "-o", "o.png"], "--height-scale"),
        (&["map", "bake", "low.glb", "high.glb", "-o", "o"], "--cage"),
    ] {
        assert_fails(&relief(&[command, &[option, "0,5"]].concat(), folder.path()), 2, &["'0,5'", said]);
    }
}

#[test]
#[cfg(target_os = "linux")]
fn devices_and_folders_of_the_system_are_written_to_or_refused_and_stay() {
    let Some(folder) = with_gpu(scene_folder) else { return };
    let run = |args: &[&str]| {
        let command = ["render", "scene.ron", "--size", "8x8"];
        relief(&[&command, args].concat(), folder.path())
    };
    for (args, said) in [
        (&["-o", "/dev/null"][..], "/dev/null: not a directory"),
        (&["-o", "/proc/relief"], "/proc/relief: files cannot be created in this directory"),
        (&["-o", "/proc"], "files cannot be created in this directory"),
        (&["-o", "out", "--save-snapshot", "/dev/null"], "/dev/null: not a regular file"),
        (&["-o", "out", "--hash", "/proc/hash"], "/proc/hash: files cannot be created in this directory"),
    ] {
        let output = run(args);
        assert_fails(&output, 2, &["error: ", said]);
        // Debug builds tell what layers say, too.
        let errors = text(&output.stderr).lines().filter(|line| line.starts_with("error: ")).count();
        assert_eq!(errors, 1, "{}", text(&output.stderr));
    }
    assert!(!run(&["-o", "out", "--hash", "/dev/null", "--record", "/dev/null"]).status.success(), "taken twice");
    for option in ["--hash", "--record"] {
        let output = run(&["-o", "out", option, "/dev/null"]);
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert_fails(&run(&["-o", "out", option, "/dev/full"]), 1, &["error: cannot write /dev/full: No space left"]);
    }
    assert!(!Path::new("/dev/null").is_file() && !Path::new("/dev/full").is_file());
}

#[test]
fn bad_scenes_exit_with_2_and_name_file_line_and_column() {
    let folder = scene_folder();
    fs::write(folder.path().join("bad.ron"), "(\n  entities: [\n    (naem: \"x\"),\n  ],\n)").expect("a file");
    let needles = ["bad.ron:3:", "naem", "name"];
    assert_fails(&relief(&["render", "bad.ron", "-o", "o"], folder.path()), 2, &needles);
    assert!(!folder.path().join("o").exists());
    let checked = relief(&["check", "bad.ron", "scene.ron", "nowhere.glb"], folder.path());
    let report = text(&checked.stdout);
    assert_eq!(checked.status.code(), Some(2));
    assert_has(&report, &["bad.ron:3:", "scene.ron: ok", "nowhere.glb"]);
    assert!(relief(&["check", "scene.ron"], folder.path()).status.success());
}

#[test]
fn a_folder_that_is_a_file_is_one_clear_error() {
    let Some(folder) = with_gpu(scene_folder) else { return };
    fs::write(folder.path().join("taken"), "a file").expect("a file");
    assert_fails(&relief(&["render", "scene.ron", "-o", "taken"], folder.path()), 2, &["taken: not a directory"]);
}

#[test]
fn a_file_in_a_folder_that_is_not_there_is_refused_before_anything_is_drawn() {
    let Some(folder) = with_gpu(scene_folder) else { return };
    succeeds(&["render", "scene.ron", "-o", "other"], folder.path());
    assert!(folder.path().join("other/color_00000.png").exists());
    for option in ["--hash=nowhere/f", "--record=nowhere/f", "--save-snapshot=nowhere/f", "--video=nowhere/f.gif"] {
        let begun = if option.starts_with("--record") { "--hash=begun" } else { "--record=begun" };
        let output = relief(&["render", "scene.ron", "-o", "out", option, begun], folder.path());
        assert!(!folder.path().join("begun").exists(), "{option}: nothing is left behind");
        assert_fails(&output, 2, &["nowhere/f", "no such directory: nowhere"]);
        assert!(!folder.path().join("out/color_00000.png").exists(), "{option}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn results_that_cannot_be_printed_are_an_error_unless_nobody_reads_them() {
    let folder = scene_folder();
    image::GrayImage::new(4, 4).save(folder.path().join("heights.png")).expect("a map");
    let printing = |args: &[&str], to: std::process::Stdio| {
        command(args, folder.path()).stdout(to).output().expect("the binary runs")
    };
    let check = ["check", "scene.ron", "nowhere.glb"];
    let map = ["map", "normal", "heights.png", "-o", "normal.png"];
    let info = ["info"];
    let render = ["render", "scene.ron", "-o", "out", "--size", "8x8"];
    let lights = ["lights", "scene.ron", "-o", "errors", "--size", "8x8", "--json"];
    let bench = ["bench", "--objects", "1", "--lights", "1", "--size", "8x8", "--frames", "1", "--json"];
    let with_adapter: &[&[&str]] = if common::gpu().is_some() { &[&info, &render, &lights, &bench] } else { &[] };
    for args in [&check[..], &map].iter().chain(with_adapter) {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("a device that is always full");
        let output = printing(args, full.into());
        assert_fails(&output, 1, &["error: cannot write standard output: No space left on device"]);
        assert_eq!(text(&output.stderr).matches("cannot write").count(), 1, "{args:?}: {}", text(&output.stderr));

        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let output = printing(args, writer.into());
        assert_eq!(output.status.code(), Some(if args[0] == "check" { 2 } else { 0 }), "{args:?}");
        assert!(!text(&output.stderr).contains("cannot write"), "{args:?}: {}", text(&output.stderr));
    }
}

#[test]
fn no_adapter_exits_with_3_and_says_what_to_install() {
    let none = |args: &[&str]| {
        let folder = scene_folder();
        command(args, folder.path()).env("WGPU_ADAPTER_NAME", "no such adapter").output().expect("the binary runs")
    };
    assert_fails(&none(&["info"]), 3, &["no graphics adapter", "mesa-vulkan-drivers"]);
    assert_fails(&none(&["render", "scene.ron", "-o", "o"]), 3, &["mesa-vulkan-drivers"]);
}

/// Headless commands must not connect to a display.
#[test]
#[cfg(target_os = "linux")]
fn headless_commands_ask_no_display() {
    use std::os::unix::net::UnixListener;
    use std::process::Stdio;
    let Some(folder) = with_gpu(scene_folder) else { return };
    // Displays that would hear it: X11's display N listens at port 6000 + N, Wayland's at a file.
    let x11 = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let number = x11.local_addr().expect("bound").port() - 6000;
    let socket = folder.path().join("wayland");
    let wayland = UnixListener::bind(&socket).expect("a socket");
    x11.set_nonblocking(true).and_then(|()| wayland.set_nonblocking(true)).expect("no waiting");
    let display = [("DISPLAY", format!("127.0.0.1:{number}")), ("WAYLAND_DISPLAY", socket.display().to_string())];
    let render = ["render", "scene.ron", "-o", "out", "--size", "16x9", "--no-cache"];
    let lights = ["lights", "scene.ron", "-o", "lights", "--size", "16x9"];
    let shadows = ["shadows", "scene.ron", "-o", "shadows", "--size", "16x9"];
    let cases: [&[&str]; 5] = [&["info"], &render, &lights, &shadows, &["check", "scene.ron"]];
    for args in cases {
        for environment in [&[][..], &display] {
            let mut command = command(args, folder.path());
            // Which driver there is, and nothing else.
            let drivers = std::env::vars_os().filter(|(name, _)| name.to_string_lossy().starts_with("VK_"));
            command.env_clear().envs(drivers);
            command.envs(environment.iter().map(|(name, value)| (name, value)));
            // What a validation layer says in builds for tests is not what is tested.
            command.env("WGPU_VALIDATION", "0").env("WGPU_DEBUG", "0");
            let mut running = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the binary runs");
            // What asks a display waits for its answer.
            loop {
                let has_ended = running.try_wait().expect("a state").is_some();
                if x11.accept().is_ok() || wayland.accept().is_ok() {
                    let _ = running.kill();
                    panic!("{args:?} with {environment:?} connected to a display");
                }
                if has_ended {
                    break;
                }
                std::thread::sleep(std::time::Duration::from_millis(5));
            }
            let output = running.wait_with_output().expect("its words");
            assert!(output.status.success(), "{args:?}: {}", text(&output.stderr));
            assert_eq!(text(&output.stderr), "", "{args:?} with {environment:?}");
        }
    }
}

#[test]
#[cfg(unix)]
fn links_that_lead_nowhere_are_refused_with_their_target() {
    let folder = scene_folder();
    for (name, target) in [("disk", "/nonexistent/disk"), ("turning", "turning")] {
        std::os::unix::fs::symlink(target, folder.path().join(name)).expect("a link");
    }
    let size = ["--size", "16x9"];
    let outputs = |name: &'static str| -> Vec<Vec<&'static str>> {
        vec![
            [&["render", "scene.ron", "-o", name][..], &size].concat(),
            [&["lights", "scene.ron", "-o", name][..], &size].concat(),
            [&["shadows", "scene.ron", "-o", name][..], &size].concat(),
            vec!["gallery", "-o", name],
            vec!["compare", "-o", name],
            vec!["bench", "--objects", "4", "--suite", "-o", name],
            vec!["bench", "--objects", "4", "--frames", "1", "--trace", name],
            [&["render", "scene.ron", "-o", "out", "--hash", name][..], &size].concat(),
            [&["render", "scene.ron", "-o", "out", "--record", name][..], &size].concat(),
            [&["render", "scene.ron", "-o", "out", "--save-snapshot", name][..], &size].concat(),
        ]
    };
    let Some(_) = common::gpu() else { return };
    for args in outputs("disk") {
        let missing = "disk: broken symbolic link: /nonexistent/disk does not exist";
        let output = relief(&args, folder.path());
        assert_fails(&output, 2, &[missing]);
        let errors = text(&output.stderr).lines().filter(|line| line.starts_with("error: ")).count();
        assert_eq!(errors, 1, "{args:?}");
    }
    for args in outputs("turning") {
        assert_fails(&relief(&args, folder.path()), 2, &["turning: circular symbolic link"]);
    }
    assert_eq!(contents(folder.path()).len(), 1, "the scene alone");
}

#[test]
fn info_names_the_adapter() {
    let Some(_) = common::gpu() else { return };
    let output = succeeds(&["info"], Path::new("."));
    assert_has(&text(&output.stdout), &["adapter", "driver", "largest texture"]);
}

/// Runs a command that measures the scene, with small pictures, into a folder.
#[track_caller]
fn measure(command: &str, args: &[&str], folder: &Path) -> String {
    text(&succeeds(&[&[command, "scene.ron", "--size", "64x36", "-o"], args].concat(), folder).stdout)
}

/// Error figures of a command as a table that holds `needles`, and as a line of JSON, which is returned; with pictures.
/// All are the same for any number of threads.
#[track_caller]
fn assert_reports(command: &str, needles: &[&str], pictures: &[String], folder: &Path) -> Value {
    let table = measure(command, &["out"], folder);
    let common = ["scene.ron: frame 0, 64x36, 41 lights", "mean      p99     FLIP", "pictures: out"];
    assert_has(&table, &[&common, needles].concat());
    let files = contents(&folder.join("out"));
    let names: Vec<_> = files.iter().map(|(name, _)| name.to_string_lossy().into_owned()).collect();
    assert_eq!(names, pictures.iter().map(|name| format!("{name}.png")).collect::<Vec<_>>());

    let line = measure(command, &["out", "--json", "--threads", "1"], folder);
    assert_eq!(line.lines().count(), 1);
    assert!(line == measure(command, &["again", "--json", "--threads", "2"], folder), "any number of threads");
    assert!(files == contents(&folder.join("again")), "the same pictures");
    let json: Value = serde_json::from_str(&line).expect("JSON");
    assert_eq!((&json["scene"], &json["frame"], &json["width"]), (&"scene.ron".into(), &0.into(), &64.into()));
    json
}

#[test]
fn lights_reports_errors_as_a_table_or_json_and_writes_pictures() {
    let Some(folder) = with_gpu(scene_folder) else { return };
    let needles = ["mean      p99     FLIP    seams", "\ndefault", "\nthree", "\nenough", "\nhard"];
    let policies = ["default", "enough", "hard", "three"].map(|name| [name.to_owned(), format!("{name}_error")]);
    let pictures = [vec!["all".to_owned()], policies.concat()].concat();
    let json = assert_reports("lights", &needles, &pictures, folder.path());
    assert!(json["hard"]["mean"].as_f64() > json["three"]["mean"].as_f64(), "{json}");
    assert!(json["three"]["mean"].as_f64() > json["enough"]["mean"].as_f64(), "{json}");
    assert!(json["hard"]["seams"].is_f64() && json["seam_pairs"].is_u64(), "{json}");

    // What render writes, another frame, another camera.
    let args = ["render", "scene.ron", "--size", "64x36", "--lights", "hard", "--frames", "5..6", "-o", "frames"];
    succeeds(&args, folder.path());
    measure("lights", &["later", "--frame", "5"], folder.path());
    let read = |name: &str| fs::read(folder.path().join(name)).expect("a picture");
    assert!(read("later/hard.png") == read("frames/color_00005.png"));
    measure("lights", &["above", "--camera", "above"], folder.path());
    assert!(read("above/all.png") != read("out/all.png"));
}

#[test]
fn bad_input_of_what_measures_a_scene_exits_with_2_and_writes_nothing() {
    for command in ["lights", "shadows"] {
        let folder = scene_folder();
        let run = |args: &[&str]| relief(&[&[command], args, &["-o", "o"]].concat(), folder.path());
        assert_fails(&run(&["missing.ron"]), 2, &["missing.ron"]);
        assert_fails(&run(&["scene.ron", "--camera", "back"]), 2, &["unknown camera \"back\"", "front, above"]);
        assert_fails(&run(&["scene.ron", "--size", "9000x9000"]), 2, &["9000x9000", "at most 16777216 pixels"]);
        assert_fails(&run(&["scene.ron", "--frame", "-1"]), 2, &["'-1'"]);
        assert_fails(&run(&["scene.ron", "--technique", "nomral"]), 2, &["did you mean \"normal\"?"]);
        assert_fails(&relief(&[command, "scene.ron"], folder.path()), 2, &["--output"]);
        assert!(!folder.path().join("o").exists(), "nothing is half-written");
        if common::gpu().is_some() {
            fs::write(folder.path().join("taken"), "a file").expect("a file");
            let output = relief(&[command, "scene.ron", "--size", "8x8", "-o", "taken"], folder.path());
            assert_fails(&output, 2, &["taken: not a directory"]);
        }
    }
}

#[test]
fn shadows_reports_errors_as_a_table_or_json_and_writes_pictures() {
    let Some(folder) = with_gpu(scene_folder) else { return };
    let needles = ["of 9216 samples", "\nunshadowed", "\nmaps ", "\nperfect"];
    let pictures = ["maps", "maps_error", "perfect", "perfect_error", "truth", "unshadowed", "unshadowed_error"];
    let json = assert_reports("shadows", &needles, &pictures.map(str::to_owned), folder.path());
    assert!(json["unshadowed"]["mean"].as_f64() > json["perfect"]["mean"].as_f64(), "{json}");
    assert!(json["perfect"]["p99"].is_f64() && json["unmet_samples"].is_u64(), "{json}");

    let truth = |out: &str| fs::read(folder.path().join(out).join("truth.png")).expect("a picture");
    measure("shadows", &["later", "--frame", "5"], folder.path());
    measure("shadows", &["above", "--camera", "above"], folder.path());
    assert!(truth("later") != truth("out") && truth("above") != truth("out"));
}

#[test]
fn textures_that_take_more_than_they_may_are_drawn_smaller_and_named() {
    let Some(folder) = with_gpu(scene_folder) else { return };
    let wall = image::RgbImage::from_fn(1024, 1024, |x, y| image::Rgb([(x / 4) as u8, (y / 4) as u8, 40]));
    wall.save(folder.path().join("wall.png")).expect("a texture");
    let scene = SCENE.replace("base_factor: (0.8, 0.1, 0.1)", "base_map: \"wall.png\"");
    fs::write(folder.path().join("scene.ron"), scene).expect("a scene");
    let render = |out: &str, megabytes: &str| {
        let args = ["render", "scene.ron", "-o", out, "--size", "96x54", "--texture-memory", megabytes];
        let said = text(&succeeds(&args, folder.path()).stderr);
        (said, image::open(folder.path().join(out).join("color_00000.png")).expect("a picture").to_rgb8())
    };
    let (said, whole) = render("whole", "6");
    assert!(!said.contains("textures reduced"), "{said}");
    let (said, smaller) = render("smaller", "1");
    assert!(said.contains("wall 1024×1024 as 256×256") && said.contains("(limit: 1 MB)"), "{said}");
    // At this size a quarter is enough: less than a step of 8 bits is not to be seen.
    let difference = |(a, b): (&u8, &u8)| f64::from(a.abs_diff(*b));
    let mean = whole.iter().zip(smaller.iter()).map(difference).sum::<f64>() / whole.len() as f64;
    assert!(mean < 1.0, "{mean}");
}

#[test]
fn no_output_takes_the_place_of_what_the_scene_is_made_from() {
    let folder = scene_folder();
    let at = |name: &str| folder.path().join(name);
    let picture = image::RgbImage::from_pixel(8, 8, image::Rgb([90, 120, 40]));
    let names = ["color_00007.png", "three_error.png", "ball.png", "yard.png"];
    names.iter().for_each(|name| picture.save(at(name)).expect("a texture"));
    // The last is named by a model that the scene names.
    let model = r#"{"asset": {"version": "2.0"}, "images": [{"uri": "yard.png"}], "buffers": [{"uri": "points.bin", "byteLength": 36}],
        "textures": [{"source": 0}], "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3,
        "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0},
        "material": 0}]}], "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}], "scene": 0}"#;
    fs::write(at("model.gltf"), model).expect("a model");
    let points = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0f32];
    fs::write(at("points.bin"), points.map(f32::to_le_bytes).concat()).expect("its points");
    let maps = "base_map: \"color_00007.png\", specular_map: \"three_error.png\", emissive_map: \"ball.png\"";
    let scene = SCENE.replace("base_factor: (0.8, 0.1, 0.1)", maps);
    let scene = scene.replace("entities: [", "entities: [(mesh: \"model\"), (figure: [\"ball\", \"floor\"]),");
    let scene = scene.replace("meshes: {", "meshes: { \"model\": model(file: \"model.gltf\"),");
    fs::write(at("scene.ron"), scene).expect("a scene");
    let before = contents(folder.path());
    let render = ["render", "scene.ron", "-o", ".", "--frames", "8"];
    let gallery = ["gallery", "--scene", "scene.ron", "-o", "."];
    let bench = ["bench", "--scene", "scene.ron", "--picture", "yard.png", "--frames", "1"];
    let here = format!("../{}", folder.path().file_name().expect("a name").to_string_lossy());
    let lights = ["lights", "scene.ron", "-o", &here];
    for (args, name) in [&render[..], &lights, &gallery, &bench].into_iter().zip(names) {
        let said = [name, "an output would overwrite this input file", "expected another name or directory"];
        assert_fails(&relief(args, folder.path()), 2, &said);
        assert!(contents(folder.path()) == before, "{args:?}");
    }
    succeeds(&["render", "scene.ron", "-o", "out", "--size", "64x36"], folder.path());
}
