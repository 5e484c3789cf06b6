//! Recordings and snapshots: as files whose checksums are right, and as what is behind them.

use crate::{Place, repair};
use relief::recording::{Recording, RunFiles};
use relief::session::{LoadOptions, Session};
use serde::{Deserialize, Serialize};
use std::path::Path;
use systems::run::inputs::{Inputs, SavedInput};
use systems::run::state_hash::StateHash;
use systems::run::{snapshot, state_hash};

/// The scene that runs are of: one of each kind of state.
pub const SCENE: &str = include_str!("run.ron");

/// Steps that are taken at the most.
const STEPS: usize = 24;

/// A block of a recording, as `src/recording/recorder.rs` has it.
#[derive(Serialize, Deserialize)]
pub enum Record {
    /// Inputs between this step and the next.
    Inputs(u64, Vec<SavedInput>),
    /// A step and its hash.
    Mark(u64, StateHash),
    /// A step and the state after it.
    Snapshot(u64, Vec<u8>),
    /// The last step and its hash.
    End(u64, StateHash),
}

/// The scene.
pub fn session(place: &Place) -> Session {
    let path = place.write("scenes", ".run.ron", SCENE.as_bytes());
    let options = LoadOptions { cache: false, ..LoadOptions::default() };
    Session::load(&path, &options).expect("the scene of runs is sound")
}

/// A recording file.
pub fn recording(place: &Place, bytes: &[u8]) {
    run(place, &place.write("", ".rec", &repair::mostly(bytes, repair::blocks)));
}

/// Replays a recording from what follows its first block: records, one after another.
pub fn replay(place: &Place, bytes: &[u8]) {
    let path = place.write("", ".rec", b"");
    let files = RunFiles { record: Some(path.clone()), ..RunFiles::default() };
    session(place).begin(&files, 0).expect("a recording can be begun");
    let mut file = std::fs::read(&path).expect("it was just written");
    let mut rest = bytes;
    while let Ok((record, after)) = postcard::take_from_bytes::<Record>(rest) {
        repair::append_block(&mut file, &postcard::to_stdvec(&record).expect("it was just read"));
        rest = after;
    }
    run(place, &place.write("", ".rec", &file));
}

fn run(place: &Place, path: &Path) {
    if let Err(error) = Recording::open(path, &Inputs::default()) {
        assert!(error.to_string().starts_with(&*path.to_string_lossy()), "which file? {error}");
        return;
    }
    begin(place, &RunFiles { replay: Some(path.to_owned()), ..RunFiles::default() });
}

/// Steps from what there is to begin from, while that works.
fn begin(place: &Place, files: &RunFiles) {
    let mut session = session(place);
    if session.begin(files, 0).is_err() {
        return;
    }
    for _ in 0..STEPS {
        if !session.play().is_ok_and(|taken| taken) {
            break;
        }
    }
    session.simulation.frame();
    snapshot::save(&mut session.simulation.world);
}

/// A snapshot file.
pub fn snapshot(place: &Place, bytes: &[u8]) {
    let path = place.write("", ".snapshot", &repair::mostly(bytes, repair::blocks));
    begin(place, &RunFiles { from_snapshot: Some(path), ..RunFiles::default() });
}

/// The state within a snapshot.
pub fn state(place: &Place, bytes: &[u8]) {
    let Session { mut simulation, .. } = session(place);
    if snapshot::restore(&mut simulation.world, bytes).is_err() {
        return;
    }
    for _ in 0..3 {
        simulation.step();
    }
    simulation.frame();
    state_hash::hash(&mut simulation.world);
}
