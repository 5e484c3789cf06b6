//! When to change lanes: MOBIL, simplified.
//!
//! Kesting, Treiber, Helbing, "General lane-changing model MOBIL for car-following models", Transportation Research
//! Record 1999 (2007). A driver changes if it is safe, none in the other lane would have to brake harder than b_safe,
//! and if it pays: what they gain in acceleration, plus a part p of what their followers gain or lose, is more than a
//! threshold, lower toward the edge of the road than away from it. Of the model's accelerations the terms without a
//! leader are the same in both lanes and cancel; where they do not, in b_safe, they count as at the wanted speed.

use super::following;
use super::lanes::{Entry, Role};
use super::traffic::Traffic;
use crate::ecs::changes::rows_per_task;
use crate::ecs::parallel::in_parallel;
use crate::vehicles::routes::{Route, Routes};
use crate::vehicles::types::VehicleTypes;

/// b_safe, m/s².
pub const SAFE_BRAKING: f32 = 4.0;
/// p: how much others count.
pub const POLITENESS: f32 = 0.2;
/// Δa_th, m/s²: what has to be gained.
pub const THRESHOLD: f32 = 0.1;
/// a_bias, m/s²: how much less toward the edge, and more away from it.
pub const EDGE_BIAS: f32 = 0.3;

/// Seconds between two considerations of a driver.
const PERIOD: f32 = 0.5;
/// m/s, below which none changes.
const SLOWEST: f32 = 3.0;
/// Metres before and behind the ends of a route in which none changes.
const NEAR_ENDS: f32 = 40.0;

/// A change of lane that begins in this step.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Start {
    pub row: u32,
    pub lane: u8,
}

/// Routes of several lanes that are worth a task.
const LEAST: usize = 16;

/// All changes that begin in a step, by row. Drivers consider in turn, lane by lane from the hindmost on; one that
/// comes later sees the gaps of those before taken.
pub(crate) fn starts(
    traffic: &Traffic,
    routes: &Routes,
    types: &VehicleTypes,
    (step, step_seconds): (u64, f64),
    begun: &mut Vec<Start>,
) {
    let period = ((f64::from(PERIOD) / step_seconds) as u64).clamp(1, 1 << 31) as u32;
    let turn = (step % u64::from(period)) as u32;
    let wide = routes.wide();
    let part = rows_per_task(wide.len(), LEAST);
    let mut found: Vec<Vec<Start>> = wide.chunks(part).map(|_| Vec::new()).collect();
    in_parallel(wide.chunks(part).zip(&mut found), |(wide, found)| {
        for route in wide.iter().filter_map(|&id| routes.get(id)) {
            starts_on(route, traffic, routes, types, (turn, period), found);
        }
    });
    begun.clear();
    begun.extend(found.into_iter().flatten());
    begun.sort_unstable_by_key(|start| start.row);
}

/// Those of one route. In each step, one in `period` considers.
fn starts_on(
    route: &Route,
    traffic: &Traffic,
    routes: &Routes,
    types: &VehicleTypes,
    (turn, period): (u32, u32),
    begun: &mut Vec<Start>,
) {
    let mut taken: Vec<(u32, Entry)> = Vec::new();
    let length = route.length as f32;
    for lane in 0..route.lanes() {
        let entries = traffic.lane(routes.lane(route, lane));
        for (index, entry) in entries.iter().enumerate() {
            if entry.role != Role::Main
                || !(entry.number % period + turn).is_multiple_of(period)
                || entry.speed < SLOWEST
                || entry.back < NEAR_ENDS.min(0.3 * length)
                || length - entry.front < NEAR_ENDS
                || traffic.rows[entry.row as usize].on.change.is_some()
            {
                continue;
            }
            let consider = |other: u8| {
                let toward_edge = other < lane;
                let target = routes.lane(route, other);
                let is_taken = |t: &&(u32, Entry)| t.0 == target && overlaps(&t.1, entry);
                let gain = gain(traffic.lane(target), entries, index, types)?;
                let wanted = THRESHOLD + if toward_edge { -EDGE_BIAS } else { EDGE_BIAS };
                (gain > wanted && taken.iter().find(is_taken).is_none()).then_some((other, gain - wanted))
            };
            let up = (lane + 1 < route.lanes()).then(|| consider(lane + 1)).flatten();
            let down = lane.checked_sub(1).and_then(consider);
            let best = match (up, down) {
                (Some(up), Some(down)) => Some(if up.1 > down.1 { up } else { down }),
                (up, down) => up.or(down),
            };
            if let Some((other, _)) = best {
                taken.push((routes.lane(route, other), *entry));
                begun.push(Start { row: entry.row, lane: other });
            }
        }
    }
}

/// Tells if two would be in one gap: nearer than the faster one drives in 2 s.
fn overlaps(a: &Entry, b: &Entry) -> bool {
    let room = 5.0 + 2.0 * a.speed.max(b.speed);
    a.front + room > b.back && b.front + room > a.back
}

/// The interaction of one with another ahead; none without.
fn minds(entry: Option<&Entry>, leader: Option<&Entry>, types: &VehicleTypes) -> f32 {
    let Some((entry, leader)) = entry.zip(leader) else { return 0.0 };
    if entry.role == Role::Obstacle {
        return 0.0;
    }
    // Beyond some point it does not matter how much too near one is.
    following::interaction(&types.get(entry.kind).driver, entry.speed, leader.speed, entry.gap(leader)).min(25.0)
}

/// m/s² that a change of the entry at `index` of its lane into a lane with the entries `target` gains; `None` if it is
/// not safe.
fn gain(target: &[Entry], own: &[Entry], index: usize, types: &VehicleTypes) -> Option<f32> {
    let entry = &own[index];
    let others = |list: &[Entry]| list.iter().all(|other| other.row != entry.row);
    let place = target.partition_point(|other| other.front < entry.front);
    let (behind, ahead) = (place.checked_sub(1).map(|i| &target[i]), target.get(place));
    if !others(behind.map_or(&[], std::slice::from_ref)) || !others(ahead.map_or(&[], std::slice::from_ref)) {
        return None;
    }
    let driver = &types.get(entry.kind).driver;
    let is_free = ahead.is_none_or(|ahead| entry.gap(ahead) > 0.5 * driver.gap)
        && behind.is_none_or(|behind| behind.gap(entry) > 0.5 * types.get(behind.kind).driver.gap);
    let new_own = minds(Some(entry), ahead, types);
    let new_behind = minds(behind, Some(entry), types);
    let rate = |entry: Option<&Entry>| entry.map_or(0.0, |entry| types.get(entry.kind).driver.acceleration);
    if !is_free || new_behind * rate(behind) > SAFE_BRAKING || new_own * driver.acceleration > SAFE_BRAKING {
        return None;
    }
    let leader = own[index + 1..].iter().find(|other| other.row != entry.row);
    let follower = own[..index].iter().rev().find(|other| other.row != entry.row);
    let gained = driver.acceleration * (minds(Some(entry), leader, types) - new_own);
    let behind_gains = rate(behind) * (minds(behind, ahead, types) - new_behind);
    let follower_gains = rate(follower) * (minds(follower, Some(entry), types) - minds(follower, leader, types));
    Some(gained + POLITENESS * (behind_gains + follower_gains))
}
