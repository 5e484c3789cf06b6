//! Speed control: the Intelligent Driver Model, for vehicles and stops ahead.
//!
//! Treiber, Hennecke, Helbing, "Congested traffic states in empirical observations and microscopic simulations",
//! Physical Review E 62 (2000): dv/dt = a·(1 − (v/v0)^δ − (s*/s)²) with s* = s0 + max(0, v·T + v·Δv / (2·√(a·b))).
//! The last term is what is called interaction here; of several leaders the one with the largest counts.

use crate::vehicles::components::{OnRoute, RouteId};
use crate::vehicles::forks::{Chooser, Fork};
use crate::vehicles::routes::{Route, Routes, Stop, Wait};
use crate::vehicles::signals::{Aspect, Signals};
use crate::vehicles::types::{Driver, Limits, VehicleType};

/// Metres: nearer ones count as this far.
const CLOSEST: f32 = 0.05;

/// m/s and m/s²: what is slower than the first and wants no more than the second stands. The model alone creeps on for
/// ever.
const STANDING: (f64, f32) = (0.1, 0.1);

/// m/s²: what stands sets off for no less.
const SETTING_OFF: f32 = 0.25;

/// (s*/s)² for a leader at `gap` metres, from front bumper to rear bumper.
pub fn interaction(driver: &Driver, speed: f32, leader_speed: f32, gap: f32) -> f32 {
    let approach = speed * (speed - leader_speed) / (2.0 * (driver.acceleration * driver.braking).sqrt());
    let wanted = driver.gap + (speed * driver.headway + approach).max(0.0);
    let ratio = wanted / gap.max(CLOSEST);
    ratio * ratio
}

/// The model's acceleration, m/s². Above the wanted speed it is at least −b: a lower limit is no emergency.
pub fn acceleration(driver: &Driver, speed: f32, wanted_speed: f32, interaction: f32) -> f32 {
    let ratio = speed / wanted_speed.max(0.1);
    let power = if driver.exponent == 4.0 { (ratio * ratio) * (ratio * ratio) } else { ratio.powf(driver.exponent) };
    (driver.acceleration * (1.0 - power)).max(-driver.braking) - driver.acceleration * interaction
}

/// The acceleration and the speed after a step, within what the vehicle can do.
pub fn step(limits: &Limits, speed: f64, acceleration: f32, seconds: f64) -> (f32, f64) {
    let possible = acceleration.clamp(-limits.braking, limits.acceleration);
    let next = speed + f64::from(possible) * seconds;
    if speed <= 0.0 && possible < SETTING_OFF {
        return (0.0, 0.0);
    }
    if next < STANDING.0 && possible < STANDING.1 { (possible, 0.0) } else { (possible, next) }
}

/// Distance that a driver looks ahead, metres: that of comfortable braking, and some.
pub(crate) fn look_ahead(driver: &Driver, speed: f32) -> f32 {
    1.3 * speed * speed / (2.0 * driver.braking) + speed * driver.headway + 20.0
}

/// Routes that one looks ahead over.
pub(crate) const ROUTES_AHEAD: usize = 4;

/// The way ahead of a vehicle: the route it is on, and those that it will choose, with the lane there and the metres
/// from its reference point to their beginning.
#[derive(Clone, Copy)]
pub(crate) struct Way<'a> {
    pub routes: &'a Routes,
    pub chooser: Chooser,
    pub id: RouteId,
    pub route: &'a Route,
    pub lane: u8,
    /// Metres to the beginning of `route`; negative on the one it is on.
    pub distance: f64,
    choices: u32,
}

impl<'a> Way<'a> {
    pub fn new(routes: &'a Routes, number: u32, kind: &VehicleType, on: &OnRoute) -> Option<Self> {
        let (route, chooser) = (routes.get(on.route)?, kind.chooser(number));
        Some(Self { routes, chooser, id: on.route, route, lane: on.lane, distance: -on.at, choices: on.choices })
    }

    /// Goes on to the next route.
    pub fn advance(&mut self) {
        self.distance += self.route.length;
        let fork = Fork { route: self.id, lane: self.lane, choices: self.choices };
        self.id = self.routes.next(fork, self.chooser);
        self.choices = self.choices.wrapping_add(1);
        if let Some(route) = self.routes.get(self.id) {
            self.route = route;
        }
        self.lane = self.lane.min(self.route.lanes() - 1);
    }

    /// Metres to the end of `route`.
    pub fn to_end(self) -> f64 {
        self.distance + self.route.length
    }

    /// Stops of `route` before which the front still is, with the distance to them.
    pub fn stops(&self, front: f32) -> impl Iterator<Item = (Stop, f32)> + use<'a> {
        let (stops, distance) = (&self.route.stops, self.distance - f64::from(front));
        let first = usize::from(self.route.stop_after(-distance));
        stops.iter().skip(first).map(move |&stop| (stop, (distance + f64::from(stop.at)) as f32))
    }
}

/// Tells if a vehicle has to stand before a stop `distance` metres ahead. `has_waited`: the time at it is over.
pub(crate) fn is_closed(
    stop: &Stop,
    distance: f32,
    speed: f32,
    braking: f32,
    has_waited: bool,
    signals: &Signals,
) -> bool {
    match stop.wait {
        Wait::Dwell(_) => !has_waited,
        Wait::Signal(head) => {
            let (aspect, left) = signals.heads().get(head as usize).copied().unwrap_or_default();
            let can_stop = speed * speed <= 2.0 * braking * distance;
            match aspect {
                Aspect::Green => false,
                // Held, it says nothing of when red comes.
                Aspect::Amber => can_stop && (left.is_infinite() || distance > speed * left),
                Aspect::Red => can_stop,
            }
        }
    }
}

/// Seconds that a standing vehicle has to wait before the stop ahead of it; `None`: it need not wait.
pub(crate) fn dwell_ahead(routes: &Routes, number: u32, on: &OnRoute, kind: &VehicleType) -> Option<f32> {
    let reach = kind.driver.gap + 1.5;
    let mut way = Way::new(routes, number, kind, on)?;
    for _ in 0..ROUTES_AHEAD {
        if let Some((stop, distance)) = way.stops(kind.front()).next() {
            return match stop.wait {
                Wait::Dwell(seconds) if distance < reach => Some(seconds),
                _ => None,
            };
        }
        if way.to_end() > f64::from(reach + kind.front()) || way.route.is_dead_end {
            return None;
        }
        way.advance();
    }
    None
}
