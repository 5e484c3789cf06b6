//! Entities of a world, as Python holds them: a world, and a number in it.

use crate::errors::{Failure, Outcome};
use crate::given::arguments::{Given, required};
use crate::given::light::refuse_turned;
use crate::given::values::{Facing, Numbers, Placing, Point, matrix, transform_of};
use crate::worlds::world::{Shared, World};
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use relief::bevy_ecs::prelude::ChildOf;
use relief::name;
use relief::systems;
use relief::systems::run::registry::StateId;
use relief::systems::run::standard_inputs::{Despawn, Hide, SetTransform};
use relief::systems::sensors::{Class, Classes};
use relief::systems::space::{Hidden, Transform};
use std::sync::Arc;

/// Something in a world. It stays the same thing in snapshots, recordings and forks of the world: they know it by its
/// id.
#[pyclass(frozen, subclass, module = "relief")]
pub struct Entity {
    pub shared: Arc<Shared>,
    pub id: StateId,
    /// [`World::birth`]: tells it from what gets its id after a reset.
    birth: u64,
}

impl Entity {
    /// Wraps the entity that has that number now.
    pub fn of(py: Python<'_>, shared: &Arc<Shared>, id: StateId) -> PyResult<Self> {
        let birth = shared.with(py, move |world| Ok(world.birth(id)))?;
        Ok(Self { shared: shared.clone(), id, birth })
    }

    /// Does something with its world, in which it still is what it was.
    pub fn with<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut World) -> Outcome<T> + Send) -> PyResult<T> {
        let (id, birth) = (self.id, self.birth);
        self.shared.with(py, move |world| {
            if world.birth(id) != birth {
                return Err(Failure::Gone(format!("entity {}", id.0 + 1)));
            }
            work(world)
        })
    }
}

/// Kind of an entity, as far as Python has a class for it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    Vehicle,
    Light,
    Sensor,
    Portal,
    Other,
}

impl World {
    pub fn kind(&self, id: StateId) -> Outcome<Kind> {
        let entity = self.simulation.world.entity(self.entity(id)?);
        Ok(if entity.contains::<systems::vehicles::Vehicle>() {
            Kind::Vehicle
        } else if entity.contains::<systems::lights::Light>() {
            Kind::Light
        } else if entity.contains::<systems::sensors::Sensor>() {
            Kind::Sensor
        } else if entity.contains::<systems::cells::Portal>() {
            Kind::Portal
        } else {
            Kind::Other
        })
    }

    fn move_to(&mut self, id: StateId, change: impl FnOnce(Transform) -> Outcome<Transform>) -> Outcome<()> {
        let now = self.component::<Transform>(id)?.unwrap_or_default();
        let transform = change(now)?;
        self.apply(SetTransform { entity: id, transform })
    }

    /// Origin that the entity's place counts from: the world's, or zero for one with a parent.
    fn origin_of(&self, id: StateId) -> Outcome<relief::glam::DVec3> {
        let is_top = self.simulation.world.get::<ChildOf>(self.entity(id)?).is_none();
        Ok(if is_top { self.origin() } else { relief::glam::DVec3::ZERO })
    }
}

#[pymethods]
impl Entity {
    /// Its number in pictures, boxes and files: 1 and up.
    #[getter]
    fn id(&self) -> u32 {
        self.id.0 + 1
    }

    /// Its name; that of the nearest named thing above it where it has none.
    #[getter]
    fn name(&self, py: Python<'_>) -> PyResult<String> {
        let id = self.id;
        self.with(py, move |world| Ok(name::of_entity(&world.simulation.world, world.entity(id)?)))
    }

    /// Tells if it is in its world.
    #[getter]
    fn alive(&self, py: Python<'_>) -> PyResult<bool> {
        let (id, birth) = (self.id, self.birth);
        self.shared.with(py, move |world| Ok(world.birth(id) == birth && world.living(id).is_some()))
    }

    /// Place in its parent's axes, else in the scene: float64 (3,), metres. Setting it moves it at once.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let id = self.id;
        let place = self.with(py, move |world| {
            let place = world.component::<Transform>(id)?.unwrap_or_default();
            Ok(place.translation.as_dvec3() + world.origin_of(id)?)
        })?;
        Ok(place.to_array().to_vec().into_pyarray(py))
    }

    #[setter]
    fn set_position(&self, py: Python<'_>, position: &Bound<'_, PyAny>) -> PyResult<()> {
        let (id, Point(position)) = (self.id, required("position", position)?);
        self.with(py, move |world| {
            let translation = (position - world.origin_of(id)?).as_vec3();
            world.move_to(id, |now| Ok(Transform { translation, ..now }))
        })
    }

    /// From its own axes to those of what it is mounted on, else of the scene: float64 (4, 4). Setting it moves it at
    /// once.
    #[getter]
    fn transform<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let id = self.id;
        let place = self.with(py, move |world| {
            let own = world.component::<Transform>(id)?.unwrap_or_default();
            Ok(relief::glam::DAffine3::from_scale_rotation_translation(
                own.scale.as_dvec3(),
                own.rotation.as_dquat(),
                own.translation.as_dvec3() + world.origin_of(id)?,
            ))
        })?;
        Ok(matrix(py, &place))
    }

    #[setter]
    fn set_transform(&self, py: Python<'_>, transform: &Bound<'_, PyAny>) -> PyResult<()> {
        let (id, Numbers(transform)) = (self.id, required("transform", transform)?);
        self.with(py, move |world| {
            let mut place = transform_of(&transform)?;
            place.translation = (place.translation.as_dvec3() - world.origin_of(id)?).as_vec3();
            world.move_to(id, |_| Ok(place))
        })
    }

    /// From its own axes to the scene's: float64 (4, 4).
    #[getter]
    fn world_from_entity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let id = self.id;
        let place = self.with(py, move |world| Ok(world.scene_from(world.entity(id)?)))?;
        Ok(matrix(py, &place))
    }

    /// Tells if it and all below it are hidden, thus not drawn.
    #[getter]
    fn hidden(&self, py: Python<'_>) -> PyResult<bool> {
        let id = self.id;
        self.with(py, move |world| Ok(world.component::<Hidden>(id)?.is_some()))
    }

    #[setter]
    fn set_hidden(&self, py: Python<'_>, hidden: &Bound<'_, PyAny>) -> PyResult<()> {
        let (id, hidden) = (self.id, required("hidden", hidden)?);
        self.with(py, move |world| {
            world.entity(id)?;
            world.apply(Hide { entity: id, hidden })
        })
    }

    /// The name of its semantic class; ``None`` where neither it nor anything above it has one.
    #[getter]
    fn class_(&self, py: Python<'_>) -> PyResult<Option<String>> {
        let id = self.id;
        self.with(py, move |world| {
            let (mut at, own) = (Some(world.entity(id)?), &world.simulation.world);
            while let Some(entity) = at {
                if let Some(class) = own.get::<Class>(entity) {
                    let known = own.resource::<Classes>().get(*class);
                    return Ok(known.map(|info| info.name.clone()));
                }
                at = own.get::<ChildOf>(entity).map(ChildOf::parent);
            }
            Ok(None)
        })
    }

    /// Takes it out of its world, with all that is below it. Nothing happens where it is gone.
    fn despawn(&self, py: Python<'_>) -> PyResult<()> {
        let id = self.id;
        self.with(py, move |world| if world.living(id).is_some() { world.apply(Despawn(id)) } else { Ok(()) })
    }

    /// Puts it elsewhere at once: `at` in what it is mounted on, else in the scene, metres; turned by `yaw` to the
    /// left, `pitch` up and `roll` with the right side down, radians. What looks along its own −Z (cameras and lights)
    /// looks forward, along +Z, where these are 0.
    #[pyo3(
        signature = (at, *, yaw=None, pitch=None, roll=None, look_at=None),
        text_signature = "($self, at, *, yaw=0.0, pitch=0.0, roll=0.0, look_at=None)"
    )]
    fn place(
        &self,
        py: Python<'_>,
        at: &Bound<'_, PyAny>,
        yaw: Given<'_, '_>,
        pitch: Given<'_, '_>,
        roll: Given<'_, '_>,
        look_at: Given<'_, '_>,
    ) -> PyResult<()> {
        required::<Point>("at", at)?;
        let (id, placing) = (self.id, Placing::read(Some(at), [yaw, pitch, roll], look_at)?);
        self.with(py, move |world| {
            if let Some(light) = world.component::<systems::lights::Light>(id)? {
                refuse_turned(&light, &placing)?;
            }
            let placing = if world.kind(id)? == Kind::Vehicle { placing.of_vehicle()? } else { placing };
            let sensor = world.component::<systems::sensors::Sensor>(id)?;
            let is_camera = sensor.is_some_and(|own| matches!(own.kind, systems::sensors::SensorKind::Camera(_)));
            let facing = if is_camera || world.kind(id)? == Kind::Light { Facing::Backward } else { Facing::Forward };
            let origin = world.origin_of(id)?;
            world.move_to(id, |now| Ok(Transform { scale: now.scale, ..placing.transform(origin, facing) }))
        })
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (id, birth) = (self.id, self.birth);
        self.shared.with(py, move |world| {
            let living = world.living(id).filter(|_| world.birth(id) == birth);
            let Some(entity) = living else { return Ok(format!("<entity {}, gone>", id.0 + 1)) };
            let kind = format!("{:?}", world.kind(id)?).to_lowercase().replace("other", "entity");
            Ok(format!("<{kind} {} {:?}>", id.0 + 1, name::of_entity(&world.simulation.world, entity)))
        })
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        let other = other.cast::<Self>();
        other.is_ok_and(|other| {
            Arc::ptr_eq(&self.shared, &other.get().shared)
                && (self.id, self.birth) == (other.get().id, other.get().birth)
        })
    }

    fn __hash__(&self) -> u64 {
        (Arc::as_ptr(&self.shared) as u64).rotate_left(17) ^ u64::from(self.id.0)
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(PyRuntimeError::new_err("entities cannot be pickled: they are of a world; use their names or ids"))
    }
}
