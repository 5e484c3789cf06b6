//! Times of one frame.

use crate::renderer::{PassTime, RenderStats};
use std::time::Duration;
use systems::ecs::stats::FrameStats;

/// Times of one frame.
#[derive(Clone, Debug)]
pub(super) struct FrameCost {
    /// Since the program started.
    pub at: Duration,
    pub mutate: Duration,
    pub simulate: Duration,
    pub prepare: Duration,
    pub encode: Duration,
    pub submit: Duration,
    pub frame: FrameStats,
    pub render: RenderStats,
    /// Empty where the adapter has no timestamps.
    pub passes: Vec<PassTime>,
}

impl FrameCost {
    pub fn engine(&self) -> Duration {
        self.simulate + self.prepare + self.encode
    }

    pub fn total(&self) -> Duration {
        self.mutate + self.engine() + self.submit
    }
}

/// For people.
pub(super) fn milliseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}
