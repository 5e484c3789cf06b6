//! Work of the classes of entities on their world.

use crate::entities::entity::Entity;
use crate::errors::Outcome;
use crate::worlds::world::World;
use pyo3::PyClass;
use pyo3::prelude::*;
use relief::systems::run::registry::StateId;

/// Does something with the world of an entity, in which it still is what it was, and with its number there.
pub fn with<S: PyClass<BaseType = Entity>, T: Send>(
    own: &PyRef<'_, S>,
    work: impl FnOnce(&mut World, StateId) -> Outcome<T> + Send,
) -> PyResult<T> {
    let entity = own.as_super();
    let id = entity.id;
    entity.with(own.py(), move |world| work(world, id))
}
