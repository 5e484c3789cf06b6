//! Spawning by `Sim`: vehicles, lights, copies of what is drawn, sensors.

use crate::entities::classes::wrap_as;
use crate::entities::entity::{Entity, Kind};
use crate::entities::mounting::add_sensor;
use crate::entities::vehicle::warn_of_by_hand;
use crate::errors::{Failure, Outcome};
use crate::given::arguments::{Given, optional, required, wrong_type};
use crate::given::light::{Light, refuse_turned};
use crate::given::values::{Facing, Numbers, Placing, Point};
use crate::sims::sim::Sim;
use crate::worlds::world::World;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use relief::glam::{DVec3, Vec3};
use relief::name;
use relief::systems::run::registry::{EntityRegistry, StateId};
use relief::systems::run::spawn::Spawn;
use relief::systems::vehicles::routes::Routes;
use relief::systems::vehicles::{Controls, FASTEST, OnRoute, VehicleTypes};
use std::sync::Arc;

/// A name that is given, else the kind and the number that comes next.
fn named(given: Option<String>, kind: &str, world: &World) -> Outcome<String> {
    match given {
        Some(name) if name.is_empty() => Err(Failure::value("name: expected one, or None")),
        Some(name) => Ok(name),
        None => Ok(format!("{kind} {}", world.simulation.world.resource::<EntityRegistry>().next_id().0 + 1)),
    }
}

/// An entity, or the name of one.
enum Like {
    Id(StateId),
    Name(String),
}

fn on_route(world: &World, route: &str, lane: u8, along: f64) -> Result<OnRoute, Failure> {
    let routes = world.simulation.world.resource::<Routes>();
    let known = routes.iter().map(|(_, route)| route.plan.name.as_str());
    let id = routes.find(route).ok_or_else(|| Failure::value(name::unknown("route", known, route)))?;
    let (lanes, length) = routes.get(id).map_or((0, 0.0), |found| (found.lanes(), found.length));
    if lane >= lanes {
        return Err(Failure::value(format!("lane: expected less than {lanes}, found {lane}")));
    }
    if !(0.0..=length).contains(&along) {
        return Err(Failure::value(format!("along: expected metres from 0 to {length}, found {along}")));
    }
    Ok(OnRoute::new(id, lane, along))
}

#[pymethods]
impl Sim {
    /// Brings a vehicle into being at once, of a type by name. `at`: in the scene, metres, the middle of its rear axle
    /// on the ground; `yaw`: radians about +Y, 0 along +Z, left positive. Or on a `route`, so many metres `along` it in
    /// a `lane`, which it follows, at first with a `speed` of 0 to 555.5 m/s. `manual`: it goes by `Vehicle.drive`
    /// even where it has a route. `paint`: which of its type's paints.
    #[pyo3(
        signature = (
            kind, at=None, *, yaw=None, name=None, manual=None, paint=None, route=None, lane=None, along=None,
            speed=None, by_hand=None
        ),
        text_signature = "($self, kind, at=None, *, yaw=0.0, name=None, manual=False, paint=0, route=None, lane=0, \
                          along=0.0, speed=0.0)"
    )]
    #[allow(clippy::too_many_arguments)]
    fn spawn_vehicle(
        &self,
        py: Python<'_>,
        kind: &Bound<'_, PyAny>,
        at: Given<'_, '_>,
        yaw: Given<'_, '_>,
        name: Given<'_, '_>,
        manual: Given<'_, '_>,
        paint: Given<'_, '_>,
        route: Given<'_, '_>,
        lane: Given<'_, '_>,
        along: Given<'_, '_>,
        speed: Given<'_, '_>,
        by_hand: Given<'_, '_>,
    ) -> PyResult<Py<PyAny>> {
        let kind: String = required("kind", kind)?;
        let placing = Placing::read(at, [yaw, None, None], None)?;
        let (name, route) = (optional::<String>("name", name)?, optional::<String>("route", route)?);
        let by_hand = optional::<bool>("by_hand", by_hand)?;
        if by_hand.is_some() {
            warn_of_by_hand(py)?;
        }
        let manual = optional("manual", manual)?.or(by_hand).unwrap_or(false);
        let paint: u32 = optional("paint", paint)?.unwrap_or(0);
        let lane = optional::<u8>("lane", lane)?.unwrap_or(0);
        let along = optional::<f64>("along", along)?.unwrap_or(0.0);
        let speed = optional::<f64>("speed", speed)?.unwrap_or(0.0);
        let is_placed = at.is_some_and(|at| !at.is_none());
        let id = self.with(py, move |world| {
            let types = world.simulation.world.resource::<VehicleTypes>();
            let Some(id) = types.find(&kind) else {
                let known: Vec<&str> = types.iter().map(|(_, known)| known.name.as_str()).collect();
                let unknown = name::unknown("vehicle type", known.iter().copied(), &kind);
                return Err(Failure::value(format!("{unknown}; expected one of: {}", known.join(", "))));
            };
            let paints = types.get(id).paints.len().max(1);
            if paint as usize >= paints {
                return Err(Failure::value(format!("paint: expected less than {paints}, found {paint}")));
            }
            let name = named(name, &kind, world)?;
            let on_route = route.map(|route| on_route(world, &route, lane, along)).transpose()?;
            if on_route.is_some() == is_placed {
                return Err(Failure::value("expected one of at and route"));
            }
            if !is_placed && placing.is_turned() {
                return Err(Failure::value("yaw: expected at beside it; a route says how a vehicle is turned"));
            }
            if is_placed && (speed, lane, along) != (0.0, 0, 0.0) {
                return Err(Failure::value(
                    "speed, lane and along: expected a route beside them; without one a vehicle begins at rest",
                ));
            }
            if !(0.0..=FASTEST).contains(&speed) {
                return Err(Failure::value(format!("speed: expected m/s from 0 to {FASTEST:.1}, found {speed}")));
            }
            let spawn = match on_route {
                Some(on) => Spawn::Driver { name, kind, paint, on, speed, manual },
                None => Spawn::Vehicle {
                    name,
                    transform: placing.transform(world.origin(), Facing::Forward),
                    kind,
                    paint,
                    controls: Controls::default(),
                    manual,
                },
            };
            world.spawn(spawn)
        })?;
        wrap_as(py, &self.shared, id, Kind::Vehicle)
    }

    /// Brings a light into being at once. `at`: in the scene, metres. Spots and directional lights shine forward, along
    /// +Z, turned by `yaw` to the left and `pitch` up, radians, or toward `look_at`.
    #[pyo3(
        signature = (light, at=None, *, yaw=None, pitch=None, look_at=None, name=None),
        text_signature = "($self, light, at=None, *, yaw=0.0, pitch=0.0, look_at=None, name=None)"
    )]
    #[allow(clippy::too_many_arguments)]
    fn spawn_light(
        &self,
        py: Python<'_>,
        light: &Bound<'_, PyAny>,
        at: Given<'_, '_>,
        yaw: Given<'_, '_>,
        pitch: Given<'_, '_>,
        look_at: Given<'_, '_>,
        name: Given<'_, '_>,
    ) -> PyResult<Py<PyAny>> {
        let light: Light = required("light", light)?;
        let placing = Placing::read(at, [yaw, pitch, None], look_at)?;
        refuse_turned(&light.0, &placing)?;
        let name = optional::<String>("name", name)?;
        let id = self.with(py, move |world| {
            let name = named(name, "light", world)?;
            let transform = placing.transform(world.origin(), Facing::Backward);
            world.spawn(Spawn::Light { name, transform, light: light.0 })
        })?;
        wrap_as(py, &self.shared, id, Kind::Light)
    }

    /// Draws once more, at another place, what is drawn of an entity that the scene began with, and of what is below
    /// it. `scale`: along its own axes.
    #[pyo3(
        signature = (like, at, *, yaw=None, pitch=None, roll=None, scale=None, name=None),
        text_signature = "($self, like, at, *, yaw=0.0, pitch=0.0, roll=0.0, scale=None, name=None)"
    )]
    #[allow(clippy::too_many_arguments)]
    fn spawn_mesh(
        &self,
        py: Python<'_>,
        like: &Bound<'_, PyAny>,
        at: &Bound<'_, PyAny>,
        yaw: Given<'_, '_>,
        pitch: Given<'_, '_>,
        roll: Given<'_, '_>,
        scale: Given<'_, '_>,
        name: Given<'_, '_>,
    ) -> PyResult<Py<PyAny>> {
        required::<Point>("at", at)?;
        let placing = Placing::read(Some(at), [yaw, pitch, roll], None)?;
        let scale = optional::<Numbers<3>>("scale", scale)?.map_or(Vec3::ONE, |scale| DVec3::from(scale.0).as_vec3());
        let name = optional::<String>("name", name)?;
        if scale.abs().min_element() < 1e-6 || scale.abs().max_element() > 1e6 {
            return Err(Failure::value(format!("scale: expected factors from 1e-6 to 1e6, found {scale}")).into());
        }
        let like: Like = match like.cast::<Entity>() {
            Ok(entity) if Arc::ptr_eq(&entity.get().shared, &self.shared) => Like::Id(entity.get().id),
            Ok(_) => return Err(Failure::value("like: expected an entity of this world").into()),
            Err(_) => Like::Name(like.extract().map_err(|_| wrong_type("like", "an entity or the name of one", like))?),
        };
        let id = self.with(py, move |world| {
            let of = match like {
                Like::Id(id) => id,
                Like::Name(name) => world.find(&name)?,
            };
            let registry = world.simulation.world.resource::<EntityRegistry>();
            world.entity(of)?;
            if of.0 >= registry.scene_len() {
                return Err(Failure::value("like: expected an entity that the scene began with"));
            }
            let name = named(name, "copy", world)?;
            let transform = placing.transform(world.origin(), Facing::Forward).with_scale(scale);
            world.spawn(Spawn::Copy { name, transform, of })
        })?;
        wrap_as(py, &self.shared, id, Kind::Other)
    }

    /// Puts a sensor of a kind into the scene.
    #[pyo3(signature = (kind, name, arguments))]
    fn _add_sensor(
        &self,
        py: Python<'_>,
        kind: &str,
        name: &Bound<'_, PyAny>,
        arguments: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Py<PyAny>> {
        add_sensor(py, &self.shared, kind, name, None, arguments)
    }
}
