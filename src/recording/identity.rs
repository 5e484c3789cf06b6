//! Identity of a recording or a snapshot: this version of the program, and a scene with every file that it names.

use super::error::RecordingError;
use crate::import;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use systems::Simulation;
use systems::ecs::clock::{Clock, Seed};
use systems::space::origin::Origin;

/// The program and the scene of a run.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Identity {
    /// The program's version.
    pub program: String,
    /// The scene's path as it was given.
    pub scene: String,
    /// Hashes of its files (BLAKE3), by their paths relative to the scene's folder.
    pub files: BTreeMap<String, [u8; 32]>,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Length of a step in seconds.
    pub step_seconds: f64,
    /// Origin of the world, in the scene's coordinates, metres.
    pub origin: [f64; 3],
}

/// The version, and what this build lacks: the state of another is other state.
pub(crate) const PROGRAM: &str = if cfg!(feature = "physics") {
    env!("CARGO_PKG_VERSION")
} else if cfg!(feature = "vehicles") {
    concat!(env!("CARGO_PKG_VERSION"), " without physics")
} else {
    concat!(env!("CARGO_PKG_VERSION"), " without vehicles")
};

impl Identity {
    /// Identity of a scene which has been loaded; reads its files again.
    ///
    /// # Errors
    /// [`RecordingError::Refused`] names a file that cannot be read.
    pub fn of(scene: &Path, named: &[PathBuf], simulation: &Simulation) -> Result<Self, RecordingError> {
        let folder = scene.parent().unwrap_or(Path::new(""));
        let mut files = BTreeMap::new();
        for path in import::with_files_named_by(named) {
            let name = path.strip_prefix(folder).unwrap_or(&path).to_string_lossy().replace('\\', "/");
            if let std::collections::btree_map::Entry::Vacant(entry) = files.entry(name) {
                let bytes = import::read_file(&path).map_err(|error| RecordingError::refused(&path, error))?;
                entry.insert(*blake3::hash(&bytes).as_bytes());
            }
        }
        let world = &simulation.world;
        Ok(Self {
            program: PROGRAM.to_owned(),
            scene: scene.to_string_lossy().into_owned(),
            files,
            seed: world.resource::<Seed>().0,
            step_seconds: world.resource::<Clock>().step_seconds,
            origin: world.resource::<Origin>().0.to_array(),
        })
    }

    /// Checks that a file of this identity fits `now`: the current program and scene.
    ///
    /// # Errors
    /// [`RecordingError::Refused`] says what differs, by name.
    pub fn check(&self, path: &Path, now: &Self) -> Result<(), RecordingError> {
        let refused = |message: String| Err(RecordingError::refused(path, message));
        self.check_program(path)?;
        // The scene itself may have another name now.
        let (then, today) = (self.scene_name(), now.scene_name());
        for (name, hash) in &self.files {
            match now.files.get(if *name == then { &today } else { name }) {
                Some(found) if found == hash => {}
                Some(_) if *name == then && then != today => {
                    return refused(format!("made with another scene, {}; expected one of {}", self.scene, now.scene));
                }
                Some(_) => return refused(format!("{name} has changed since this file was made")),
                None => {
                    return refused(format!(
                        "made with another scene, {}: {} does not use {name}",
                        self.scene, now.scene
                    ));
                }
            }
        }
        if let Some(name) = now.files.keys().find(|&name| *name != today && !self.files.contains_key(name)) {
            return refused(format!("made with another scene, {}: {} also uses {name}", self.scene, now.scene));
        }
        if (self.seed, self.step_seconds) != (now.seed, now.step_seconds) {
            return refused(format!("made with another seed or step length than that of {}", now.scene));
        }
        if self.origin != now.origin {
            let [then, today] = [self.origin, now.origin].map(|[x, y, z]| format!("({x}, {y}, {z})"));
            return refused(format!(
                "made with the origin {then}, to which its positions are relative; the scene has {today}"
            ));
        }
        Ok(())
    }

    /// Name of the first file that is another, or only there, in `now`.
    pub(crate) fn changed_file<'a>(&'a self, now: &'a Self) -> Option<&'a str> {
        let mut names = self.files.keys().chain(now.files.keys());
        names.find(|name| self.files.get(*name) != now.files.get(*name)).map(String::as_str)
    }

    /// The scene's own name among its files.
    fn scene_name(&self) -> String {
        Path::new(&self.scene).file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Checks that this version of the program made it: another may move things otherwise.
    ///
    /// # Errors
    /// [`RecordingError::Refused`].
    pub fn check_program(&self, path: &Path) -> Result<(), RecordingError> {
        if self.program == PROGRAM {
            return Ok(());
        }
        let message = format!("made by version {:?} of the program; this is {PROGRAM}", self.program);
        Err(RecordingError::refused(path, message))
    }
}
