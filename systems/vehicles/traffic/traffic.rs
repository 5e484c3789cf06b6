//! Order of vehicles in lanes: which one is ahead of which.
//!
//! In every step all vehicles are noted as `Row`s in the order of their tables, and lanes are filled with entries
//! (`lanes.rs`). A vehicle has an entry wherever others have to mind it, and where it has to mind others:
//!
//! - in its lane, and while it changes, in the lane that it leaves;
//! - behind its rear, in the lanes that it came from, as long as it is not wholly out of them;
//! - beside it, in the lanes of other ways that begin where its own does, until they have parted;
//! - ahead, in the lanes that it will choose: before their beginnings, at negative metres. So vehicles see across the
//!   ends of routes, and where several lanes lead into one, they follow each other in the order in which they will be
//!   there. What will stand before a stop on the way has no entries beyond it;
//! - of a vehicle that no route drives, in all lanes that it stands in.
//!
//! Every entry minds the next one in its lane. What comes to a crossing then minds its line, if it may not enter
//! (`crossings.rs`).

use super::crossings::{Coming, Inside};
use super::following::{self, ROUTES_AHEAD, Way};
use super::lanes::{Entry, Found, Lanes, Role, Stretches};
use crate::ecs::parallel::in_parallel;
use crate::vehicles::components::{OnRoute, RouteId, VehicleTypeId};
use crate::vehicles::forks::Parting;
use crate::vehicles::routes::Routes;
use crate::vehicles::signals::Signals;
use crate::vehicles::types::{VehicleType, VehicleTypes};
use bevy_ecs::prelude::*;
use glam::Vec3;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// Data of a vehicle that others have to know.
#[derive(Clone, Copy, Default)]
pub(crate) struct Row {
    pub number: u32,
    pub kind: VehicleTypeId,
    /// Set if a route drives it; else `on` means nothing.
    pub is_routed: bool,
    pub speed: f32,
    pub position: Vec3,
    pub yaw: f32,
    /// It is elsewhere than when the last step began.
    pub put: bool,
    pub on: OnRoute,
}

/// Vehicles by lane, and what each minds most. Follows from the rest of the world in every step; kept for its memory.
#[derive(Resource, Default)]
pub struct Traffic {
    pub(crate) entities: Vec<Entity>,
    pub(crate) rows: Vec<Row>,
    /// Rows that no route drives.
    strays: Vec<u32>,
    pub(crate) lanes: Lanes,
    /// Bits of the largest interaction, by row; positive floats are ordered as their bits.
    interactions: Vec<AtomicU32>,
    /// Set for each row that has no room beyond the crossing that it comes to.
    pub(crate) blocked: Vec<AtomicBool>,
    found: Vec<Found>,
    pub(crate) inside: Inside,
    pub(crate) changes: Vec<super::lane_changes::Start>,
    /// Vehicles that were put back because their numbers made no sense: their entities, once each.
    pub faults: Vec<Entity>,
    /// External vehicles of which nothing has come for [`STALE`](crate::vehicles::external::STALE) seconds.
    pub stale: Vec<Entity>,
}

/// Vehicles to enter per task, where nothing is known of their order.
const ROWS: usize = 1024;

impl Traffic {
    /// The largest interaction of a row.
    pub(crate) fn interaction(&self, row: usize) -> f32 {
        f32::from_bits(self.interactions[row].load(Ordering::Relaxed))
    }

    pub(crate) fn press(&self, row: u32, interaction: f32) {
        press(&self.interactions, row, interaction);
    }

    /// The entries of a lane, first the hindmost.
    pub(crate) fn lane(&self, lane: u32) -> &[Entry] {
        self.lanes.get(lane)
    }

    /// After rows were noted: fills the lanes and works out what each of them minds. `is_new`: rows are others than
    /// last time.
    pub(crate) fn observe(&mut self, is_new: bool, routes: &Routes, signals: &Signals, types: &VehicleTypes) {
        self.interactions.resize_with(self.rows.len(), AtomicU32::default);
        self.interactions.iter_mut().for_each(|interaction| *interaction.get_mut() = 0);
        self.blocked.resize_with(self.rows.len(), AtomicBool::default);
        self.blocked.iter_mut().for_each(|blocked| *blocked.get_mut() = false);
        if is_new {
            let (routed, strays) = (0..self.rows.len() as u32).partition(|&row| self.rows[row as usize].is_routed);
            let routed: Vec<u32> = routed;
            self.lanes.order = routed.chunks(ROWS).map(<[_]>::to_vec).collect();
            self.strays = strays;
        }
        let stretches = Stretches::new(routes.lanes(), self.rows.len());
        let count = self.enter(stretches, routes, signals, types);
        let interactions = &self.interactions;
        self.lanes.fill(&self.found[..count], (stretches, routes.lanes()), |entry, ahead| {
            if let Some(leader) = ahead.iter().find(|other| other.row != entry.row) {
                press(interactions, entry.row, minding(entry, leader, types));
            }
        });
        let this = &*self;
        in_parallel(this.found[..count].iter(), |found| {
            found.coming.iter().for_each(|coming| this.hold(coming, routes, signals, types));
        });
    }

    /// Lists the entries of all vehicles; returns how many of the lists count.
    fn enter(&mut self, stretches: Stretches, routes: &Routes, signals: &Signals, types: &VehicleTypes) -> usize {
        let Self { rows, strays, lanes, interactions, found, inside, .. } = self;
        inside.reset(signals.heads().len());
        let parts = lanes.order.iter().map(|part| &part[..]).chain(strays.chunks(ROWS));
        let parts: Vec<&[u32]> = parts.filter(|part| !part.is_empty()).collect();
        let count = parts.len();
        if found.len() < count {
            found.resize_with(count, Found::default);
        }
        in_parallel(parts.into_iter().zip(found), |(part, found)| {
            let inside = &*inside;
            found.reset(stretches);
            let mut near = Vec::new();
            for &index in part {
                let row = &rows[index as usize];
                let kind = types.get(row.kind);
                if row.is_routed {
                    press(interactions, index, enter_routed(index, row, kind, (routes, signals, inside), found));
                } else {
                    enter_stray(index, row, kind, routes, &mut near, found);
                }
            }
        });
        count
    }
}

fn press(interactions: &[AtomicU32], row: u32, interaction: f32) {
    if interaction > 0.0 {
        interactions[row as usize].fetch_max(interaction.to_bits(), Ordering::Relaxed);
    }
}

/// The interaction with a leader. Toward one on another road, before both come to where the roads meet, one brakes
/// comfortably, until shortly before.
fn minding(entry: &Entry, leader: &Entry, types: &VehicleTypes) -> f32 {
    let driver = &types.get(entry.kind).driver;
    let interaction = following::interaction(driver, entry.speed, leader.speed, entry.gap(leader));
    let is_merging = leader.road != entry.road && leader.front < 0.0 && -entry.front > 5.0 + entry.speed;
    if is_merging { interaction.min(1.0 + driver.braking / driver.acceleration) } else { interaction }
}

fn enter_routed(
    index: u32,
    row: &Row,
    kind: &VehicleType,
    (routes, signals, inside): (&Routes, &Signals, &Inside),
    found: &mut Found,
) -> f32 {
    let (on, driver) = (&row.on, &kind.driver);
    let Some(mut way) = Way::new(routes, row.number, kind, on) else { return 0.0 };
    let (route, front, rear) = (way.route, kind.front(), kind.rear());
    inside.note(row, routes, route, (front, rear));
    let scale = (1.0 - route.curvature(on.at) * routes.offset(route, on.lane)).clamp(0.2, 5.0);
    let entry = |at: f64, role: Role, scale: f32| Entry {
        front: (at + f64::from(front / scale)) as f32,
        back: (at - f64::from(rear / scale)) as f32,
        scale,
        speed: row.speed,
        row: index,
        number: row.number,
        kind: row.kind,
        road: on.route,
        role,
    };
    found.push(routes.lane(route, on.lane), entry(on.at, Role::Main, scale));
    if let Some(change) = on.change
        && change.from_lane != on.lane
    {
        found.push(routes.lane(route, change.from_lane), entry(on.at, Role::Follower, scale));
    }
    let mut behind = on.at - f64::from(rear / scale);
    let mut before = 0.0;
    for (id, lane) in on.previous.into_iter().flatten() {
        let Some(previous) = routes.get(id).filter(|_| behind < 0.0) else { break };
        before += previous.length;
        found.push(routes.lane(previous, lane), entry(on.at + before, Role::Obstacle, 1.0));
        behind += previous.length;
    }
    let back = (on.at - f64::from(rear)) as f32;
    if back < route.parted
        && let Some(from) = on.previous[0]
    {
        let is_near = |parting: &&Parting| parting.from == from && back < parting.metres;
        for parting in route.partings.iter().filter(is_near) {
            found.push(parting.lane, entry(on.at, Role::Obstacle, 1.0));
        }
    }
    let far = following::look_ahead(driver, row.speed) + front;
    let mut has_waited = on.waited.is_infinite();
    for _ in 0..ROUTES_AHEAD {
        for (stop, distance) in way.stops(front) {
            if distance > far {
                break;
            }
            if following::is_closed(&stop, distance, row.speed, kind.limits.braking, has_waited, signals) {
                return following::interaction(driver, row.speed, 0.0, distance);
            }
            found.coming.extend(Coming::new(index, kind, row.speed, &way, &stop, distance));
            has_waited &= !matches!(stop.wait, crate::vehicles::routes::Wait::Dwell(_));
        }
        if way.to_end() > f64::from(far) {
            break;
        }
        if way.route.is_dead_end {
            return following::interaction(driver, row.speed, 0.0, (way.to_end() - f64::from(front)) as f32);
        }
        way.advance();
        if way.distance < f64::from(front) {
            let ends = (-way.distance - f64::from(rear), f64::from(front) - way.distance);
            inside.note_on(way.id, way.route, ends, f64::INFINITY);
        }
        found.push(routes.lane(way.route, way.lane), entry(-way.distance, Role::Follower, 1.0));
    }
    0.0
}

/// Metres that a vehicle which no route drives must leave beside it for others to pass, of half a lane's width.
const SQUEEZE: f32 = 0.8;

/// Enters a vehicle into all lanes that it stands in.
fn enter_stray(
    index: u32,
    row: &Row,
    kind: &VehicleType,
    routes: &Routes,
    near: &mut Vec<(RouteId, u32, f64)>,
    found: &mut Found,
) {
    let (front, rear) = (kind.front(), kind.rear());
    let forward = crate::vehicles::steering::forward(row.yaw);
    let middle = (row.position + crate::vehicles::steering::flat(forward) * (0.5 * (front - rear))).as_dvec3();
    let (half_length, half_width) = (0.5 * (front + rear), 0.5 * kind.size.x);
    routes.cells().near(routes, middle, near);
    for &(id, sample, _) in near.iter() {
        let Some(route) = routes.get(id) else { continue };
        let place = route.place(route.metres_of(sample as usize));
        let (along, across) = place.off(middle);
        let (along, across) = (along as f32, across as f32);
        let (cos, sin) = (forward.dot(place.tangent), forward.dot(place.left()));
        let reach = cos.abs() * half_length + sin.abs() * half_width;
        let breadth = sin.abs() * half_length + cos.abs() * half_width;
        let at = route.metres_of(sample as usize) as f32 + along;
        for lane in 0..route.lanes() {
            let beside = (across - routes.offset(route, lane)).abs();
            if beside < breadth + SQUEEZE * 0.5 * route.lane_width()
                && along.abs() < reach + 0.6 * route.metres_of(1) as f32
            {
                let entry = Entry {
                    front: at + reach,
                    back: at - reach,
                    scale: 1.0,
                    speed: row.speed * cos,
                    row: index,
                    number: row.number,
                    kind: row.kind,
                    road: id,
                    role: Role::Obstacle,
                };
                found.push(routes.lane(route, lane), entry);
            }
        }
    }
}
