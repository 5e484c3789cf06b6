//! Rigs as a scene has them once they have been read: entities below those that take them.

use super::entities::Entity;
use std::path::PathBuf;
use systems::describe::Trail;

/// The rigs of a scene, in the order in which it takes them first.
#[derive(Debug, Default)]
pub struct Rigs(pub Vec<Rig>);

/// A file of entities that others take.
#[derive(Debug)]
pub struct Rig {
    /// Name in the scene.
    pub name: String,
    /// Place in the scene that takes it first.
    pub taken_at: Trail,
    pub path: PathBuf,
    pub text: String,
    pub entities: Vec<Entity>,
}

impl Rigs {
    /// Entities that an entity has below it by its rig.
    pub fn of(&self, entity: &Entity) -> &[Entity] {
        let taken = entity.rig.as_ref().and_then(|name| self.0.iter().find(|rig| rig.name == *name));
        taken.map_or(&[], |rig| &rig.entities)
    }

    /// Their files.
    pub fn files(&self) -> impl Iterator<Item = PathBuf> {
        self.0.iter().map(|rig| rig.path.clone())
    }
}
