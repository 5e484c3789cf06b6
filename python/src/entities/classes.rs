//! Entities as the classes of their kinds.

use crate::entities::entity::{Entity, Kind};
use crate::entities::light::LightEntity;
use crate::entities::portal::Portal;
use crate::entities::sensor::Sensor;
use crate::entities::vehicle::Vehicle;
use crate::worlds::world::Shared;
use pyo3::prelude::*;
use relief::systems::run::registry::StateId;
use std::sync::Arc;

/// Wraps an entity in the Python class of its kind.
pub fn wrap(py: Python<'_>, shared: &Arc<Shared>, id: StateId) -> PyResult<Py<PyAny>> {
    let kind = shared.with(py, |world| world.kind(id))?;
    wrap_as(py, shared, id, kind)
}

pub fn wrap_as(py: Python<'_>, shared: &Arc<Shared>, id: StateId, kind: Kind) -> PyResult<Py<PyAny>> {
    let entity = PyClassInitializer::from(Entity::of(py, shared, id)?);
    Ok(match kind {
        Kind::Vehicle => Py::new(py, entity.add_subclass(Vehicle))?.into_any(),
        Kind::Light => Py::new(py, entity.add_subclass(LightEntity))?.into_any(),
        Kind::Sensor => Py::new(py, entity.add_subclass(Sensor))?.into_any(),
        Kind::Portal => Py::new(py, entity.add_subclass(Portal))?.into_any(),
        Kind::Other => Py::new(py, entity)?.into_any(),
    })
}
