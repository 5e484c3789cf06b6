//! Routes, signals, and what refers to them. A build without vehicles has `no_roads.rs` instead.

use super::route_lengths::{driven_length, straight_length};
use super::walk::Check;
use crate::scene::format::entities::Entity;
use crate::scene::format::roads::{Along, LONGEST, Route, Stop, Vehicle};
use crate::scene::text::faults::unknown;
use std::fmt::Display;
use systems::space::FARTHEST;

/// Routes of a scene.
const MOST_ROUTES: usize = 65_000;
/// Metres that a place may be beyond the end of its route.
const ROUNDING: f64 = 0.01;

impl<'a> Check<'a> {
    pub(super) fn roads(&mut self) {
        let scene = self.scene;
        self.field("signals", |c| c.entries(&scene.signals, Self::described));
        self.field("routes", |c| {
            if scene.routes.entries().len() > MOST_ROUTES {
                c.fault(format_args!("expected at most {} routes", MOST_ROUTES));
            }
            c.entries(&scene.routes, Self::route);
        });
    }

    fn route(&mut self, route: &Route) {
        self.described(route);
        self.field("points", |c| {
            let first = route.points.first();
            if route.points.iter().all(|point| Some(point) == first) {
                c.fault("expected at least two points that differ");
            }
            if route.closed && route.points.len() < 3 {
                c.fault("expected at least three points of a closed route");
            }
            let length = straight_length(route);
            let is_far = |x: &f64| !(-FARTHEST..=FARTHEST).contains(x);
            // Points that are refused need not be refused twice, by a length that may be infinite.
            if length > LONGEST && !route.points.iter().flatten().any(is_far) {
                c.fault(format_args!("expected a length of at most {LONGEST} m, found {length} m"));
            }
        });
        let length = driven_length(route);
        self.each("limits", &route.limits, |c, limit| {
            c.along_route("from", limit.from, length);
        });
        self.each("stops", &route.stops, |c, stop| c.stop(stop, length));
        if route.closed && !route.then.is_empty() {
            self.field("then", |c| c.fault("not allowed for a closed route, which continues at its own beginning"));
        }
        self.each("then", &route.then, |c, name| {
            c.known_route(name);
            let lanes = c.scene.routes.get(name).map_or(&[][..], |next| &next.from_lanes);
            if !lanes.is_empty() && lanes.iter().all(|lane| *lane >= route.lanes) {
                let count = route.lanes;
                c.fault(format_args!(
                    "{name:?} follows the lanes {lanes:?} only; this route has {count} lanes, counted from 0"
                ));
            }
        });
    }

    /// A place between a route's beginning and its end, if that is known; metres, which may be rounded.
    fn along_route(&mut self, name: &'static str, at: impl Into<f64> + Display + Copy, length: Option<f64>) {
        if let Some(length) = length.filter(|length| !(0.0..=length + ROUNDING).contains(&at.into())) {
            self.field(name, |c| {
                c.fault(format_args!("expected a number from 0 to {length:.2}, the route's length, found {at}"))
            });
        }
    }

    fn length_of(&self, route: &str) -> Option<f64> {
        self.scene.routes.position(route).and_then(|index| *self.route_lengths.get(index)?)
    }

    fn stop(&mut self, stop: &Stop, length: Option<f64>) {
        self.along_route("at", stop.at, length);
        if stop.keep_clear > 0.0 && stop.signal.is_none() {
            self.field("keep_clear", |c| c.fault("only allowed at a stop with a signal"));
        }
        match (&stop.signal, stop.seconds) {
            (Some(signal), None) => self.known_group(signal, stop.group),
            (None, Some(_)) => {}
            _ => self.fault("expected either a signal (and its group) or seconds"),
        }
    }

    pub(super) fn known_group(&mut self, name: &str, group: usize) {
        let Some(signal) = self.scene.signals.get(name) else {
            let message = unknown("signal", name, self.scene.signals.names());
            return self.field("signal", |c| c.fault(message));
        };
        let count = signal.green_seconds.len();
        if group >= count {
            let message = format!("signal {name:?} has {count} groups, counted from 0; found {group}");
            self.field("group", |c| c.fault(message));
        }
    }

    fn known_route(&mut self, name: &str) {
        if self.scene.routes.get(name).is_none() {
            let message = unknown("route", name, self.scene.routes.names());
            self.fault(message);
        }
    }

    /// Types that a generator chooses from: types that are not known are warned of where they are spawned.
    pub(super) fn generated_vehicles(&mut self) {}

    pub(super) fn vehicle(&mut self, entity: &Entity, vehicle: &Vehicle) {
        self.described(vehicle);
        if vehicle.physical.is_some() && !cfg!(feature = "physics") {
            self.field("physical", |c| c.fault("this build has no physics (feature `physics`)"));
        }
        let Some(name) = &vehicle.route else {
            if vehicle.at != 0.0 {
                self.field("at", |c| c.fault("only allowed with a route"));
            }
            return;
        };
        self.field("route", |c| c.known_route(name));
        if let Some(route) = self.scene.routes.get(name) {
            self.along_route("at", vehicle.at, self.length_of(name));
            if vehicle.lane >= route.lanes {
                let message = format!("the route has {} lanes, counted from 0; found {}", route.lanes, vehicle.lane);
                self.field("lane", |c| c.fault(message));
            }
        }
        if entity.transform.translation.is_some_and(|translation| translation != [0.0; 3]) {
            self.field("route", |c| c.fault("expected either a route or a translation: the route says where it is"));
        }
    }

    /// Returns how many copies there may be.
    pub(super) fn along(&mut self, along: &'a Along) -> u64 {
        self.each("routes", &along.routes, |c, name| c.known_route(name));
        let named = |name: &str| along.routes.is_empty() || along.routes.iter().any(|route| route == name);
        let routes = self.scene.routes.entries().iter().filter(|(name, _)| named(name));
        let copies = |name: &str, route: &Route| {
            let lanes = if along.beside.is_some() || along.lane.is_some() { 1 } else { u64::from(route.lanes) };
            lanes * (1 + (self.length_of(name).unwrap_or_default() / f64::from(along.spacing.max(0.1))) as u64)
        };
        routes.map(|(name, route)| copies(name, route)).sum()
    }
}
