//! Helpers of several tests, of which each program uses some.

#![allow(dead_code)]

use prelude::*;

/// True if what is missing fails a test rather than skipping it.
pub fn strict() -> bool {
    std::env::var_os("RELIEF_STRICT").is_some_and(|v| v != "0")
}

/// Says why a test, or a part of it, is skipped.
///
/// # Panics
/// In strict mode.
#[track_caller]
pub fn skip(why: &str) {
    assert!(!strict(), "{why}");
    skip_always(why);
}

/// Says why a test, or a part of it, is skipped, in strict mode, too: for what no installation changes, such as what an
/// adapter is.
pub fn skip_always(why: &str) {
    use std::io::Write;
    // Not by a macro: what these print is shown of failed tests alone.
    let _ = writeln!(std::io::stderr(), "skipped: {why}");
}

/// Looks for ffmpeg and what reads its films; said aloud where not.
///
/// # Panics
/// In strict mode, where they are not.
#[track_caller]
pub fn has_ffmpeg() -> bool {
    let runs = |tool| std::process::Command::new(tool).arg("-version").output().is_ok();
    let has = ["ffmpeg", "ffprobe"].into_iter().all(runs);
    if !has {
        skip("no ffmpeg");
    }
    has
}

/// The folder of test data: `RELIEF_TEST_DATA`, or `../shared/data` beside the project. `None`, said aloud, where there
/// is none.
///
/// # Panics
/// In strict mode, where there is none.
pub fn test_data() -> Option<PathBuf> {
    let folder = std::env::var_os("RELIEF_TEST_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    skip(&format!("no test data at {}", folder.display()));
    None
}

/// An open device; `None`, said aloud, where there is no adapter.
///
/// # Panics
/// In strict mode, where there is none.
pub fn gpu() -> Option<relief::renderer::Gpu> {
    match relief::renderer::Gpu::headless() {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            skip(&error.to_string());
            None
        }
    }
}

/// No light but that of lamps and suns, and pictures that are what their linear colours are.
pub fn dark() -> systems::draw::Environment {
    systems::draw::Environment {
        ambient: glam::Vec3::ZERO,
        zenith: glam::Vec3::ZERO,
        horizon: glam::Vec3::ZERO,
        ground: glam::Vec3::ZERO,
        exposure: 1.0,
        tone_map: systems::draw::ToneMap::Clamp,
    }
}

/// Output of a program, as text.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// All files below a folder, by their paths in it.
pub fn files(folder: &std::path::Path) -> std::collections::BTreeMap<PathBuf, Vec<u8>> {
    let mut found = std::collections::BTreeMap::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(next).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("below").to_owned();
                found.insert(name, std::fs::read(&path).expect("read"));
            }
        }
    }
    found
}

/// Names of all files and folders in a folder, sorted.
pub fn names(folder: &std::path::Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder").flatten();
    let mut names: Vec<_> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Asserts the exit code of a program, and that its errors hold all needles.
///
/// # Panics
/// If they do not.
#[track_caller]
pub fn assert_fails(output: &std::process::Output, code: i32, needles: &[&str]) {
    let error = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{error}");
    for needle in needles {
        assert!(error.contains(needle), "\"{needle}\" is not in: {error}");
    }
}

/// Asserts that `relief check` refuses `scene.ron` of a folder, with these words.
///
/// # Panics
/// If it does not.
#[track_caller]
pub fn assert_fails_to_check(folder: &std::path::Path, expected: &str) {
    let output = relief(&["check", "scene.ron"], folder);
    let said = text(&output.stdout) + &text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains(expected), "{expected} is not in: {said}");
}

/// Bump techniques.
pub mod bumps;
pub mod floor;

/// A display for windows, and the program with a window on it.
pub mod app;
pub mod display;

pub mod prelude;

/// Pictures of one square.
pub mod square;

/// Runs a script of `tests/python` that needs some modules; `None`, said aloud, where there is no Python that has them.
/// `scripts/python-packages` installs those that are in `tests/python/requirements.txt`.
///
/// # Panics
/// In strict mode, where there is none; where the script fails.
pub fn python(script: &str, modules: &[&str], args: &[&std::ffi::OsStr]) -> Option<std::process::Output> {
    use std::process::Command;
    let has_modules = |python: &PathBuf| {
        let asked = Command::new(python).args(["-c", &format!("import {}", modules.join(", "))]).output();
        asked.is_ok_and(|output| output.status.success())
    };
    // Beside the folder that cargo gives tests for their files.
    let installed = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).with_file_name("tools").join("python/bin/python");
    let known = ["python3", "/usr/bin/python3", "python"].map(PathBuf::from);
    let Some(python) = std::iter::once(installed).chain(known).find(has_modules) else {
        skip(&format!("no Python with {} (scripts/python-packages)", modules.join(", ")));
        return None;
    };
    let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/python").join(script);
    let output = Command::new(python).arg(script).args(args).output().expect("Python runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(output)
}

/// Command `relief` with some arguments, in a folder and without a display.
pub fn command(args: &[&str], folder: &std::path::Path) -> std::process::Command {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_relief"));
    command.args(args).current_dir(folder).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    command
}

/// Runs `relief` with some arguments, in a folder.
pub fn relief(args: &[&str], folder: &std::path::Path) -> std::process::Output {
    command(args, folder).output().expect("the binary runs")
}

/// Runs `relief` as [`relief`] does, and returns the output of a success.
///
/// # Panics
/// If it fails.
#[track_caller]
pub fn succeeds(args: &[&str], folder: &std::path::Path) -> std::process::Output {
    let output = relief(args, folder);
    assert!(output.status.success(), "{args:?}: {}", text(&output.stderr));
    output
}

/// A folder with `scene.ron`.
pub fn scene_folder(scene: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("scene.ron"), scene).expect("written");
    folder
}

/// A world without light, in which nothing moves.
pub fn dark_world() -> systems::Simulation {
    let mut simulation = systems::Simulation::new();
    simulation.world.insert_resource(dark());
    simulation
}

/// A material of one colour, linear, seen from both sides.
pub fn unlit(simulation: &mut systems::Simulation, color: glam::Vec3) -> systems::assets::MaterialId {
    use systems::assets::{Library, Material, Shading};
    let mut library = simulation.world.resource_mut::<Library>();
    let base_factor = color.extend(1.0);
    library.add_material(Material { base_factor, shading: Shading::Unlit, double_sided: true, ..Material::default() })
}
