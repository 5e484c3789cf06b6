//! The state of spawning: what it works with, and what it found.

#[cfg(feature = "vehicles")]
use super::signal_heads::LitGlass;
use super::turned_meshes::TurnedMeshes;
use crate::scene::format::rigs::Rigs;
use crate::scene::read::items::Items;
use bevy_ecs::prelude::*;
use systems::space::Aabb;

/// Findings about a scene while it is spawned.
#[derive(Default)]
pub struct Spawned {
    /// Name and entity of every camera: the file's own first, in its order, then those within models.
    pub cameras: Vec<(String, Entity)>,
    /// Around everything that is drawn, world space.
    pub bounds: Option<Aabb>,
    /// True if anything shines.
    pub has_lights: bool,
    /// Warnings of results that are not as asked.
    pub warnings: Vec<String>,
}

/// A world while a scene is spawned into it.
pub struct Spawner<'a> {
    pub items: &'a Items,
    pub rigs: &'a Rigs,
    pub world: &'a mut World,
    pub piece_metres: f32,
    /// Entities that may be larger than that, or than a length of their own.
    pub large: Vec<(Entity, f32)>,
    pub model_cameras: Vec<(String, Entity)>,
    pub turned: TurnedMeshes,
    /// Names of vehicle types that were asked for in vain.
    #[cfg(feature = "vehicles")]
    pub unknown_types: Vec<String>,
    #[cfg(feature = "vehicles")]
    pub glass: LitGlass,
    pub found: Spawned,
}

impl Spawner<'_> {
    pub fn enclose(&mut self, aabb: Aabb) {
        self.found.bounds = Some(self.found.bounds.map_or(aabb, |bounds| bounds.union(aabb)));
    }
}
