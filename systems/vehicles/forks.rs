//! Forks, where several routes may follow one: the choice of a vehicle, and how far the routes are in each other's way.
//!
//! A route may be for some lanes of the one before it only, as a lane for turning, and for vehicles up to a length.
//! Among those that are open to it a vehicle chooses by a function of the seed, its number and how often it chose
//! before: it knows beforehand, looks ahead and indicates. Where two ways begin in one lane, a vehicle that has just
//! turned into one is still in the way of those that take the other.

use super::components::{OnRoute, RouteId};
use super::routes::{Route, RoutePlan, Routes, mixed};
use glam::DVec3;

/// A route that may follow another.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Next {
    /// The following route.
    pub id: RouteId,
    /// A bit for each lane of the route before from which it may be chosen; the last one is for all further lanes.
    lanes: u16,
    /// Metres: longer vehicles choose others.
    longest: f32,
}

impl Next {
    /// The route with that plan.
    pub fn new(id: RouteId, plan: &RoutePlan) -> Self {
        let lanes = plan.from_lanes.iter().fold(0, |bits, &lane| bits | 1 << lane.min(LAST_LANE));
        Self { id, lanes: if lanes == 0 { u16::MAX } else { lanes }, longest: plan.longest }
    }

    fn is_for(&self, lane: u8) -> bool {
        self.lanes >> lane.min(LAST_LANE) & 1 != 0
    }
}

/// The lane of the highest bit of [`Next`].
const LAST_LANE: u8 = u16::BITS as u8 - 1;

/// End of a route where a vehicle has to choose.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Fork {
    /// The route at whose end it is.
    pub route: RouteId,
    /// Its lane there.
    pub lane: u8,
    /// Number of choices before.
    pub choices: u32,
}

impl From<&OnRoute> for Fork {
    fn from(on: &OnRoute) -> Self {
        Self { route: on.route, lane: on.lane, choices: on.choices }
    }
}

/// A vehicle that chooses.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Chooser {
    /// Value of its [`super::VehicleNumber`].
    pub number: u32,
    /// Metres, from the front to the end of a trailer.
    pub length: f32,
}

impl Routes {
    /// The route that a vehicle takes at a fork. Where none is open to it, one that is at least long enough for it;
    /// where none is, any.
    pub fn next(&self, fork: Fork, chooser: Chooser) -> RouteId {
        let then = match self.get(fork.route).map_or(&[][..], |route| &route.then) {
            [] => return fork.route,
            [only] => return only.id,
            several => several,
        };
        let bits = mixed(self.seed ^ mixed(u64::from(chooser.number) << 32 | u64::from(fork.choices)));
        let fits = |next: &Next| next.longest >= chooser.length;
        let one_of = |is_open: &dyn Fn(&Next) -> bool| {
            let count = then.iter().filter(|next| is_open(next)).count();
            let pick = (((bits >> 32) * count as u64) >> 32) as usize;
            then.iter().filter(|next| is_open(next)).nth(pick)
        };
        let open = one_of(&|next| next.is_for(fork.lane) && fits(next));
        open.or_else(|| one_of(&fits)).or_else(|| one_of(&|_| true)).map_or(fork.route, |next| next.id)
    }
}

/// Metres from the end of a lane within which the next one begins; what is farther from its lane is lost
/// (`on_route.rs`). Nothing is put across a wider gap.
pub const APART: f64 = 12.0;

/// Distance between the nearest lanes of a route and of one that may follow it, and its ends.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Gap {
    /// Between the end of the one and the beginning of the other.
    pub metres: f64,
    /// End of the lane, world space.
    pub end: DVec3,
    /// Beginning of the next one, world space.
    pub beginning: DVec3,
}

/// The gap between a route and one that follows it, among the lanes that lead there.
pub fn gap(routes: &Routes, route: &Route, next: &Next) -> Gap {
    let Some(following) = routes.get(next.id) else {
        return Gap { metres: 0.0, end: DVec3::ZERO, beginning: DVec3::ZERO };
    };
    let (last, first) = (route.place(route.length), following.place(0.0));
    let of_lane = |lane: u8| {
        let end = last.beside(routes.offset(route, lane));
        let beginning = first.beside(routes.offset(following, lane));
        Gap { metres: end.distance(beginning), end, beginning }
    };
    let open = (0..route.lanes()).filter(|&lane| next.is_for(lane)).map(of_lane);
    open.min_by(|a, b| a.metres.total_cmp(&b.metres)).unwrap_or_else(|| of_lane(0))
}

/// Another way out of the same lane, in whose way a vehicle is for some metres.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Parting {
    /// The route and the lane that both begin in.
    pub from: (RouteId, u8),
    /// The other way's lane, among those of all routes.
    pub lane: u32,
    /// From the beginning of both.
    pub metres: f32,
}

/// Part of half the sum of both lanes' widths: middles that are nearer are in each other's way.
const NEAR: f32 = 0.9;
/// Metres: ways part no later; steps in which the place is looked for.
const LATEST: (f64, f64) = (40.0, 1.0);

/// The partings of all routes, by id.
pub(super) fn partings(routes: &Routes) -> Vec<Vec<Parting>> {
    let mut all = vec![Vec::new(); routes.iter().count()];
    for (id, route) in routes.iter().filter(|(_, route)| route.then.len() > 1) {
        for lane in 0..route.lanes() {
            let ways: Vec<(RouteId, &Route)> = route
                .then
                .iter()
                .filter(|next| next.is_for(lane))
                .filter_map(|n| Some((n.id, routes.get(n.id)?)))
                .collect();
            for (i, &(a, way)) in ways.iter().enumerate() {
                for &(b, other) in ways[i + 1..].iter().filter(|(b, _)| *b != a) {
                    let metres = apart(routes, (way, lane), (other, lane));
                    for (of, beside) in [(a, other), (b, way)] {
                        let parting = Parting { from: (id, lane), lane: routes.lane(beside, lane), metres };
                        all[usize::from(of.0)].push(parting);
                    }
                }
            }
        }
    }
    all
}

/// Metres from the beginning of two lanes to where both have room.
fn apart(routes: &Routes, (a, lane_a): (&Route, u8), (b, lane_b): (&Route, u8)) -> f32 {
    let reach = NEAR * 0.5 * (a.lane_width() + b.lane_width());
    let (left_a, left_b) = (routes.offset(a, lane_a), routes.offset(b, lane_b));
    let end = a.length.min(b.length).min(LATEST.0);
    let reach = f64::from(reach);
    let mut at = 0.0;
    while at < end && a.place(at).beside(left_a).distance(b.place(at).beside(left_b)) < reach {
        at += LATEST.1;
    }
    at as f32
}
