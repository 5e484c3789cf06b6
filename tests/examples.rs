//! The examples run without a window and leave pictures of something.

mod common;

use std::path::PathBuf;
use std::process::Command;

/// Where cargo puts examples: beside the folder of this test's program.
fn built(example: &str) -> PathBuf {
    let test = std::env::current_exe().expect("this program");
    let folder = test.parent().and_then(|deps| deps.parent()).expect("target/PROFILE/deps");
    folder.join("examples").join(format!("{example}{}", std::env::consts::EXE_SUFFIX))
}

fn pictures_of(example: &str, names: &[&str]) {
    if common::gpu().is_none() {
        return;
    }
    let program = built(example);
    if !program.exists() {
        assert!(!common::strict(), "{} is not built", program.display());
        return eprintln!("skipped: {example} is not built (cargo build --examples)");
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = Command::new(program).current_dir(folder.path()).output().expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for name in names {
        let picture = image::open(folder.path().join(name)).expect("a picture").into_rgb8();
        let mut colors: Vec<[u8; 3]> = picture.pixels().map(|p| p.0).collect();
        colors.sort_unstable();
        colors.dedup();
        assert!(colors.len() > 300, "{name} has {} colours", colors.len());
    }
}

#[test]
fn add_light() {
    pictures_of("add_light", &["add_light_1.png", "add_light_2.png"]);
}

#[test]
fn add_vehicle() {
    pictures_of("add_vehicle", &["add_vehicle.png"]);
}

#[test]
fn many_objects() {
    pictures_of("many_objects", &["many_objects.png"]);
}

#[test]
fn several_cameras() {
    pictures_of("several_cameras", &["front.png", "above.png"]);
}

#[test]
fn own_pass() {
    pictures_of("own_pass", &["own_pass.png"]);
}

#[test]
fn own_world() {
    pictures_of("own_world", &["own_world.png"]);
}
