//! Portals between rooms: doors and windows.

use crate::entities::entity::Entity;
use crate::entities::own::with;
use crate::errors::Failure;
use crate::given::arguments::required;
use pyo3::prelude::*;
use relief::systems::cells;
use relief::systems::describe::check;
use relief::systems::run::standard_inputs::SetPortal;

/// An opening between two rooms, or a room and outside.
#[pyclass(frozen, extends = Entity, module = "relief")]
pub struct Portal;

#[pymethods]
impl Portal {
    /// Openness: 0 shut, no light comes through; 1 all the way. A door that is set moves no more by itself.
    #[getter]
    fn open(own: PyRef<'_, Self>) -> PyResult<f32> {
        with(&own, |world, id| Ok(world.component::<cells::Portal>(id)?.unwrap_or_default().open))
    }

    #[setter]
    fn set_open(own: PyRef<'_, Self>, open: &Bound<'_, PyAny>) -> PyResult<()> {
        let open = required::<f32>("open", open)?;
        check(&cells::Portal { open }).map_err(|fault| Failure::value(fault.to_string()))?;
        with(&own, |world, entity| {
            world.entity(entity)?;
            world.apply(SetPortal { entity, open })
        })
    }
}
