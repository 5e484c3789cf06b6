//! The physics as state of the simulation: what is saved of them, and what is hashed.

use super::state::{StateError, StateKind, StateList, decode, encode};
use super::state_hash::{Sum, of_bytes};
use crate::physics::bodies::Physics;
use crate::physics::ground::Obstacle;
use bevy_ecs::prelude::*;
use xxhash_rust::xxh3::xxh3_128;

impl StateList {
    /// Adds obstacles and the bodies.
    pub(super) fn add_physics(&mut self) {
        self.add_component::<Obstacle>("obstacle");
        self.add(PhysicsState);
    }
}

/// [`Physics`] as a kind of state.
pub(crate) struct PhysicsState;

impl StateKind for PhysicsState {
    fn name(&self) -> &'static str {
        "physics"
    }

    /// Hash of the bodies only: the triangles of the ground do not change with every step.
    fn hash(&mut self, world: &mut World) -> Sum {
        let mut bytes = Vec::new();
        world.resource::<Physics>().state(|bits| bytes.extend(bits.to_le_bytes()));
        of_bytes(self.name(), &bytes)
    }

    /// All of it, and a sum: what is within refers to itself in so many ways that nothing else could tell that it fits.
    fn save(&mut self, world: &mut World) -> Vec<u8> {
        let mut bytes = encode(world.resource::<Physics>());
        let sum = xxh3_128(&bytes);
        bytes.extend(sum.to_le_bytes());
        bytes
    }

    fn restore(&mut self, world: &mut World, bytes: &[u8]) -> Result<(), StateError> {
        let Some((saved, sum)) = bytes.split_last_chunk() else {
            return Err(StateError::new(self.name(), "unexpected end of data"));
        };
        if xxh3_128(saved) != u128::from_le_bytes(*sum) {
            return Err(StateError::new(self.name(), "checksum mismatch"));
        }
        *world.resource_mut::<Physics>() = decode(self.name(), saved)?;
        Ok(())
    }
}
