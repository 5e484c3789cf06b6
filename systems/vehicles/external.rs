//! Vehicles that something outside the simulation moves, such as another simulator or a trace.
//!
//! Poses with velocities and stamps come at a rate of their own. From each on, the vehicle goes on by dead reckoning:
//! its speed and its yaw rate change as they did between the last two stamps, until the next one is due, and stay
//! then. So constant turn rate and acceleration are met exactly. A newer pose takes over without a jump: what is shown
//! comes from where the earlier one has led, at that velocity, to the newer one's way within an interval between
//! stamps, by a cubic. A pose farther off than that could be driven is a jump.
//!
//! A source without a pose for [`STALE`] seconds is told of, and its vehicle brakes to a standstill.

use super::components::{FASTEST, ManualControl, Motion, OnRoute};
use super::driving::{Body, Surroundings};
use super::routes::Routes;
use super::steering;
use crate::space::transform::FARTHEST;
use bevy_ecs::prelude::*;
use glam::{DQuat, DVec3, Quat};
use serde::{Deserialize, Serialize};

/// Seconds after which a source counts as stale, and by which a stamp differs from the clock at most.
pub const STALE: f64 = 2.0;
/// Radians, and radians per second, at most.
const MOST_TURNED: (f64, f64) = (1e4, 100.0);
/// Seconds that a correction takes at most.
const LONGEST: f64 = 1.0;
/// Seconds between stamps, below which nothing is said of how velocities change.
const SHORTEST: f64 = 1e-3;
/// Radians by which a heading may differ beyond what it turns in an interval.
const TURNED: f64 = 0.5;
/// Metres up to which a pose is never a jump, and part of the way of an interval beyond that.
const NEAR: (f64, f64) = (1.0, 0.5);
/// m/s: slower than that, the steering stays as it is.
const STEERED: f64 = 0.1;

/// Source of a vehicle's motion.
///
/// An entity's components say which it is, and no field does: they were state before there was the third one.
/// Snapshots and recordings of that time are read and written as they were.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MotionSource {
    /// [`OnRoute`].
    Route,
    /// Its [`Controls`](super::components::Controls).
    Manual,
    /// [`External`], whatever else there is.
    External,
}

impl MotionSource {
    /// Finds out what moves a vehicle of a world.
    pub fn of(world: &World, vehicle: Entity) -> Self {
        let has_routes = world.get_resource::<Routes>().is_some_and(|routes| !routes.is_empty());
        if world.get::<External>(vehicle).is_some() {
            Self::External
        } else if has_routes && world.get::<OnRoute>(vehicle).is_some() && world.get::<ManualControl>(vehicle).is_none()
        {
            Self::Route
        } else {
            Self::Manual
        }
    }
}

/// Pose and velocity of a vehicle at a time, as they come from outside.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct StampedMotion {
    /// Seconds of the simulation's clock.
    pub stamp: f64,
    /// Place of its origin in world space, metres. On the ground the height counts only where it is put.
    pub place: DVec3,
    /// World space, about +Y, 0 along +Z, left positive.
    pub yaw: f64,
    /// Pitch, up ahead, and roll, right side down, radians; `None`: it stands on the ground.
    pub tilt: Option<[f64; 2]>,
    /// m/s in world space.
    pub velocity: DVec3,
    /// Radians per second about +Y.
    pub yaw_rate: f64,
}

impl StampedMotion {
    /// Tells if its numbers are finite and in range.
    pub fn is_valid(&self) -> bool {
        let (turned, turning) = MOST_TURNED;
        let angles = [self.yaw].into_iter().chain(self.tilt.into_iter().flatten());
        self.stamp.is_finite()
            && self.place.abs().max_element() <= 2.0 * FARTHEST
            && angles.into_iter().all(|angle| angle.abs() <= turned)
            && self.velocity.length() <= FASTEST
            && self.yaw_rate.abs() <= turning
    }

    /// Direction in which it looks.
    fn forward(&self) -> DVec3 {
        let pitch = self.tilt.map_or(0.0, |[pitch, _]| pitch);
        DQuat::from_rotation_y(self.yaw) * DVec3::new(0.0, pitch.sin(), pitch.cos())
    }

    /// Goes on along an arc, or back where `seconds` are negative. Slowing down ends at a standstill.
    fn go_on(&mut self, seconds: f64, acceleration: f64, yaw_acceleration: f64) {
        let speed = self.velocity.length();
        let next = (speed + acceleration * seconds).max(0.0);
        let turned = (self.yaw_rate + 0.5 * yaw_acceleration * seconds) * seconds;
        if speed > 0.0 || next > 0.0 {
            let half = 0.5 * turned;
            // An arc's chord is shorter than the arc.
            let chord = if half.abs() > 1e-4 { half.sin() / half } else { 1.0 - half * half / 6.0 };
            // From a standstill it goes where it looks.
            let way = if speed > 0.0 { self.velocity / speed } else { self.forward() };
            let ahead = DQuat::from_rotation_y(half) * way;
            self.place += ahead * (0.5 * (speed + next) * seconds * chord);
            self.velocity = DQuat::from_rotation_y(half) * ahead * next;
        }
        self.yaw = steering::wrapped(self.yaw + turned);
        self.yaw_rate += yaw_acceleration * seconds;
        self.stamp += seconds;
    }
}

/// Difference of what is shown to where the last pose has led.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
struct Offset {
    place: DVec3,
    yaw: f64,
    tilt: [f64; 2],
}

impl Offset {
    /// This times a factor, and a rate of change times another.
    fn blend(&self, own: f64, rate: &Self, of_rate: f64) -> Self {
        let tilt = [0, 1].map(|i| self.tilt[i] * own + rate.tilt[i] * of_rate);
        Self { place: self.place * own + rate.place * of_rate, yaw: self.yaw * own + rate.yaw * of_rate, tilt }
    }
}

/// Moved from outside, even where it has a route or is under manual control. State.
#[derive(Component, Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct External {
    /// Pose that came last.
    given: StampedMotion,
    /// Pose to which it has led until now.
    now: StampedMotion,
    /// Seconds between the last two stamps, at most [`LONGEST`].
    interval: f64,
    /// Change of the speed between them, m/s².
    acceleration: f64,
    /// Change of the yaw rate between them, rad/s².
    yaw_acceleration: f64,
    /// Difference of what was shown when the pose came, and its change per second.
    off: Offset,
    off_rate: Offset,
    /// Seconds since the pose came.
    since: f64,
}

impl External {
    /// Stamp of the pose that came last.
    pub fn stamp(&self) -> f64 {
        self.given.stamp
    }

    /// Checks the stamp of a pose that comes at a time of the clock, after one with a `last` stamp.
    ///
    /// # Errors
    /// The range that was expected.
    pub fn check_stamp(stamp: f64, last: Option<f64>, seconds: f64) -> Result<(), String> {
        let (from, to) = (seconds - STALE, seconds + STALE);
        if !(stamp > from && stamp <= to) {
            return Err(format!("stamp: expected seconds of the clock from {from:.3} to {to:.3}, found {stamp}"));
        }
        match last.filter(|last| stamp <= *last) {
            Some(last) => Err(format!("stamp: expected more than {last}, the one before, found {stamp}")),
            None => Ok(()),
        }
    }

    /// Begins where a vehicle is, as it moves by itself.
    fn of(motion: &Motion, wheelbase: f32) -> Self {
        let yaw_rate = motion.speed * f64::from(motion.steering.tan() / wheelbase);
        let stands = StampedMotion { place: motion.place, yaw: motion.yaw, yaw_rate, ..StampedMotion::default() };
        let given = StampedMotion { velocity: stands.forward() * motion.speed, stamp: f64::NEG_INFINITY, ..stands };
        Self {
            given,
            now: given,
            interval: LONGEST,
            acceleration: 0.0,
            yaw_acceleration: 0.0,
            off: Offset::default(),
            off_rate: Offset::default(),
            since: 0.0,
        }
    }

    /// Takes a pose over at a time of the clock. `before`: what the vehicle had, if it was external already; `motion`
    /// and `rotation`: how it is shown. Returns whether it jumps; `None`: the stamp is refused.
    pub(crate) fn take(
        given: &StampedMotion,
        before: Option<&Self>,
        (motion, rotation, wheelbase): (&Motion, Quat, f32),
        seconds: f64,
    ) -> Option<(Self, bool)> {
        Self::check_stamp(given.stamp, before.map(Self::stamp), seconds).ok()?;
        let mut given = *given;
        if given.tilt.is_none() {
            // The ground has the heights.
            given.velocity.y = 0.0;
        }
        let is_first = before.is_none();
        let before = before.copied().unwrap_or_else(|| Self::of(motion, wheelbase));
        let apart = given.stamp - before.given.stamp;
        let speeds = [&before.given, &given].map(|given| given.velocity.length());
        let mut taken = Self {
            given,
            now: given,
            interval: apart.clamp(SHORTEST, LONGEST),
            acceleration: if apart < SHORTEST { 0.0 } else { (speeds[1] - speeds[0]) / apart },
            yaw_acceleration: if apart < SHORTEST { 0.0 } else { (given.yaw_rate - before.given.yaw_rate) / apart },
            off: Offset::default(),
            off_rate: Offset::default(),
            since: 0.0,
        };
        let late = seconds - given.stamp;
        let due = late.clamp(-taken.interval, taken.interval);
        taken.now.go_on(due, taken.acceleration, taken.yaw_acceleration);
        taken.now.go_on(late - due, 0.0, 0.0);
        let off = taken.off_from(motion, rotation);
        // What is still being corrected is no part of what the source has done.
        let mut way = taken.now.place - before.now.place;
        if taken.now.tilt.is_none() {
            way.y = 0.0;
        }
        let driven = if is_first { 0.0 } else { NEAR.1 * speeds[0].max(speeds[1]) * taken.interval };
        let turned = TURNED + given.yaw_rate.abs() * taken.interval;
        // On the ground it is as high as that, wherever it was.
        let lands = before.given.tilt.is_some() && given.tilt.is_none();
        let is_far = way.length() > NEAR.0 + driven || off.yaw.abs() > turned || lands;
        if is_far {
            (taken.acceleration, taken.yaw_acceleration) = (0.0, 0.0);
            taken.now = given;
            taken.now.go_on(late, 0.0, 0.0);
        } else {
            let (_, rate) = before.correction();
            taken.off = off;
            taken.off_rate = Offset {
                place: before.now.velocity + rate.place - taken.now.velocity,
                yaw: before.now.yaw_rate + rate.yaw - taken.now.yaw_rate,
                tilt: [0.0; 2],
            };
        }
        taken.is_valid().then_some((taken, is_far))
    }

    /// Difference of what is shown to the pose.
    fn off_from(&self, motion: &Motion, rotation: Quat) -> Offset {
        let mut place = motion.place - self.now.place;
        let tilt = self.now.tilt.map_or([0.0; 2], |[pitch, roll]| {
            let shown = steering::tilt(rotation);
            [steering::wrapped(shown[0] - pitch), steering::wrapped(shown[1] - roll)]
        });
        if self.now.tilt.is_none() {
            place.y = 0.0;
        }
        Offset { place, yaw: steering::wrapped(motion.yaw - self.now.yaw), tilt }
    }

    /// Remainder of the difference, and its change per second: a cubic from the first to nothing.
    fn correction(&self) -> (Offset, Offset) {
        let (seconds, t) = (self.interval, self.since / self.interval);
        if t >= 1.0 {
            return (Offset::default(), Offset::default());
        }
        let (Self { off, off_rate, .. }, left) = (self, 1.0 - t);
        let shown = off.blend(left * left * (1.0 + 2.0 * t), off_rate, seconds * t * left * left);
        (shown, off.blend(-6.0 * t * left / seconds, off_rate, left * (1.0 - 3.0 * t)))
    }

    /// Place from which it goes on at the same speed, put there by something else.
    pub(crate) fn put(&mut self, place: DVec3, yaw: f64) {
        self.now.velocity = DQuat::from_rotation_y(yaw - self.now.yaw) * self.now.velocity;
        (self.now.place, self.now.yaw) = (place, yaw);
        (self.off, self.off_rate) = (Offset::default(), Offset::default());
    }

    /// Place, yaw and, where it has one, tilt to which the last pose has led.
    pub(crate) fn place(&self) -> (DVec3, f64, Option<[f64; 2]>) {
        (self.now.place, self.now.yaw, self.now.tilt)
    }

    /// Age of the pose that came last, in seconds of the clock.
    fn age(&self) -> f64 {
        self.now.stamp - self.given.stamp
    }

    /// Goes on by a step; a stale one brakes. Returns the acceleration.
    fn go_on(&mut self, seconds: f64, braking: f64) -> f64 {
        let (age, speed) = (self.age(), self.now.velocity.length());
        let (acceleration, yaw_acceleration) = if age >= STALE {
            // It stays on its circle.
            let part = (braking * seconds / speed).min(1.0) / seconds;
            (-speed * part, -self.now.yaw_rate * part)
        } else if (age + 0.5 * seconds).abs() < self.interval {
            (self.acceleration, self.yaw_acceleration)
        } else {
            (0.0, 0.0)
        };
        self.now.go_on(seconds, acceleration, yaw_acceleration);
        self.since += seconds;
        acceleration
    }

    /// Tells if no pose has come for too long.
    pub(super) fn is_stale(&self) -> bool {
        self.age() >= STALE
    }

    /// Tells if its numbers make sense.
    pub(crate) fn is_valid(&self) -> bool {
        let Self { given, now, interval, acceleration, yaw_acceleration, off, off_rate, since } = self;
        let numbers = [*interval, *acceleration, *yaw_acceleration, *since, now.stamp, now.yaw, now.yaw_rate];
        let angles = [off, off_rate].into_iter().flat_map(|off| [off.yaw, off.tilt[0], off.tilt[1]]);
        let tilt = now.tilt.into_iter().flatten();
        given.is_valid()
            && *interval > 0.0
            && numbers.into_iter().chain(angles).chain(tilt).all(f64::is_finite)
            && [now.velocity, off.place, off_rate.place].iter().all(|vector| vector.is_finite())
            && now.place.abs().max_element() <= 2.0 * FARTHEST
    }
}

impl Surroundings<'_> {
    /// Moves a vehicle as its poses from outside lead.
    pub(super) fn be_moved(&self, body: &mut Body, external: &mut External) {
        let (kind, seconds, before) = (body.kind, self.seconds, body.motion);
        if body.jumped {
            external.put(before.place, before.yaw);
        }
        let acceleration = external.go_on(seconds, kind.driver.braking.into());
        let (off, rate) = external.correction();
        let now = &external.now;
        let shown = StampedMotion {
            place: now.place + off.place,
            yaw: steering::wrapped(now.yaw + off.yaw),
            tilt: now.tilt.map(|[pitch, roll]| [pitch + off.tilt[0], roll + off.tilt[1]]),
            ..*now
        };
        let (given, forward) = (now.velocity.dot(now.forward()), shown.forward());
        let speed = (now.velocity + rate.place).dot(forward);
        let motion = &mut body.motion;
        // No correction drives it the other way.
        motion.speed = if speed * given < 0.0 || given == 0.0 && speed < 0.0 { 0.0 } else { speed };
        motion.acceleration = if given < 0.0 { -acceleration } else { acceleration } as f32;
        if given.abs() > STEERED {
            let angle = (f64::from(kind.wheelbase) * now.yaw_rate / given).atan() as f32;
            motion.steering = steering::turn_wheel(&kind.limits, motion.steering, angle, seconds as f32);
        }
        let turned = steering::wrapped(shown.yaw - before.yaw);
        let mut way = shown.place - before.place;
        if shown.tilt.is_none() {
            way.y = 0.0;
        }
        let metres = way.dot(DQuat::from_rotation_y(-0.5 * turned) * forward);
        motion.rolled += metres;
        if let Some(trailer) = &kind.trailer {
            motion.hitch = steering::pull(trailer, motion.hitch, metres, turned);
        }
        motion.yaw = shown.yaw;
        motion.place += way;
        match shown.tilt {
            Some([pitch, roll]) => {
                body.transform.translation = body.motion.place.as_vec3();
                body.transform.rotation = steering::posture(shown.yaw as f32, pitch as f32, roll as f32);
            }
            None => {
                let height = body.motion.place.y;
                self.stand(body, |_| height);
            }
        }
    }
}
