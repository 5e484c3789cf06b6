//! Who is ahead of whom.
//!
//! In every step all vehicles are noted as `Row`s in the order of their tables, and lanes are filled with `Entry`s,
//! sorted by where their fronts are. A vehicle has an entry wherever others have to mind it, and where it has to mind
//! others:
//!
//! - in its lane, and while it changes, in the lane that it leaves;
//! - behind its rear, in the lanes that it came from, as long as it is not wholly out of them;
//! - ahead, in the lanes that it will choose: before their beginnings, at negative metres. So vehicles see across the ends
//!   of routes, and where several lanes lead into one, they follow each other in the order in which they will be there.
//!   Who will stand before a stop on the way has no entries beyond it;
//! - of a vehicle that no route drives, in all lanes that it stands in.
//!
//! Every entry minds the next one in its lane. Lanes are refilled in the order of the last step, so that they are nearly
//! sorted: insertion sort does the rest.

use super::following::{self, ROUTES_AHEAD, Way};
use super::routes::{Route, RouteId, Routes};
use super::signals::Signals;
use super::{OnRoute, VehicleType, VehicleTypeId, VehicleTypes};
use crate::changes::in_parallel;
use bevy_ecs::prelude::*;
use bevy_tasks::ComputeTaskPool;
use glam::{Vec2, Vec3};
use std::sync::atomic::{AtomicU32, Ordering};

/// What of a vehicle others have to know.
#[derive(Clone, Copy, Default)]
pub(super) struct Row {
    pub number: u32,
    pub kind: VehicleTypeId,
    /// Whether a route drives it; else `on` means nothing.
    pub is_routed: bool,
    pub speed: f32,
    pub position: Vec3,
    pub yaw: f32,
    /// It is elsewhere than when the last step began.
    pub put: bool,
    pub on: OnRoute,
}

/// A vehicle in a lane; metres along the route.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Entry {
    pub front: f32,
    pub back: f32,
    /// Metres that it drives per metre of the centre line: less than 1 inside of a bend.
    pub scale: f32,
    pub speed: f32,
    pub row: u32,
    pub number: u32,
    pub kind: VehicleTypeId,
    /// The route that it is on now.
    pub road: RouteId,
    pub role: Role,
    /// It has to come through a crossing yet that others come through to the same lane: who goes first is decided there.
    pub is_guarded: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) enum Role {
    /// In its lane.
    #[default]
    Main,
    /// Minds who is ahead: in a lane that it leaves, or will come to.
    Follower,
    /// Is only minded.
    Obstacle,
}

impl Entry {
    fn is_before(&self, other: &Self) -> bool {
        self.front.total_cmp(&other.front).then(self.number.cmp(&other.number)).then(self.back.total_cmp(&other.back))
            == std::cmp::Ordering::Less
    }

    /// Metres from its front to another's back.
    pub fn gap(&self, leader: &Self) -> f32 {
        (leader.back - self.front) * self.scale
    }
}

/// Vehicles by lane, and what each minds most. Follows from the rest of the world in every step; kept for its memory.
#[derive(Resource, Default)]
pub struct Traffic {
    pub(super) entities: Vec<Entity>,
    pub(super) rows: Vec<Row>,
    /// Rows of routed vehicles, as their entries were sorted last.
    order: Vec<u32>,
    /// Sorted within each lane.
    pub(super) entries: Vec<Entry>,
    /// Where the entries of each lane begin, and the end.
    pub(super) starts: Vec<u32>,
    /// Of each row, bits of the largest interaction; positive floats are ordered as their bits.
    interactions: Vec<AtomicU32>,
    parts: Vec<Vec<(u32, Entry)>>,
    pub(super) changes: Vec<super::lane_changes::Start>,
    /// Vehicles that were put back because their numbers made no sense: their entities, once each.
    pub faults: Vec<Entity>,
}

impl Traffic {
    /// The largest interaction of a row.
    pub(super) fn interaction(&self, row: usize) -> f32 {
        f32::from_bits(self.interactions[row].load(Ordering::Relaxed))
    }

    pub(super) fn press(&self, row: u32, interaction: f32) {
        self.interactions[row as usize].fetch_max(interaction.max(0.0).to_bits(), Ordering::Relaxed);
    }

    /// The entries of a lane, first the hindmost.
    pub(super) fn lane(&self, lane: u32) -> &[Entry] {
        let range = self.starts.get(lane as usize).zip(self.starts.get(lane as usize + 1));
        range.map_or(&[], |(&from, &to)| &self.entries[from as usize..to as usize])
    }

    /// After rows were noted: fills the lanes and works out what everyone minds. `is_new`: rows are others than last time.
    pub(super) fn observe(&mut self, is_new: bool, routes: &Routes, signals: &Signals, types: &VehicleTypes) {
        self.interactions.resize_with(self.rows.len(), AtomicU32::default);
        self.interactions.iter_mut().for_each(|interaction| *interaction.get_mut() = 0);
        if is_new {
            self.order.clear();
            self.order.extend(0..self.rows.len() as u32);
        }
        let parts = self.enter(routes, signals, types);
        self.fill(&parts, routes.lanes());
        self.sort();
        self.parts = parts;
        self.order.clear();
        self.order.extend(self.entries.iter().filter(|entry| entry.role == Role::Main).map(|entry| entry.row));
        let strays = (0u32..).zip(&self.rows).filter(|(_, row)| !row.is_routed);
        self.order.extend(strays.map(|(index, _)| index));
        self.mind(types);
        self.give_way(routes, types);
    }

    /// All entries with their lanes, in parts.
    fn enter(&mut self, routes: &Routes, signals: &Signals, types: &VehicleTypes) -> Vec<Vec<(u32, Entry)>> {
        let mut parts = std::mem::take(&mut self.parts);
        let chunk = self.order.len().div_ceil(2 * ComputeTaskPool::get().thread_num()).max(512);
        parts.resize_with(self.order.len().div_ceil(chunk), Vec::new);
        let this = &*self;
        in_parallel(self.order.chunks(chunk).zip(&mut parts), |(order, found)| {
            found.clear();
            let mut near = Vec::new();
            for &index in order {
                let row = &this.rows[index as usize];
                let kind = types.get(row.kind);
                if row.is_routed {
                    let interaction = enter_routed(index, row, kind, routes, signals, found);
                    this.press(index, interaction);
                } else {
                    enter_stray(index, row, kind, routes, &mut near, found);
                }
            }
        });
        parts
    }

    fn fill(&mut self, parts: &[Vec<(u32, Entry)>], lanes: u32) {
        self.starts.clear();
        self.starts.resize(lanes as usize + 1, 0);
        let all = || parts.iter().flatten();
        all().for_each(|(lane, _)| self.starts[*lane as usize] += 1);
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        self.entries.clear();
        self.entries.resize(sum as usize, Entry::default());
        // From behind, which leaves `starts` where they should be.
        for (lane, entry) in parts.iter().rev().flat_map(|part| part.iter().rev()) {
            let start = &mut self.starts[*lane as usize];
            *start -= 1;
            self.entries[*start as usize] = *entry;
        }
    }

    fn sort(&mut self) {
        let mut rest = &mut self.entries[..];
        let starts = &self.starts;
        let mut parts = Vec::new();
        for lanes in in_parts(starts.len() - 1) {
            let count = (starts[lanes.end] - starts[lanes.start]) as usize;
            let (entries, others) = rest.split_at_mut(count);
            rest = others;
            parts.push((lanes, entries));
        }
        in_parallel(parts.into_iter(), |(lanes, entries)| {
            let before = starts[lanes.start];
            for bounds in starts[lanes.start..=lanes.end].windows(2) {
                sort_lane(&mut entries[(bounds[0] - before) as usize..(bounds[1] - before) as usize]);
            }
        });
    }

    /// Lets every entry mind the next.
    fn mind(&mut self, types: &VehicleTypes) {
        let this = &*self;
        in_parallel(in_parts(self.starts.len() - 1), |lanes| {
            for entries in lanes.map(|lane| this.lane(lane as u32)) {
                for (index, entry) in entries.iter().enumerate() {
                    if entry.role != Role::Obstacle
                        && let Some(leader) = entries[index + 1..].iter().find(|other| is_minded(entry, other))
                    {
                        this.press(entry.row, minding(entry, leader, types));
                    }
                }
            }
        });
    }
}

/// Numbers up to a count in parts for tasks.
fn in_parts(count: usize) -> impl ExactSizeIterator<Item = std::ops::Range<usize>> {
    let part = count.div_ceil(4 * ComputeTaskPool::get().thread_num()).max(16);
    (0..count.div_ceil(part)).map(move |i| i * part..count.min((i + 1) * part))
}

/// Whether one in the same lane is minded: it is there, or will come there in the order in which both get there.
fn is_minded(entry: &Entry, ahead: &Entry) -> bool {
    ahead.row != entry.row && !(ahead.is_guarded && ahead.front < 0.0)
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
    routes: &Routes,
    signals: &Signals,
    found: &mut Vec<(u32, Entry)>,
) -> f32 {
    let (on, driver) = (&row.on, &kind.driver);
    let Some(mut way) = Way::new(routes, row.number, on) else { return 0.0 };
    let (route, front, rear) = (way.route, kind.front(), kind.rear());
    let scale = (1.0 - route.curvature(on.at) * routes.offset(route, on.lane)).clamp(0.2, 5.0);
    let entry = |at: f32, role: Role, scale: f32| Entry {
        front: at + front / scale,
        back: at - rear / scale,
        scale,
        speed: row.speed,
        row: index,
        number: row.number,
        kind: row.kind,
        road: on.route,
        role,
        is_guarded: false,
    };
    found.push((routes.lane(route, on.lane), entry(on.at, Role::Main, scale)));
    for lane in sweeps(kind, routes, route, on.lane, on.at).into_iter().flatten() {
        found.push((routes.lane(route, lane), entry(on.at, Role::Follower, scale)));
    }
    if let Some(change) = on.change
        && change.from_lane != on.lane
    {
        found.push((routes.lane(route, change.from_lane), entry(on.at, Role::Follower, scale)));
    }
    let mut behind = on.at - rear / scale;
    let (mut before, mut last) = (0.0, route);
    for (id, lane) in on.previous.into_iter().flatten() {
        let Some(previous) = routes.get(id).filter(|_| behind < last.parting) else { break };
        before += previous.length;
        found.push((routes.lane(previous, lane), entry(on.at + before, Role::Obstacle, 1.0)));
        behind += previous.length;
        last = previous;
    }
    let far = following::look_ahead(driver, row.speed) + front;
    let mut has_waited = on.waited.is_infinite();
    let mut is_guarded = false;
    for _ in 0..ROUTES_AHEAD {
        for (stop, distance) in way.stops(front) {
            if distance > far {
                break;
            }
            if following::is_closed(&stop, distance, row.speed, kind.limits.braking, has_waited, signals) {
                return following::interaction(driver, row.speed, 0.0, distance);
            }
            has_waited &= !matches!(stop.wait, super::routes::Wait::Dwell(_));
        }
        if way.to_end() > far {
            break;
        }
        is_guarded |= way.route.is_guarded;
        way.advance();
        let coming = Entry { is_guarded, ..entry(-way.distance, Role::Follower, 1.0) };
        found.push((routes.lane(way.route, way.lane), coming));
        for lane in sweeps(kind, routes, way.route, way.lane, -way.distance).into_iter().flatten() {
            found.push((routes.lane(way.route, lane), coming));
        }
    }
    0.0
}

/// Metres that half of another vehicle beside takes, with some room; of sweeping that is none; before and behind a bend.
const BESIDE: (f32, f32, f32, f32) = (1.4, 0.1, 30.0, 5.0);

/// The lanes to either side that a vehicle needs, too: in a bend of curvature κ the front corner of one that reaches f
/// ahead of its rear axle is f²·κ/2 farther outside, and the end of a trailer of length l is l²·κ/2 farther inside.
fn sweeps(kind: &VehicleType, routes: &Routes, route: &Route, lane: u8, at: f32) -> [Option<u8>; 2] {
    if route.lanes() < 2 {
        return [None; 2];
    }
    let outside = 0.5 * kind.front() * kind.front();
    let inside = kind.trailer.map_or(0.0, |trailer| 0.5 * trailer.length * trailer.length);
    let room = (route.lane_width() - 0.5 * kind.size.x - BESIDE.0).max(BESIDE.1);
    if outside.max(inside) * route.sharpest < room {
        return [None; 2];
    }
    let (right, left) = route.curvatures(at - BESIDE.3, at + BESIDE.2);
    let to_left = (-right * outside).max(left * inside) > room;
    let to_right = (left * outside).max(-right * inside) > room;
    let (down, up) = if routes.left_hand { (to_left, to_right) } else { (to_right, to_left) };
    [lane.checked_sub(1).filter(|_| down), Some(lane + 1).filter(|&lane| up && lane < route.lanes())]
}

/// Metres that a vehicle which no route drives must leave beside it for others to pass, of half a lane's width.
const SQUEEZE: f32 = 0.8;

/// Enters a vehicle into all lanes that it stands in.
fn enter_stray(
    index: u32,
    row: &Row,
    kind: &VehicleType,
    routes: &Routes,
    near: &mut Vec<(RouteId, u32, f32)>,
    found: &mut Vec<(u32, Entry)>,
) {
    let (front, rear) = (kind.front(), kind.rear());
    let forward = super::steering::forward(row.yaw);
    let middle = row.position + super::steering::flat(forward) * (0.5 * (front - rear));
    let (half_length, half_width) = (0.5 * (front + rear), 0.5 * kind.size.x);
    routes.cells().near(routes, middle, near);
    for &(id, sample, _) in near.iter() {
        let Some(route) = routes.get(id) else { continue };
        let place = route.place(route.metres_of(sample as usize));
        let off = middle - place.position;
        let off = Vec2::new(off.x, off.z);
        let (along, across) = (off.dot(place.tangent), off.dot(place.left()));
        let (cos, sin) = (forward.dot(place.tangent), forward.dot(place.left()));
        let reach = cos.abs() * half_length + sin.abs() * half_width;
        let breadth = sin.abs() * half_length + cos.abs() * half_width;
        let at = route.metres_of(sample as usize) + along;
        for lane in 0..route.lanes() {
            let beside = (across - routes.offset(route, lane)).abs();
            if beside < breadth + SQUEEZE * 0.5 * route.lane_width() && along.abs() < reach + 0.6 * route.metres_of(1) {
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
                    is_guarded: false,
                };
                found.push((routes.lane(route, lane), entry));
            }
        }
    }
}

/// Sorts a lane that is nearly sorted; one that is not takes no longer than others.
fn sort_lane(entries: &mut [Entry]) {
    let mut moves = 8 * entries.len();
    for i in 1..entries.len() {
        let mut at = i;
        while at > 0 && entries[i].is_before(&entries[at - 1]) {
            at -= 1;
        }
        if at < i {
            entries[at..=i].rotate_right(1);
            if moves < i - at {
                entries.sort_unstable_by(|a, b| {
                    if a.is_before(b) { std::cmp::Ordering::Less } else { std::cmp::Ordering::Greater }
                });
                return;
            }
            moves -= i - at;
        }
    }
}
