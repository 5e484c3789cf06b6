//! Durations of a film's frames: steps of the clock as fractions, and their rounding to a format's ticks.

use std::fmt;
use std::ops::Range;

/// Seconds that a frame is shown, a fraction in lowest terms.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FrameTime {
    /// Seconds times the denominator, more than 0.
    pub numerator: u64,
    /// More than 0.
    pub denominator: u64,
}

impl FrameTime {
    /// The first convergent of the seconds' continued fraction that rounds to them: what is written
    /// 0.016666666666666666 is 1/60, what is written 0.0004 is 1/2500. Seconds from a nanosecond to a billion; others
    /// are taken for the nearest of these.
    pub fn of(seconds: f64) -> Self {
        let seconds = if seconds.is_finite() { seconds.clamp(1e-9, 1e9) } else { 1.0 };
        Self::convergents(seconds)
            .find(|time| time.seconds() == seconds)
            .unwrap_or(Self { numerator: 1, denominator: 1 })
    }

    /// The best fraction whose terms are at most `limit`, among the convergents.
    pub fn within(self, limit: u64) -> Self {
        let fits = |time: &Self| time.numerator.max(time.denominator) <= limit;
        if fits(&self) {
            return self;
        }
        Self::convergents(self.seconds()).filter(|time| time.numerator > 0).take_while(fits).last().unwrap_or(self)
    }

    /// Fractions ever nearer to a number, the last equal to it (Hardy, Wright: "An Introduction to the Theory of
    /// Numbers", chapter X), in whole numbers: a double is one over a power of two. Stops at terms that no double holds
    /// exactly, which are nearer than any double is.
    fn convergents(seconds: f64) -> impl Iterator<Item = Self> {
        const EXACT: u128 = 1 << f64::MANTISSA_DIGITS;
        // At most 2⁵³ · 2⁸³ for a nanosecond, 2⁻³⁰.
        let (mut rest, mut divisor) = (seconds, 1u128);
        while rest.fract() != 0.0 {
            (rest, divisor) = (rest * 2.0, divisor * 2);
        }
        let (mut high, mut low) = (rest as u128, divisor);
        let (mut before, mut last) = ((0u128, 1u128), (1u128, 0u128));
        std::iter::from_fn(move || {
            let part = high.checked_div(low)?;
            (high, low) = (low, high % low);
            let next = (part.checked_mul(last.0)? + before.0, part.checked_mul(last.1)? + before.1);
            (before, last) = (last, next);
            let fits = next.0.max(next.1) <= EXACT;
            fits.then_some(Self { numerator: next.0 as u64, denominator: next.1 as u64 })
        })
    }

    /// The nearest double.
    pub fn seconds(self) -> f64 {
        self.numerator as f64 / self.denominator as f64
    }
}

/// For people: `1/60 s`, `100 s`.
impl fmt::Display for FrameTime {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.denominator {
            1 => write!(f, "{} s", self.numerator),
            _ => write!(f, "{}/{} s", self.numerator, self.denominator),
        }
    }
}

/// Durations of a picture that a format can express.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Ticks {
    /// Ticks of a second.
    pub per_second: u64,
    /// Least ticks of a picture.
    pub shortest: u64,
    /// Most ticks of a picture.
    pub longest: u64,
}

/// A picture of a film, and the ticks that it is shown for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Shown {
    /// The number of the frame.
    pub frame: u64,
    /// From the shortest to the longest of the format.
    pub ticks: u64,
}

impl Ticks {
    /// Frames that are shown, each with its duration. Every picture begins, and the last ends, at the tick nearest to
    /// its time, so that roundings do not add up. Frames that would be shown for less than the shortest time are left
    /// out; one that is shown for more than the longest stands there again. A film is one shortest time long at the
    /// least.
    pub fn of_frames(&self, frames: Range<u64>, time: FrameTime) -> Vec<Shown> {
        let (of_second, of_time) = (u128::from(self.per_second), u128::from(time.numerator));
        let tick_of = |frame: u64| {
            let doubled = 2 * u128::from(frame - frames.start) * of_time * of_second / u128::from(time.denominator);
            doubled.div_ceil(2) as u64
        };
        let end = tick_of(frames.end);
        let mut shown = Vec::new();
        let mut frame = frames.start;
        while frame < frames.end {
            let begins = tick_of(frame);
            let has_room =
                |next: &u64| tick_of(*next) - begins >= self.shortest && end - tick_of(*next) >= self.shortest;
            let next = (frame + 1..frames.end).find(has_room).unwrap_or(frames.end);
            let mut left = (tick_of(next) - begins).max(self.shortest);
            while left > self.longest {
                // What is left is enough for a picture.
                let ticks = self.longest.min(left - self.shortest);
                shown.push(Shown { frame, ticks });
                left -= ticks;
            }
            shown.push(Shown { frame, ticks: left });
            frame = next;
        }
        shown
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn time(numerator: u64, denominator: u64) -> FrameTime {
        FrameTime { numerator, denominator }
    }

    #[test]
    fn a_step_is_the_fraction_that_was_meant() {
        for denominator in 1..=2000 {
            assert_eq!(FrameTime::of(1.0 / denominator as f64), time(1, denominator), "1/{denominator}");
        }
        for (seconds, expected) in [
            (0.016_666_666_666_666_666, time(1, 60)),
            (0.016_666_7, time(166_667, 10_000_000)),
            (0.0004, time(1, 2500)),
            (1e-6, time(1, 1_000_000)),
            (1001.0 / 30_000.0, time(1001, 30_000)),
            (0.1, time(1, 10)),
            (100.0, time(100, 1)),
            (12.34, time(617, 50)),
            (f64::NAN, time(1, 1)),
            (0.0, time(1, 1_000_000_000)),
        ] {
            assert_eq!(FrameTime::of(seconds), expected, "{seconds}");
        }
    }

    #[test]
    fn a_fraction_with_smaller_terms_is_near() {
        let near = FrameTime::of(0.016_666_7).within(1_001_000);
        assert!(near.numerator.max(near.denominator) <= 1_001_000);
        // A convergent p/q is nearer than 1/q² (Hardy, Wright, theorem 171).
        assert!((near.seconds() - 0.016_666_7).abs() < (near.denominator as f64).powi(-2), "{near}");
        assert_eq!(time(1, 60).within(1_001_000), time(1, 60));
    }

    #[test]
    fn roundings_do_not_add_up() {
        let hundredths = Ticks { per_second: 100, shortest: 2, longest: 65_535 };
        for denominator in [3, 7, 24, 30, 60, 120, 144, 1000, 2500] {
            for frames in [1, 2, 59, 60, 1000] {
                let shown = hundredths.of_frames(5..5 + frames, time(1, denominator));
                assert_eq!(shown[0].frame, 5);
                let exact = frames as f64 * 100.0 / denominator as f64;
                let mut at = 0;
                for picture in &shown {
                    // A picture begins at the hundredth nearest to its time.
                    let due = (picture.frame - 5) as f64 * 100.0 / denominator as f64;
                    assert!((at as f64 - due).abs() <= 0.5, "{picture:?} of 1/{denominator} at {at}, due {due}");
                    assert!((2..=65_535).contains(&picture.ticks));
                    at += picture.ticks;
                }
                assert!((at as f64 - exact.max(2.0)).abs() <= 0.5, "{frames} of 1/{denominator}: {at} for {exact}");
            }
        }
    }

    #[test]
    fn what_a_format_holds_exactly_is_exact_and_long_frames_stand_there_again() {
        let exact = Ticks { per_second: 144, shortest: 1, longest: 65_535 };
        assert_eq!(exact.of_frames(0..3, time(1, 144)), [0, 1, 2].map(|frame| Shown { frame, ticks: 1 }));
        let hundredths = Ticks { per_second: 100, shortest: 2, longest: 65_535 };
        let shown = hundredths.of_frames(0..2, time(1000, 1));
        let expected = [(0, 65_535), (0, 34_465), (1, 65_535), (1, 34_465)];
        assert_eq!(shown, expected.map(|(frame, ticks)| Shown { frame, ticks }));
        let barely = Ticks { per_second: 1, shortest: 2, longest: 5 };
        assert_eq!(barely.of_frames(0..1, time(6, 1)), [4, 2].map(|ticks| Shown { frame: 0, ticks }));
    }
}
