//! Routes, signals, and what refers to them. A build without vehicles has `no_roads.rs` instead.

use super::route_lengths::{LONGEST, MOST_POINTS, driven_length, straight_length};
use super::walk::{Check, SIZES};
use crate::scene::format::entities::Entity;
use crate::scene::format::roads::{Along, Route, Signal, Stop, Vehicle};
use crate::scene::text::faults::unknown;
use std::fmt::Display;
use systems::describe::Step;
use systems::space::FARTHEST;
use systems::vehicles::FASTEST;

/// Groups of a signal, routes.
const MOST: (usize, usize) = (64, 65_000);
/// Metres that a place may be beyond the end of its route.
const ROUNDING: f64 = 0.01;
/// Most lanes of a route.
const LANES: u8 = 16;
/// Routes that may follow one.
const MOST_WAYS: usize = 64;
/// Metres.
const LONGEST_VEHICLE: f32 = 1000.0;
/// Metres of a crossing.
const FARTHEST_CLEAR: f32 = 200.0;
/// Seconds.
const LONGEST_WAIT: f32 = 1e5;
/// The highest speed of anything, km/h.
const FASTEST_KMH: f32 = (FASTEST * 3.6) as f32;

impl<'a> Check<'a> {
    pub(super) fn roads(&mut self) {
        let scene = self.scene;
        self.field("signals", |c| c.entries(&scene.signals, Self::signal));
        self.field("routes", |c| {
            if scene.routes.entries().len() > MOST.1 {
                c.fault(format_args!("expected at most {} routes", MOST.1));
            }
            c.entries(&scene.routes, Self::route);
        });
    }

    fn signal(&mut self, signal: &Signal) {
        let count = signal.green_seconds.len();
        if count == 0 || count > MOST.0 {
            self.field("green_seconds", |c| {
                c.fault(format_args!("expected from 1 to {} groups, found {count}", MOST.0))
            });
        }
        self.numbers("green_seconds", &signal.green_seconds, 0.1, LONGEST_WAIT);
        self.number("amber_seconds", signal.amber_seconds, 0.0, LONGEST_WAIT);
        self.number("red_seconds", signal.red_seconds, 0.0, LONGEST_WAIT);
        self.number("offset_seconds", signal.offset_seconds, -LONGEST_WAIT, LONGEST_WAIT);
    }

    fn route(&mut self, route: &Route) {
        self.field("points", |c| {
            for (i, point) in route.points.iter().enumerate() {
                c.inside(Step::Index(i), "", |c| {
                    if point.iter().any(|x| !(-FARTHEST..=FARTHEST).contains(x)) {
                        c.fault(format_args!("expected a point within {FARTHEST} m, found {point:?}"));
                    }
                });
            }
            if route.points.len() > MOST_POINTS {
                c.fault(format_args!("expected at most {} points", MOST_POINTS));
            }
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
        if !(1..=LANES).contains(&route.lanes) {
            self.field("lanes", |c| c.fault(format_args!("expected from 1 to {LANES} lanes, found {}", route.lanes)));
        }
        self.number("lane_width", route.lane_width, 0.5, 100.0);
        self.number("speed_limit_kmh", route.speed_limit_kmh, 1.0, FASTEST_KMH);
        let length = driven_length(route);
        self.each("limits", &route.limits, |c, limit| {
            c.along_route("from", limit.from, length);
            c.number("kmh", limit.kmh, 1.0, FASTEST_KMH);
        });
        self.each("stops", &route.stops, |c, stop| c.stop(stop, length));
        if route.closed && !route.then.is_empty() {
            self.field("then", |c| c.fault("not allowed for a closed route, which continues at its own beginning"));
        }
        if route.then.len() > MOST_WAYS {
            let count = route.then.len();
            self.field("then", |c| c.fault(format_args!("expected at most {MOST_WAYS} routes, found {count}")));
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
        self.each("from_lanes", &route.from_lanes, |c, &lane| {
            if lane >= LANES {
                c.fault(format_args!("expected a lane from 0 to {}, found {lane}", LANES - 1));
            }
        });
        if let Some(longest) = route.longest_vehicle {
            self.number("longest_vehicle", longest, 0.1, LONGEST_VEHICLE);
        }
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
        self.number("keep_clear", stop.keep_clear, 0.0, FARTHEST_CLEAR);
        if stop.keep_clear > 0.0 && stop.signal.is_none() {
            self.field("keep_clear", |c| c.fault("only allowed at a stop with a signal"));
        }
        match (&stop.signal, stop.seconds) {
            (Some(signal), None) => self.known_group(signal, stop.group),
            (None, Some(seconds)) => self.number("seconds", seconds, 0.0, LONGEST_WAIT),
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
        self.number("speed_kmh", vehicle.speed_kmh, 0.0, FASTEST_KMH);
        if let Some(physical) = &vehicle.physical {
            self.field("physical", |c| c.physical(physical));
        }
        let Some(name) = &vehicle.route else {
            return self.number("at", vehicle.at as f32, 0.0, 0.0);
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
        self.number("spacing", along.spacing, 0.1, LONGEST as f32);
        self.number("jitter", along.jitter, 0.0, LONGEST as f32);
        self.number("from", along.from, 0.0, LONGEST as f32);
        if let Some(beside) = along.beside {
            self.number("beside", beside, -SIZES.1, SIZES.1);
        }
        let named = |name: &str| along.routes.is_empty() || along.routes.iter().any(|route| route == name);
        let routes = self.scene.routes.entries().iter().filter(|(name, _)| named(name));
        let copies = |name: &str, route: &Route| {
            let lanes = if along.beside.is_some() || along.lane.is_some() { 1 } else { u64::from(route.lanes) };
            lanes * (1 + (self.length_of(name).unwrap_or_default() / f64::from(along.spacing.max(0.1))) as u64)
        };
        routes.map(|(name, route)| copies(name, route)).sum()
    }
}
