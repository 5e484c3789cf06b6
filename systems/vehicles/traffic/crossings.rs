//! Crossings that are kept clear: which may drive into one although its signal is green.
//!
//! A stop at a signal may have a stretch beyond its line in which none should stand
//! ([`crate::vehicles::routes::Stop::clear`]): the crossing. A vehicle waits before the line while one that came in
//! elsewhere, by another group of the signal, is in its own stretch, and while there is no room for it beyond: what
//! stands there leaves less than it and those ahead of it need. What cannot stop any more drives on. What has stood
//! there for some seconds for want of room draws again which way to take: else vehicles that wait for each other round
//! a block would do so for ever.
//!
//! Vehicles in crossings are noted while lanes are filled, per head of a signal; what comes to a line is looked at when
//! lanes are complete. Both follow from where vehicles are, and nothing of it is kept.

use super::following::{self, ROUTES_AHEAD, Way};
use super::lanes::Role;
use super::traffic::{Row, Traffic};
use crate::vehicles::components::RouteId;
use crate::vehicles::routes::{Route, Routes, Stop, Wait};
use crate::vehicles::signals::Signals;
use crate::vehicles::types::{VehicleType, VehicleTypes};
use std::sync::atomic::{AtomicU32, Ordering};

/// Metres, and of the distance that comfortable braking takes: so far before a line one looks.
const LOOK: (f32, f32) = (5.0, 1.3);
/// m/s: what is slower beyond a crossing may be about to stand.
const SLOW: f32 = 2.0;
/// Metres beyond a crossing in which those that stand are looked for.
const BEYOND: f32 = 60.0;

/// Seconds for which one waits for room in the way that it chose.
pub(crate) const PATIENCE: f64 = 2.0;

/// A vehicle before the line of a crossing.
#[derive(Clone, Copy)]
pub(crate) struct Coming {
    row: u32,
    /// Metres from its front to the line.
    distance: f32,
    /// Metres from its reference point to the crossing's end.
    end: f32,
    /// The route that the line is on.
    route: RouteId,
    head: u32,
}

impl Coming {
    /// A vehicle that has a stop ahead, if it has to look there, and still can stop.
    pub fn new(row: u32, kind: &VehicleType, speed: f32, way: &Way, stop: &Stop, distance: f32) -> Option<Self> {
        let Wait::Signal(head) = stop.wait else { return None };
        let square = speed * speed;
        let is_near = distance < LOOK.0 + LOOK.1 * square / (2.0 * kind.driver.braking);
        let can_stop = square <= 2.0 * kind.limits.braking * distance;
        if stop.clear <= 0.0 || !is_near || !can_stop {
            return None;
        }
        let mut across = *way;
        across.advance();
        let end = (kind.front() + distance + stop.clear).min(across.to_end() as f32);
        Some(Self { row, distance, end, route: way.id, head })
    }
}

/// Vehicles in crossings: by head of a signal, the route of those that passed its line and are inside.
#[derive(Default)]
pub(crate) struct Inside(Vec<AtomicU32>);

/// None is; several are, by different routes. Else it is the number of the route.
const EMPTY: u32 = u32::MAX;
const SEVERAL: u32 = u32::MAX - 1;

impl Inside {
    /// Forgets all.
    pub fn reset(&mut self, heads: usize) {
        self.0.resize_with(heads, AtomicU32::default);
        self.0.iter_mut().for_each(|inside| *inside.get_mut() = EMPTY);
    }

    /// Notes a vehicle whose ends are so far from its reference point, on its route and those that it came from.
    pub fn note(&self, row: &Row, routes: &Routes, route: &Route, (front, rear): (f32, f32)) {
        let (front, rear) = (f64::from(front), f64::from(rear));
        let mut at = row.on.at;
        if at + front > f64::from(route.first_line) {
            self.note_on(row.on.route, route, (at - rear, at + front), f64::INFINITY);
        }
        if at - rear >= f64::from(route.crossed) {
            return;
        }
        let mut after = route;
        for (id, previous) in row.on.previous.into_iter().flatten().filter_map(|(id, _)| Some((id, routes.get(id)?))) {
            at += previous.length;
            self.note_on(id, previous, (at - rear, at + front), previous.length + after.length);
            after = previous;
        }
    }

    /// Notes one whose ends are at these metres of a route, in the crossings that begin there; they end at `most`.
    pub fn note_on(&self, id: RouteId, route: &Route, (back, front): (f64, f64), most: f64) {
        for stop in route.stops.iter().filter(|stop| stop.clear > 0.0) {
            let is_in = front > f64::from(stop.at) && back < f64::from(stop.at + stop.clear).min(most);
            if let Wait::Signal(head) = stop.wait
                && is_in
                && let Some(inside) = self.0.get(head as usize)
            {
                let id = u32::from(id.0);
                let before = inside.compare_exchange(EMPTY, id, Ordering::Relaxed, Ordering::Relaxed);
                if before.is_err_and(|before| before != id) {
                    inside.store(SEVERAL, Ordering::Relaxed);
                }
            }
        }
    }

    /// Tells if one is there that passed the line of one of the heads, on a route that is not among these.
    fn is_any(&self, mut heads: impl Iterator<Item = u32>, mut own: impl FnMut(u32) -> bool) -> bool {
        heads.any(|head| {
            let inside = self.0.get(head as usize).map_or(EMPTY, |inside| inside.load(Ordering::Relaxed));
            inside != EMPTY && !own(inside)
        })
    }
}

impl Traffic {
    /// Lets a vehicle wait before a crossing into which it may not drive.
    pub(crate) fn hold(&self, coming: &Coming, routes: &Routes, signals: &Signals, types: &VehicleTypes) {
        // It itself, and those that came in where it comes from, are not in its way but ahead of it.
        let on = &self.rows[coming.row as usize].on;
        let before = on.previous.iter().flatten().map(|(id, _)| *id);
        let own = [coming.route, on.route].into_iter().chain(before);
        let is_own = |inside: u32| own.clone().any(|id| u32::from(id.0) == inside);
        let is_met = self.inside.is_any(signals.others(coming.head), is_own);
        let is_blocked = !is_met && !self.has_room(coming, routes, types);
        if is_met || is_blocked {
            let row = &self.rows[coming.row as usize];
            let driver = &types.get(row.kind).driver;
            self.press(coming.row, following::interaction(driver, row.speed, 0.0, coming.distance));
        }
        if is_blocked {
            self.blocked[coming.row as usize].store(true, Ordering::Relaxed);
        }
    }

    /// Tells if those that stand beyond the crossing leave room for it and all between.
    fn has_room(&self, coming: &Coming, routes: &Routes, types: &VehicleTypes) -> bool {
        let row = &self.rows[coming.row as usize];
        let kind = types.get(row.kind);
        let Some(mut way) = Way::new(routes, row.number, kind, &row.on) else { return true };
        let takes = |kind: &VehicleType| kind.front() + kind.rear() + kind.driver.gap;
        let (line, end) = (kind.front() + coming.distance, coming.end);
        let mut needed = takes(kind);
        for _ in 0..=ROUTES_AHEAD {
            let entries = self.lane(routes.lane(way.route, way.lane));
            let before = way.distance as f32;
            let first = entries.partition_point(|entry| before + entry.front <= kind.front());
            for entry in entries[first..].iter().filter(|entry| entry.row != coming.row) {
                let is_routed = self.rows[entry.row as usize].is_routed;
                // One whose rear is still in the lane before, or that changes lanes, counts where its front is.
                if entry.role != Role::Main && is_routed {
                    continue;
                }
                let other = types.get(entry.kind);
                let (front, back) = (before + entry.front, before + entry.back);
                if front < line || back > end + BEYOND {
                    // It comes to the line before, and is looked at itself; or it is far.
                    return true;
                }
                let is_beyond = front > end || !is_routed;
                if is_beyond && entry.speed < SLOW {
                    let rests = back + entry.speed.max(0.0).powi(2) / (2.0 * other.driver.braking);
                    if rests - needed < end {
                        return false;
                    }
                }
                needed += takes(other);
            }
            if way.to_end() > f64::from(end + BEYOND) {
                return true;
            }
            way.advance();
        }
        true
    }
}
