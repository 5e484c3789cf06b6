//! The step of all vehicles: note them, see which minds which, then move each by itself.
//!
//! ```text
//! rows          where every vehicle is, in the order of the tables
//! traffic       lanes filled and sorted, and what each minds              super::traffic
//! lane changes  which begin to change in this step                        super::traffic::lane_changes
//! moving        speed, steering, place and height of each                 here, super::on_route and super::external
//! ```
//!
//! Each vehicle is moved by what was noted before any moved, and decisions that touch two are made in the order of
//! lanes and vehicle numbers: neither threads nor the order of tables show in results. What did not change is not
//! written.

use super::components::{Controls, ManualControl, Motion, OnRoute, Stalled, Vehicle, VehicleNumber, Wanted};
use super::external::External;
use super::ground::Grounds;
use super::routes::Routes;
use super::signals::Signals;
use super::traffic::lane_changes::{self, Start};
use super::traffic::traffic::{Row, Traffic};
use super::types::{VehicleType, VehicleTypes};
use super::{hand, steering};
use crate::ecs::changes::rows_per_task;
use crate::ecs::columns::{Column, ColumnPart};
use crate::ecs::parallel::in_parallel;
use crate::ecs::sub_steps::SubStep;
use crate::space::interpolation::Interpolated;
use crate::space::transform::Transform;
use bevy_ecs::change_detection::{ContiguousMut, ContiguousRef};
use bevy_ecs::prelude::*;
use glam::{DVec3, Quat, Vec3};

/// Most times that a standing vehicle is put on the ground in a step.
const SETTLED: usize = 16;

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
    Option<&'a mut External>,
    Has<ManualControl>,
    Has<Stalled>,
);

/// World around all vehicles, which they are moved by.
pub(super) struct Surroundings<'a> {
    pub routes: &'a Routes,
    pub types: &'a VehicleTypes,
    pub grounds: &'a Grounds,
    pub traffic: &'a Traffic,
    pub starts: &'a [Start],
    pub seconds: f64,
    /// Vehicles that stand are put on the ground, too.
    pub settle: bool,
}

/// Moves all vehicles one step on, or one part of a long one.
#[allow(clippy::too_many_arguments)]
pub fn drive(
    now: Res<SubStep>,
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
    lane_changes::starts(traffic, &routes, &types, (now.count, now.seconds), &mut changes);
    let around = Surroundings {
        routes: &routes,
        types: &types,
        grounds: &grounds,
        traffic,
        starts: &changes,
        seconds: now.seconds,
        settle: grounds.is_changed(),
    };
    let Told { broken, stale } = move_all(&mut vehicles, &around);
    traffic.changes = changes;
    traffic.stale.extend(stale);
    for entity in broken {
        commands.entity(entity).insert(Stalled);
        traffic.faults.push(entity);
    }
}

/// Notes all vehicles as rows. Returns whether they are others than in the last step, or in another order.
fn note(vehicles: &mut Query<Columns>, traffic: &mut Traffic, without_routes: bool) -> bool {
    let (mut count, mut is_new) = (0, false);
    for (entities, numbers, kinds, motions, _, transforms, on, _, _, external, manual, _) in
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
        let on = on.filter(|_| !manual && external.is_none() && !without_routes);
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
                row.speed = if motions[i].speed.is_finite() { motions[i].speed as f32 } else { 0.0 };
                // What is not finite leaves the last that was.
                if transforms[i].translation.is_finite() && motions[i].yaw.is_finite() {
                    let place = (transforms[i].translation, motions[i].yaw as f32);
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
pub(super) struct Body<'a> {
    pub row: usize,
    pub number: u32,
    pub kind: &'a VehicleType,
    pub motion: Motion,
    pub controls: Controls,
    pub transform: Transform,
    /// It was put elsewhere.
    pub jumped: bool,
}

impl Body<'_> {
    /// Moves it as it is steered, at a step's mean speed; what follows from the place is left to
    /// [`Surroundings::stand`].
    pub fn roll(&mut self, speed: f64, seconds: f64) {
        let (wheelbase, trailer) = (self.kind.wheelbase, self.kind.trailer.as_ref());
        let off = steering::roll(&mut self.motion, wheelbase, trailer, speed, seconds);
        self.motion.place += DVec3::new(off.x, 0.0, off.y);
    }
}

/// Vehicles that are told of after a step.
#[derive(Default)]
struct Told {
    /// Their numbers make no sense any more.
    broken: Vec<Entity>,
    /// Nothing has come from outside for a while.
    stale: Vec<Entity>,
}

/// Moves all.
fn move_all(vehicles: &mut Query<Columns>, around: &Surroundings) -> Told {
    let told = std::sync::Mutex::new(Told::default());
    let mut count = 0;
    for (entities, numbers, kinds, motions, controls, transforms, on, wanted, drawn, external, manual, is_stalled) in
        vehicles.contiguous_iter_mut().into_iter().flatten()
    {
        let first = count;
        count += entities.len();
        if is_stalled {
            continue;
        }
        let chunk = rows_per_task(entities.len(), LEAST_ROWS);
        let (kinds, _) = ContiguousRef::split(kinds);
        let on = on.filter(|_| !manual && external.is_none() && !around.routes.is_empty());
        let wanted = wanted.filter(|_| external.is_none());
        let (mut motions, mut controls) = (Column::new(motions), Column::new(controls));
        let mut transforms = Column::new(transforms);
        let (mut on, mut wanted, mut drawn) = (on.map(Column::new), wanted.map(Column::new), drawn.map(Column::new));
        let mut external = external.map(Column::new);
        let motions = motions.parts(0, chunk);
        let controls = controls.parts(0, chunk);
        let transforms = transforms.parts(0, chunk);
        let on = maybe_parts(on.as_mut(), motions.len(), chunk);
        let wanted = maybe_parts(wanted.as_mut(), motions.len(), chunk);
        let drawn = maybe_parts(drawn.as_mut(), motions.len(), chunk);
        let external = maybe_parts(external.as_mut(), motions.len(), chunk);
        let parts = motions.zip(controls).zip(transforms).zip(on).zip(wanted.into_iter().zip(drawn).zip(external));
        in_parallel(parts, |((((mut motions, mut controls), mut transforms), mut on), others)| {
            let ((mut wanted, mut drawn), mut external) = others;
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
                // What something else moves is where that has it; else it was put there.
                body.jumped = body.motion.follow(body.transform.translation) && wanted.is_none();
                let mut route = on.as_ref().map(|on| *on.get(index));
                let mut wants = wanted.as_ref().map(|wanted| *wanted.get(index));
                let mut led = external.as_ref().map(|external| *external.get(index));
                let was_stale = led.is_some_and(|led| led.is_stale());
                match &mut led {
                    Some(led) => around.be_moved(&mut body, led),
                    None => around.step(&mut body, route.as_mut(), wants.as_mut()),
                }
                if led.is_some_and(|led| led.is_stale() && !was_stale)
                    && let Ok(mut told) = told.lock()
                {
                    told.stale.push(entities[index]);
                }
                if !is_valid(&body, route.as_ref()) {
                    if let Ok(mut told) = told.lock() {
                        told.broken.push(entities[index]);
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
                if let (Some(external), Some(led)) = (&mut external, led) {
                    external.set_if_neq(index, led);
                }
            }
        });
    }
    let mut told = told.into_inner().unwrap_or_default();
    told.broken.sort_unstable();
    told.stale.sort_unstable();
    told
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

fn is_valid(body: &Body, on: Option<&OnRoute>) -> bool {
    body.motion.is_valid()
        && on.is_none_or(|on| on.at.is_finite())
        && body.transform.translation.is_finite()
        && body.transform.rotation.is_finite()
}

/// Puts a vehicle where it last was, standing.
fn restore(body: &mut Body, row: &Row) {
    let rolled = if body.motion.rolled.is_finite() { body.motion.rolled } else { 0.0 };
    body.jumped = true;
    body.motion = Motion { place: row.position.as_dvec3(), yaw: row.yaw.into(), rolled, ..Motion::default() };
    let scale = if body.transform.scale.is_finite() { body.transform.scale } else { Vec3::ONE };
    body.transform =
        Transform::from_translation(row.position).with_rotation(steering::posture(row.yaw, 0.0, 0.0)).with_scale(scale);
}

impl Surroundings<'_> {
    fn step(&self, body: &mut Body, on: Option<&mut OnRoute>, wanted: Option<&mut Wanted>) {
        match on {
            Some(on) => self.follow(body, on, wanted),
            None => self.manual(body, wanted),
        }
    }

    /// Under manual control.
    fn manual(&self, body: &mut Body, wanted: Option<&mut Wanted>) {
        let (kind, seconds, speed) = (body.kind, self.seconds, body.motion.speed as f32);
        let acceleration = hand::acceleration(&body.controls, &kind.limits, speed);
        let angle = hand::steering(&body.controls, kind, speed);
        if let Some(wanted) = wanted {
            *wanted = Wanted { acceleration, steering: angle };
            return;
        }
        let before = body.motion.speed;
        let (acceleration, speed) = hand::step(&body.controls, &kind.limits, before, acceleration, seconds);
        (body.motion.acceleration, body.motion.speed) = (acceleration, speed);
        body.motion.steering = steering::turn_wheel(&kind.limits, body.motion.steering, angle, seconds as f32);
        if speed != 0.0 || before != 0.0 || self.settle || self.traffic.rows[body.row].put {
            body.roll(0.5 * (before + speed), seconds);
            // Until nothing changes, so that what stands is where it would be put again: ground counts up to a step
            // above.
            for _ in 0..SETTLED {
                let height = body.motion.place.y;
                self.stand(body, |_| height);
                if speed != 0.0 || body.motion.place.y == height {
                    break;
                }
            }
        }
    }

    /// Puts a vehicle on the ground, or to heights of its own: `height` so many metres ahead of the rear axle.
    pub fn stand(&self, body: &mut Body, height: impl Fn(f64) -> f64) {
        let (y, rotation) = standing(self.grounds, body.kind, &body.motion, height);
        body.motion.place.y = y;
        body.transform.translation = body.motion.place.as_vec3();
        body.transform.rotation = rotation;
    }
}

/// Height and rotation of a vehicle on the ground, or else at heights of its own: `height` so many metres ahead of the
/// rear axle.
pub(crate) fn standing(
    grounds: &Grounds,
    kind: &VehicleType,
    motion: &Motion,
    height: impl Fn(f64) -> f64,
) -> (f64, Quat) {
    let (wheelbase, yaw) = (kind.wheelbase, motion.yaw as f32);
    let posture = grounds.posture(motion.place.as_vec3(), yaw, wheelbase, kind.track);
    let (y, pitch, roll) = posture.map(|(y, pitch, roll)| (f64::from(y), pitch, roll)).unwrap_or_else(|| {
        let (rear, front) = (height(0.0), height(wheelbase.into()));
        (rear, ((front - rear) as f32 / wheelbase).atan(), 0.0)
    });
    (y, steering::posture(yaw, pitch, roll))
}
