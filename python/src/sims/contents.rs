//! Contents of a `Sim`'s world: entities by name, id and kind, roads, classes, types.

use crate::entities::classes::{wrap, wrap_as};
use crate::entities::entity::Kind;
use crate::errors::Failure;
use crate::getters::getters;
use crate::given::arguments::required;
use crate::sims::roads::Route;
use crate::sims::sim::Sim;
use numpy::ndarray::{Array2, ArrayView1};
use numpy::{IntoPyArray, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use relief::bevy_ecs::name::Name;
use relief::bevy_ecs::prelude::{ChildOf, Entity, World};
use relief::name;
use relief::systems::assets::MeshId;
use relief::systems::draw::pieces::WholeMesh;
use relief::systems::draw::{Environment, ToneMap};
use relief::systems::run::registry::StateId;
use relief::systems::sensors::Classes;
use relief::systems::vehicles::VehicleTypes;

impl Sim {
    fn known_classes(&self, py: Python<'_>) -> PyResult<Classes> {
        self.with(py, |world| Ok(world.simulation.world.resource::<Classes>().clone()))
    }

    /// Names of the entities that have one and pass, in the order in which they came to be.
    fn names_where(&self, py: Python<'_>, passes: fn(&World, Entity) -> bool) -> PyResult<Vec<String>> {
        self.with(py, move |world| {
            let own = &world.simulation.world;
            let named = world.ids_where(|own, entity| own.get::<Name>(entity).is_some() && passes(own, entity));
            Ok(named.into_iter().filter_map(|id| Some(own.get::<Name>(world.living(id)?)?.to_string())).collect())
        })
    }

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

getters! { Sim::read, Sim:
    /// Roads to follow, in the scene's order.
    routes: Vec<Route> = |world| world.routes();
    /// The names of vehicle types.
    vehicle_types: Vec<String> = |world| {
        world.simulation.world.resource::<VehicleTypes>().iter().map(|(_, known)| known.name.clone()).collect()
    };
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

    /// Entities without a parent: vehicles, lights and models each as one thing, without the parts that they have.
    /// Those are their `children`.
    #[getter]
    fn roots(&self, py: Python<'_>) -> PyResult<Vec<Py<PyAny>>> {
        let ids = self.with(py, |world| Ok(world.ids_where(|own, entity| own.get::<ChildOf>(entity).is_none())))?;
        ids.into_iter().map(|id| wrap(py, &self.shared, id)).collect()
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
        self.names_where(py, |_, _| true)
    }

    /// The names of what is drawn and can be drawn once more by `spawn_mesh`.
    #[getter]
    fn meshes(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.names_where(py, |own, entity| {
            own.get::<MeshId>(entity).is_some() || own.get::<WholeMesh>(entity).is_some()
        })
    }

    /// By name: for each group of a signal, what it shows ("red", "amber", "green") and for how many seconds still,
    /// which are infinite while `set_signal` holds it.
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
        let dict = PyDict::new(py);
        for class in self.known_classes(py)?.0 {
            dict.set_item(class.name, class.id)?;
        }
        Ok(dict)
    }

    /// Properties of each semantic class, by name: a dict with its `id`, its `color` (8-bit sRGB), whether it
    /// `is_thing` (whose instances are counted; else it is stuff, as road and sky) and its `train_id` (255: none).
    #[getter]
    fn class_info<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for class in self.known_classes(py)?.0 {
            let info = PyDict::new(py);
            info.set_item("id", class.id)?;
            info.set_item("color", PyTuple::new(py, class.color)?)?;
            info.set_item("is_thing", class.is_thing)?;
            info.set_item("train_id", class.train_id)?;
            dict.set_item(class.name, info)?;
        }
        Ok(dict)
    }

    /// Colours of semantic classes by id, 8-bit sRGB: uint8 (256, 3). `sim.palette[capture["front"].cls]` is a picture.
    /// Ids without a class are black.
    #[getter]
    fn palette<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u8>>> {
        let mut palette = Array2::zeros((256, 3));
        for class in self.known_classes(py)?.0 {
            palette.row_mut(class.id.into()).assign(&ArrayView1::from(&class.color));
        }
        Ok(palette.into_pyarray(py))
    }

    /// Light and look that belong to the whole scene, as its file has them: a dict with `ambient`, `zenith`, `horizon`
    /// and `ground` (linear red, green and blue), `exposure`, `auto_exposure`, `tone_map` and `lux`. The sun is a light.
    #[getter]
    fn environment<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let own = self.with(py, |world| Ok(world.simulation.world.resource::<Environment>().clone()))?;
        let dict = PyDict::new(py);
        let colors =
            [("ambient", own.ambient), ("zenith", own.zenith), ("horizon", own.horizon), ("ground", own.ground)];
        for (name, color) in colors {
            dict.set_item(name, <(f32, f32, f32)>::from(color))?;
        }
        dict.set_item("exposure", own.exposure)?;
        dict.set_item("auto_exposure", own.auto_exposure)?;
        dict.set_item("tone_map", name::of(&ToneMap::ALL, own.tone_map))?;
        dict.set_item("lux", own.lux)?;
        Ok(dict)
    }

    /// Properties shared by all vehicles of a type: a dict. `size` (width, height, length), `rear_overhang` (from the
    /// rear axle back to the bumper), `wheelbase` and `track`, metres; `mass`, kilograms; `speed` and `reverse_speed`
    /// at most, m/s; `acceleration` and `braking` of whole pedals, m/s²; `steering`, the largest angle, radians, and
    /// `steering_rate`, rad/s; `lateral_acceleration` that a driver on a route slows down for, m/s²; `paints`, how
    /// many; `class`, the name of its semantic class. Raises KeyError, which names the nearest.
    fn vehicle_type<'py>(&self, py: Python<'py>, name: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyDict>> {
        let name: String = required("name", name)?;
        let own = self.with(py, move |world| {
            let types = world.simulation.world.resource::<VehicleTypes>();
            let known = types.iter().map(|(_, known)| known.name.as_str());
            let found = types.find(&name).ok_or_else(|| Failure::Name(name::unknown("vehicle type", known, &name)))?;
            Ok(types.get(found).clone())
        })?;
        let (dict, limits) = (PyDict::new(py), own.limits);
        dict.set_item("name", own.name)?;
        dict.set_item("size", <(f32, f32, f32)>::from(own.size))?;
        let numbers = [
            ("rear_overhang", own.rear_overhang),
            ("wheelbase", own.wheelbase),
            ("track", own.track),
            ("mass", own.mass),
            ("speed", limits.speed),
            ("reverse_speed", limits.reverse_speed),
            ("acceleration", limits.acceleration),
            ("braking", limits.braking),
            ("steering", limits.steering),
            ("steering_rate", limits.steering_rate),
            ("lateral_acceleration", limits.lateral_acceleration),
        ];
        for (name, number) in numbers {
            dict.set_item(name, number)?;
        }
        dict.set_item("paints", own.paints.len())?;
        dict.set_item("class", Some(own.class).filter(|class| !class.is_empty()))?;
        Ok(dict)
    }
}
