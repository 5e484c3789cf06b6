//! What there is in the world of a `Sim`: entities by name, id and kind, roads, classes, types.

use crate::arguments::required;
use crate::entity::{Kind, wrap, wrap_as};
use crate::errors::Failure;
use crate::roads::Route;
use crate::sim::Sim;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use relief::bevy_ecs::name::Name;
use relief::bevy_ecs::prelude::Entity;
use relief::systems::assets::MeshId;
use relief::systems::draw::pieces::WholeMesh;
use relief::systems::run::registry::StateId;
use relief::systems::sensors::Classes;
use relief::systems::vehicles::VehicleTypes;

impl Sim {
    fn entities_of(&self, py: Python<'_>, kind: Option<Kind>) -> PyResult<Vec<Py<PyAny>>> {
        let ids = self.with(py, move |world| {
            let all = world.ids_where(|_, _| true);
            let kinds = all.into_iter().map(|id| Ok((id, world.kind(id)?)));
            kinds.collect::<Result<Vec<_>, Failure>>()
        })?;
        let wanted = ids.into_iter().filter(|(_, found)| kind.is_none_or(|kind| kind == *found));
        wanted.map(|(id, kind)| wrap_as(py, &self.shared, id, kind)).collect()
    }
}

#[pymethods]
impl Sim {
    /// The first entity of a name. Raises KeyError, which names the nearest.
    fn __getitem__(&self, py: Python<'_>, name: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        let name: String = required("name", name)?;
        let id = self.with(py, move |world| world.find(&name))?;
        wrap(py, &self.shared, id)
    }

    fn __contains__(&self, py: Python<'_>, name: &Bound<'_, PyAny>) -> PyResult<bool> {
        let name: String = required("name", name)?;
        self.with(py, move |world| Ok(world.find(&name).is_ok()))
    }

    /// The entity of an id, as pictures and boxes have it. Raises GoneError.
    fn entity(&self, py: Python<'_>, id: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        let id: u32 = required("id", id)?;
        let id = StateId(id.checked_sub(1).ok_or_else(|| Failure::value("id: expected 1 or more, found 0"))?);
        wrap(py, &self.shared, id)
    }

    /// All that is there, in the order in which it came to be.
    #[getter]
    fn entities(&self, py: Python<'_>) -> PyResult<Vec<Py<PyAny>>> {
        self.entities_of(py, None)
    }

    /// All vehicles.
    #[getter]
    fn vehicles(&self, py: Python<'_>) -> PyResult<Vec<Py<PyAny>>> {
        self.entities_of(py, Some(Kind::Vehicle))
    }

    /// All lights, those of vehicles and models, too.
    #[getter]
    fn lights(&self, py: Python<'_>) -> PyResult<Vec<Py<PyAny>>> {
        self.entities_of(py, Some(Kind::Light))
    }

    /// All sensors.
    #[getter]
    fn sensors(&self, py: Python<'_>) -> PyResult<Vec<Py<PyAny>>> {
        self.entities_of(py, Some(Kind::Sensor))
    }

    /// All openings between rooms.
    #[getter]
    fn portals(&self, py: Python<'_>) -> PyResult<Vec<Py<PyAny>>> {
        self.entities_of(py, Some(Kind::Portal))
    }

    /// The names of the entities that have one, in the order in which they came to be.
    #[getter]
    fn names(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.with(py, |world| {
            let named = world.ids_where(|world, entity| world.get::<Name>(entity).is_some());
            let name = |id| Some(world.simulation.world.get::<Name>(world.living(id)?)?.to_string());
            Ok(named.into_iter().filter_map(name).collect())
        })
    }

    /// The names of what is drawn and can be drawn once more by `spawn_mesh`.
    #[getter]
    fn meshes(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.with(py, |world| {
            let is_drawn = |own: &relief::bevy_ecs::world::World, entity: Entity| {
                own.get::<Name>(entity).is_some()
                    && (own.get::<MeshId>(entity).is_some() || own.get::<WholeMesh>(entity).is_some())
            };
            let drawn = world.ids_where(is_drawn);
            let name = |id| Some(world.simulation.world.get::<Name>(world.living(id)?)?.to_string());
            Ok(drawn.into_iter().filter_map(name).collect())
        })
    }

    /// Roads to follow, in the scene's order.
    #[getter]
    fn routes(&self, py: Python<'_>) -> PyResult<Vec<Route>> {
        self.with(py, |world| Ok(world.routes()))
    }

    /// By name: for each group of a signal, what it shows ("red", "amber", "green") and for how many seconds still.
    #[getter]
    fn signals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let signals = self.with(py, |world| Ok(world.signals()))?;
        let dict = PyDict::new(py);
        for (name, groups) in signals {
            dict.set_item(name, groups)?;
        }
        Ok(dict)
    }

    /// Ids of semantic classes by name.
    #[getter]
    fn classes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let classes = self.with(py, |world| Ok(world.simulation.world.resource::<Classes>().clone()))?;
        let dict = PyDict::new(py);
        for class in classes.0 {
            dict.set_item(class.name, class.id)?;
        }
        Ok(dict)
    }

    /// The names of vehicle types.
    #[getter]
    fn vehicle_types(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.with(py, |world| {
            let types = world.simulation.world.resource::<VehicleTypes>();
            Ok(types.iter().map(|(_, known)| known.name.clone()).collect())
        })
    }
}
