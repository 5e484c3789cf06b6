//! Inertial measurement units: specific force and angular rate, from where a sensor was at three moments.
//!
//! Both are of the moment in the middle, from differences of second order about it: of places ((p₀ − 2p₁ + p₂)/h²) and
//! of turns (half the turn from the first to the last, by the two between). So both are of one time, an interval before
//! the last moment. Rates that are constant come out as they are.

use super::philox::{Noise, normal};
use crate::describe::check::Described;
use crate::space::gravity::GRAVITY;
use glam::{DQuat, DVec3, Vec3Swizzles};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Channels of its random numbers.
const ACCELEROMETER: u32 = 0;
const GYROSCOPE: u32 = 1;

/// An inertial measurement unit. Its axes are X forward, Y left, Z up (ROS, REP 103); its entity looks along +Z with +Y
/// up, as vehicles do.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ImuSensor {
    /// Errors of real ones.
    pub noise: ImuNoise,
}

/// The noise of an inertial measurement unit; by default there is none. A bias that walks at random is a sum over all
/// steps before, which no counter knows: it is left out.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ImuNoise {
    /// White noise of the specific force: its standard deviation is this times the root of the rate.
    #[schemars(range(min = 0.0, max = 100.0), extend("unit" = "(m/s²)/√Hz"))]
    pub accelerometer_density: f32,
    /// White noise of the angular rate.
    #[schemars(range(min = 0.0, max = 100.0), extend("unit" = "(rad/s)/√Hz"))]
    pub gyroscope_density: f32,
    /// Added to every specific force, in the sensor's axes.
    #[schemars(inner(range(min = -100.0, max = 100.0)), extend("unit" = "m/s²"))]
    pub accelerometer_bias: [f32; 3],
    /// Added to every angular rate, in the sensor's axes.
    #[schemars(inner(range(min = -100.0, max = 100.0)), extend("unit" = "rad/s"))]
    pub gyroscope_bias: [f32; 3],
}

/// Measurement in the sensor's axes at the moment in the middle.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct ImuReading {
    /// Acceleration against free fall, m/s²: (0, 0, 9.81) at rest on level ground.
    pub specific_force: DVec3,
    /// About its axes, rad/s.
    pub angular_velocity: DVec3,
}

impl Described for ImuSensor {}

impl ImuSensor {
    /// Standard deviations of its white noise at a reading every so many seconds: m/s² and rad/s. A density n becomes
    /// n/√seconds (Furgale, Rehder, Siegwart: "Unified Temporal and Spatial Calibration for Multi-Sensor Systems", IROS
    /// 2013; Kalibr's "IMU noise model").
    pub fn sigmas(&self, seconds: f64) -> [f64; 2] {
        [self.noise.accelerometer_density, self.noise.gyroscope_density].map(|n| f64::from(n) / seconds.sqrt())
    }

    /// Measures from its poses at three moments, each so many seconds after the one before. A pose is the place in the
    /// world, metres, Y up, and the rotation from the entity's axes.
    pub fn measure(&self, moments: &[(DVec3, DQuat); 3], seconds: f64, noise: Noise) -> ImuReading {
        let [(p0, q0), (p1, q1), (p2, q2)] = *moments;
        let acceleration = ((p2 - p1) - (p1 - p0)) / (seconds * seconds);
        let specific_force = q1.inverse() * (acceleration + DVec3::Y * GRAVITY);
        let turned = turn_of(q0.inverse() * q1) + turn_of(q1.inverse() * q2);
        let [of_force, of_rate] = self.sigmas(seconds);
        let ImuNoise { accelerometer_bias, gyroscope_bias, .. } = self.noise;
        ImuReading {
            specific_force: forward_left_up(specific_force) + error(noise, ACCELEROMETER, of_force, accelerometer_bias),
            angular_velocity: forward_left_up(turned / (2.0 * seconds))
                + error(noise, GYROSCOPE, of_rate, gyroscope_bias),
        }
    }
}

fn error(noise: Noise, channel: u32, sigma: f64, bias: [f32; 3]) -> DVec3 {
    let [x, y, z, _] = noise.words(0, channel).map(|word| f64::from(normal(word)));
    DVec3::new(x, y, z) * sigma + DVec3::from_array(bias.map(f64::from))
}

/// From an entity's axes (X left, Y up, Z forward).
fn forward_left_up(entity: DVec3) -> DVec3 {
    entity.zxy()
}

/// Axis times angle of a unit quaternion's turn by the shorter way: radians.
fn turn_of(turn: DQuat) -> DVec3 {
    let turn = if turn.w < 0.0 { -turn } else { turn };
    let axis = turn.xyz();
    let sin = axis.length();
    if sin > 0.0 { axis * (2.0 * sin.atan2(turn.w) / sin) } else { DVec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::describe::check::check;
    use proptest::prelude::*;

    const STEP: f64 = 1.0 / 60.0;

    fn quiet() -> Noise {
        Noise::new(0, 0, 0)
    }

    fn measured(sensor: &ImuSensor, at: impl Fn(f64) -> (DVec3, DQuat)) -> ImuReading {
        sensor.measure(&[-STEP, 0.0, STEP].map(at), STEP, quiet())
    }

    #[test]
    fn at_rest_gravity_is_felt_upward_and_nothing_turns() {
        let still = measured(&ImuSensor::default(), |_| (DVec3::new(3.0, -2.0, 7.0), DQuat::IDENTITY));
        assert_eq!(still, ImuReading { specific_force: DVec3::new(0.0, 0.0, GRAVITY), ..ImuReading::default() });
        // Leaning to the left by 30°: what is up is to the right by half.
        let leaning = DQuat::from_rotation_z(-30f64.to_radians());
        let found = measured(&ImuSensor::default(), |_| (DVec3::ZERO, leaning)).specific_force;
        assert!(found.abs_diff_eq(DVec3::new(0.0, -0.5, 0.75f64.sqrt()) * GRAVITY, 1e-14), "{found}");
    }

    #[test]
    fn in_free_fall_nothing_is_felt() {
        let fall = |t: f64| (DVec3::new(2.0 * t, 5.0 - 0.5 * GRAVITY * t * t, -t), DQuat::IDENTITY);
        // Second differences are exact for parabolas; places of 5 m round by 4.4e-16 · 3600.
        assert!(measured(&ImuSensor::default(), fall).specific_force.length() < 1e-11);
    }

    #[test]
    fn on_a_circle_it_is_pushed_toward_the_centre_by_the_difference_scheme_s_v2_over_r() {
        for (radius, speed) in [(20.0, 10.0), (50.0, 15.0), (5.0, -2.0), (0.5, 8.0)] {
            let rate: f64 = speed / radius;
            // To the left, about +Y; the centre is to the left, +X of the entity.
            let circle = |t: f64| {
                let turn = DQuat::from_rotation_y(rate * t);
                (turn * DVec3::new(-radius, 0.0, 0.0), turn)
            };
            let found = measured(&ImuSensor::default(), circle);
            // Chords: |p₀ − 2p₁ + p₂| = 4R sin²(ωh/2).
            let half = rate * STEP / 2.0;
            let expected = speed * speed / radius * (half.sin() / half).powi(2);
            // Places of up to 50 m round by 7e-15, four of them, times 3600.
            let off = found.specific_force - DVec3::new(0.0, expected, GRAVITY);
            assert!(off.length() < 1e-9, "{radius} {speed}: {off}");
            // Against the true one: sin² x/x² is at least 1 − x²/3.
            assert!((expected - speed * speed / radius).abs() <= speed * speed / radius * half * half / 3.0);
            assert!((found.angular_velocity - DVec3::Z * rate).length() < 1e-12 * (1.0 + rate.abs() * 60.0));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        #[test]
        fn a_constant_rate_is_measured_exactly(
            x in -50.0f64..50.0, y in -50.0f64..50.0, z in -50.0f64..50.0, a in -3.0f64..3.0, b in -1.5f64..1.5,
            long in 1u32..4,
        ) {
            let seconds = STEP * f64::from(long);
            let rate = DVec3::new(x, y, z) / f64::from(long);
            prop_assume!(rate.length() * seconds < 3.0);
            let begin = DQuat::from_rotation_y(a) * DQuat::from_rotation_x(b);
            // The entity's axes from forward, left, up.
            let about = DVec3::new(rate.y, rate.z, rate.x);
            let at = |t: f64| (DVec3::ZERO, begin * DQuat::from_scaled_axis(about * t));
            let found = ImuSensor::default().measure(&[0.0, seconds, 2.0 * seconds].map(at), seconds, quiet());
            // Quaternions round by some 4e-16, near half a turn by more, over seconds of at least 1/60.
            prop_assert!((found.angular_velocity - rate).length() < 1e-11, "{} for {rate}", found.angular_velocity);
        }
    }

    #[test]
    fn noise_has_the_variance_of_its_density_and_the_mean_of_its_bias() {
        let noise = ImuNoise {
            accelerometer_density: 0.02,
            gyroscope_density: 0.003,
            accelerometer_bias: [0.1, -0.2, 0.3],
            gyroscope_bias: [-0.01, 0.02, 0.0],
        };
        let sensor = ImuSensor { noise };
        let moments = [(DVec3::ZERO, DQuat::IDENTITY); 3];
        let count = 100_000;
        let (mut sums, mut squares) = ([DVec3::ZERO; 2], [DVec3::ZERO; 2]);
        for step in 0..count {
            let ImuReading { specific_force, angular_velocity } =
                sensor.measure(&moments, STEP, Noise::new(7, 3, step));
            for (i, value) in [specific_force - DVec3::Z * GRAVITY, angular_velocity].into_iter().enumerate() {
                sums[i] += value;
                squares[i] += value * value;
            }
        }
        let n = count as f64;
        for (i, (density, bias)) in [(0.02, noise.accelerometer_bias), (0.003, noise.gyroscope_bias)].iter().enumerate()
        {
            let variance: f64 = density * density * 60.0;
            let mean = sums[i] / n;
            let off = mean - DVec3::from_array(bias.map(f64::from));
            // Three deviations of a mean, and of a variance, whose own is σ² √(1.99/n); densities are 32-bit.
            assert!(off.abs().max_element() < 3.0 * (variance / n).sqrt(), "{i}: {off}");
            let spread = (squares[i] / n - mean * mean) / variance - 1.0;
            assert!(spread.abs().max_element() < 3.0 * (1.99 / n).sqrt() + 1e-6, "{i}: {spread}");
        }
        assert_ne!(
            sensor.measure(&moments, STEP, Noise::new(7, 3, 1)),
            sensor.measure(&moments, STEP, Noise::new(7, 4, 1))
        );
    }

    #[test]
    fn faults_are_named() {
        let noise = ImuNoise { gyroscope_density: -1.0, ..ImuNoise::default() };
        let told = |noise| check(&ImuSensor { noise }).expect_err("out of range").to_string();
        assert_eq!(told(noise), "noise.gyroscope_density: expected a number from 0 to 100, found -1");
        let noise = ImuNoise { accelerometer_bias: [0.0, f32::NAN, 0.0], ..ImuNoise::default() };
        assert_eq!(told(noise), "noise.accelerometer_bias[1]: expected a number from -100 to 100, found NaN");
        assert_eq!(check(&ImuSensor::default()), Ok(()));
    }
}
