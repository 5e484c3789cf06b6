//! Portals between rooms: doors and windows.

use crate::entity::Entity;
use pyo3::prelude::*;
use relief::systems::cells;
use relief::systems::run::standard_inputs::SetPortal;

/// An opening between two rooms, or a room and outside.
#[pyclass(frozen, extends = Entity, module = "relief")]
pub struct Portal;

#[pymethods]
impl Portal {
    /// How far it is open: 0 shut, no light comes through; 1 all the way. A door that is set moves no more by itself.
    #[getter]
    fn open(own: PyRef<'_, Self>) -> PyResult<f32> {
        let entity: &Entity = own.as_super();
        let id = entity.id;
        entity.with(own.py(), move |world| Ok(world.component::<cells::Portal>(id)?.unwrap_or_default().open))
    }

    #[setter]
    fn set_open(own: PyRef<'_, Self>, open: f32) -> PyResult<()> {
        let entity: &Entity = own.as_super();
        let id = entity.id;
        entity.with(own.py(), move |world| {
            world.entity(id)?;
            world.apply(SetPortal { entity: id, open })
        })
    }
}
