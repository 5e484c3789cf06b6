//! Durations of frames, for the panel.

use std::time::{Duration, Instant};

/// Smoothed times of frames that follow one another.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Timing {
    began: Option<Instant>,
    /// The frame follows another at once; the first is slow for reasons of its own.
    follows: bool,
    /// Milliseconds from frame to frame; 0 until there were two.
    pub frame_ms: f64,
    /// Milliseconds that the window's thread worked on a frame.
    pub work_ms: f64,
}

/// The part of a new time in the smoothed one.
const NEWEST: f64 = 0.1;

impl Timing {
    /// A frame begins; returns the seconds since the one before, 0 after a pause.
    pub fn begin(&mut self, now: Instant) -> f64 {
        let before = self.began.replace(now);
        self.follows = before.is_some();
        let Some(began) = before else { return 0.0 };
        let seconds = now.saturating_duration_since(began).as_secs_f64();
        smooth(&mut self.frame_ms, seconds * 1e3);
        seconds
    }

    /// The frame is drawn.
    pub fn worked(&mut self, time: Duration) {
        let milliseconds = time.as_secs_f64() * 1e3;
        if self.follows {
            smooth(&mut self.work_ms, milliseconds);
        } else {
            self.work_ms = milliseconds;
        }
    }

    /// No frame follows for now.
    pub fn rest(&mut self) {
        self.began = None;
    }

    /// Frames per second.
    pub fn rate(&self) -> f64 {
        if self.frame_ms > 0.0 { 1e3 / self.frame_ms } else { 0.0 }
    }
}

fn smooth(value: &mut f64, newest: f64) {
    *value = if *value == 0.0 { newest } else { *value + (newest - *value) * NEWEST };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_at_rest_is_not_a_frame() {
        let (start, mut timing) = (Instant::now(), Timing::default());
        assert_eq!(timing.begin(start), 0.0);
        assert!((timing.begin(start + Duration::from_millis(20)) - 0.02).abs() < 1e-9);
        timing.rest();
        assert_eq!(timing.begin(start + Duration::from_secs(9)), 0.0);
        assert!((timing.frame_ms - 20.0).abs() < 1e-6 && (timing.rate() - 50.0).abs() < 1e-3);
    }
}
