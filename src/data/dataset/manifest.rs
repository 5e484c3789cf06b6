//! `manifest.json`: a hash of each file of a data set, and what made them.

use crate::renderer::Gpu;
use bevy_ecs::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use systems::ecs::clock::Clock;
use systems::run::state_hash;

/// Contents of the file.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub(super) struct Manifest {
    /// The adapter that drew; `None`: nothing was drawn.
    adapter: Option<String>,
    /// BLAKE3 of each file, by its path in the folder.
    pub blake3: BTreeMap<String, String>,
    driver: Option<String>,
    last_step: u64,
    /// Hash of the state after the last step.
    state_hash: String,
    /// The program's.
    version: String,
}

impl Manifest {
    /// Manifest of a world as it is now, without files. `gpu`: the device, if anything was drawn.
    pub fn of_world(world: &mut World, gpu: Option<&Gpu>) -> Self {
        let adapter = gpu.map(|gpu| gpu.adapter.get_info());
        Self {
            blake3: BTreeMap::new(),
            driver: adapter.as_ref().map(|adapter| format!("{} {}", adapter.driver, adapter.driver_info)),
            adapter: adapter.map(|adapter| adapter.name),
            last_step: world.resource::<Clock>().step,
            state_hash: state_hash::hash(world).to_string(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
        }
    }

    /// The file's text.
    ///
    /// # Errors
    /// None that are known of.
    pub fn text(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}
