//! Common parts of several benchmarks.

use cpu_time::ProcessTime;
use criterion::measurement::{Measurement, ValueFormatter, WallTime};
use std::time::Duration;

/// A clock, and what benchmarks call it.
pub trait Clock: Measurement<Value = Duration> {
    const NAME: &'static str;
    /// For benchmarks that time a part of what they do.
    #[allow(dead_code)]
    const CLOCK: Self;
}

impl Clock for WallTime {
    const NAME: &'static str = "wall";
    const CLOCK: Self = Self;
}

impl Clock for CpuTime {
    const NAME: &'static str = "cpu";
    const CLOCK: Self = Self;
}

/// Processor time of all threads.
pub struct CpuTime;

impl Measurement for CpuTime {
    type Intermediate = ProcessTime;
    type Value = Duration;

    fn start(&self) -> ProcessTime {
        ProcessTime::now()
    }

    fn end(&self, start: ProcessTime) -> Duration {
        start.elapsed()
    }

    fn add(&self, a: &Duration, b: &Duration) -> Duration {
        *a + *b
    }

    fn zero(&self) -> Duration {
        Duration::ZERO
    }

    fn to_f64(&self, value: &Duration) -> f64 {
        value.as_nanos() as f64
    }

    fn formatter(&self) -> &dyn ValueFormatter {
        WallTime.formatter()
    }
}
