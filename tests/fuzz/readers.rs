//! Each target for a second or two: what was found once, the seeds as they are, and changed ones, the same in every
//! run.

use fastrand::Rng;
use fuzz::{Place, TARGETS, Target, mutate, repair, seeds};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A reader's time for a file. What is asked for is five seconds of a release build.
const TIME_LIMIT: Duration = Duration::from_secs(20);
/// Changed files per target.
const CHANGED: usize = 60;

fn data() -> Option<PathBuf> {
    std::env::var_os("RELIEF_TEST_DATA").map(PathBuf::from).filter(|folder| folder.is_dir())
}

fn read(target: &Target, place: &Place, what: &str, bytes: &[u8]) {
    let start = Instant::now();
    let survived = std::panic::catch_unwind(|| (target.read)(place, bytes)).is_ok();
    let (name, took) = (target.name, start.elapsed());
    if !survived || took > TIME_LIMIT {
        let kept = std::env::temp_dir().join(format!("relief-fuzz-{name}"));
        let _ = fs::write(&kept, bytes);
        panic!(
            "{name}, {what}: {}, took {took:?}; the file is {}",
            if survived { "ends" } else { "panics" },
            kept.display()
        );
    }
}

#[test]
fn damaged_files_of_every_kind_are_read_or_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    Place::prepare(folder.path()).expect("stand-ins for assets");
    let seeds = seeds::all(folder.path(), data().as_deref()).expect("seeds");
    let place = Place::new(folder.path());
    for target in TARGETS {
        let seeds = &seeds[target.name];
        let mut random = Rng::with_seed(30);
        for round in 0..CHANGED {
            let mut bytes = seeds[random.usize(..seeds.len())].clone();
            if target.is_text {
                mutate::text(&mut bytes, &mut random)
            } else {
                mutate::binary(&mut bytes, &mut random)
            }
            read(&target, &place, &format!("round {round}"), &bytes);
        }
    }
}

/// Files in `tests/fuzz/found/TARGET`, the smallest of each fault that was found.
#[test]
fn what_was_found_once_is_read_or_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    Place::prepare(folder.path()).expect("stand-ins for assets");
    let place = Place::new(folder.path());
    let found = Path::new(env!("CARGO_MANIFEST_DIR")).join("found");
    for target in TARGETS {
        let Ok(files) = fs::read_dir(found.join(target.name)) else { continue };
        for file in files.flatten() {
            let bytes = fs::read(file.path()).expect("a file");
            read(&target, &place, &file.file_name().to_string_lossy(), &bytes);
        }
    }
}

#[test]
fn what_is_sound_needs_no_repair() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    Place::prepare(folder.path()).expect("stand-ins for assets");
    let seeds = seeds::all(folder.path(), None).expect("seeds");
    type Repair = fn(&mut [u8]);
    let repairs: [(&str, Repair); 3] =
        [("png", repair::png), ("recording", repair::blocks), ("snapshot", repair::blocks)];
    for (target, repair) in repairs {
        for (number, bytes) in seeds[target].iter().enumerate() {
            let mut repaired = bytes.clone();
            repair(&mut repaired);
            assert!(repaired == *bytes, "{target}, seed {number}");
        }
    }
}
