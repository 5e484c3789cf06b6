//! Routes: where vehicles drive by themselves.
//!
//! A [`RoutePlan`] says what a route is: a centre line, lanes, speed limits, stops, and the routes that may follow. All
//! plans together become [`Routes`], whose centre lines are sampled at even steps of arc length
//! ([`super::route_line`]), so that where `at` metres along a route is, which way it goes there and how fast one may be
//! is looked up at once.
//!
//! A vehicle's `at` is that of its reference point, the rear axle. Lanes lie side by side around the centre line; lane
//! 0 is the one at the edge of the road: the rightmost, or the leftmost where traffic keeps left. All lanes of a route
//! go the same way.

use super::components::{OnRoute, RouteId};
use super::forks::{self, Next, Parting};
use super::route_line;
use super::turns::{about_y, left_of};
use crate::space::transform::Transform;
use bevy_ecs::prelude::*;
use glam::{DVec3, Vec2, Vec3Swizzles};

/// Plan of a route; all lengths along the centre line, from its beginning.
#[derive(Clone, PartialEq, Debug)]
pub struct RoutePlan {
    /// Name in scenes.
    pub name: String,
    /// World space, metres; of a closed route the first is not repeated at the end. At least two that differ.
    pub points: Vec<DVec3>,
    /// A centripetal Catmull-Rom spline through the points instead of straight lines between them.
    pub spline: bool,
    /// The end is the beginning.
    pub closed: bool,
    /// At least one.
    pub lanes: u8,
    /// Metres.
    pub lane_width: f32,
    /// m/s.
    pub speed_limit: f32,
    /// From `.0` metres on, `.1` m/s; ascending.
    pub limits: Vec<(f32, f32)>,
    /// Stops of vehicles.
    pub stops: Vec<Stop>,
    /// Routes that may follow at the end; a vehicle chooses evenly among those that are open to it ([`Routes::next`]).
    /// None: the same route again, from its beginning. One that begins more than [`forks::APART`] from the end is not
    /// taken, unless it is the route itself.
    pub then: Vec<RouteId>,
    /// The lanes of the route before from which vehicles choose this one; none: from all.
    pub from_lanes: Vec<u8>,
    /// Metres: longer vehicles, trailers included, choose another.
    pub longest: f32,
}

impl Default for RoutePlan {
    /// 100 m along +Z, at 50 km/h.
    fn default() -> Self {
        Self {
            name: String::new(),
            points: vec![DVec3::ZERO, DVec3::Z * 100.0],
            spline: false,
            closed: false,
            lanes: 1,
            lane_width: 3.2,
            speed_limit: 50.0 / 3.6,
            limits: Vec::new(),
            stops: Vec::new(),
            then: Vec::new(),
            from_lanes: Vec::new(),
            longest: f32::INFINITY,
        }
    }
}

/// A line across a route at which vehicles wait, with their front before it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Stop {
    /// Metres from the route's beginning.
    pub at: f32,
    /// Reason for which vehicles wait.
    pub wait: Wait,
    /// Length of a signal's crossing beyond the line, metres, in which none should stand. It ends with the route after
    /// this one at the latest. A vehicle waits before the line if it would have to stand in it. So does one that would
    /// meet another there that came by another group of the signal.
    pub clear: f32,
}

/// Reason for which vehicles wait at a [`Stop`].
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Wait {
    /// Until it is green: an index of [`super::signals::Signals::heads`].
    Signal(u32),
    /// So many seconds, as at a bus stop.
    Dwell(f32),
}

/// A route, ready to be driven on. What every vehicle reads in every step lies together.
#[derive(Clone, PartialEq, Debug)]
pub struct Route {
    /// Length of its centre line, metres.
    pub length: f64,
    /// Heading at its end against that at its beginning, radians, left positive.
    pub turn: f32,
    /// Samples per metre.
    density: f64,
    /// The number of its lane 0 among the lanes of all routes.
    first_lane: u32,
    lane_width: f32,
    /// The height of all of it, if it is level.
    level: Option<f64>,
    lanes: u8,
    /// The end is the beginning.
    pub closed: bool,
    /// Set if it is one of several ways that a vehicle may take: turning is indicated there only.
    pub is_one_of_several: bool,
    /// Routes that may follow: those of the plan that begin where it ends.
    pub then: Box<[Next]>,
    /// Set if none of the plan's `then` begins where it ends: vehicles stop there.
    pub is_dead_end: bool,
    /// Metres from its beginning to the first line before a crossing; infinite without.
    pub(super) first_line: f32,
    /// Metres from its beginning to where the crossings end that begin in the route before it.
    pub(super) crossed: f32,
    /// Other ways that begin where it does, and how far from its beginning the last of them has parted from it.
    pub(super) partings: Box<[Parting]>,
    pub(super) parted: f32,
    /// Stops of vehicles, ascending.
    pub stops: Box<[Stop]>,
    /// Evenly spaced from beginning to end.
    samples: Box<[Place]>,
    /// Plan that it was made from.
    pub plan: Box<RoutePlan>,
}

/// Place on the centre line.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Place {
    /// World space.
    pub position: DVec3,
    /// The way it goes, as (x, z) of a unit vector.
    pub tangent: Vec2,
    /// Radians per metre, left positive.
    pub curvature: f32,
    /// Speed limit there, with lower ones ahead that one has to brake for, m/s.
    pub limit: f32,
    /// Square of the speed that bends here and ahead allow, per m/s² of sideways acceleration.
    pub bend: f32,
}

impl Place {
    /// The unit vector to the left of the way it goes, (x, z).
    pub fn left(&self) -> Vec2 {
        left_of(self.tangent)
    }

    /// The point so far to the left of the centre line.
    pub fn beside(&self, left: f32) -> DVec3 {
        let aside = (self.left() * left).as_dvec2();
        self.position + DVec3::new(aside.x, 0.0, aside.y)
    }

    /// Offset of a point from this place: along the way the line goes, and to the left of it.
    pub(super) fn off(&self, point: DVec3) -> (f64, f64) {
        let off = (point - self.position).xz();
        (off.dot(self.tangent.as_dvec2()), off.dot(self.left().as_dvec2()))
    }
}

impl Route {
    /// The place `at` metres from its beginning. Beyond its ends the line goes on straight, or round if it is closed.
    #[inline]
    pub fn place(&self, at: f64) -> Place {
        let at = self.inside(at);
        let scaled = at * self.density;
        let last = self.samples.len().saturating_sub(2);
        let index = (scaled.max(0.0) as usize).min(last);
        let (Some(a), Some(b)) = (self.samples.get(index), self.samples.get(index + 1)) else {
            return Place { position: DVec3::ZERO, tangent: Vec2::Y, curvature: 0.0, limit: 0.0, bend: 0.0 };
        };
        let t = scaled - index as f64;
        let inside = t.clamp(0.0, 1.0) as f32;
        let tangent = a.tangent.lerp(b.tangent, inside);
        Place {
            position: a.position + (b.position - a.position) * t,
            tangent: tangent / tangent.length().max(1e-6),
            curvature: a.curvature + (b.curvature - a.curvature) * inside,
            limit: a.limit.min(b.limit),
            bend: a.bend + (b.bend - a.bend) * inside,
        }
    }

    /// The same place of a closed route, within it.
    fn inside(&self, at: f64) -> f64 {
        match at {
            _ if !self.closed || (0.0..self.length).contains(&at) => at,
            _ if (0.0..2.0 * self.length).contains(&at) => at - self.length,
            _ => at.rem_euclid(self.length),
        }
    }

    /// The height of the centre line, as [`Route::place`] has it.
    pub fn height(&self, at: f64) -> f64 {
        self.level.unwrap_or_else(|| self.place(at).position.y)
    }

    /// Curvature of the centre line near `at`, radians per metre, left positive.
    pub(super) fn curvature(&self, at: f64) -> f32 {
        let index = ((at * self.density).max(0.0) as usize).min(self.samples.len() - 1);
        self.samples[index].curvature
    }

    /// The number of its lanes, at least 1.
    pub fn lanes(&self) -> u8 {
        self.lanes
    }

    /// Metres from the middle of a lane to that of the next.
    pub fn lane_width(&self) -> f32 {
        self.lane_width
    }

    /// The nearest place to a point, among the samples that are as high up to 5 m: metres from the beginning.
    pub fn nearest(&self, point: DVec3) -> f64 {
        let distance = |sample: &Place| {
            let off = sample.position - point;
            off.x * off.x + off.z * off.z + (off.y.abs() - 5.0).max(0.0) * 1e3
        };
        let samples = self.samples.iter().enumerate();
        let nearest = samples.min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)));
        nearest.map_or(0.0, |(index, _)| self.metres_of(index))
    }

    /// The first stop whose line is beyond `at`.
    pub fn stop_after(&self, at: f64) -> u16 {
        self.stops.partition_point(|stop| f64::from(stop.at) <= at) as u16
    }

    pub(super) fn samples(&self) -> &[Place] {
        &self.samples
    }

    pub(super) fn metres_of(&self, sample: usize) -> f64 {
        sample as f64 / self.density
    }
}

/// All routes, by id.
#[derive(Resource, Clone, PartialEq, Debug, Default)]
pub struct Routes {
    routes: Vec<Route>,
    /// Traffic keeps left: lane 0 is the leftmost.
    pub left_hand: bool,
    /// Seed of the choices of vehicles at forks.
    pub seed: u64,
    lanes: u32,
    /// Those of several lanes.
    wide: Vec<RouteId>,
    cells: route_line::Cells,
}

impl Routes {
    /// Routes from plans, whose ids are their places in the list. Plans are taken as they are: names of `then` that are
    /// not in the list count as the route itself, a route without two points that differ is a metre long.
    pub fn new(plans: Vec<RoutePlan>, left_hand: bool, seed: u64) -> Self {
        let count = plans.len().min(usize::from(u16::MAX));
        let mut lanes = 0;
        let mut routes: Vec<Route> = Vec::with_capacity(count);
        for mut plan in plans.into_iter().take(count) {
            plan.then.retain(|next| usize::from(next.0) < count);
            plan.stops.sort_by(|a, b| a.at.total_cmp(&b.at));
            let (samples, length) = route_line::sample(&plan);
            let first = samples[0].position.y;
            routes.push(Route {
                length,
                turn: route_line::turn(&samples),
                density: (samples.len() - 1) as f64 / length,
                first_lane: lanes,
                lane_width: plan.lane_width,
                level: samples.iter().all(|sample| sample.position.y == first).then_some(first),
                lanes: plan.lanes.max(1),
                closed: plan.closed,
                is_one_of_several: false,
                then: Box::default(),
                is_dead_end: false,
                first_line: f32::INFINITY,
                crossed: 0.0,
                partings: Box::default(),
                parted: 0.0,
                stops: plan.stops.as_slice().into(),
                samples: samples.into(),
                plan: Box::new(plan),
            });
            lanes += u32::from(routes[routes.len() - 1].lanes);
        }
        let ids = (0..).map(RouteId).zip(&routes);
        let wide = ids.filter(|(_, route)| route.lanes > 1).map(|(id, _)| id).collect();
        let mut all = Self { routes, left_hand, seed, lanes, wide, cells: route_line::Cells::default() };
        all.note_forks();
        all.note_crossings();
        all.look_ahead();
        all.cells = route_line::Cells::new(&all.routes);
        all
    }

    /// A route; that of the id 0 for an id of other routes. `None` where there are none at all.
    pub fn get(&self, id: RouteId) -> Option<&Route> {
        self.routes.get(usize::from(id.0)).or(self.routes.first())
    }

    /// All, in the order of their ids.
    pub fn iter(&self) -> impl Iterator<Item = (RouteId, &Route)> {
        self.routes.iter().enumerate().map(|(index, route)| (RouteId(index as u16), route))
    }

    /// The route of that name.
    pub fn find(&self, name: &str) -> Option<RouteId> {
        self.routes.iter().position(|route| route.plan.name == name).map(|index| RouteId(index as u16))
    }

    /// Tells if there are none.
    pub fn is_empty(&self) -> bool {
        self.routes.is_empty()
    }

    /// Lanes of all routes together.
    pub fn lanes(&self) -> u32 {
        self.lanes
    }

    /// The number of a lane among the lanes of all routes.
    pub fn lane(&self, route: &Route, lane: u8) -> u32 {
        route.first_lane + u32::from(lane.min(route.lanes() - 1))
    }

    /// Metres from the centre line to the middle of a lane, left positive.
    pub fn offset(&self, route: &Route, lane: u8) -> f32 {
        let from_edge = f32::from(lane.min(route.lanes() - 1)) - (f32::from(route.lanes()) - 1.0) * 0.5;
        from_edge * route.lane_width * if self.left_hand { -1.0 } else { 1.0 }
    }

    /// Transform of a vehicle that is `at` metres along a lane.
    pub fn stand(&self, on: &OnRoute) -> Transform {
        let (place, yaw) = self.stand_at(on);
        Transform::from_translation(place.as_vec3()).with_rotation(about_y(yaw as f32))
    }

    /// Transform of [`Routes::stand`] in 64 bits: the place, and the yaw.
    pub fn stand_at(&self, on: &OnRoute) -> (DVec3, f64) {
        let Some(route) = self.get(on.route) else { return (DVec3::ZERO, 0.0) };
        let place = route.place(on.at);
        let tangent = place.tangent.as_dvec2();
        (place.beside(self.offset(route, on.lane)), tangent.x.atan2(tangent.y))
    }

    /// Tells if a vehicle that goes on from the end of a route on the same route is put to its beginning. The route has
    /// no `then`, or is among it, and does not lead back by itself.
    pub fn begins_anew(&self, route: &Route) -> bool {
        route.then.is_empty() || route.place(route.length).position.distance(route.place(0.0).position) > forks::APART
    }

    /// Routes of several lanes.
    pub(super) fn wide(&self) -> &[RouteId] {
        &self.wide
    }

    pub(super) fn cells(&self) -> &route_line::Cells {
        &self.cells
    }

    fn note_forks(&mut self) {
        for index in 0..self.routes.len() {
            let (own, route) = (RouteId(index as u16), &self.routes[index]);
            let all = route.plan.then.iter().map(|&id| Next::new(id, &self.routes[usize::from(id.0)].plan));
            let meets = |next: &Next| next.id == own || forks::gap(self, route, next).metres <= forks::APART;
            let then: Box<[Next]> = all.filter(meets).collect();
            let is_dead_end = then.is_empty() && !route.plan.then.is_empty();
            if let [_, _, ..] = &then[..] {
                then.iter().for_each(|way| self.routes[usize::from(way.id.0)].is_one_of_several = true);
            }
            (self.routes[index].then, self.routes[index].is_dead_end) = (then, is_dead_end);
        }
        for (route, partings) in forks::partings(self).into_iter().enumerate() {
            let route = &mut self.routes[route];
            route.parted = partings.iter().map(|parting| parting.metres).fold(0.0, f32::max);
            route.partings = partings.into();
        }
    }

    /// The routes that begin where one ends.
    fn followers(&self, index: usize) -> Vec<usize> {
        let route = &self.routes[index];
        let own = route.closed.then_some(index);
        own.into_iter().chain(route.then.iter().map(|next| usize::from(next.id.0))).collect()
    }

    /// Notes how far crossings that begin at a stop reach into the next route.
    fn note_crossings(&mut self) {
        for index in 0..self.routes.len() {
            let route = &mut self.routes[index];
            let lines = route.stops.iter().filter(|stop| stop.clear > 0.0).map(|stop| stop.at);
            route.first_line = lines.fold(f32::INFINITY, f32::min);
            let over = |stop: &Stop| (f64::from(stop.at + stop.clear) - route.length) as f32;
            let over = route.stops.iter().map(over).fold(0.0, f32::max);
            for next in self.followers(index) {
                let next = &mut self.routes[next];
                next.crossed = next.crossed.max(over.min(next.length as f32));
            }
        }
    }

    /// Lets limits and bends of what follows count at the end of what comes before. Every pass carries them over one
    /// more route; what is farther away than that is too far to brake for.
    fn look_ahead(&mut self) {
        let followers: Vec<Vec<usize>> = (0..self.routes.len()).map(|index| self.followers(index)).collect();
        for _ in 0..6 {
            let starts: Vec<(f32, f32)> = self
                .routes
                .iter()
                .map(|r| r.samples.first().map_or((f32::MAX, f32::MAX), |s| (s.limit, s.bend)))
                .collect();
            for (index, route) in self.routes.iter_mut().enumerate() {
                let after = followers[index].iter().filter_map(|&next| starts.get(next));
                let after = after.fold((f32::MAX, f32::MAX), |least, s| (least.0.min(s.0), least.1.min(s.1)));
                let step = 1.0 / route.density as f32;
                route_line::brake_ahead(&mut route.samples, step, after);
            }
        }
    }
}

/// SplitMix64's finalizer (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014).
pub(crate) fn mixed(bits: u64) -> u64 {
    let mut z = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
