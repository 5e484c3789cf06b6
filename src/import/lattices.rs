//! Lattices of openness, kept on disk: asking the corners of a town takes some seconds.

use super::cache::{Cache, Key};
use bevy_ecs::prelude::*;
use std::sync::Arc;
use systems::draw::sky_light::{KeptLattices, LatticeStore};

/// Changes whenever lattices are made, or written, in another way.
const VERSION: u32 = 1;

/// A cache as a store of lattices.
struct InCache(Cache);

impl LatticeStore for InCache {
    fn read(&self, hash: u128) -> Option<Vec<u8>> {
        self.0.read(&key(hash), |bytes| Some(bytes.to_vec()))
    }

    fn write(&self, hash: u128, bytes: &[u8]) {
        self.0.write(&key(hash), bytes);
        self.0.trim();
    }
}

fn key(hash: u128) -> Key {
    let mut hasher = blake3::Hasher::new();
    hasher.update(b"openness").update(&VERSION.to_le_bytes()).update(&hash.to_le_bytes());
    hasher.finalize()
}

/// Lets a world find lattices in the user's cache, and leave them there.
pub fn keep_lattices(world: &mut World) {
    if let Some(cache) = Cache::of_user() {
        world.insert_resource(KeptLattices(Arc::new(InCache(cache))));
    }
}
