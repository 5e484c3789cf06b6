//! `Sim`: a world of a scene, and its run.

use crate::capture::Capture;
use crate::entity::{Entity, Kind, wrap, wrap_as};
use crate::errors::Failure;
use crate::light::Light;
use crate::roads::Route;
use crate::sensor::{CameraArguments, add_gnss, add_imu, add_lidar};
use crate::values::{Facing, Placing, Point};
use crate::world::{Scene, Shared, World};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use relief::bevy_ecs::name::Name;
use relief::name;
use relief::sensors::Wanted;
use relief::systems::assets::MeshId;
use relief::systems::draw::pieces::WholeMesh;
use relief::systems::ecs::clock::{Clock, Seed};
use relief::systems::run::registry::StateId;
use relief::systems::run::spawn::Spawn;
use relief::systems::run::standard_inputs::NextMeshVariant;
use relief::systems::run::state_hash;
use relief::systems::sensors::Classes;
use relief::systems::vehicles::routes::Routes;
use relief::systems::vehicles::{Controls, OnRoute, VehicleTypes};
use std::path::PathBuf;
use std::sync::Arc;

/// Steps of a call.
const MOST_STEPS: u64 = 1 << 40;

/// A world of a scene, and its run.
///
/// `scene`: a scene file (.ron) or a model (.gltf, .glb); without one, an open field with a sun, on which vehicles of
/// all types can be spawned. `seed`: in the place of the scene's own. Any thread may use it, one after the other.
/// Raises SceneError.
#[pyclass(frozen, module = "relief")]
pub struct Sim {
    pub shared: Arc<Shared>,
}

impl Sim {
    pub fn of(world: World) -> Self {
        Self { shared: Shared::new(world) }
    }

    fn with<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut World) -> Result<T, Failure> + Send) -> PyResult<T> {
        self.shared.with(py, work)
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

/// The open field.
fn field(py: Python<'_>) -> PyResult<PathBuf> {
    py.import("relief")?.getattr("assets")?.call0()?.call_method1("joinpath", ("field.ron",))?.extract()
}

/// A name that is given, else the kind and the number that comes next.
fn named(given: Option<String>, kind: &str, next: StateId) -> String {
    given.unwrap_or_else(|| format!("{kind} {}", next.0 + 1))
}

fn next_id(world: &World) -> StateId {
    world.simulation.world.resource::<relief::systems::run::registry::EntityRegistry>().next_id()
}

#[pymethods]
impl Sim {
    #[new]
    #[pyo3(signature = (scene=None, *, seed=None))]
    fn new(py: Python<'_>, scene: Option<PathBuf>, seed: Option<u64>) -> PyResult<Self> {
        crate::device::check_process()?;
        let scene = scene.map_or_else(|| field(py), Ok)?;
        let made = py.detach(|| Ok::<_, Failure>(World::new(Arc::new(Scene::load(&scene)?), seed)));
        Ok(Self::of(made?))
    }

    /// Takes so many steps of the clock. Returns the number of steps done since the run began. Raises RecordingError
    /// where a replay comes out otherwise, OutputError where a recording cannot be written.
    #[pyo3(signature = (n=1))]
    fn step(&self, py: Python<'_>, n: u64) -> PyResult<u64> {
        if n > MOST_STEPS {
            return Err(Failure::value(format!("n: expected at most {MOST_STEPS} steps, found {n}")).into());
        }
        let mut left = n;
        loop {
            // In between the keyboard may interrupt.
            let now = left.min(1000);
            let step = self.with(py, move |world| world.step(now))?;
            left -= now;
            if left == 0 {
                return Ok(step);
            }
            py.check_signals()?;
        }
    }

    /// Captures every sensor that is due after the step, in one submission to the graphics device. With `names`, of
    /// these those alone, by their full names or the last parts of them. Raises GpuError.
    #[pyo3(signature = (*names))]
    fn capture(&self, py: Python<'_>, names: &Bound<'_, PyTuple>) -> PyResult<Capture> {
        let names: Vec<String> = names.extract()?;
        let (captured, classes) = self.with(py, move |world| {
            let captured = world.capture(Wanted::Due(&|name| is_among(&names, name)))?;
            Ok((captured, world.simulation.world.resource::<Classes>().clone()))
        })?;
        Capture::new(py, captured, &classes)
    }

    /// Captures sensors of the state at hand, whether they are due or not: all, or those of `names`.
    #[pyo3(signature = (*names))]
    fn look(&self, py: Python<'_>, names: &Bound<'_, PyTuple>) -> PyResult<Capture> {
        let names: Vec<String> = names.extract()?;
        let (captured, classes) = self.with(py, move |world| {
            let all = relief::sensors::sensor_names(&mut world.simulation.world);
            let wanted: Vec<_> =
                all.into_iter().filter(|(name, _)| is_among(&names, name)).map(|(_, sensor)| sensor).collect();
            let captured = world.capture(Wanted::Look(&wanted))?;
            Ok((captured, world.simulation.world.resource::<Classes>().clone()))
        })?;
        Capture::new(py, captured, &classes)
    }

    /// Brings a vehicle into being at once, of a type by name. `at`: in the scene, metres, the middle of its rear axle on
    /// the ground; `yaw`: radians about +Y, 0 along +Z, left positive. Or on a `route`, so many metres `along` it in a
    /// `lane`, which it follows. `by_hand`: it goes by `Vehicle.drive` even where it has a route. `paint`: which of its
    /// type's paints, counted round.
    #[pyo3(signature = (
        kind, at=None, *, yaw=0.0, name=None, by_hand=false, paint=0, route=None, lane=0, along=0.0, speed=0.0
    ))]
    #[allow(clippy::too_many_arguments)]
    fn spawn_vehicle(
        &self,
        py: Python<'_>,
        kind: String,
        at: Option<Point>,
        yaw: f64,
        name: Option<String>,
        by_hand: bool,
        paint: u32,
        route: Option<String>,
        lane: u8,
        along: f64,
        speed: f64,
    ) -> PyResult<Py<PyAny>> {
        let placing = Placing::new(at, (yaw, 0.0, 0.0), None)?;
        let id = self.with(py, move |world| {
            let types = world.simulation.world.resource::<VehicleTypes>();
            if types.find(&kind).is_none() {
                let known: Vec<&str> = types.iter().map(|(_, known)| known.name.as_str()).collect();
                let hint = name::nearest(&known, &kind);
                let hint = hint.map_or(String::new(), |near| format!(" (did you mean {near:?}?)"));
                let known = known.join(", ");
                return Err(Failure::value(format!("unknown vehicle type {kind:?}{hint}; expected one of: {known}")));
            }
            let name = named(name, &kind, next_id(world));
            let on_route = route.map(|route| on_route(world, &route, lane, along)).transpose()?;
            if on_route.is_some() == at.is_some() {
                return Err(Failure::value("expected one of at and route"));
            }
            let spawn = match on_route {
                Some(on) => Spawn::Driver { name, kind, paint, on, speed, manual: by_hand },
                None => Spawn::Vehicle {
                    name,
                    transform: placing.transform(world.origin(), Facing::Forward),
                    kind,
                    paint,
                    controls: Controls::default(),
                    manual: by_hand,
                },
            };
            world.spawn(spawn)
        })?;
        wrap_as(py, &self.shared, id, Kind::Vehicle)
    }

    /// Brings a light into being at once. `at`: in the scene, metres. Spots and directional lights shine forward, along
    /// +Z, turned by `yaw` to the left and `pitch` up, radians, or toward `look_at`.
    #[pyo3(signature = (light, at=None, *, yaw=0.0, pitch=0.0, look_at=None, name=None))]
    #[allow(clippy::too_many_arguments)]
    fn spawn_light(
        &self,
        py: Python<'_>,
        light: Light,
        at: Option<Point>,
        yaw: f64,
        pitch: f64,
        look_at: Option<Point>,
        name: Option<String>,
    ) -> PyResult<Py<PyAny>> {
        let placing = Placing::new(at, (yaw, pitch, 0.0), look_at)?;
        let id = self.with(py, move |world| {
            let name = named(name, "light", next_id(world));
            let transform = placing.transform(world.origin(), Facing::Backward);
            world.spawn(Spawn::Light { name, transform, light: light.0 })
        })?;
        wrap_as(py, &self.shared, id, Kind::Light)
    }

    /// Draws once more, at another place, what is drawn of an entity that the scene began with, and of what is below it.
    /// `scale`: along its own axes.
    #[pyo3(signature = (like, at, *, yaw=0.0, pitch=0.0, roll=0.0, scale=None, name=None))]
    #[allow(clippy::too_many_arguments)]
    fn spawn_mesh(
        &self,
        py: Python<'_>,
        like: &Bound<'_, PyAny>,
        at: Point,
        yaw: f64,
        pitch: f64,
        roll: f64,
        scale: Option<Point>,
        name: Option<String>,
    ) -> PyResult<Py<PyAny>> {
        let placing = Placing::new(Some(at), (yaw, pitch, roll), None)?;
        let scale = scale.map_or(relief::glam::Vec3::ONE, |scale| scale.vector().as_vec3());
        if scale.abs().min_element() < 1e-6 || scale.abs().max_element() > 1e6 {
            return Err(Failure::value(format!("scale: expected factors from 1e-6 to 1e6, found {scale}")).into());
        }
        let like: Like = match like.cast::<Entity>() {
            Ok(entity) if Arc::ptr_eq(&entity.get().shared, &self.shared) => Like::Id(entity.get().id),
            Ok(_) => return Err(Failure::value("like: expected an entity of this world").into()),
            Err(_) => Like::Name(like.extract()?),
        };
        let id = self.with(py, move |world| {
            let of = match like {
                Like::Id(id) => id,
                Like::Name(name) => world.find(&name)?,
            };
            let registry = world.simulation.world.resource::<relief::systems::run::registry::EntityRegistry>();
            world.entity(of)?;
            if of.0 >= registry.scene_len() {
                return Err(Failure::value("like: expected an entity that the scene began with"));
            }
            let name = named(name, "copy", next_id(world));
            let transform = placing.transform(world.origin(), Facing::Forward).with_scale(scale);
            world.spawn(Spawn::Copy { name, transform, of })
        })?;
        wrap_as(py, &self.shared, id, Kind::Other)
    }

    /// A camera in the scene. Keywords: `at` metres, `yaw`, `pitch` and `roll` radians, or `look_at`; `size` (width,
    /// height) pixels; `K` as (fx, fy, cx, cy) or a matrix (3, 3), with `distortion` (OpenCV's k1 k2 p1 p2 k3 k4 k5 k6)
    /// or `fisheye` (k1 to k4, `largest_degrees` from the axis), or `fov_y_degrees`, or `half_height` metres of a
    /// parallel projection; `near`, `far` metres; `outputs`; `samples` of colours, 1 or 4; `exposure`; `every` and
    /// `phase`, steps. Raises ValueError.
    #[pyo3(signature = (name, **arguments))]
    fn add_camera(&self, py: Python<'_>, name: &str, arguments: Option<&Bound<'_, PyDict>>) -> PyResult<Py<PyAny>> {
        CameraArguments::read(arguments)?.add(py, &self.shared, name, None)
    }

    /// A lidar in the scene. Keywords: as `add_camera` for its place and rate; `beams` "vlp16", "hdl32", "hdl64",
    /// "os1_64" or "os1_128"; `hz` revolutions a second; `columns` a revolution; `range` (least, most) metres;
    /// `attenuation` per metre; `sweep`; `range_sigma` metres, `drop_rate`, `drop_below`. Raises ValueError.
    #[pyo3(signature = (name, **arguments))]
    fn add_lidar(&self, py: Python<'_>, name: &str, arguments: Option<&Bound<'_, PyDict>>) -> PyResult<Py<PyAny>> {
        add_lidar(py, &self.shared, name, None, arguments)
    }

    /// An inertial measurement unit in the scene. Keywords: as `add_camera` for its place and rate;
    /// `accelerometer_density` m/s²/√Hz, `gyroscope_density` rad/s/√Hz.
    #[pyo3(signature = (name, **arguments))]
    fn add_imu(&self, py: Python<'_>, name: &str, arguments: Option<&Bound<'_, PyDict>>) -> PyResult<Py<PyAny>> {
        add_imu(py, &self.shared, name, None, arguments)
    }

    /// A receiver of satellite navigation in the scene, which needs a geo_origin. Keywords: as `add_camera` for its place
    /// and rate; `horizontal_sigma`, `vertical_sigma` metres, `velocity_sigma` m/s.
    #[pyo3(signature = (name, **arguments))]
    fn add_gnss(&self, py: Python<'_>, name: &str, arguments: Option<&Bound<'_, PyDict>>) -> PyResult<Py<PyAny>> {
        add_gnss(py, &self.shared, name, None, arguments)
    }

    /// The first entity of a name. Raises KeyError, which names the nearest.
    fn __getitem__(&self, py: Python<'_>, name: String) -> PyResult<Py<PyAny>> {
        let id = self.with(py, move |world| world.find(&name))?;
        wrap(py, &self.shared, id)
    }

    fn __contains__(&self, py: Python<'_>, name: String) -> PyResult<bool> {
        self.with(py, move |world| Ok(world.find(&name).is_ok()))
    }

    /// The entity of an id, as pictures and boxes have it. Raises GoneError.
    fn entity(&self, py: Python<'_>, id: u32) -> PyResult<Py<PyAny>> {
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
            let is_drawn = |own: &relief::bevy_ecs::world::World, entity| {
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

    /// Every entity with mesh variants shows its next one.
    fn next_mesh_variant(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, |world| world.apply(NextMeshVariant))
    }

    /// The scene's file name without its extension.
    #[getter]
    fn name(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |world| Ok(world.loaded.name.clone()))
    }

    /// What a person should know of the scene though it loaded.
    #[getter]
    fn warnings(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.with(py, |world| Ok(world.loaded.warnings.clone()))
    }

    /// The scene's file and those that it names.
    #[getter]
    fn files(&self, py: Python<'_>) -> PyResult<Vec<PathBuf>> {
        self.with(py, |world| Ok(world.loaded.files.clone()))
    }

    /// What random numbers of the run begin with.
    #[getter]
    fn seed(&self, py: Python<'_>) -> PyResult<u64> {
        self.with(py, |world| Ok(world.simulation.world.resource::<Seed>().0))
    }

    /// Steps done since the run began.
    #[getter]
    fn steps(&self, py: Python<'_>) -> PyResult<u64> {
        self.with(py, |world| Ok(world.step_number()))
    }

    /// Length of a step, seconds.
    #[getter]
    fn step_seconds(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |world| Ok(world.simulation.world.resource::<Clock>().step_seconds))
    }

    /// Seconds since the run began.
    #[getter]
    fn seconds(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |world| Ok(world.simulation.world.resource::<Clock>().seconds()))
    }

    /// A hash of the whole state, 32 hexadecimal digits: equal states, equal hashes.
    fn hash(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |world| Ok(state_hash::hash(&mut world.simulation.world).to_string()))
    }

    /// The whole state, as a file of `relief run --save-snapshot` holds it.
    fn snapshot<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = self.with(py, World::snapshot)?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Makes the state that of a snapshot of this scene. Entities that are in both stay what they are. Raises
    /// RecordingError; the state is what it was then.
    fn restore(&self, py: Python<'_>, snapshot: Vec<u8>) -> PyResult<()> {
        self.with(py, move |world| world.restore(&snapshot))
    }

    /// Another world of the scene in the same state, which shares its meshes and images.
    fn fork(&self, py: Python<'_>) -> PyResult<Self> {
        self.with(py, World::fork).map(Self::of)
    }

    /// Another world of the scene as it begins, which shares its meshes and images. `seed`: in the place of this one's.
    #[pyo3(signature = (*, seed=None))]
    fn fresh(&self, py: Python<'_>, seed: Option<u64>) -> PyResult<Self> {
        let made = self.with(py, move |world| Ok(World::new(world.scene.clone(), seed.or(world.seed))));
        made.map(Self::of)
    }

    /// Begins the run anew, with a `seed` in the place of this one's if one is given. What was spawned is gone.
    #[pyo3(signature = (*, seed=None))]
    fn reset(&self, py: Python<'_>, seed: Option<u64>) -> PyResult<()> {
        self.with(py, move |world| {
            world.refuse_while_kept()?;
            let seed = seed.or(world.seed);
            world.begin_anew(seed, |_| Ok(()))
        })
    }

    /// Reads the scene's files anew, and begins the run anew. Raises SceneError; nothing changes then.
    fn reload(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, |world| {
            world.refuse_while_kept()?;
            let scene = Scene::load(world.scene.template.path())?;
            *world = World::new(Arc::new(scene), world.seed);
            Ok(())
        })
    }

    /// Begins to record the run, from its state as it is: `with sim.record("run.rec"): …`. At the end of the block, or
    /// by `close`, the recording ends in order. `relief replay run.rec --check` and `relief.replay` compare every step.
    /// Raises RecordingError, OutputError.
    fn record(&self, py: Python<'_>, path: PathBuf) -> PyResult<Recording> {
        self.with(py, move |world| world.record(&path))?;
        Ok(Recording { shared: self.shared.clone() })
    }

    /// Gives back what it takes on the graphics device, and ends a recording. It can still be used.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, |world| {
            world.rest();
            world.finish()
        })
    }

    fn __enter__(own: Py<Self>) -> Py<Self> {
        own
    }

    #[pyo3(signature = (*_exception))]
    fn __exit__(&self, py: Python<'_>, _exception: &Bound<'_, PyTuple>) -> PyResult<()> {
        self.close(py)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        self.with(py, |world| Ok(format!("<Sim of {:?}, step {}>", world.loaded.name, world.step_number())))
    }
}

/// An entity, or the name of one.
enum Like {
    Id(StateId),
    Name(String),
}

/// Whether a sensor is wanted: all are where no names are given.
pub fn is_among(names: &[String], full: &str) -> bool {
    let last = full.rsplit_once('/').map_or(full, |(_, last)| last);
    names.is_empty() || names.iter().any(|name| name == full || name == last)
}

fn on_route(world: &World, route: &str, lane: u8, along: f64) -> Result<OnRoute, Failure> {
    let routes = world.simulation.world.resource::<Routes>();
    let id = routes.find(route).ok_or_else(|| {
        let known: Vec<&str> = routes.iter().map(|(_, route)| route.plan.name.as_str()).collect();
        let hint = name::nearest(&known, route).map_or(String::new(), |near| format!(" (did you mean {near:?}?)"));
        Failure::value(format!("unknown route {route:?}{hint}"))
    })?;
    let found = routes.get(id).map_or((0, 0.0), |found| (found.lanes(), found.length));
    if lane >= found.0 {
        return Err(Failure::value(format!("lane: expected less than {}, found {lane}", found.0)));
    }
    if !(0.0..=found.1).contains(&along) {
        return Err(Failure::value(format!("along: expected metres from 0 to {}, found {along}", found.1)));
    }
    Ok(OnRoute::new(id, lane, along))
}

/// A recording that is being written.
#[pyclass(frozen, module = "relief")]
pub struct Recording {
    shared: Arc<Shared>,
}

#[pymethods]
impl Recording {
    /// Ends it in order. Nothing happens where it has ended.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        self.shared.with(py, World::finish)
    }

    fn __enter__(own: Py<Self>) -> Py<Self> {
        own
    }

    #[pyo3(signature = (*_exception))]
    fn __exit__(&self, py: Python<'_>, _exception: &Bound<'_, PyTuple>) -> PyResult<()> {
        self.close(py)
    }
}
