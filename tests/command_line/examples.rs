//! The examples run without a window, and those that draw leave pictures of something.

use crate::common::display::{Display, Running, wait_for};
use crate::common::{self, prelude::*};
use std::process::Command;

/// Path of a built example: in `examples`, beside the folder of this test's program.
fn built(example: &str) -> PathBuf {
    let test = std::env::current_exe().expect("this program");
    let folder = test.parent().and_then(|deps| deps.parent()).expect("target/PROFILE/deps");
    folder.join("examples").join(format!("{example}{}", std::env::consts::EXE_SUFFIX))
}

/// The command for an example; `None`, said aloud, where it is not built.
fn command(example: &str) -> Option<Command> {
    let program = built(example);
    if program.exists() {
        return Some(Command::new(program));
    }
    common::skip(&format!("{} is not built (cargo build --examples)", program.display()));
    None
}

/// Runs an example in a folder; returns what it prints.
fn run(example: &str, folder: &Path) -> Option<String> {
    let output = command(example)?.current_dir(folder).output().expect("it runs");
    assert!(output.status.success(), "{}", common::text(&output.stderr));
    Some(common::text(&output.stdout))
}

fn colors_of(picture: &image::RgbImage) -> usize {
    let mut colors: Vec<[u8; 3]> = picture.pixels().map(|p| p.0).collect();
    colors.sort_unstable();
    colors.dedup();
    colors.len()
}

#[test]
fn pictures_show_something() {
    for (example, names) in [
        ("add_light", &["add_light_1.png", "add_light_2.png"][..]),
        ("add_vehicle", &["add_vehicle.png"]),
        ("many_objects", &["many_objects.png"]),
        ("several_cameras", &["front.png", "above.png"]),
        ("swap_assets", &["swap_assets_1.png", "swap_assets_2.png"]),
        ("own_pass", &["own_pass.png"]),
        ("own_world", &["own_world.png"]),
    ] {
        let Some(folder) = with_gpu(Folder::new) else { return };
        if run(example, folder.path()).is_none() {
            continue;
        }
        for name in names {
            let colors = colors_of(&image::open(folder.at(name)).expect("a picture").into_rgb8());
            assert!(colors > 300, "{example}: {name} has {colors} colours");
        }
    }
}

#[test]
fn own_state() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let said = run("own_state", folder.path());
    assert!(said.is_none_or(|said| said == "100 steps come out as recorded\n"));
}

#[test]
fn own_format() {
    let Some(folder) = with_gpu(Folder::new) else { return };
    let Some(said) = run("own_format", folder.path()) else { return };
    let files = ["ego/front/depth_00000.npy", "ego/top/points_00012.npy", "things.csv", "manifest.json"];
    assert!(files.iter().all(|file| said.contains(&format!("own_format/{file}\n"))), "{said}");
    let table = fs::read_to_string(folder.at("own_format/things.csv")).expect("a table");
    // The van that drives ahead is seen at each of three captures.
    let of_van = |line: &&str| line.contains("ego/front") && line.split(',').nth(3) == Some("truck");
    assert!(table.lines().filter(of_van).count() >= 3, "{table}");
    let manifest = fs::read_to_string(folder.at("own_format/manifest.json")).expect("a manifest");
    assert!(manifest.contains("\"things.csv\": \""), "{manifest}");
}

#[test]
fn own_sensor() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(said) = run("own_sensor", folder.path()) else { return };
    let files = [0, 2, 4].map(|step| format!("own_sensor/plate/slope/inclinometer_{step:05}.npy\n"));
    assert!(files.iter().all(|file| said.contains(file)), "{said}");
    let read = |file: &str| std::fs::read(folder.path().join("own_sensor").join(file)).expect("a file");
    let degrees = |step: u32| {
        let bytes = read(&format!("plate/slope/inclinometer_{step:05}.npy"));
        f64::from_le_bytes(bytes[bytes.len() - 8..].try_into().expect("a number"))
    };
    // Forward is turned up by 10 degrees; no number of the noise is beyond 3.67 deviations.
    let found = [0, 2, 4].map(degrees);
    assert!(found.iter().all(|degrees| (degrees - 10.0).abs() < 3.7 * 0.05 && *degrees != 10.0), "{found:?}");
    assert!(found[0] != found[1] && found[1] != found[2], "{found:?}");
    let described: serde_json::Value = serde_json::from_slice(&read("sensors.json")).expect("JSON");
    let sensor = &described["sensors"][0];
    assert_eq!((&sensor["kind"], &sensor["every"]), (&"inclinometer".into(), &2.into()));
    assert_eq!(sensor["outputs"]["degrees"]["unit"], "degrees");
}

#[test]
fn sensors() {
    let Some(folder) = with_gpu(Folder::new) else { return };
    let Some(said) = run("sensors", folder.path()) else { return };
    let steps: Vec<&str> = said.lines().filter_map(|line| line.split(':').next()).collect();
    assert_eq!(steps, ["step 6", "step 12", "step 18"], "{said}");
}

#[test]
fn own_window() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(display) = Display::start(folder.path()) else { return };
    let Some(mut command) = command("own_window") else { return };
    command.env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET").env("DISPLAY", &display.name);
    let _running = Running(command.spawn().expect("it starts"));
    let look = || display.look((480, 270)).filter(|picture| colors_of(picture) > 300);
    let first = wait_for("a picture", look);
    wait_for("another one", || look().filter(|picture| *picture != first));
}
