//! Lidars as data, and which of their columns fire when.

use super::beams::Beams;
use crate::describe::check::Described;
use crate::describe::fault::{Fault, Trail};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A lidar. It looks along its entity's +Z, as vehicles do, with +X to the left and +Y up. Its points have the axes of
/// ROS (REP 103): x forward, y left, z up.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LidarSensor {
    /// Beams of a column.
    #[schemars(extend("see" = "a model, `grid(…)` or `list(…)`: see below"))]
    pub beams: Beams,
    /// Revolutions per second.
    #[schemars(range(min = 1e-3, max = 1e4), extend("unit" = "Hz"))]
    pub hz: f32,
    /// Columns per revolution.
    #[schemars(range(min = 1, max = Self::MOST_COLUMNS))]
    pub columns: u32,
    /// Least and largest distance at which something is met. What is nearer is not in the way.
    #[schemars(extend("minimum" = 0, "maximum" = 100000, "unit" = "m"))]
    pub range: (f32, f32),
    /// Fading of intensity: e^(−attenuation · range).
    #[schemars(range(min = 0.0, max = 10.0), extend("unit" = "1/m"))]
    pub attenuation: f32,
    /// Each column is fired from where the sensor is at its time, not from where it is at the end.
    pub sweep: bool,
    /// Errors of real sensors.
    pub noise: LidarNoise,
}

/// The noise of a lidar; by default there is none.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LidarNoise {
    /// Standard deviation of ranges.
    #[schemars(range(min = 0.0, max = 100.0), extend("unit" = "m"))]
    pub range_sigma: f32,
    /// Share of returns that are lost.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub drop_rate: f32,
    /// Intensity below which returns are lost.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub drop_below: f32,
}

impl Default for LidarSensor {
    fn default() -> Self {
        Self {
            beams: Beams::Vlp16,
            hz: 10.0,
            columns: 1800,
            range: (0.5, 100.0),
            attenuation: 0.0,
            sweep: false,
            noise: LidarNoise::default(),
        }
    }
}

impl Described for LidarSensor {
    fn check_whole(&self) -> Vec<Fault> {
        let (least, most) = self.range;
        let expected = || format!("expected the least below the most, found {:?}", self.range);
        (least >= most).then(|| Trail::default().field("range").fault(expected())).into_iter().collect()
    }
}

impl LidarSensor {
    /// Most columns of a revolution.
    pub const MOST_COLUMNS: u32 = 1 << 20;
    /// Most beams of a capture: half a gigabyte.
    pub const MOST_BEAMS: f64 = 16_777_216.0;

    /// Checks that the beams between two captures, so many seconds apart, can be held.
    ///
    /// # Errors
    /// The number of beams, and the most.
    pub fn check_beams(&self, seconds: f64) -> Result<(), String> {
        let columns = seconds * f64::from(self.hz) * f64::from(self.columns);
        let beams = columns * self.beams.rings().len() as f64;
        if beams <= Self::MOST_BEAMS {
            return Ok(());
        }
        Err(format!("expected at most {} beams in a capture, found {beams:.0}", Self::MOST_BEAMS))
    }

    /// The columns that fire between two steps: from the time of the first on, and before the time of the second. They
    /// are counted by integers, so that adjoining intervals lose and repeat none. The sensor is to be without faults.
    pub fn columns_between(&self, from_step: u64, to_step: u64, step_seconds: f64) -> Columns {
        let Ratio { above, below } = Ratio::nearest(step_seconds * f64::from(self.hz));
        // Column c fires at step c · below / (above · columns).
        let (per_step, below) = (u128::from(above) * u128::from(self.columns), u128::from(below));
        let (start, end) = (u128::from(from_step) * per_step, u128::from(to_step.max(from_step)) * per_step);
        let (first, last) = (start.div_ceil(below), end.div_ceil(below));
        Columns {
            first: first as u64,
            count: (last - first) as u64,
            lead: (first * below - start) as f64 / below as f64,
            length: (end - start) as f64 / below as f64,
            seconds: self.column_seconds(),
        }
    }

    /// The columns of one revolution, from the one that looks forward on.
    pub fn revolution(&self) -> Columns {
        let columns = u64::from(self.columns);
        Columns { first: 0, count: columns, lead: 0.0, length: columns as f64, seconds: self.column_seconds() }
    }

    /// From one column to the next.
    fn column_seconds(&self) -> f64 {
        1.0 / (f64::from(self.hz) * f64::from(self.columns))
    }
}

/// Columns that fire one after the other in an interval of time.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Columns {
    /// Counted since step 0; in its revolution a column is this number modulo the revolution's columns.
    pub first: u64,
    /// Number of columns.
    pub count: u64,
    /// From the interval's begin to the first column, in columns: 0 to below 1.
    lead: f64,
    /// Length of the interval, in columns.
    length: f64,
    /// From one column to the next.
    pub seconds: f64,
}

impl Columns {
    /// When the i-th of them fires: 0 at the interval's begin, 1 at its end.
    pub fn fraction(&self, i: u64) -> f64 {
        if self.length > 0.0 { ((self.lead + i as f64) / self.length).min(1.0) } else { 1.0 }
    }

    /// Seconds from the interval's begin to the first column.
    pub fn lead_seconds(&self) -> f64 {
        self.lead * self.seconds
    }
}

/// A fraction of integers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Ratio {
    above: u64,
    below: u64,
}

impl Ratio {
    /// The simplest one that a rounded number may stand for: the first convergent of its continued fraction within
    /// 2⁻⁵⁰ of it, relatively. So 1/60 · 10 is 1/6, which no float is.
    fn nearest(value: f64) -> Self {
        let (mut before, mut now) = (Self { above: 0, below: 1 }, Self { above: 1, below: 0 });
        let mut rest = value;
        loop {
            let whole = rest.floor();
            let next = Self {
                above: (whole as u64).saturating_mul(now.above).saturating_add(before.above),
                below: (whole as u64).saturating_mul(now.below).saturating_add(before.below),
            };
            // Beyond these the products in `columns_between` might overflow; 2⁻³² is a column in 50 days.
            if next.above.max(next.below) > 1 << 32 {
                return if now.below == 0 { Self { above: u64::from(u32::MAX), below: 1 } } else { now };
            }
            let error = (next.above as f64 / next.below as f64 - value).abs();
            if error <= value * 2f64.powi(-50) || rest == whole {
                return next;
            }
            (before, now) = (now, next);
            rest = (rest - whole).recip();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::describe::check::check;
    use proptest::prelude::*;

    #[test]
    fn usual_rates_are_simple_fractions() {
        let cases = [
            (1.0 / 60.0 * 10.0, (1, 6)),
            (1.0 / 60.0 * 20.0, (1, 3)),
            (0.01 * 10.0, (1, 10)),
            (1.0 / 30.0 * 7.5, (1, 4)),
            (0.1 * 25.0, (5, 2)),
            (1.0, (1, 1)),
        ];
        for (value, (above, below)) in cases {
            assert_eq!(Ratio::nearest(value), Ratio { above, below }, "{value}");
        }
    }

    #[test]
    fn six_steps_of_a_sixtieth_are_a_revolution_at_ten_hertz_for_ever() {
        let lidar = LidarSensor { columns: 1024, ..LidarSensor::default() };
        for start in [0, 6, 6_000_000, 6u64 << 48] {
            let parts: Vec<Columns> =
                (start..start + 6).map(|step| lidar.columns_between(step, step + 1, 1.0 / 60.0)).collect();
            assert_eq!(parts.iter().map(|part| part.count).collect::<Vec<_>>(), [171, 171, 170, 171, 171, 170]);
            assert_eq!(parts[0].first % 1024, 0);
            // The second step begins a third of a column before the first that it fires.
            assert!((parts[1].fraction(0) - (1.0 / 3.0) / (1024.0 / 6.0)).abs() < 1e-12);
        }
        let whole = lidar.columns_between(12, 18, 1.0 / 60.0);
        assert_eq!((whole.first, whole.count, whole.fraction(0), whole.fraction(512)), (2048, 1024, 0.0, 0.5));
        assert_eq!(lidar.columns_between(5, 5, 1.0 / 60.0).count, 0);
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        #[test]
        fn intervals_that_adjoin_have_every_column_once(
            hz in 0.1f32..100.0,
            columns in 1u32..4096,
            step_seconds in prop_oneof![Just(1.0 / 60.0), Just(0.01), 1e-4f64..0.5],
            start in 0u64..1 << 40,
            lengths in prop::collection::vec(0u64..50, 1..40),
        ) {
            let lidar = LidarSensor { hz, columns, ..LidarSensor::default() };
            let mut step = start;
            let mut next = lidar.columns_between(start, start, step_seconds).first;
            for length in lengths {
                let part = lidar.columns_between(step, step + length, step_seconds);
                prop_assert_eq!(part.first, next);
                next += part.count;
                step += length;
                let expected = length as f64 * step_seconds * f64::from(hz) * f64::from(columns);
                // Whole columns, and the rate is a fraction to within 2⁻³¹.
                prop_assert!((part.count as f64 - expected).abs() < 1.0 + expected * 2f64.powi(-30));
                for i in [0, part.count.saturating_sub(1)] {
                    prop_assert!(part.count == 0 || (0.0..1.0).contains(&part.fraction(i)));
                }
            }
        }
    }

    #[test]
    fn lidars_are_read_as_they_are_written_and_faults_are_named() {
        let lidar = LidarSensor { beams: Beams::Os1With128, sweep: true, ..LidarSensor::default() };
        let text = serde_json::to_string(&lidar).expect("text");
        assert!(text.contains("\"os1_128\""), "{text}");
        assert_eq!(serde_json::from_str::<LidarSensor>(&text).expect("a lidar"), lidar);
        assert_eq!(check(&lidar), Ok(()));
        let faults = [
            (LidarSensor { hz: f32::NAN, ..lidar.clone() }, "hz: expected a number from 0.001 to 10000, found NaN"),
            (
                LidarSensor { columns: 0, ..lidar.clone() },
                "columns: expected a whole number from 1 to 1048576, found 0",
            ),
            (
                LidarSensor { range: (5.0, 5.0), ..lidar.clone() },
                "range: expected the least below the most, found (5.0, 5.0)",
            ),
        ];
        for (lidar, expected) in faults {
            assert_eq!(check(&lidar).expect_err("a fault").to_string(), expected);
        }
    }
}
