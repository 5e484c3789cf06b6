//! Entities on others: parents, children, and sensors that are mounted.

use crate::entities::classes::wrap;
use crate::entities::entity::Entity;
use crate::entities::mounting::{self, CameraArguments};
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

    /// Mounts a camera on it; see `Sim.add_camera`.
    #[pyo3(signature = (name, **arguments))]
    fn add_camera(
        &self,
        py: Python<'_>,
        name: &Bound<'_, PyAny>,
        arguments: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Py<PyAny>> {
        CameraArguments::read(arguments)?.add(py, &self.shared, name, Some(self.id))
    }

    /// Mounts a lidar on it; see `Sim.add_lidar`.
    #[pyo3(signature = (name, **arguments))]
    fn add_lidar(
        &self,
        py: Python<'_>,
        name: &Bound<'_, PyAny>,
        arguments: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Py<PyAny>> {
        mounting::add_lidar(py, &self.shared, name, Some(self.id), arguments)
    }

    /// Mounts an inertial measurement unit on it; see `Sim.add_imu`.
    #[pyo3(signature = (name, **arguments))]
    fn add_imu(
        &self,
        py: Python<'_>,
        name: &Bound<'_, PyAny>,
        arguments: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Py<PyAny>> {
        mounting::add_imu(py, &self.shared, name, Some(self.id), arguments)
    }

    /// Mounts a receiver of satellite navigation on it; see `Sim.add_gnss`.
    #[pyo3(signature = (name, **arguments))]
    fn add_gnss(
        &self,
        py: Python<'_>,
        name: &Bound<'_, PyAny>,
        arguments: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Py<PyAny>> {
        mounting::add_gnss(py, &self.shared, name, Some(self.id), arguments)
    }

    /// Has it tell what it touches; see `Collisions`.
    #[pyo3(signature = (name, **arguments))]
    fn add_collision(
        &self,
        py: Python<'_>,
        name: &Bound<'_, PyAny>,
        arguments: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Py<PyAny>> {
        mounting::add_collision(py, &self.shared, name, Some(self.id), arguments)
    }

    /// Has it tell where in a lane it is; see `LaneReading`.
    #[pyo3(signature = (name, **arguments))]
    fn add_lane(
        &self,
        py: Python<'_>,
        name: &Bound<'_, PyAny>,
        arguments: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Py<PyAny>> {
        mounting::add_lane(py, &self.shared, name, Some(self.id), arguments)
    }
}
