//! Long steps of what drives, in parts.
//!
//! A driver decides once in a step and drives on blindly until the next. The longer that takes, the farther a vehicle
//! gets beyond the place where it would have braked: steps of a second run over stops, signals and each other. So a
//! step longer than [`LONGEST`] is driven in equal parts that are not: signals, drivers and physics see each of them,
//! and only what is drawn, heard of or saved waits for the whole step.

use super::clock::Clock;
use bevy_ecs::prelude::*;
use bevy_ecs::schedule::ScheduleLabel;

/// Seconds. Drivers stop some 2 m before a line ([`crate::vehicles::types::Driver::gap`]); none drives farther than
/// that in 0.05 s below 40 m/s, 144 km/h, so that a driver that decides a step too late still stops before it.
pub const LONGEST: f64 = 0.05;

/// The schedule of a part: systems that have to see every one of them are added here.
#[derive(ScheduleLabel, Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Parts;

/// The part of a step that is driven now; the whole of it where steps are short. Follows from the clock, and is no
/// state.
#[derive(Resource, Clone, Copy, PartialEq, Debug)]
pub struct SubStep {
    /// Simulated duration.
    pub seconds: f64,
    /// Simulated seconds at its end.
    pub time: f64,
    /// Number of parts since the run began, this one included.
    pub count: u64,
}

impl Default for SubStep {
    fn default() -> Self {
        Self { seconds: Clock::default().step_seconds, time: 0.0, count: 0 }
    }
}

impl SubStep {
    /// The parts of the clock's present step.
    pub fn of(clock: &Clock) -> impl ExactSizeIterator<Item = Self> + use<> {
        // A step that is a rounding error longer is not cut.
        let parts = (clock.step_seconds / LONGEST - 1e-6).ceil().max(1.0) as u32;
        let (step, end, seconds) = (clock.step, clock.seconds(), clock.step_seconds / f64::from(parts));
        (0..parts).rev().map(move |left| Self {
            seconds,
            time: end - f64::from(left) * seconds,
            count: step.wrapping_mul(parts.into()).wrapping_sub(left.into()),
        })
    }
}

/// Drives the clock's step in its parts.
pub fn drive(world: &mut World) {
    let parts = SubStep::of(world.resource());
    world.schedule_scope(Parts, |world, schedule| {
        for part in parts {
            *world.resource_mut::<SubStep>() = part;
            schedule.run(world);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_step_is_whole_and_a_long_one_ends_at_the_clock_s_time() {
        for (step_seconds, parts) in [(1e-4, 1), (1.0 / 60.0, 1), (0.05, 1), (0.051, 2), (0.1, 2), (1.0, 20)] {
            let mut clock = Clock::default();
            (clock.step_seconds, clock.step) = (step_seconds, 7);
            let all: Vec<SubStep> = SubStep::of(&clock).collect();
            assert_eq!(all.len(), parts, "{step_seconds}");
            let last = all[parts - 1];
            assert_eq!((last.time, last.count), (clock.seconds(), 7 * parts as u64), "{step_seconds}");
            assert!(last.seconds <= LONGEST && (last.seconds * parts as f64 - step_seconds).abs() < 1e-12);
            assert!(all.is_sorted_by(|a, b| a.time < b.time && a.count + 1 == b.count));
        }
    }
}
