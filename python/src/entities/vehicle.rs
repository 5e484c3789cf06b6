//! Vehicles.

use crate::entities::entity::Entity;
use crate::errors::{Failure, Outcome};
use crate::given::arguments::{Given, optional, required};
use crate::worlds::world::World;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use relief::glam::DVec3;
use relief::name;
use relief::systems::run::registry::StateId;
use relief::systems::run::standard_inputs::{Drive, SetManualControl};
use relief::systems::vehicles;
use relief::systems::vehicles::routes::Routes;
use relief::systems::vehicles::{Controls, Headlights, Indicator, ManualControl, Motion, OnRoute, VehicleTypes};

/// Head lamps by name.
pub const HEADLIGHTS: [(&str, Headlights); 3] =
    [("off", Headlights::Off), ("low", Headlights::Low), ("high", Headlights::High)];
/// Indicators by name.
const INDICATORS: [(&str, Indicator); 4] =
    [("off", Indicator::Off), ("left", Indicator::Left), ("right", Indicator::Right), ("hazard", Indicator::Hazard)];

/// A vehicle: its origin is on the ground below the middle of its rear axle, +Z forward, +X left, +Y up.
#[pyclass(frozen, extends = Entity, module = "relief")]
pub struct Vehicle;

#[pymethods]
impl Vehicle {
    /// The name of its type.
    #[getter]
    fn type_(own: PyRef<'_, Self>) -> PyResult<String> {
        let (py, entity) = (own.py(), own.as_super());
        let id = entity.id;
        entity.with(py, move |world| {
            let vehicle = world.component::<vehicles::Vehicle>(id)?;
            let types = world.simulation.world.resource::<VehicleTypes>();
            Ok(vehicle.map_or_else(String::new, |vehicle| types.get(vehicle.kind).name.clone()))
        })
    }

    /// Metres per second along its own forward; negative in reverse.
    #[getter]
    fn speed(own: PyRef<'_, Self>) -> PyResult<f64> {
        motion(&own, |motion| motion.speed)
    }

    /// Acceleration along its forward, m/s².
    #[getter]
    fn acceleration(own: PyRef<'_, Self>) -> PyResult<f64> {
        motion(&own, |motion| motion.acceleration.into())
    }

    /// Radians about the world's +Y, 0 along +Z, left positive.
    #[getter]
    fn yaw(own: PyRef<'_, Self>) -> PyResult<f64> {
        motion(&own, |motion| motion.yaw)
    }

    /// Steering angle of the front wheels, radians, left positive.
    #[getter]
    fn steering(own: PyRef<'_, Self>) -> PyResult<f64> {
        motion(&own, |motion| motion.steering.into())
    }

    /// Metres along its own forward since it came to be.
    #[getter]
    fn rolled(own: PyRef<'_, Self>) -> PyResult<f64> {
        motion(&own, |motion| motion.rolled)
    }

    /// The name of the route that it follows; ``None``: it has none.
    #[getter]
    fn route(own: PyRef<'_, Self>) -> PyResult<Option<String>> {
        let (py, entity) = (own.py(), own.as_super());
        let id = entity.id;
        entity.with(py, move |world| {
            let on = world.component::<OnRoute>(id)?;
            let routes = world.simulation.world.resource::<Routes>();
            Ok(on.and_then(|on| Some(routes.get(on.route)?.plan.name.clone())))
        })
    }

    /// The lane of its route that it is in or changes to, 0 the outermost; ``None`` without a route. Under manual
    /// control this, `along` and `offset` are those of the nearest place of its route.
    #[getter]
    fn lane(own: PyRef<'_, Self>) -> PyResult<Option<u32>> {
        on_route(&own, |on| on.lane)
    }

    /// Metres along its route's centre line from its beginning; ``None`` without a route.
    #[getter]
    fn along(own: PyRef<'_, Self>) -> PyResult<Option<f64>> {
        on_route(&own, |on| on.along)
    }

    /// Metres from the middle of the lane that it is in or changes to, left positive; ``None`` without a route.
    #[getter]
    fn offset(own: PyRef<'_, Self>) -> PyResult<Option<f64>> {
        on_route(&own, |on| on.offset)
    }

    /// Goes by `drive` even where it has a route; without a route it does so anyway. Setting it to ``False`` lets its
    /// route have it.
    #[getter]
    fn by_hand(own: PyRef<'_, Self>) -> PyResult<bool> {
        let (py, entity) = (own.py(), own.as_super());
        let id = entity.id;
        entity.with(py, move |world| Ok(world.component::<ManualControl>(id)?.is_some()))
    }

    #[setter]
    fn set_by_hand(own: PyRef<'_, Self>, by_hand: &Bound<'_, PyAny>) -> PyResult<()> {
        let by_hand = required("by_hand", by_hand)?;
        let (py, entity) = (own.py(), own.as_super());
        let id = entity.id;
        entity.with(py, move |world| {
            world.entity(id)?;
            world.apply(SetManualControl { vehicle: id, manual: by_hand })
        })
    }

    /// Control inputs: a dict with `throttle`, `brake`, `steer`, `headlights` and `indicator`.
    #[getter]
    fn controls<'py>(own: PyRef<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let py = own.py();
        let (entity, id) = (own.as_super(), own.as_super().id);
        let controls = entity.with(py, move |world| Ok(world.component::<Controls>(id)?.unwrap_or_default()))?;
        let dict = PyDict::new(py);
        dict.set_item("throttle", controls.throttle)?;
        dict.set_item("brake", controls.brake)?;
        dict.set_item("steer", controls.steer)?;
        dict.set_item("headlights", name::of(&HEADLIGHTS, controls.headlights))?;
        dict.set_item("indicator", name::of(&INDICATORS, controls.indicator))?;
        Ok(dict)
    }

    /// Asks for something; what is not given stays. `throttle`: 0 to 1 of its acceleration, −1 to 0 in reverse.
    /// `brake`: 0 to 1 of its hardest braking. `steer`: −1 to 1 of its largest steering angle, left positive.
    /// `headlights`: "off", "low" or "high". `indicator`: "off", "left", "right" or "hazard".
    ///
    /// A vehicle without a route goes by this alone. One that follows a route takes lamps and "hazard" only; asked for
    /// anything else it raises ValueError, unless `by_hand` is ``True``.
    #[pyo3(signature = (*, throttle=None, brake=None, steer=None, headlights=None, indicator=None))]
    fn drive(
        own: PyRef<'_, Self>,
        throttle: Given<'_, '_>,
        brake: Given<'_, '_>,
        steer: Given<'_, '_>,
        headlights: Given<'_, '_>,
        indicator: Given<'_, '_>,
    ) -> PyResult<()> {
        let (py, entity) = (own.py(), own.as_super());
        let throttle = optional::<f32>("throttle", throttle)?;
        let (brake, steer) = (optional::<f32>("brake", brake)?, optional::<f32>("steer", steer)?);
        let headlights = optional::<String>("headlights", headlights)?;
        let headlights = headlights.map(|wanted| name::find("headlights", &HEADLIGHTS, &wanted));
        let headlights = headlights.transpose().map_err(Failure::Value)?;
        let indicator = optional::<String>("indicator", indicator)?;
        let indicator = indicator.map(|wanted| name::find("indicator", &INDICATORS, &wanted));
        let indicator = indicator.transpose().map_err(Failure::Value)?;
        for (name, value, least) in [("throttle", throttle, -1.0), ("brake", brake, 0.0), ("steer", steer, -1.0)] {
            if let Some(value) = value.filter(|value| !(least..=1.0).contains(value)) {
                return Err(
                    Failure::value(format!("{name}: expected a number from {least} to 1, found {value}")).into()
                );
            }
        }
        let id = entity.id;
        let turns = matches!(indicator, Some(Indicator::Left | Indicator::Right));
        let moves = throttle.is_some() || brake.is_some() || steer.is_some() || turns;
        entity.with(py, move |world| {
            if moves {
                refuse_on_route(world, id)?;
            }
            let now = world.component::<Controls>(id)?.unwrap_or_default();
            let controls = Controls {
                throttle: throttle.unwrap_or(now.throttle),
                brake: brake.unwrap_or(now.brake),
                steer: steer.unwrap_or(now.steer),
                headlights: headlights.unwrap_or(now.headlights),
                indicator: indicator.unwrap_or(now.indicator),
            };
            world.apply(Drive { vehicle: id, controls })
        })
    }
}

/// Refuses controls of a vehicle that a route drives: they would have no effect.
fn refuse_on_route(world: &World, id: StateId) -> Outcome<()> {
    let Some(on) = world.component::<OnRoute>(id)? else { return Ok(()) };
    let routes = world.simulation.world.resource::<Routes>();
    if routes.is_empty() || world.component::<ManualControl>(id)?.is_some() {
        return Ok(());
    }
    let route = routes.get(on.route).map_or("", |route| route.plan.name.as_str());
    let vehicle = name::of_entity(&world.simulation.world, world.entity(id)?);
    Err(Failure::value(format!("{vehicle:?} goes by its route, {route:?}; set by_hand to True to drive it")))
}

fn motion(own: &PyRef<'_, Vehicle>, value: impl FnOnce(&Motion) -> f64 + Send) -> PyResult<f64> {
    let entity: &Entity = own.as_super();
    let id: StateId = entity.id;
    entity.with(own.py(), move |world| Ok(value(&world.component::<Motion>(id)?.unwrap_or_default())))
}

/// A vehicle's place on its route.
struct PlaceOnRoute {
    lane: u32,
    along: f64,
    offset: f64,
}

fn on_route<T: Send>(own: &PyRef<'_, Vehicle>, value: impl FnOnce(PlaceOnRoute) -> T + Send) -> PyResult<Option<T>> {
    let entity: &Entity = own.as_super();
    let id: StateId = entity.id;
    entity.with(own.py(), move |world| Ok(place_on_route(world, id)?.map(value)))
}

fn place_on_route(world: &World, id: StateId) -> Outcome<Option<PlaceOnRoute>> {
    let Some((on, motion)) = world.component::<OnRoute>(id)?.zip(world.component::<Motion>(id)?) else {
        return Ok(None);
    };
    let routes = world.simulation.world.resource::<Routes>();
    if world.component::<ManualControl>(id)?.is_some() {
        let forward = DVec3::new(motion.yaw.sin(), 0.0, motion.yaw.cos());
        let found = routes.beside_route(&on, motion.place, forward);
        return Ok(found.map(|found| PlaceOnRoute { lane: found.lane, along: found.along, offset: found.offset }));
    }
    Ok(routes.get(on.route).map(|route| {
        let centre = route.place(on.at);
        let (left, off) = (centre.left().as_dvec2(), motion.place - centre.position);
        let offset = off.x * left.x + off.z * left.y - f64::from(routes.offset(route, on.lane));
        PlaceOnRoute { lane: on.lane.into(), along: on.at, offset }
    }))
}
