//! `manifest.json` of a shard: which files there are, and what made them.

use super::job::read_text;
use crate::output::{self, OutputError};
use crate::recording::PROGRAM;
use crate::renderer::Gpu;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use systems::run::state_hash::StateHash;

/// The file's name in the shard's folder.
pub const NAME: &str = "manifest.json";

/// Contents of the file.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Manifest {
    /// Hash of the job's file (BLAKE3).
    pub job: String,
    /// Machine that rendered it.
    pub machine: Machine,
    /// The state at its first frame.
    pub first: State,
    /// The state at the next shard's first frame; of the last shard, after its own last.
    pub last: State,
    /// BLAKE3 of each file, by its path in the shard's folder.
    pub blake3: BTreeMap<String, String>,
}

/// Machine and program, on which the bytes of pictures depend beside the job.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Machine {
    /// The program's version.
    pub version: String,
    /// Processor and operating system, as programs are built for them.
    pub system: String,
    /// The adapter; those that are programs say how wide their vectors are.
    pub adapter: String,
    /// Its driver, with the version.
    pub driver: String,
}

/// A state of the run.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct State {
    /// After this step.
    pub step: u64,
    /// In hexadecimal digits.
    pub hash: String,
}

impl Machine {
    /// This one, with a device.
    pub fn of(gpu: &Gpu) -> Self {
        let adapter = gpu.adapter.get_info();
        Self {
            version: PROGRAM.to_owned(),
            system: format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS),
            adapter: adapter.name,
            driver: format!("{} {}", adapter.driver, adapter.driver_info),
        }
    }
}

impl std::fmt::Display for Machine {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Self { version, system, adapter, driver } = self;
        write!(f, "version {version}, {system}, {adapter}, {driver}")
    }
}

impl Manifest {
    /// Manifest of a shard whose files are these, all in its folder; `states`: its first and its last.
    ///
    /// # Errors
    /// A file that cannot be read back.
    pub fn of(
        job: &str,
        machine: Machine,
        states: [(u64, StateHash); 2],
        (folder, files): (&Path, &[PathBuf]),
    ) -> Result<Self, OutputError> {
        let [first, last] = states.map(|(step, hash)| State { step, hash: hash.to_string() });
        Ok(Self { job: job.to_owned(), machine, first, last, blake3: output::hashes_of(folder, files)? })
    }

    /// Reads the manifest of a shard and checks its files.
    ///
    /// # Errors
    /// The reason for which the shard is to be rendered.
    pub fn check(folder: &Path, job: &str) -> Result<Self, String> {
        if !folder.is_dir() {
            return Err("not rendered".to_owned());
        }
        let bytes = read_text(&folder.join(NAME)).map_err(|error| format!("{NAME}: {error}"))?;
        let manifest: Self = serde_json::from_slice(&bytes).map_err(|error| format!("{NAME} is damaged: {error}"))?;
        if manifest.job != job {
            return Err("rendered for another shards.json".to_owned());
        }
        for (name, hash) in &manifest.blake3 {
            if !is_below(name) {
                return Err(format!("{NAME} is damaged: {name:?} is no file of the shard"));
            }
            match output::hash_of(&folder.join(name)) {
                Ok(found) if found == *hash => {}
                Ok(_) => return Err(format!("{name} is damaged: its BLAKE3 is not that of {NAME}")),
                Err(error) => return Err(format!("{name}: {error}")),
            }
        }
        Ok(manifest)
    }
}

/// Tells if a name is that of something below a folder, as [`output::hashes_of`] writes it.
fn is_below(name: &str) -> bool {
    let is_part = |part: &str| !part.is_empty() && part != "." && !part.contains('\\');
    name.split('/').all(is_part) && Path::new(name).components().all(|part| matches!(part, Component::Normal(_)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_files_do_not_lead_elsewhere() {
        for name in ["data/color_00000.png", "films/ego/front/color/7.png", "a"] {
            assert!(is_below(name), "{name}");
        }
        for name in ["", "/a", "data//etc/passwd", "data/../../a", "../a", "./a", "data/.", "data/", "a\\b"] {
            assert!(!is_below(name), "{name}");
        }
    }
}
