//! Entities on others: parents, children, and sensors that are mounted.

use crate::entities::classes::wrap;
use crate::entities::entity::Entity;
use crate::entities::mounting::add_sensor;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use relief::bevy_ecs::prelude::{ChildOf, Children};

#[pymethods]
impl Entity {
    /// Entity that it is mounted on; ``None``: nothing.
    #[getter]
    fn parent(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        let id = self.id;
        let parent = self.with(py, move |world| {
            let parent = world.simulation.world.get::<ChildOf>(world.entity(id)?).map(ChildOf::parent);
            Ok(parent.and_then(|parent| world.id(parent)))
        })?;
        parent.map(|parent| wrap(py, &self.shared, parent)).transpose()
    }

    /// Entities directly below it.
    #[getter]
    fn children(&self, py: Python<'_>) -> PyResult<Vec<Py<PyAny>>> {
        let id = self.id;
        let children = self.with(py, move |world| {
            let children = world.simulation.world.get::<Children>(world.entity(id)?);
            let children = children.into_iter().flat_map(|children| children.iter());
            Ok(children.filter_map(|child| world.id(*child)).collect::<Vec<_>>())
        })?;
        children.into_iter().map(|child| wrap(py, &self.shared, child)).collect()
    }

    /// Mounts a sensor of a kind on it.
    #[pyo3(signature = (kind, name, arguments))]
    fn _add_sensor(
        &self,
        py: Python<'_>,
        kind: &str,
        name: &Bound<'_, PyAny>,
        arguments: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Py<PyAny>> {
        add_sensor(py, &self.shared, kind, name, Some(self.id), arguments)
    }
}
