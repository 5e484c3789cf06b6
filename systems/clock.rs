//! Simulated time: fixed steps, pause and speed. No wall clock; the window says how much real time went by.

use bevy_ecs::prelude::*;

/// The simulation's clock. The time is always `step · step_seconds`.
#[derive(Resource, Clone, PartialEq, Debug)]
pub struct Clock {
    /// Length of a step in seconds.
    pub step_seconds: f64,
    /// Steps done.
    pub step: u64,
    /// A paused clock takes no steps by itself.
    pub paused: bool,
    /// Simulated seconds per real second.
    pub speed: f64,
    /// Simulated seconds that are not a whole step yet.
    owed: f64,
}

impl Default for Clock {
    fn default() -> Self {
        Self { step_seconds: 1.0 / 60.0, step: 0, paused: false, speed: 1.0, owed: 0.0 }
    }
}

impl Clock {
    /// At most this many steps are caught up with at once; a slow machine sees slow motion, not a standstill.
    const MOST_STEPS: u64 = 8;

    /// Simulated seconds since the start.
    pub fn seconds(&self) -> f64 {
        self.step as f64 * self.step_seconds
    }

    /// Takes note of real time gone by; returns how many steps are due.
    pub fn advance(&mut self, real_seconds: f64) -> u64 {
        if self.paused {
            self.owed = 0.0;
            return 0;
        }
        self.owed += real_seconds.max(0.0) * self.speed;
        let due = (self.owed / self.step_seconds) as u64;
        self.owed -= due as f64 * self.step_seconds;
        due.min(Self::MOST_STEPS)
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
        assert_eq!(clock.advance(60.0), Clock::MOST_STEPS);
        clock.paused = true;
        assert_eq!(clock.advance(1.0), 0);
    }
}
