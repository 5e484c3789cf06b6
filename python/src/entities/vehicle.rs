//! Vehicles.

use crate::entities::entity::Entity;
use crate::entities::own::with;
use crate::errors::{Failure, Outcome};
use crate::getters::getters;
use crate::given::arguments::{Given, one_of, optional, required, within};
use crate::given::values::Point;
use crate::worlds::world::World;
use pyo3::exceptions::PyDeprecationWarning;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use relief::glam::DVec3;
use relief::name;
use relief::systems::ecs::clock::Clock;
use relief::systems::run::registry::StateId;
use relief::systems::run::standard_inputs::{Drive, MoveVehicle, ReleaseVehicle, SetManualControl};
use relief::systems::vehicles;
use relief::systems::vehicles::routes::Routes;
use relief::systems::vehicles::{
    Controls, External, FASTEST, Headlights, Indicator, ManualControl, Motion, MotionSource, OnRoute, StampedMotion,
    VehicleTypes,
};

/// Head lamps by name.
pub const HEADLIGHTS: [(&str, Headlights); 3] =
    [("off", Headlights::Off), ("low", Headlights::Low), ("high", Headlights::High)];
/// Indicators by name.
const INDICATORS: [(&str, Indicator); 4] =
    [("off", Indicator::Off), ("left", Indicator::Left), ("right", Indicator::Right), ("hazard", Indicator::Hazard)];

/// Sources of motion by name.
const MOTION_SOURCES: [(&str, MotionSource); 3] =
    [("route", MotionSource::Route), ("manual", MotionSource::Manual), ("external", MotionSource::External)];
/// Radians, and radians per second, at most.
const MOST_TURNED: f64 = 1e4;
const MOST_TURNING: f64 = 100.0;

/// A vehicle: its origin is on the ground below the middle of its rear axle, +Z forward, +X left, +Y up.
#[pyclass(frozen, extends = Entity, module = "relief")]
pub struct Vehicle;

getters! { with, Vehicle:
    /// The name of its type.
    type_: String = |world, id| type_of(world, id)?;
    /// Metres per second along its own forward; negative in reverse.
    speed: f64 = |world, id| motion(world, id)?.speed;
    /// Acceleration along its forward, m/s².
    acceleration: f32 = |world, id| motion(world, id)?.acceleration;
    /// Radians about the world's +Y, 0 along +Z, left positive.
    yaw: f64 = |world, id| motion(world, id)?.yaw;
    /// Steering angle of the front wheels, radians, left positive.
    steering: f32 = |world, id| motion(world, id)?.steering;
    /// Metres along its own forward since it came to be.
    rolled: f64 = |world, id| motion(world, id)?.rolled;
    /// The name of the route that it follows; ``None``: it has none.
    route: Option<String> = |world, id| route_of(world, id)?;
    /// The lane of its route that it is in or changes to, 0 the outermost; ``None`` without a route. Where it
    /// does not follow its route, this, `along` and `offset` are those of the nearest place of it.
    lane: Option<u32> = |world, id| place_on_route(world, id)?.map(|on| on.lane);
    /// Metres along its route's centre line from its beginning; ``None`` without a route.
    along: Option<f64> = |world, id| place_on_route(world, id)?.map(|on| on.along);
    /// Metres from the middle of the lane that it is in or changes to, left positive; ``None`` without a route.
    offset: Option<f64> = |world, id| place_on_route(world, id)?.map(|on| on.offset);
    /// Source of its motion: "route", "manual" (it goes by `drive`) or "external" (it goes by `move`).
    motion_source: &'static str = |world, id| {
        name::of(&MOTION_SOURCES, MotionSource::of(&world.simulation.world, world.entity(id)?))
    };
}

#[pymethods]
impl Vehicle {
    /// Goes by `drive` even where it has a route; without a route it does so anyway. Setting it to ``False`` lets its
    /// route have it.
    #[getter]
    fn manual(own: PyRef<'_, Self>) -> PyResult<bool> {
        with(&own, |world, id| Ok(world.component::<ManualControl>(id)?.is_some()))
    }

    #[setter]
    fn set_manual(own: PyRef<'_, Self>, manual: &Bound<'_, PyAny>) -> PyResult<()> {
        let manual = required("manual", manual)?;
        with(&own, |world, id| {
            world.entity(id)?;
            world.apply(SetManualControl { vehicle: id, manual })
        })
    }

    /// Deprecated name of `manual`.
    #[getter]
    fn by_hand(own: PyRef<'_, Self>) -> PyResult<bool> {
        warn_of_by_hand(own.py())?;
        Self::manual(own)
    }

    #[setter]
    fn set_by_hand(own: PyRef<'_, Self>, by_hand: &Bound<'_, PyAny>) -> PyResult<()> {
        warn_of_by_hand(own.py())?;
        Self::set_manual(own, by_hand)
    }

    /// Moves it from outside, as another simulator or a trace has it: it is `at` a place in the scene, metres, turned
    /// by `yaw`, with a `velocity` (x, y, z) in the scene's axes, m/s, and a `yaw_rate`, radians per second. Given
    /// `pitch` or `roll`, it is as high and tilted as they say; without both it stands on the ground.
    ///
    /// `stamp`: the time of this, by default now: seconds of the clock, later than that of the call before, and at most
    /// 2 s from now. Between stamps it goes on at its speed and yaw rate, and a newer one takes over smoothly, or by a
    /// jump where it could not have got there. Where none comes for 2 s, `Sim.step` tells it as a UserWarning, and the
    /// vehicle brakes to a standstill. Until `release` neither a route nor `drive` moves it.
    #[pyo3(
        signature = (at, *, yaw=None, pitch=None, roll=None, velocity=None, yaw_rate=None, stamp=None),
        text_signature = "($self, at, *, yaw=0.0, pitch=None, roll=None, velocity=(0, 0, 0), yaw_rate=0.0, stamp=None)"
    )]
    #[allow(clippy::too_many_arguments)]
    fn r#move(
        own: PyRef<'_, Self>,
        at: &Bound<'_, PyAny>,
        yaw: Given<'_, '_>,
        pitch: Given<'_, '_>,
        roll: Given<'_, '_>,
        velocity: Given<'_, '_>,
        yaw_rate: Given<'_, '_>,
        stamp: Given<'_, '_>,
    ) -> PyResult<()> {
        let Point(at) = required("at", at)?;
        let turned = |name, given| within(name, given, "radians", -MOST_TURNED..=MOST_TURNED);
        let (yaw, pitch, roll) = (turned("yaw", yaw)?, turned("pitch", pitch)?, turned("roll", roll)?);
        let velocity = optional::<Point>("velocity", velocity)?.map_or(DVec3::ZERO, |velocity| velocity.0);
        if velocity.length() > FASTEST {
            let found = velocity.length();
            return Err(Failure::value(format!("velocity: expected at most {FASTEST:.1} m/s, found {found}")).into());
        }
        let yaw_rate = within("yaw_rate", yaw_rate, "radians per second", -MOST_TURNING..=MOST_TURNING)?;
        let yaw_rate = yaw_rate.unwrap_or_default();
        let stamp = optional::<f64>("stamp", stamp)?;
        let tilt = (pitch.is_some() || roll.is_some()).then(|| [pitch, roll].map(Option::unwrap_or_default));
        with(&own, |world, id| {
            let last = world.component::<External>(id)?.map(|external| external.stamp());
            let now = world.simulation.world.resource::<Clock>().seconds();
            let stamp = stamp.unwrap_or(now);
            External::check_stamp(stamp, last, now).map_err(Failure::Value)?;
            let place = at - world.origin();
            let yaw = yaw.unwrap_or_default();
            world.apply(MoveVehicle {
                vehicle: id,
                motion: StampedMotion { stamp, place, yaw, tilt, velocity, yaw_rate },
            })
        })
    }

    /// Ends motion from outside: it goes on by its route, or by `drive`.
    fn release(own: PyRef<'_, Self>) -> PyResult<()> {
        with(&own, |world, id| {
            world.entity(id)?;
            world.apply(ReleaseVehicle(id))
        })
    }

    /// Control inputs: a dict with `throttle`, `brake`, `steer`, `headlights` and `indicator`.
    #[getter]
    fn controls<'py>(own: PyRef<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let controls = with(&own, |world, id| Ok(world.component::<Controls>(id)?.unwrap_or_default()))?;
        let dict = PyDict::new(own.py());
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
    /// anything else it raises ValueError, unless `manual` is ``True``. One that is moved from outside takes lamps and
    /// indicators.
    #[pyo3(signature = (*, throttle=None, brake=None, steer=None, headlights=None, indicator=None))]
    fn drive(
        own: PyRef<'_, Self>,
        throttle: Given<'_, '_>,
        brake: Given<'_, '_>,
        steer: Given<'_, '_>,
        headlights: Given<'_, '_>,
        indicator: Given<'_, '_>,
    ) -> PyResult<()> {
        let number = |name, given, least: f32| within(name, given, "a number", least..=1.0);
        let asked = Asked {
            throttle: number("throttle", throttle, -1.0)?,
            brake: number("brake", brake, 0.0)?,
            steer: number("steer", steer, -1.0)?,
            headlights: one_of("headlights", headlights, &HEADLIGHTS)?,
            indicator: one_of("indicator", indicator, &INDICATORS)?,
        };
        with(&own, |world, id| {
            asked.refuse_unless_manual(world, id)?;
            let now = world.component::<Controls>(id)?.unwrap_or_default();
            let controls = Controls {
                throttle: asked.throttle.unwrap_or(now.throttle),
                brake: asked.brake.unwrap_or(now.brake),
                steer: asked.steer.unwrap_or(now.steer),
                headlights: asked.headlights.unwrap_or(now.headlights),
                indicator: asked.indicator.unwrap_or(now.indicator),
            };
            world.apply(Drive { vehicle: id, controls })
        })
    }
}

/// Controls that were asked for.
struct Asked {
    throttle: Option<f32>,
    brake: Option<f32>,
    steer: Option<f32>,
    headlights: Option<Headlights>,
    indicator: Option<Indicator>,
}

impl Asked {
    /// Refuses controls that would have no effect: pedals where something else moves it, indicators on a route.
    fn refuse_unless_manual(&self, world: &World, id: StateId) -> Outcome<()> {
        let moves = self.throttle.is_some() || self.brake.is_some() || self.steer.is_some();
        let turns = matches!(self.indicator, Some(Indicator::Left | Indicator::Right));
        let entity = world.entity(id)?;
        let vehicle = name::of_entity(&world.simulation.world, entity);
        match MotionSource::of(&world.simulation.world, entity) {
            MotionSource::Route if moves || turns => {
                let route = route_of(world, id)?.unwrap_or_default();
                Err(Failure::value(format!("{vehicle:?} goes by its route, {route:?}; set manual to True to drive it")))
            }
            MotionSource::External if moves => {
                Err(Failure::value(format!("{vehicle:?} is moved from outside; call release() to drive it")))
            }
            _ => Ok(()),
        }
    }
}

/// The name of the route that a vehicle is on.
fn route_of(world: &World, id: StateId) -> Outcome<Option<String>> {
    let routes = world.simulation.world.resource::<Routes>();
    Ok(world.component::<OnRoute>(id)?.and_then(|on| Some(routes.get(on.route)?.plan.name.clone())))
}

/// Warns of the old name of `manual`.
pub fn warn_of_by_hand(py: Python<'_>) -> PyResult<()> {
    PyErr::warn(py, &py.get_type::<PyDeprecationWarning>(), c"by_hand is deprecated; use manual", 1)
}

fn motion(world: &World, id: StateId) -> Outcome<Motion> {
    Ok(world.component::<Motion>(id)?.unwrap_or_default())
}

fn type_of(world: &World, id: StateId) -> Outcome<String> {
    let vehicle = world.component::<vehicles::Vehicle>(id)?;
    let types = world.simulation.world.resource::<VehicleTypes>();
    Ok(vehicle.map_or_else(String::new, |vehicle| types.get(vehicle.kind).name.clone()))
}

/// A vehicle's place on its route.
struct PlaceOnRoute {
    lane: u32,
    along: f64,
    offset: f64,
}

fn place_on_route(world: &World, id: StateId) -> Outcome<Option<PlaceOnRoute>> {
    let Some((on, motion)) = world.component::<OnRoute>(id)?.zip(world.component::<Motion>(id)?) else {
        return Ok(None);
    };
    let routes = world.simulation.world.resource::<Routes>();
    if MotionSource::of(&world.simulation.world, world.entity(id)?) != MotionSource::Route {
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
