//! Helpers of several tests, of which each program uses some.

#![allow(dead_code)]

use prelude::*;
use relief::renderer::ViewTarget;

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
pub fn gpu() -> Option<Gpu> {
    match Gpu::headless() {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            skip(&error.to_string());
            None
        }
    }
}

/// Things of a test that draws; `None`, said aloud, where there is none.
///
/// # Panics
/// In strict mode, where there is none.
pub fn with_gpu<T>(make: impl FnOnce() -> T) -> Option<T> {
    gpu().map(|_| make())
}

/// No light but that of lamps and suns, and pictures that are what their linear colours are.
pub fn dark() -> Environment {
    let [ambient, zenith, horizon, ground] = [Vec3::ZERO; 4];
    Environment { ambient, zenith, horizon, ground, exposure: 1.0, tone_map: ToneMap::Clamp, ..Environment::default() }
}

/// Output of a program, as text.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// All files below a folder, by their paths in it.
pub fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(next).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("below").to_owned();
                found.insert(name, fs::read(&path).expect("read"));
            }
        }
    }
    found
}

/// Names of all files and folders in a folder, sorted.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder").flatten();
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
    assert_has(&error, needles);
}

/// Asserts that a text has all of these parts.
///
/// # Panics
/// If it has not.
#[track_caller]
pub fn assert_has(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "\"{part}\" is not in: {text}");
    }
}

/// The only one of all.
///
/// # Panics
/// If there are none or several.
#[track_caller]
pub fn only(all: &[String]) -> &str {
    let [one] = all else { panic!("expected one, found {all:#?}") };
    one
}

/// Random numbers, the same in every run.
pub fn random() -> TestRng {
    TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha)
}

/// A file or folder of those that come with the project.
pub fn asset(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets").join(path)
}

/// Draws views in one submission, after they were prepared.
pub fn encode(renderer: &mut Renderer, views: &mut [ViewTarget<'_>]) {
    let gpu = renderer.gpu().clone();
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    renderer.encode(&mut encoder, views);
    gpu.queue.submit([encoder.finish()]);
}

/// Draws with default settings.
pub fn headless(gpu: &Gpu) -> Headless {
    Headless { renderer: SingleView::new(gpu), settings: Settings::default() }
}

/// Asserts that `relief check` refuses `scene.ron` of a folder, with these words.
///
/// # Panics
/// If it does not.
#[track_caller]
pub fn assert_fails_to_check(folder: &Path, expected: &str) {
    let output = relief(&["check", "scene.ron"], folder);
    let said = text(&output.stdout) + &text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains(expected), "{expected} is not in: {said}");
}

/// Cases of a text, each indented by four spaces: what is given, in one or more lines, and after an arrow what is
/// expected, which may go on in lines that are indented further. Lines that begin with `##` are comments.
///
/// # Panics
/// A line is not indented, or a case has no arrow.
pub fn cases(text: &str) -> Vec<(String, String)> {
    let (mut cases, mut given) = (Vec::<(String, String)>::new(), Vec::new());
    for line in text.lines().filter(|line| !line.trim().is_empty()) {
        let line = line.strip_prefix("    ").unwrap_or_else(|| panic!("expected four spaces before {line:?}"));
        if line.starts_with("##") {
            continue;
        }
        match (line.split_once("→ "), line.strip_prefix("  "), cases.last_mut()) {
            (Some((last, expected)), ..) => {
                given.extend(Some(last.trim_end()).filter(|last| !last.is_empty()));
                cases.push((given.join("\n"), expected.to_owned()));
                given.clear();
            }
            (None, Some(more), Some((_, expected))) if given.is_empty() => *expected += &format!(" {more}"),
            _ => given.push(line),
        }
    }
    assert!(!cases.is_empty() && given.is_empty(), "expected an arrow after {given:?}");
    cases
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
pub fn command(args: &[&str], folder: &Path) -> std::process::Command {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_relief"));
    command.args(args).current_dir(folder).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    command
}

/// Runs `relief` with some arguments, in a folder.
pub fn relief(args: &[&str], folder: &Path) -> std::process::Output {
    command(args, folder).output().expect("the binary runs")
}

/// Runs `relief` as [`relief`] does, and returns the output of a success.
///
/// # Panics
/// If it fails.
#[track_caller]
pub fn succeeds(args: &[&str], folder: &Path) -> std::process::Output {
    let output = relief(args, folder);
    assert!(output.status.success(), "{args:?}: {}", text(&output.stderr));
    output
}

/// A temporary folder, and the program in it.
pub struct Folder(tempfile::TempDir);

impl std::ops::Deref for Folder {
    type Target = tempfile::TempDir;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    pub fn at(&self, name: &str) -> PathBuf {
        self.path().join(name)
    }

    /// Writes a file, and returns its path.
    pub fn file(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        fs::write(self.at(name), content).expect("written");
        self.at(name)
    }

    #[track_caller]
    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.at(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    pub fn relief(&self, args: &[&str]) -> std::process::Output {
        relief(args, self.path())
    }

    #[track_caller]
    pub fn succeeds(&self, args: &[&str]) -> std::process::Output {
        succeeds(args, self.path())
    }

    /// Asserts that the program refuses what it is asked, with these words in its last line.
    #[track_caller]
    pub fn is_refused(&self, args: &[&str], needles: &[&str]) {
        let output = self.relief(args);
        assert_fails(&output, 2, &[]);
        assert_has(text(&output.stderr).trim_end().lines().last().unwrap_or_default(), needles);
    }
}

/// A folder with `scene.ron`.
pub fn scene_folder(scene: &str) -> Folder {
    let folder = Folder::new();
    folder.file("scene.ron", scene);
    folder
}

/// A world without light, in which nothing moves.
pub fn dark_world() -> Simulation {
    let mut simulation = Simulation::new();
    simulation.world.insert_resource(dark());
    simulation
}

/// A material of one colour, linear, seen from both sides.
pub fn unlit(simulation: &mut Simulation, color: Vec3) -> MaterialId {
    let mut library = simulation.world.resource_mut::<Library>();
    let base_factor = color.extend(1.0);
    library.add_material(Material { base_factor, shading: Shading::Unlit, double_sided: true, ..Material::default() })
}
