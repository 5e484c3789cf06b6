//! A vehicle's step along its route: how fast, where to, the next route at the end, stops, indicators.

use super::components::{Indicator, LaneChange, OnRoute, RouteId, Wanted};
use super::driving::{Body, Surroundings};
use super::forks::APART;
use super::routes::{Place, Route};
use super::steering;
use super::traffic::crossings::PATIENCE;
use super::traffic::following;
use super::types::VehicleType;
use glam::Vec3Swizzles;
use std::sync::atomic::Ordering;

/// Seconds that a lane change takes; and metres at least, beside three wheelbases: what hardly moves cannot change.
const LANE_CHANGE: (f64, f32) = (3.0, 8.0);
/// Radians: a route that turns by more is indicated; metres before it.
const INDICATED: (f32, f64) = (0.5, 40.0);
/// Metres from its lane at which a vehicle is looked for along its whole route again: something else moved it.
const LOST: f32 = APART as f32;

impl Surroundings<'_> {
    /// Moves a vehicle as its route wants, or writes the demand to `wanted`.
    pub(super) fn follow(&self, body: &mut Body, on: &mut OnRoute, wanted: Option<&mut Wanted>) {
        let Some(route) = self.routes.get(on.route) else { return };
        let (kind, seconds, speed) = (body.kind, self.seconds, body.motion.speed);
        let mut place = route.place(on.at);
        let mut across = place.off(body.motion.place).1 as f32;
        if (across - self.routes.offset(route, on.lane)).abs() > LOST + f32::from(route.lanes()) * route.lane_width() {
            on.at = route.nearest(body.motion.place);
            place = route.place(on.at);
            across = place.off(body.motion.place).1 as f32;
        }
        if let Ok(start) = self.starts.binary_search_by_key(&(body.row as u32), |start| start.row) {
            on.change = Some(LaneChange { from: across, from_lane: on.lane, done: 0.0 });
            on.lane = self.starts[start].lane;
        }
        let allowed = self.allowed(&place, kind);
        let pressing = self.traffic.interaction(body.row);
        let acceleration = following::acceleration(&kind.driver, speed as f32, allowed, pressing);
        let (acceleration, next_speed) = following::step(&kind.limits, speed, acceleration, seconds);
        let angle = self.aim(body, on, route);
        let is_moved_elsewhere = wanted.is_some();
        if let Some(wanted) = wanted {
            *wanted = Wanted { acceleration, steering: angle };
        } else {
            (body.motion.acceleration, body.motion.speed) = (acceleration, next_speed);
            if speed != 0.0 || next_speed != 0.0 {
                let steered = body.motion.steering;
                body.motion.steering = steering::turn_wheel(&kind.limits, steered, angle, seconds as f32);
                body.roll(0.5 * (speed + next_speed), seconds);
            }
        }
        self.advance(body, on, route, &place);
        // What something else moves stands as it was put by that, unless it is put to a route's beginning.
        if (!is_moved_elsewhere || body.jumped)
            && let Some(route) = self.routes.get(on.route)
        {
            self.stand(body, |wheelbase| route.height(on.at + wheelbase));
        }
        self.wait(body, on);
        if let Some(change) = &mut on.change {
            let rolled = body.motion.speed.abs() * seconds / f64::from(LANE_CHANGE.1 + 3.0 * kind.wheelbase);
            change.done += rolled.min(seconds / LANE_CHANGE.0);
            if change.done >= 1.0 {
                on.change = None;
            }
        }
        let indicator = self.indicator(body, on);
        if body.controls.indicator != indicator && body.controls.indicator != Indicator::Hazard {
            body.controls.indicator = indicator;
        }
    }

    /// m/s, by limits and bends.
    fn allowed(&self, place: &Place, kind: &VehicleType) -> f32 {
        let in_bends = (place.bend * kind.limits.lateral_acceleration).sqrt();
        (place.limit * kind.driver.speed_factor).min(in_bends).min(kind.limits.speed)
    }

    /// The route that it will take at the end of its own.
    fn next(&self, body: &Body, on: &OnRoute) -> RouteId {
        self.routes.next(on.into(), body.kind.chooser(body.number))
    }

    /// Tells if a vehicle that goes on on that route is to be put to its beginning.
    fn jumps(&self, route: &Route, on: &OnRoute, next: RouteId) -> bool {
        !route.closed && next == on.route && self.routes.begins_anew(route)
    }

    /// The steering angle toward a point ahead on the path.
    fn aim(&self, body: &Body, on: &OnRoute, route: &Route) -> f32 {
        let ahead = steering::lookahead(body.kind.wheelbase, body.motion.speed as f32);
        let target = on.at + f64::from(ahead);
        let over = target - route.length;
        let next = (over > 0.0).then(|| self.next(body, on)).filter(|&next| !self.jumps(route, on, next));
        let point = if let Some(next) = next.filter(|_| !route.then.is_empty()) {
            let next = self.routes.get(next).unwrap_or(route);
            next.place(over).beside(self.path(on, next, on.lane))
        } else {
            route.place(target).beside(self.path(on, route, on.lane))
        };
        let off = (point - body.motion.place).as_vec3();
        steering::pursue(body.kind.wheelbase, steering::forward(body.motion.yaw as f32), off.xz())
    }

    /// Metres from the centre line to where the vehicle should be, left positive.
    fn path(&self, on: &OnRoute, route: &Route, lane: u8) -> f32 {
        let offset = self.routes.offset(route, lane);
        let Some(change) = on.change else { return offset };
        // Where it will be when it gets to the point that it aims at: smoothstep over the change.
        let t = change.done.clamp(0.0, 1.0) as f32;
        change.from + (offset - change.from) * t * t * (3.0 - 2.0 * t)
    }

    /// Follows the vehicle along its route, and on to the next one at the end.
    fn advance(&self, body: &mut Body, on: &mut OnRoute, route: &Route, place: &Place) {
        let (along, across) = place.off(body.motion.place);
        let front = |on: &OnRoute| on.at + f64::from(body.kind.front());
        let before = front(on);
        on.at += along / (1.0 - f64::from(place.curvature) * across).clamp(0.2, 5.0);
        if on.waited != 0.0 && route.stop_after(front(on)) != route.stop_after(before) {
            on.waited = 0.0;
        }
        if on.at < route.length || route.is_dead_end {
            return;
        }
        let next = self.next(body, on);
        let Some(following) = self.routes.get(next) else { return };
        let jumps = self.jumps(route, on, next);
        on.previous = [Some((on.route, on.lane)), on.previous[0]];
        on.choices = on.choices.wrapping_add(1);
        (on.route, on.at) = (next, (on.at - route.length).min(following.length));
        if following.stop_after(front(on)) > 0 {
            // It has come past a stop there already.
            on.waited = 0.0;
        }
        on.lane = on.lane.min(following.lanes() - 1);
        if jumps {
            body.jumped = true;
            on.change = None;
            (body.motion.place, body.motion.yaw) = self.routes.stand_at(on);
            (body.motion.hitch, body.motion.steering) = (0.0, 0.0);
        } else if !route.closed {
            let across = following.place(on.at).off(body.motion.place).1 as f32;
            let change = on.change.filter(|_| route.lanes() == following.lanes());
            on.change = match change {
                None if (across - self.routes.offset(following, on.lane)).abs() > 0.3 => {
                    Some(LaneChange { from: across, from_lane: on.lane, done: 0.0 })
                }
                kept => kept,
            };
        }
    }

    /// Counts the time before a stop, as long as it stands there; before a crossing that is blocked it chooses again.
    fn wait(&self, body: &Body, on: &mut OnRoute) {
        if body.motion.speed != 0.0 || on.waited.is_infinite() {
            return;
        }
        if self.traffic.blocked[body.row].load(Ordering::Relaxed) {
            on.waited += self.seconds;
            // Unless its front is in the next route already.
            let can_choose = self.routes.get(on.route).is_some_and(|r| on.at + f64::from(body.kind.front()) < r.length);
            if on.waited > PATIENCE && can_choose {
                on.choices = on.choices.wrapping_add(1);
                on.waited = 0.0;
            }
        } else if let Some(seconds) = following::dwell_ahead(self.routes, body.number, on, body.kind) {
            on.waited += self.seconds;
            if on.waited >= f64::from(seconds) {
                on.waited = f64::INFINITY;
            }
        }
    }

    /// Toward the lane that it changes to, or the way that the route that it is on, or will be, turns.
    fn indicator(&self, body: &Body, on: &OnRoute) -> Indicator {
        let toward = |left: bool| if left { Indicator::Left } else { Indicator::Right };
        if let Some(change) = on.change.filter(|change| change.from_lane != on.lane) {
            return toward((on.lane > change.from_lane) != self.routes.left_hand);
        }
        let Some(route) = self.routes.get(on.route) else { return Indicator::Off };
        if route.turn.abs() > INDICATED.0 && route.is_one_of_several {
            return toward(route.turn > 0.0);
        }
        let next = if route.length - on.at < INDICATED.1 && route.then.len() > 1 {
            self.routes.get(self.next(body, on))
        } else {
            None
        };
        match next {
            Some(next) if next.turn.abs() > INDICATED.0 && next.is_one_of_several => toward(next.turn > 0.0),
            _ => Indicator::Off,
        }
    }
}
