//! `manifest.json`: a hash of each file of a data set, and what made them.

use crate::output::OutputError;
use crate::renderer::Gpu;
use bevy_ecs::prelude::*;
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use systems::ecs::clock::Clock;
use systems::run::state_hash;

/// The file's text: of each file its BLAKE3, by its path in the folder; the program's version, the adapter with its
/// driver, and the last step with the hash of the state after it.
///
/// # Errors
/// [`OutputError::Io`]: a file cannot be read back.
pub(super) fn of_files(
    folder: &Path,
    files: &BTreeSet<PathBuf>,
    gpu: &Gpu,
    world: &mut World,
) -> Result<String, OutputError> {
    let mut hashes = BTreeMap::new();
    for path in files {
        let hash = hash_of(path).map_err(|error| OutputError::io(path, error))?;
        let name = path.strip_prefix(folder).unwrap_or(path).to_string_lossy().replace('\\', "/");
        hashes.insert(name, hash.to_string());
    }
    let adapter = gpu.adapter.get_info();
    let manifest = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "adapter": adapter.name,
        "driver": format!("{} {}", adapter.driver, adapter.driver_info),
        "last_step": world.resource::<Clock>().step,
        "state_hash": state_hash::hash(world).to_string(),
        "blake3": hashes,
    });
    Ok(format!("{manifest:#}\n"))
}

/// Of a file that need not fit into memory.
fn hash_of(path: &Path) -> std::io::Result<blake3::Hash> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(std::fs::File::open(path)?)?;
    Ok(hasher.finalize())
}
