//! The step of all vehicles: note them, see who minds whom, then move each by itself.
//!
//! ```text
//! rows          where every vehicle is, in the order of the tables
//! traffic       lanes filled and sorted, and what everyone minds          super::traffic
//! lane changes  who begins to change in this step                         super::lane_changes
//! moving        speed, steering, place, height, indicators of each        here
//! ```
//!
//! Each vehicle is moved by what was noted before any moved, and decisions that touch two are made in the order of lanes
//! and vehicle numbers: neither threads nor the order of tables show in results. What did not change is not written.

use super::crossings::PATIENCE;
use super::ground::Grounds;
use super::lane_changes::{self, Start};
use super::routes::{Place, Route, RouteId, Routes};
use super::signals::Signals;
use super::steering::{self, flat};
use super::traffic::{Row, Traffic};
use super::{
    ByHand, Controls, Indicator, LaneChange, Motion, OnRoute, Stalled, Vehicle, VehicleNumber, VehicleType,
    VehicleTypes, Wanted, following, hand,
};
use crate::changes::rows_per_task;
use crate::clock::Clock;
use crate::columns::{Column, ColumnPart};
use crate::interpolation::Interpolated;
use crate::parallel::in_parallel;
use crate::transform::Transform;
use bevy_ecs::change_detection::{ContiguousMut, ContiguousRef};
use bevy_ecs::prelude::*;
use glam::{Vec2, Vec3};
use std::sync::atomic::Ordering;

/// Seconds that a lane change takes; and metres at least, beside three wheelbases: who hardly moves cannot change.
const LANE_CHANGE: (f32, f32) = (3.0, 8.0);
/// Radians: a route that turns by more is indicated; metres before it.
const INDICATED: (f32, f32) = (0.5, 40.0);
/// How often a vehicle that stands is put on the ground at most.
const SETTLED: usize = 16;
/// Metres from its lane at which a vehicle is looked for along its whole route again: somebody else moved it.
const LOST: f32 = 12.0;

type Columns<'a> = (
    Entity,
    &'a VehicleNumber,
    Ref<'a, Vehicle>,
    &'a mut Motion,
    &'a mut Controls,
    &'a mut Transform,
    Option<&'a mut OnRoute>,
    Option<&'a mut Wanted>,
    Option<&'a mut Interpolated>,
    Has<ByHand>,
    Has<Stalled>,
);

/// What all vehicles are moved by.
struct Surroundings<'a> {
    routes: &'a Routes,
    types: &'a VehicleTypes,
    grounds: &'a Grounds,
    traffic: &'a Traffic,
    starts: &'a [Start],
    seconds: f32,
    /// Vehicles that stand are put on the ground, too.
    settle: bool,
}

/// Moves all vehicles one step on.
#[allow(clippy::too_many_arguments)]
pub fn drive(
    clock: Res<Clock>,
    routes: Res<Routes>,
    signals: Res<Signals>,
    types: Res<VehicleTypes>,
    grounds: Res<Grounds>,
    mut traffic: ResMut<Traffic>,
    mut vehicles: Query<Columns>,
    mut commands: Commands,
) {
    let traffic = &mut *traffic;
    let is_new = note(&mut vehicles, traffic, routes.is_empty());
    traffic.observe(is_new, &routes, &signals, &types);
    let mut changes = std::mem::take(&mut traffic.changes);
    lane_changes::starts(traffic, &routes, &types, (clock.step, clock.step_seconds), &mut changes);
    let around = Surroundings {
        routes: &routes,
        types: &types,
        grounds: &grounds,
        traffic,
        starts: &changes,
        seconds: clock.step_seconds as f32,
        settle: grounds.is_changed(),
    };
    let broken = move_all(&mut vehicles, &around);
    traffic.changes = changes;
    for entity in broken {
        commands.entity(entity).insert(Stalled);
        traffic.faults.push(entity);
    }
}

/// Notes all vehicles as rows. Returns whether they are others than in the last step, or in another order.
fn note(vehicles: &mut Query<Columns>, traffic: &mut Traffic, without_routes: bool) -> bool {
    let (mut count, mut is_new) = (0, false);
    for (entities, numbers, kinds, motions, _, transforms, on, _, _, by_hand, _) in
        vehicles.contiguous_iter_mut().into_iter().flatten()
    {
        let end = count + entities.len();
        if traffic.entities.get(count..end) != Some(entities) {
            is_new = true;
            traffic.entities.truncate(count);
            traffic.entities.extend_from_slice(entities);
            traffic.rows.truncate(count);
        }
        traffic.rows.resize(traffic.rows.len().max(end), Row::default());
        let on = on.filter(|_| !by_hand && !without_routes);
        is_new |= traffic.rows[count..end].first().is_some_and(|row| row.is_routed != on.is_some());
        let on = on.map(|on| ContiguousMut::bypass_change_detection_split(on).0);
        let (kinds, _) = ContiguousRef::split(kinds);
        let (motions, _) = ContiguousMut::bypass_change_detection_split(motions);
        let (transforms, _) = ContiguousMut::bypass_change_detection_split(transforms);
        let chunk = rows_per_task(entities.len(), LEAST_ROWS);
        let rows = traffic.rows[count..end].chunks_mut(chunk).enumerate();
        in_parallel(rows, |(part, rows)| {
            for (i, row) in rows.iter_mut().enumerate() {
                let i = part * chunk + i;
                row.number = numbers[i].0;
                row.kind = kinds[i].kind;
                row.is_routed = on.is_some();
                row.on = on.as_ref().map_or_else(OnRoute::default, |on| on[i]);
                row.speed = if motions[i].speed.is_finite() { motions[i].speed } else { 0.0 };
                // What is not finite leaves the last that was.
                if transforms[i].translation.is_finite() && motions[i].yaw.is_finite() {
                    let place = (transforms[i].translation, motions[i].yaw);
                    row.put = (row.position, row.yaw) != place;
                    (row.position, row.yaw) = place;
                }
            }
        });
        count = end;
    }
    is_new |= traffic.entities.len() != count;
    traffic.entities.truncate(count);
    traffic.rows.truncate(count);
    is_new
}

/// Vehicles that are worth a task.
const LEAST_ROWS: usize = 256;

/// A vehicle while it is moved.
struct Body<'a> {
    row: usize,
    number: u32,
    kind: &'a VehicleType,
    motion: Motion,
    controls: Controls,
    transform: Transform,
    /// It was put elsewhere.
    jumped: bool,
}

/// Moves all; returns those whose numbers make no sense any more.
fn move_all(vehicles: &mut Query<Columns>, around: &Surroundings) -> Vec<Entity> {
    let broken = std::sync::Mutex::new(Vec::new());
    let mut count = 0;
    for (entities, numbers, kinds, motions, controls, transforms, on, wanted, drawn, by_hand, is_stalled) in
        vehicles.contiguous_iter_mut().into_iter().flatten()
    {
        let first = count;
        count += entities.len();
        if is_stalled {
            continue;
        }
        let chunk = rows_per_task(entities.len(), LEAST_ROWS);
        let (kinds, _) = ContiguousRef::split(kinds);
        let on = on.filter(|_| !by_hand && !around.routes.is_empty());
        let (mut motions, mut controls) = (Column::new(motions), Column::new(controls));
        let mut transforms = Column::new(transforms);
        let (mut on, mut wanted, mut drawn) = (on.map(Column::new), wanted.map(Column::new), drawn.map(Column::new));
        let motions = motions.parts(0, chunk);
        let controls = controls.parts(0, chunk);
        let transforms = transforms.parts(0, chunk);
        let on = maybe_parts(on.as_mut(), motions.len(), chunk);
        let wanted = maybe_parts(wanted.as_mut(), motions.len(), chunk);
        let drawn = maybe_parts(drawn.as_mut(), motions.len(), chunk);
        let parts = motions.zip(controls).zip(transforms).zip(on).zip(wanted).zip(drawn);
        in_parallel(parts, |(((((mut motions, mut controls), mut transforms), mut on), mut wanted), mut drawn)| {
            for index in motions.rows() {
                let mut body = Body {
                    row: first + index,
                    number: numbers[index].0,
                    kind: around.types.get(kinds[index].kind),
                    motion: *motions.get(index),
                    controls: *controls.get(index),
                    transform: *transforms.get(index),
                    jumped: false,
                };
                let mut route = on.as_ref().map(|on| *on.get(index));
                let mut wants = wanted.as_ref().map(|wanted| *wanted.get(index));
                around.step(&mut body, route.as_mut(), wants.as_mut());
                if !is_sound(&body, route.as_ref()) {
                    if let Ok(mut broken) = broken.lock() {
                        broken.push(entities[index]);
                    }
                    restore(&mut body, &around.traffic.rows[first + index]);
                    route = None;
                    wants = wants.map(|_| Wanted::default());
                }
                if let Some(drawn) = drawn.as_mut().filter(|_| body.jumped) {
                    let mut noted = *drawn.get(index);
                    noted.jump();
                    drawn.set(index, noted);
                }
                motions.set_if_neq(index, body.motion);
                controls.set_if_neq(index, body.controls);
                transforms.set_if_neq(index, body.transform);
                if let (Some(on), Some(route)) = (&mut on, route) {
                    on.set_if_neq(index, route);
                }
                if let (Some(wanted), Some(wants)) = (&mut wanted, wants) {
                    wanted.set_if_neq(index, wants);
                }
            }
        });
    }
    let mut broken = broken.into_inner().unwrap_or_default();
    broken.sort_unstable();
    broken
}

/// The parts of a column that a table may lack.
fn maybe_parts<'a, T>(
    column: Option<&'a mut Column<'_, T>>,
    count: usize,
    rows: usize,
) -> Vec<Option<ColumnPart<'a, T>>> {
    match column {
        Some(column) => column.parts(0, rows).map(Some).collect(),
        None => (0..count).map(|_| None).collect(),
    }
}

fn is_sound(body: &Body, on: Option<&OnRoute>) -> bool {
    let Motion { speed, acceleration, steering, yaw, hitch, rolled } = body.motion;
    let rest = speed + acceleration + steering + yaw + hitch + on.map_or(0.0, |on| on.at);
    rest.is_finite()
        && rolled.is_finite()
        && body.transform.translation.is_finite()
        && body.transform.rotation.is_finite()
}

/// Where a vehicle last was, standing.
fn restore(body: &mut Body, row: &Row) {
    let rolled = if body.motion.rolled.is_finite() { body.motion.rolled } else { 0.0 };
    body.jumped = true;
    body.motion = Motion { yaw: row.yaw, rolled, ..Motion::default() };
    let scale = if body.transform.scale.is_finite() { body.transform.scale } else { Vec3::ONE };
    body.transform =
        Transform::from_translation(row.position).with_rotation(steering::posture(row.yaw, 0.0, 0.0)).with_scale(scale);
}

impl Surroundings<'_> {
    fn step(&self, body: &mut Body, on: Option<&mut OnRoute>, wanted: Option<&mut Wanted>) {
        match on {
            Some(on) => self.follow(body, on, wanted),
            None => self.by_hand(body, wanted),
        }
    }

    /// As the one at the wheel wants.
    fn by_hand(&self, body: &mut Body, wanted: Option<&mut Wanted>) {
        let (kind, seconds) = (body.kind, self.seconds);
        let acceleration = hand::acceleration(&body.controls, &kind.limits, body.motion.speed);
        let angle = hand::steering(&body.controls, kind, body.motion.speed);
        if let Some(wanted) = wanted {
            *wanted = Wanted { acceleration, steering: angle };
            return;
        }
        let before = body.motion.speed;
        let (acceleration, speed) = hand::step(&body.controls, &kind.limits, before, acceleration, seconds);
        (body.motion.acceleration, body.motion.speed) = (acceleration, speed);
        body.motion.steering = steering::turn_wheel(&kind.limits, body.motion.steering, angle, seconds);
        if speed != 0.0 || before != 0.0 || self.settle || self.traffic.rows[body.row].put {
            let off = steering::roll(
                &mut body.motion,
                kind.wheelbase,
                kind.trailer.as_ref(),
                0.5 * (before + speed),
                seconds,
            );
            body.transform.translation += flat(off);
            // Until nothing changes, so that who stands is where it would be put again: ground counts up to a step above.
            for _ in 0..SETTLED {
                let height = body.transform.translation.y;
                self.stand(body, |_| height);
                if speed != 0.0 || body.transform.translation.y == height {
                    break;
                }
            }
        }
    }

    /// As its route wants.
    fn follow(&self, body: &mut Body, on: &mut OnRoute, wanted: Option<&mut Wanted>) {
        let Some(route) = self.routes.get(on.route) else { return };
        let (kind, seconds, speed) = (body.kind, self.seconds, body.motion.speed);
        let mut place = route.place(on.at);
        let mut across = off_line(&place, body.transform.translation);
        if (across - self.routes.offset(route, on.lane)).abs() > LOST + f32::from(route.lanes()) * route.lane_width() {
            on.at = route.nearest(body.transform.translation);
            place = route.place(on.at);
            across = off_line(&place, body.transform.translation);
        }
        if let Ok(start) = self.starts.binary_search_by_key(&(body.row as u32), |start| start.row) {
            on.change = Some(LaneChange { from: across, from_lane: on.lane, done: 0.0 });
            on.lane = self.starts[start].lane;
        }
        let allowed = self.allowed(&place, kind);
        let pressing = self.traffic.interaction(body.row);
        let acceleration = following::acceleration(&kind.driver, speed, allowed, pressing);
        let (acceleration, next_speed) = following::step(&kind.limits, speed, acceleration, seconds);
        let angle = self.aim(body, on, route);
        if let Some(wanted) = wanted {
            *wanted = Wanted { acceleration, steering: angle };
        } else {
            (body.motion.acceleration, body.motion.speed) = (acceleration, next_speed);
            if speed != 0.0 || next_speed != 0.0 {
                body.motion.steering = steering::turn_wheel(&kind.limits, body.motion.steering, angle, seconds);
                let mean = 0.5 * (speed + next_speed);
                let off = steering::roll(&mut body.motion, kind.wheelbase, kind.trailer.as_ref(), mean, seconds);
                body.transform.translation += flat(off);
            }
        }
        self.advance(body, on, route, &place);
        self.wait(body, on);
        if let Some(change) = &mut on.change {
            let rolled = body.motion.speed.abs() * seconds / (LANE_CHANGE.1 + 3.0 * kind.wheelbase);
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

    /// The steering angle toward a point ahead on the path.
    fn aim(&self, body: &Body, on: &OnRoute, route: &Route) -> f32 {
        let ahead = steering::lookahead(body.kind.wheelbase, body.motion.speed);
        let target = on.at + ahead;
        let over = target - route.length;
        let point = if over > 0.0 && !route.then.is_empty() {
            let next = self.next(body, on);
            let next = self.routes.get(next).unwrap_or(route);
            next.place(over).beside(self.path(on, next, on.lane))
        } else {
            route.place(target).beside(self.path(on, route, on.lane))
        };
        let off = point - body.transform.translation;
        steering::pursue(body.kind.wheelbase, steering::forward(body.motion.yaw), Vec2::new(off.x, off.z))
    }

    /// Metres from the centre line to where the vehicle should be, left positive.
    fn path(&self, on: &OnRoute, route: &Route, lane: u8) -> f32 {
        let offset = self.routes.offset(route, lane);
        let Some(change) = on.change else { return offset };
        // Where it will be when it gets to the point that it aims at: smoothstep over the change.
        let t = change.done.clamp(0.0, 1.0);
        change.from + (offset - change.from) * t * t * (3.0 - 2.0 * t)
    }

    /// Follows the vehicle along its route, and on to the next one at the end.
    fn advance(&self, body: &mut Body, on: &mut OnRoute, route: &Route, place: &Place) {
        let off = body.transform.translation - place.position;
        let (along, across) = (Vec2::new(off.x, off.z).dot(place.tangent), off_line(place, body.transform.translation));
        let front = |on: &OnRoute| on.at + body.kind.front();
        let before = front(on);
        on.at += along / (1.0 - place.curvature * across).clamp(0.2, 5.0);
        if on.waited != 0.0 && route.stop_after(front(on)) != route.stop_after(before) {
            on.waited = 0.0;
        }
        if on.at < route.length {
            return self.stand(body, |wheelbase| route.height(on.at + wheelbase));
        }
        let next = self.next(body, on);
        let Some(following) = self.routes.get(next) else { return };
        let jumps = route.then.is_empty() && !route.closed;
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
            let there = self.routes.stand(on);
            body.transform.translation = there.translation;
            let forward = there.rotation * Vec3::Z;
            (body.motion.yaw, body.motion.hitch, body.motion.steering) = (forward.x.atan2(forward.z), 0.0, 0.0);
        } else if !route.closed {
            let across = off_line(&following.place(on.at), body.transform.translation);
            let change = on.change.filter(|_| route.lanes() == following.lanes());
            on.change = match change {
                None if (across - self.routes.offset(following, on.lane)).abs() > 0.3 => {
                    Some(LaneChange { from: across, from_lane: on.lane, done: 0.0 })
                }
                kept => kept,
            };
        }
        self.stand(body, |wheelbase| following.height(on.at + wheelbase));
    }

    /// Puts a vehicle on the ground, or to heights of its own: `height` so many metres ahead of the rear axle.
    fn stand(&self, body: &mut Body, height: impl Fn(f32) -> f32) {
        let (wheelbase, yaw) = (body.kind.wheelbase, body.motion.yaw);
        let at = body.transform.translation;
        let posture = self.grounds.posture(at, yaw, wheelbase, body.kind.track).unwrap_or_else(|| {
            let (rear, front) = (height(0.0), height(wheelbase));
            (rear, ((front - rear) / wheelbase).atan(), 0.0)
        });
        let (y, pitch, roll) = posture;
        body.transform.translation.y = y;
        body.transform.rotation = steering::posture(yaw, pitch, roll);
    }

    /// Counts the time before a stop, as long as it stands there; before a crossing that is blocked it chooses again.
    fn wait(&self, body: &Body, on: &mut OnRoute) {
        if body.motion.speed != 0.0 || on.waited.is_infinite() {
            return;
        }
        if self.traffic.blocked[body.row].load(Ordering::Relaxed) {
            on.waited += self.seconds;
            // Unless its front is in the next route already.
            let can_choose = self.routes.get(on.route).is_some_and(|r| on.at + body.kind.front() < r.length);
            if on.waited > PATIENCE && can_choose {
                on.choices = on.choices.wrapping_add(1);
                on.waited = 0.0;
            }
        } else if let Some(seconds) = following::dwell_ahead(self.routes, body.number, on, body.kind) {
            on.waited += self.seconds;
            if on.waited >= seconds {
                on.waited = f32::INFINITY;
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

/// Metres to the left of the centre line.
fn off_line(place: &Place, position: Vec3) -> f32 {
    let off = position - place.position;
    Vec2::new(off.x, off.z).dot(place.left())
}
