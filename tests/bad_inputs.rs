//! Broken and hostile files: what the manifest calls valid loads; the rest is refused by name and place, or loads with
//! a warning. Nothing panics, hangs or fills the memory.

mod common;

use crate::common::prelude::*;
use relief::import::{ImportError, check_model, load_image};
use relief::problem::{Problem, Severity};
use std::time::{Duration, Instant};

const TIME_LIMIT: Duration = Duration::from_secs(5);
const MEMORY_LIMIT_KB: u64 = 1 << 20;

struct Row {
    file: String,
    /// Errors that the reference validator finds; `None` where the manifest tells in words what to expect.
    errors: Option<u32>,
    expectation: String,
}

/// The manifest is CSV with quotes around fields that hold commas.
fn manifest(folder: &Path) -> Vec<Row> {
    let text = std::fs::read_to_string(folder.join("MANIFEST.csv")).unwrap();
    let rows: Vec<Row> = text
        .lines()
        .skip(1)
        .map(|line| {
            let mut fields = vec![String::new()];
            let mut quoted = false;
            for c in line.chars() {
                match c {
                    '"' => quoted = !quoted,
                    ',' if !quoted => fields.push(String::new()),
                    c => fields.last_mut().unwrap().push(c),
                }
            }
            Row { file: fields[0].clone(), errors: fields[2].parse().ok(), expectation: fields[3].clone() }
        })
        .collect();
    assert!(rows.len() > 300, "the manifest is not whole");
    rows
}

enum Outcome {
    Refused(ImportError),
    Warned(Vec<String>),
    Clean,
}

fn load(path: &Path) -> Outcome {
    let is_model = path.extension().is_some_and(|e| e == "gltf" || e == "glb");
    if !is_model {
        return load_image(path, ImageKind::Color).map_or_else(Outcome::Refused, |_| Outcome::Clean);
    }
    let mut library = Library::default();
    let before = library.sizes();
    match load_model(path, &mut library) {
        Err(error) => {
            assert_eq!(before, library.sizes(), "{}: refused, yet something joined the library", path.display());
            Outcome::Refused(error)
        }
        Ok(model) => {
            assert_sane(&model, &library, path);
            let warnings: Vec<String> = model.warnings.iter().map(ToString::to_string).collect();
            // This comes with sound files too, and says nothing about what is broken.
            let telling = warnings.into_iter().filter(|w| !w.ends_with("nothing is drawn")).collect::<Vec<_>>();
            if telling.is_empty() { Outcome::Clean } else { Outcome::Warned(telling) }
        }
    }
}

/// Asserts that a loaded model can be drawn without further checks.
fn assert_sane(model: &relief::import::Model, library: &Library, path: &Path) {
    for (_, place) in model.placed() {
        assert!(place.is_finite(), "{}: a node's place is not finite", path.display());
    }
    for (_, entry) in library.meshes() {
        let mesh = &entry.mesh;
        let count = mesh.positions.len();
        assert!(
            mesh.indices.len() % 3 == 0 && mesh.indices.iter().all(|&i| (i as usize) < count),
            "{}",
            path.display()
        );
        assert!(mesh.positions.iter().all(|p| p.is_finite()), "{}", path.display());
        assert!(mesh.normals.len() == count && mesh.normals.iter().all(|n| n.is_normalized()), "{}", path.display());
        for length in [mesh.tangents.len(), mesh.uvs[0].len(), mesh.uvs[1].len(), mesh.colors.len()] {
            assert!(length == 0 || length == count, "{}: {length} of {count}", path.display());
        }
    }
}

fn peak_memory_kb() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?.trim().trim_end_matches(" kB").parse().ok()
}

#[test]
fn every_bad_input_is_refused_by_place_or_loads_sanely() {
    let Some(data) = common::test_data() else { return };
    let folder = data.join("bad-inputs");
    let verbose = std::env::var_os("RELIEF_VERBOSE").is_some();
    let (mut refused, mut warned, mut clean, mut valid) = (0, 0, 0, 0);
    let mut failures = Vec::new();
    for Row { file, errors, expectation } in manifest(&folder) {
        let path = folder.join(&file);
        let start = Instant::now();
        let Ok(outcome) = std::panic::catch_unwind(|| load(&path)) else {
            failures.push(format!("{file}: panicked"));
            continue;
        };
        let took = start.elapsed();
        if took > TIME_LIMIT {
            failures.push(format!("{file}: took {took:?}"));
        }
        if verbose {
            match &outcome {
                Outcome::Refused(error) => println!("refused  {errors:?} {error}"),
                Outcome::Warned(warnings) => warnings.iter().for_each(|w| println!("warned   {errors:?} {w}")),
                Outcome::Clean => println!("clean    {errors:?} {file} ({expectation})"),
            }
        }
        let sound = expectation.starts_with("loads") || expectation.starts_with("spec-legal");
        let errors = if sound { Some(0) } else { errors };
        match (errors, &outcome) {
            (Some(0), Outcome::Refused(error)) => failures.push(format!("valid, but refused: {error}")),
            (Some(0), _) => valid += 1,
            (_, Outcome::Refused(error)) => {
                refused += 1;
                if !error.to_string().contains(&file) {
                    failures.push(format!("{file}: the error does not name the file: {error}"));
                }
            }
            (_, Outcome::Warned(_)) => warned += 1,
            (Some(_), Outcome::Clean) => failures.push(format!("{file}: {expectation} went unnoticed")),
            (None, Outcome::Clean) => {
                clean += 1;
                if expectation.contains("must be reported as an error") {
                    failures.push(format!("{file}: loads"));
                }
            }
        }
    }
    println!("valid and loaded: {valid}; broken: {refused} refused, {warned} loaded with warnings, {clean} loaded");
    assert!(failures.is_empty(), "{} failures:\n{}", failures.len(), failures.join("\n"));
    assert!(valid > 50 && refused > 100 && warned > 20, "the manifest has changed");
    if let Some(peak) = peak_memory_kb() {
        println!("peak memory: {} MB", peak >> 10);
        assert!(peak < MEMORY_LIMIT_KB, "peak memory {peak} kB");
    }
}

#[test]
fn checking_agrees_with_loading_and_names_every_place() {
    let Some(data) = common::test_data() else { return };
    let folder = data.join("bad-inputs");
    for row in manifest(&folder).into_iter().filter(|r| r.file.ends_with(".gltf") || r.file.ends_with(".glb")) {
        let path = folder.join(&row.file);
        let problems = check_model(&path);
        let is_error = |p: &&Problem| p.severity == Severity::Error;
        let first = problems.iter().find(is_error).map(ToString::to_string);
        let refused = load_model(&path, &mut Library::default()).err().map(|e| e.to_string());
        assert_eq!(first, refused, "{}", row.file);
        assert!(problems.iter().all(|p| !p.place.is_empty() && !p.message.is_empty()), "{}: {problems:?}", row.file);
    }
}

/// Numbers below the one given, the same in every run (xorshift64).
fn random() -> impl FnMut(usize) -> usize {
    let mut state = 0x2545_F491_4F6C_DD1Du64;
    move |below| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % below as u64) as usize
    }
}

/// The JSON pointers of all values within.
fn pointers(value: &Value, here: String, found: &mut Vec<String>) {
    match value {
        Value::Object(members) => members.iter().for_each(|(k, v)| pointers(v, format!("{here}/{k}"), found)),
        Value::Array(items) => items.iter().enumerate().for_each(|(i, v)| pointers(v, format!("{here}/{i}"), found)),
        _ => {}
    }
    found.push(here);
}

/// Small files with a few bytes changed at random, thousands of times: whatever comes of it, it is no panic.
#[test]
fn damaged_copies_of_sound_files_never_panic() {
    let Some(data) = common::test_data() else { return };
    let folder = tempfile::tempdir().unwrap();
    let originals = [
        "models/GltfPrimitives/gltf_primitives.glb",
        "models/box_sparse/box_sparse.glb",
        "models/Lights/Lights.glb",
        "models/BoxTextured-Embedded/BoxTextured.gltf",
        "models/SimpleSkin/SimpleSkin.gltf",
        "models/SimpleInstancing/simple-instancing.glb",
        "models/TwoQuads/TwoQuads.gltf",
    ];
    let mut next = random();
    for original in originals {
        let bytes = std::fs::read(data.join(original)).unwrap();
        let path = folder.path().join(Path::new(original).file_name().unwrap());
        // JSON alone makes the interesting half: digits into other digits.
        let digits: Vec<usize> = (0..bytes.len().min(8000)).filter(|&i| bytes[i].is_ascii_digit()).collect();
        for round in 0..300 {
            let mut damaged = bytes.clone();
            for _ in 0..=next(3) {
                if round % 2 == 0 {
                    damaged[digits[next(digits.len())]] = b'0' + next(10) as u8;
                } else {
                    damaged[next(bytes.len())] = next(256) as u8;
                }
            }
            std::fs::write(&path, &damaged).unwrap();
            let start = Instant::now();
            let survived = std::panic::catch_unwind(|| load(&path)).is_ok();
            assert!(survived && start.elapsed() < TIME_LIMIT, "{original}, round {round}");
        }
    }
}

/// One property at a time replaced by something odd, in documents that use most of glTF: whatever passes the check
/// must suit the readers and the types they read from.
#[test]
fn documents_with_odd_values_never_panic() {
    let Some(data) = common::test_data() else { return };
    let odd =
        json!([null, true, -1, 0, 1, 2, 1.0, 0.5, 1e30, 5124, 5126, 4294967300u64, "", "odd", [], [0], [1, 1], {}]);
    let odd = odd.as_array().unwrap();
    let originals = [
        "models/SimpleSkin/SimpleSkin.gltf",
        "models/TextureTransformTest/TextureTransformTest.gltf",
        "models/BoxTextured-SpecGloss/BoxTextured.gltf",
        "models/Cameras/Cameras.gltf",
        "asset-generator/Buffer_Interleaved/Buffer_Interleaved_00.gltf",
        "bad-inputs/gltf-validator/base/material/alpha_modes.gltf",
    ];
    let mut next = random();
    for original in originals {
        let original = data.join(original);
        let root: Value = serde_json::from_slice(&std::fs::read(&original).unwrap()).unwrap();
        let mut places = Vec::new();
        pointers(&root, String::new(), &mut places);
        // Beside the original, for the files that it names.
        let folder = tempfile::tempdir().unwrap();
        for entry in std::fs::read_dir(original.parent().unwrap()).unwrap().flatten() {
            if entry.path().is_file() {
                std::fs::copy(entry.path(), folder.path().join(entry.file_name())).unwrap();
            }
        }
        let path = folder.path().join("odd.gltf");
        for _ in 0..300 {
            let mut changed = root.clone();
            let (place, value) = (&places[next(places.len())], &odd[next(odd.len())]);
            *changed.pointer_mut(place).unwrap() = value.clone();
            std::fs::write(&path, changed.to_string()).unwrap();
            let survived = std::panic::catch_unwind(|| load(&path)).is_ok();
            assert!(survived, "{}: {place} = {value}", original.display());
        }
    }
}
