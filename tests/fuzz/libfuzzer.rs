//! The program that `scripts/fuzz` builds and runs: libFuzzer with the target that `RELIEF_FUZZ_TARGET` names, in the
//! folder `RELIEF_FUZZ_FOLDER`, which is filled if it is not there.

#![no_main]

use fuzz::{Place, Target, mutate, seeds};
use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::{fs, io};

static WORK: LazyLock<(Target, Place)> = LazyLock::new(|| {
    let variable = |name| std::env::var(name).unwrap_or_else(|_| panic!("scripts/fuzz sets {name}"));
    let folder = PathBuf::from(variable("RELIEF_FUZZ_FOLDER"));
    let place = folder.join("place");
    if !place.exists() {
        fill(&folder, &place).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    }
    let target = fuzz::target(&variable("RELIEF_FUZZ_TARGET")).expect("a target of that name");
    (target, Place::new(&place))
});

/// Stand-ins for assets, seeds of all targets, words of text.
fn fill(folder: &Path, place: &Path) -> io::Result<()> {
    Place::prepare(place)?;
    let data = std::env::var_os("RELIEF_TEST_DATA").map(PathBuf::from);
    for (target, files) in seeds::all(place, data.as_deref().filter(|data| data.is_dir()))? {
        let seeds = folder.join("seeds").join(target);
        fs::create_dir_all(&seeds)?;
        fs::write(folder.join(format!("{target}.dict")), seeds::dictionary(&files))?;
        for (number, bytes) in files.iter().enumerate() {
            fs::write(seeds.join(format!("seed-{number:04}")), bytes)?;
        }
    }
    Ok(())
}

fuzz_target!(init: LazyLock::force(&WORK), |bytes: &[u8]| {
    let (target, place) = &*WORK;
    (target.read)(place, bytes);
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    // libFuzzer's own in half of the cases: it knows what was compared with what, and other files.
    if !WORK.0.is_text || seed.is_multiple_of(2) {
        return fuzzer_mutate(data, size, max_size);
    }
    let mut text = data[..size].to_vec();
    mutate::text(&mut text, &mut fastrand::Rng::with_seed(u64::from(seed)));
    text.truncate(max_size);
    data[..text.len()].copy_from_slice(&text);
    text.len()
});
