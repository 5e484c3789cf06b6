//! Simulated time: fixed steps, pause and speed. No wall clock; the window says how much real time went by.

use bevy_ecs::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// The speeds that a person can choose: simulated seconds per real second.
pub const SPEEDS: RangeInclusive<f64> = 0.1..=100.0;

/// Seed of the simulation's random numbers, from the scene's file: the same seed, the same run.
#[derive(Resource, Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Seed(pub u64);

/// The simulation's clock. The time is always `step · step_seconds`. Of these, what tells the time is state; how fast
/// it goes by is not.
#[derive(Resource, Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Clock {
    /// Length of a step in seconds.
    pub step_seconds: f64,
    /// Steps done.
    pub step: u64,
    /// A paused clock takes no steps by itself.
    #[serde(skip)]
    pub paused: bool,
    /// Simulated seconds per real second.
    #[serde(skip)]
    pub speed: f64,
    /// Simulated seconds that are not a whole step yet.
    #[serde(skip)]
    owed: f64,
}

impl Default for Clock {
    fn default() -> Self {
        Self { step_seconds: 1.0 / 60.0, step: 0, paused: false, speed: 1.0, owed: 0.0 }
    }
}

impl Clock {
    /// Seconds: a frame that took longer than this counts as this long, as do the hours that a machine sleeps.
    const LONGEST_FRAME: f64 = 0.25;

    /// Simulated seconds since the start.
    pub fn seconds(&self) -> f64 {
        self.step as f64 * self.step_seconds
    }

    /// Takes note of real time gone by; returns how many steps are due. Where there is no time for all of them,
    /// leave the rest out: nothing is caught up with later, so that a slow machine sees slow motion and not a
    /// standstill.
    pub fn advance(&mut self, real_seconds: f64) -> u64 {
        if self.paused {
            self.owed = 0.0;
            return 0;
        }
        self.owed += real_seconds.clamp(0.0, Self::LONGEST_FRAME) * self.speed;
        let due = (self.owed / self.step_seconds) as u64;
        self.owed = (self.owed - due as f64 * self.step_seconds).max(0.0);
        due
    }

    /// Part of the next step that has gone by, 0 to 1; 1 while the clock stands.
    pub fn fraction(&self) -> f32 {
        if self.paused { 1.0 } else { (self.owed / self.step_seconds).min(1.0) as f32 }
    }

    /// Steps that are exact as a number of seconds; no run gets there.
    const MOST_STEPS: u64 = 1 << 53;

    /// Takes the time from a saved clock and goes on at its own speed.
    pub(crate) fn take_over(&mut self, saved: Self) -> Result<(), &'static str> {
        if saved.step_seconds != self.step_seconds || saved.step > Self::MOST_STEPS {
            return Err("expected the scene's step length");
        }
        (self.step, self.owed) = (saved.step, 0.0);
        Ok(())
    }
}

/// Counts a step; the first system of the step schedule.
pub fn tick(mut clock: ResMut<Clock>) {
    clock.step += 1;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn due_steps_follow_real_time_speed_and_pause() {
        let mut clock = Clock { step_seconds: 0.1, speed: 2.0, ..Clock::default() };
        assert_eq!((clock.advance(0.12), clock.advance(0.12)), (2, 2));
        assert!((clock.fraction() - 0.8).abs() < 1e-6);
        assert_eq!(clock.advance(60.0), 5, "no catching up with a minute");
        clock.speed = 100.0;
        assert_eq!(clock.advance(0.2), 200);
        clock.paused = true;
        assert_eq!((clock.advance(1.0), clock.fraction()), (0, 1.0));
    }
}
