//! Who goes first where lanes cross.
//!
//! Before the line of a block of conflicts ([`super::crossings`]) a vehicle waits as before a stop while one of another
//! lane is between that lane's line and the end of the conflict, or will be there first. First is who can hardly stop any
//! more; then who gets to the line earlier, setting off at once, or has stood there for longer; then the lower number. All
//! go by what entries and rows say, which is the same for both, and by one order for all conflicts of a block, so that of
//! those who wait one always may go. Nobody goes who would have to stand in the crossing, behind one that stands beyond it.

use super::OnRoute;
use super::crossings::{Block, CrossedLane};
use super::following::{self, ROUTES_AHEAD, Way};
use super::lanes::{Entry, Role};
use super::routes::Routes;
use super::traffic::Traffic;
use super::types::{VehicleType, VehicleTypes};
use crate::parallel::in_parallel;

/// m/s: who is slower may be about to stand.
const SLOW: f32 = 2.0;
/// Metres, and of the distance that comfortable braking takes: so far before a line one looks.
const LOOK: (f32, f32) = (5.0, 1.3);
/// m/s² that everybody is taken to set off with: of two in a row the one ahead comes first.
const SETTING_OFF: f32 = 1.5;
/// Metres beyond the gap that a driver keeps: who stands nearer to a line is the first there.
const FIRST: f32 = 0.8;
/// Metres: longer vehicles are looked for no farther.
const LONGEST: f32 = 40.0;
/// Lanes that are worth a task.
const LEAST_LANES: usize = 64;

/// Who comes first: the least.
#[derive(Clone, Copy)]
struct Rank {
    can_stop: bool,
    seconds: f32,
    number: u32,
}

impl Rank {
    fn is_before(&self, other: &Self) -> bool {
        let by_time = self.seconds.total_cmp(&other.seconds);
        self.can_stop.cmp(&other.can_stop).then(by_time).then(self.number.cmp(&other.number)).is_lt()
    }
}

impl Traffic {
    /// Lets those who have to wait before crossings mind the lines there.
    pub(super) fn give_way(&self, routes: &Routes, types: &VehicleTypes) {
        let lanes = routes.crossings();
        let part = lanes.len().div_ceil(4).max(LEAST_LANES);
        in_parallel(lanes.chunks(part), |lanes| lanes.iter().for_each(|lane| self.wait_in(lane, routes, types)));
    }

    fn wait_in(&self, crossed: &CrossedLane, routes: &Routes, types: &VehicleTypes) {
        let entries = self.lane(crossed.lane);
        if entries.is_empty() {
            return;
        }
        for block in &crossed.blocks {
            let before = entries.partition_point(|entry| entry.front <= block.line);
            for (index, entry) in entries[..before].iter().enumerate().rev() {
                let kind = types.get(entry.kind);
                let (distance, square) = (block.line - entry.front, entry.speed * entry.speed);
                let is_near = distance < LOOK.0 + LOOK.1 * square / (2.0 * kind.driver.braking);
                if entry.role != Role::Obstacle
                    && is_near
                    && square <= 2.0 * kind.limits.braking * distance
                    && !(self.is_first(entry, block, routes, types)
                        && self.has_room(crossed.lane, index, block.end, routes, types))
                {
                    self.press(entry.row, following::interaction(&kind.driver, entry.speed, 0.0, distance));
                }
            }
        }
    }

    /// Whether nobody else is in a block, or comes first, of those in the way of one before its line.
    fn is_first(&self, entry: &Entry, block: &Block, routes: &Routes, types: &VehicleTypes) -> bool {
        let own = self.rank(entry, block.line, types);
        block.conflicts.iter().all(|conflict| {
            let others = self.lane(conflict.other);
            let (line, end) = conflict.other_block;
            let before = others.partition_point(|other| other.front <= line);
            // Obstacles go nowhere: they matter where they are.
            let is_in = |other: &Entry| {
                other.row != entry.row
                    && other.back < conflict.other_to
                    && (other.role != Role::Obstacle || other.front > conflict.other_from)
            };
            let near = others[before..].iter().take_while(|other| other.front < conflict.other_to + LONGEST);
            if near.into_iter().any(is_in) {
                return false;
            }
            let coming = |(_, other): &(usize, &Entry)| other.role != Role::Obstacle && other.row != entry.row;
            let Some((index, other)) = others[..before].iter().enumerate().rev().find(coming) else { return true };
            !self.rank(other, line, types).is_before(&own) || !self.has_room(conflict.other, index, end, routes, types)
        })
    }

    /// Whether nobody stands so near beyond a block that a vehicle before it would have to stand in it.
    fn has_room(&self, lane: u32, index: usize, end: f32, routes: &Routes, types: &VehicleTypes) -> bool {
        let entries = self.lane(lane);
        let entry = &entries[index];
        let needed = end + entry.front - entry.back + types.get(entry.kind).driver.gap;
        let is_free = |ahead: &[Entry], needed: f32| {
            let leader = ahead.iter().find(|other| other.row != entry.row && other.front > 0.0);
            leader.is_none_or(|leader| leader.speed > SLOW || leader.back > needed)
        };
        if !is_free(&entries[index + 1..], needed) {
            return false;
        }
        let row = &self.rows[entry.row as usize];
        let Some(mut way) = Way::new(routes, row.number, &row.on) else { return true };
        let mut ahead = 0;
        while !way.route.has_lane(lane) {
            ahead += 1;
            if ahead > ROUTES_AHEAD {
                return true;
            }
            way.advance();
        }
        let beyond = needed - way.route.length;
        way.advance();
        beyond <= 0.0 || is_free(self.lane(routes.lane(way.route, way.lane)), beyond)
    }

    fn rank(&self, entry: &Entry, line: f32, types: &VehicleTypes) -> Rank {
        let kind = types.get(entry.kind);
        let (distance, speed) = ((line - entry.front).max(0.0), entry.speed.max(0.0));
        let hard = 0.5 * (kind.driver.braking + kind.limits.braking);
        let reached = speed + (speed * speed + 2.0 * SETTING_OFF * distance).sqrt();
        let waited = self.rows[entry.row as usize].on.waited;
        Rank {
            can_stop: speed * speed <= 2.0 * hard * distance,
            seconds: 2.0 * distance / reached.max(1e-3) - if waited.is_finite() { waited } else { 0.0 },
            number: entry.number,
        }
    }
}

/// Whether one that stands waits before a crossing, as the first there.
pub(super) fn stands_before(routes: &Routes, number: u32, on: &OnRoute, kind: &VehicleType) -> bool {
    let (front, reach) = (kind.front(), kind.driver.gap + FIRST);
    let Some(mut way) = Way::new(routes, number, on) else { return false };
    for _ in 0..ROUTES_AHEAD {
        let lane = routes.lane(way.route, way.lane);
        if let Ok(index) = routes.crossings().binary_search_by_key(&lane, |crossed| crossed.lane) {
            let mut lines = routes.crossings()[index].blocks.iter().map(|block| way.distance + block.line - front);
            if lines.any(|distance| (0.0..reach).contains(&distance)) {
                return true;
            }
        }
        if way.to_end() > reach + front {
            return false;
        }
        way.advance();
    }
    false
}
