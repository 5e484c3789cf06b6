//! Weather over time.

use super::weather::Weather;
use crate::describe::check::check;
use crate::ecs::clock::Clock;
use bevy_ecs::prelude::*;
use serde::{Deserialize, Serialize};

/// Weather of a run: what it was, what it becomes, and when. It is state; what follows from it is not.
#[derive(Resource, Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct WeatherTimeline {
    before: Weather,
    after: Weather,
    /// Step at which the change began, from which both dates count.
    began: u64,
    /// Steps that the change takes.
    steps: u64,
}

impl WeatherTimeline {
    /// That weather, from the first step on.
    pub fn new(weather: Weather) -> Self {
        Self { before: weather.clone(), after: weather, began: 0, steps: 0 }
    }

    /// Weather at the clock's step: on the way from the one to the other, linear in the number of steps.
    pub fn now(&self, clock: &Clock) -> Weather {
        let gone = clock.step.saturating_sub(self.began);
        let seconds = gone as f64 * clock.step_seconds;
        let running = |weather: &Weather| {
            let date = weather.date.later(seconds * weather.time_speed);
            Weather { date, ..weather.clone() }
        };
        if gone >= self.steps {
            return running(&self.after);
        }
        running(&self.before).toward(&running(&self.after), gone as f64 / self.steps as f64)
    }

    /// Begins to become another weather, which it is after some seconds of the clock.
    pub fn change(&mut self, weather: Weather, over_seconds: f64, clock: &Clock) {
        let steps = (over_seconds / clock.step_seconds).round() as u64;
        *self = Self { before: self.now(clock), after: weather, began: clock.step, steps };
    }

    /// Tells if a value from a file can be what a world holds.
    pub(crate) fn is_valid(&self) -> bool {
        check(&self.before).is_ok() && check(&self.after).is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::weather::date::Date;

    fn clock(step: u64) -> Clock {
        let mut clock = Clock::default();
        (clock.step, clock.step_seconds) = (step, 0.1);
        clock
    }

    fn sun(azimuth: f64, elevation: f64) -> Weather {
        Weather { sun_azimuth_degrees: Some(azimuth), sun_elevation_degrees: Some(elevation), ..Weather::default() }
    }

    #[test]
    fn a_change_is_linear_and_the_date_goes_on() {
        let first = Weather { date: Date(1e9), time_speed: 60.0, clouds: 0.2, ..Weather::default() };
        let mut timeline = WeatherTimeline::new(first.clone());
        assert_eq!(timeline.now(&clock(0)), first);
        assert_eq!(timeline.now(&clock(100)).date, Date(1e9 + 600.0));
        let later = Weather { clouds: 1.0, haze: 20_000.0, ..timeline.now(&clock(100)) };
        timeline.change(later, 2.0, &clock(100));
        assert_eq!(timeline.now(&clock(100)).clouds, 0.2);
        let half = timeline.now(&clock(110));
        assert!((half.clouds - 0.6).abs() < 1e-12 && half.haze == 30_000.0, "{half:?}");
        assert_eq!(half.date, Date(1e9 + 660.0));
        assert_eq!((timeline.now(&clock(120)).clouds, timeline.now(&clock(1000)).clouds), (1.0, 1.0));
    }

    #[test]
    fn a_change_that_is_interrupted_goes_on_from_where_it_was() {
        let mut timeline = WeatherTimeline::new(sun(350.0, 10.0));
        timeline.change(sun(10.0, 30.0), 1.0, &clock(0));
        // Over north, not over south.
        let half = timeline.now(&clock(5));
        assert_eq!(half.sun(), Some((360.0, 20.0)));
        timeline.change(sun(0.0, 0.0), 0.0, &clock(5));
        assert_eq!(timeline.now(&clock(5)).sun(), Some((0.0, 0.0)));
    }

    #[test]
    fn all_that_a_change_goes_through_is_valid() {
        for (from, to) in
            [((350.0, -90.0), (20.0, 90.0)), ((-350.0, 90.0), (-20.0, -90.0)), ((360.0, 5.0), (-360.0, 5.0))]
        {
            let mut timeline = WeatherTimeline::new(sun(from.0, from.1));
            timeline.change(sun(to.0, to.1), 1.0, &clock(0));
            for step in 0..=10 {
                let now = timeline.now(&clock(step));
                assert!(check(&now).is_ok(), "{from:?} to {to:?}, {step}: {now:?}");
                let mut interrupted = timeline.clone();
                interrupted.change(sun(0.0, 0.0), 1.0, &clock(step));
                assert!(interrupted.is_valid(), "{from:?} to {to:?}, {step}");
            }
        }
    }
}
