//! Crossings that are kept clear: who may drive into one although its signal is green.
//!
//! A stop at a signal may have a stretch beyond its line in which nobody should stand ([`super::routes::Stop::clear`]): the
//! crossing. A vehicle waits before the line while one that came in by another group of the signal is in its own stretch,
//! and while there is no room for it beyond: whoever stands there leaves less than it and those ahead of it need. Who can
//! not stop any more drives on. Who has stood there for some seconds for want of room chooses another way, if there is one:
//! else vehicles that wait for each other round a block would do so for ever.
//!
//! Vehicles in crossings are noted while lanes are filled, per head of a signal; who comes to a line is looked at when
//! lanes are complete. Both follow from where vehicles are, and nothing of it is kept.

use super::following::{self, ROUTES_AHEAD, Way};
use super::lanes::Role;
use super::routes::{Route, Routes, Stop, Wait};
use super::signals::Signals;
use super::traffic::{Row, Traffic};
use super::types::{VehicleType, VehicleTypes};
use std::sync::atomic::{AtomicBool, Ordering};

/// Metres, and of the distance that comfortable braking takes: so far before a line one looks.
const LOOK: (f32, f32) = (5.0, 1.3);
/// m/s: who is slower beyond a crossing may be about to stand.
const SLOW: f32 = 2.0;
/// Metres beyond a crossing in which those who stand are looked for.
const BEYOND: f32 = 60.0;

/// A vehicle before the line of a crossing.
#[derive(Clone, Copy)]
pub(super) struct Coming {
    row: u32,
    /// Metres from its front to the line.
    distance: f32,
    /// Metres from its reference point to the crossing's end.
    end: f32,
    head: u32,
}

/// Seconds for which one waits for room in the way that it chose.
pub(super) const PATIENCE: f32 = 2.0;

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
        let end = (kind.front() + distance + stop.clear).min(across.to_end());
        Some(Self { row, distance, end, head })
    }
}

/// Who is in crossings: of each head of a signal, whether somebody who passed its line is.
#[derive(Default)]
pub(super) struct Inside(Vec<AtomicBool>);

impl Inside {
    /// Forgets all.
    pub fn reset(&mut self, heads: usize) {
        self.0.resize_with(heads, AtomicBool::default);
        self.0.iter_mut().for_each(|inside| *inside.get_mut() = false);
    }

    /// Notes a vehicle whose ends are so far from its reference point.
    pub fn note(&self, row: &Row, routes: &Routes, route: &Route, (front, rear): (f32, f32)) {
        let note = |route: &Route, at: f32, most: f32| {
            for stop in &route.stops {
                let is_in = at + front > stop.at && at - rear < (stop.at + stop.clear).min(most);
                if let Wait::Signal(head) = stop.wait
                    && stop.clear > 0.0
                    && is_in
                    && let Some(inside) = self.0.get(head as usize)
                {
                    inside.store(true, Ordering::Relaxed);
                }
            }
        };
        let mut at = row.on.at;
        if at + front > route.first_line {
            note(route, at, f32::INFINITY);
        }
        if at - rear >= route.crossed {
            return;
        }
        let mut after = route;
        for previous in row.on.previous.into_iter().flatten().filter_map(|(id, _)| routes.get(id)) {
            at += previous.length;
            note(previous, at, previous.length + after.length);
            after = previous;
        }
    }

    fn is_any(&self, mut heads: impl Iterator<Item = u32>) -> bool {
        heads.any(|head| self.0.get(head as usize).is_some_and(|inside| inside.load(Ordering::Relaxed)))
    }
}

impl Traffic {
    /// Lets a vehicle wait before a crossing into which it may not drive.
    pub(super) fn hold(&self, coming: &Coming, routes: &Routes, signals: &Signals, types: &VehicleTypes) {
        let is_met = self.inside.is_any(signals.others(coming.head));
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

    /// Whether those who stand beyond the crossing leave room for it and all between.
    fn has_room(&self, coming: &Coming, routes: &Routes, types: &VehicleTypes) -> bool {
        let row = &self.rows[coming.row as usize];
        let kind = types.get(row.kind);
        let Some(mut way) = Way::new(routes, row.number, kind, &row.on) else { return true };
        let takes = |kind: &VehicleType| kind.front() + kind.rear() + kind.driver.gap;
        let end = coming.end;
        let mut needed = takes(kind);
        for _ in 0..=ROUTES_AHEAD {
            let entries = self.lane(routes.lane(way.route, way.lane));
            let first = entries.partition_point(|entry| way.distance + entry.front <= kind.front());
            for entry in entries[first..].iter().filter(|entry| entry.row != coming.row) {
                let is_routed = self.rows[entry.row as usize].is_routed;
                // One whose rear is still in the lane before, or that changes lanes, counts where its front is.
                if entry.role != Role::Main && is_routed {
                    continue;
                }
                let other = types.get(entry.kind);
                if way.distance + entry.front < kind.front() + coming.distance {
                    // It comes to the line before, and is looked at itself.
                    return true;
                }
                let (front, back) = (way.distance + entry.front, way.distance + entry.back);
                if back > end + BEYOND {
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
            if way.to_end() > end + BEYOND {
                return true;
            }
            way.advance();
        }
        true
    }
}
