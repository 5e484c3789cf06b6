//! IMU, GNSS, collision and lane sensors against what is known of worlds that move, and their files.

mod collisions;
mod files;
mod jumps;

use crate::common::{self, prelude::*};
use relief::sense::{BarometerCapture, GnssCapture, ImuCapture};
use std::f64::consts::FRAC_PI_2;
use systems::physics::Physical;
use systems::run::snapshot;
use systems::sensors::{BarometerSensor, GnssSensor, ImuSensor, LaneReading, LaneSensor, SensorKind};
use systems::space::GRAVITY;
use systems::space::GeoOrigin;
use systems::space::origin::Origin;
use systems::space::wgs84::Geodetic;
use systems::vehicles::routes::{RoutePlan, Routes};
use systems::vehicles::{ManualControl, Motion, OnRoute, RouteId, VehicleTypeId};

const STEP: f64 = 1.0 / 60.0;
/// Radians: some roundings of quaternions of 32 bits, of 2⁻²³ each.
const TURN: f64 = 5e-7;
const CAR: Vehicle = Vehicle { kind: VehicleTypeId::STAND_IN, paint: 0 };

fn imu() -> Sensor {
    Sensor::new(SensorKind::Imu(ImuSensor::default()))
}

fn gnss() -> Sensor {
    Sensor::new(SensorKind::Gnss(GnssSensor::default()))
}

/// Puts a sensor on something, there and turned so.
fn mount(simulation: &mut Simulation, on: Entity, name: &str, sensor: Sensor, at: Transform) {
    simulation.world.spawn((sensor, Name::new(name.to_owned()), at, ChildOf(on)));
}

fn capture(suite: &mut SensorSuite, simulation: &mut Simulation) -> Capture {
    suite.capture(simulation).expect("captured")
}

/// A vehicle that a test moves by itself: on a circle about the origin, to the left.
struct Circle {
    simulation: Simulation,
    car: Entity,
    radius: f64,
    rate: f64,
}

impl Circle {
    fn new(radius: f64, rate: f64) -> Self {
        let mut simulation = Simulation::new();
        let car = simulation.world.spawn((CAR, Name::new("car"))).id();
        Self { simulation, car, radius, rate }
    }

    /// Place, metres, and yaw, radians, at a step.
    fn at(&self, step: u64) -> (DVec3, f64) {
        let yaw = self.rate * step as f64 * STEP;
        let (sin, cos) = yaw.sin_cos();
        (DVec3::new(-cos, 0.0, sin) * self.radius, yaw)
    }

    fn go(&mut self, step: u64) {
        let (place, yaw) = self.at(step);
        self.simulation.world.resource_mut::<Clock>().step = step;
        let transform = Transform::from_translation(place.as_vec3()).with_rotation(Quat::from_rotation_y(yaw as f32));
        self.simulation.world.entity_mut(self.car).insert((Motion { place, yaw, ..Motion::default() }, transform));
    }
}

#[test]
fn a_car_on_a_circle_has_the_force_and_the_rates_of_the_circle() {
    let Some(gpu) = common::gpu() else { return };
    let (radius, rate) = (30.0, 0.4);
    let mut circle = Circle::new(radius, rate);
    let car = circle.car;
    mount(&mut circle.simulation, car, "each", imu(), Transform::IDENTITY);
    mount(&mut circle.simulation, car, "third", imu().every(3), Transform::IDENTITY);
    // Turned to the left: what was to the left is ahead.
    let turned = Transform::from_xyz(0.5, 1.0, 2.0).with_rotation(Quat::from_rotation_y(FRAC_PI_2 as f32));
    mount(&mut circle.simulation, car, "turned", imu(), turned);
    mount(&mut circle.simulation, car, "mast", gnss().every(2), Transform::IDENTITY);
    let place = Geodetic { latitude_degrees: 48.0, longitude_degrees: 11.0, altitude: 500.0 };
    let origin = GeoOrigin { place, at: DVec3::new(5_300_000.0, 0.0, 700_000.0) };
    circle.simulation.world.insert_resource(origin);
    circle.simulation.world.insert_resource(Origin(origin.at));
    register_all(&mut circle.simulation.world);
    let mut suite = SensorSuite::new(&gpu);
    for step in 0..=12 {
        circle.go(step);
        let got = capture(&mut suite, &mut circle.simulation);
        for (name, every) in [("car/each", 1), ("car/third", 3), ("car/turned", 1)] {
            let Some(sensor) = got.get(name) else { continue };
            let found = sensor.reading::<ImuCapture>().expect("an IMU");
            assert_eq!(found.valid, step >= 2 * every, "{name} after {step}");
            if !found.valid {
                assert_eq!([found.specific_force, found.angular_velocity], [DVec3::ZERO; 2]);
                continue;
            }
            let seconds = every as f64 * STEP;
            assert_eq!(found.nanoseconds, ((step - every) as f64 * STEP * 1e9).round() as u64);
            let half = rate * seconds / 2.0;
            // What is 2 m ahead and 0.5 m to the left is carried about the centre, too.
            let arm = if name == "car/turned" { DVec2::new(radius - 0.5, 2.0) } else { DVec2::new(radius, 0.0) };
            let [to_left, back] = (arm * rate * rate * (half.sin() / half).powi(2)).to_array();
            let expected = if name == "car/turned" {
                DVec3::new(to_left, back, GRAVITY)
            } else {
                DVec3::new(-back, to_left, GRAVITY)
            };
            // Turns are some roundings of 32 bits off: the arm of 2.1 m by that, four times, over h²; the force itself.
            let room = TURN * (2.0 * GRAVITY + arm.y * 4.2 / (seconds * seconds)) + 1e-9;
            let off = found.specific_force - expected;
            assert!(off.length() < room, "{name} after {step}: {off}");
            let off = found.angular_velocity - DVec3::Z * rate;
            assert!(off.length() < 2.0 * TURN / seconds, "{name} after {step}: {off}");
        }
        let Some(fix) = got.get("car/mast") else { continue };
        let found = fix.reading::<GnssCapture>().expect("a receiver");
        assert_eq!((found.valid, found.has_velocity), (true, step >= 2), "{step}");
        let at = circle.at(step).0;
        let truth = origin.geodetic(origin.at + at);
        // Places on a map of 5,000 km have 1e-9 m, which is 1e-14 degrees.
        assert!((found.latitude - truth.latitude_degrees).abs() < 1e-12, "{found:?}");
        assert!((found.longitude - truth.longitude_degrees).abs() < 1e-12, "{found:?}");
        if step >= 2 {
            let mean = (at - circle.at(step - 2).0) / (2.0 * STEP);
            // East is Z and north is X; 30 m turn them by less than 1e-5.
            let expected = DVec3::new(mean.z, mean.x, 0.0);
            assert!((found.velocity - expected).length() < 1e-5 * mean.length() + 1e-6, "{found:?}");
        }
        // Asked again, all say the same.
        assert_eq!(capture(&mut suite, &mut circle.simulation), got);
    }
}

#[test]
fn what_was_measured_of_another_state_does_not_count_after_a_snapshot() {
    let Some(gpu) = common::gpu() else { return };
    let mut circle = Circle::new(30.0, 0.4);
    let car = circle.car;
    mount(&mut circle.simulation, car, "unit", imu(), Transform::IDENTITY);
    mount(&mut circle.simulation, car, "mast", gnss(), Transform::IDENTITY);
    register_all(&mut circle.simulation.world);
    circle.go(2);
    let saved = snapshot::save(&mut circle.simulation.world);
    let [mut kept, mut fresh] = [(); 2].map(|()| SensorSuite::new(&gpu));
    circle.radius = 31.0;
    for step in 0..=3 {
        circle.go(step);
        capture(&mut kept, &mut circle.simulation);
    }
    circle.radius = 30.0;
    snapshot::restore(&mut circle.simulation.world, &saved).expect("restored");
    for step in 2..=6 {
        if step > 2 {
            circle.go(step);
        }
        let [got, expected] = [&mut kept, &mut fresh].map(|suite| capture(suite, &mut circle.simulation));
        assert_eq!(got, expected, "step {step}");
        assert_eq!(got["car/unit"].reading::<ImuCapture>().expect("an IMU").valid, step >= 4);
    }
}

#[test]
fn a_physical_car_feels_its_fall_and_then_its_weight() {
    let Some(gpu) = common::gpu() else { return };
    let mut simulation = Simulation::new();
    let physical = Physical { drag: Some(0.001), ..Physical::default() };
    let car = simulation.world.spawn((CAR, Name::new("car"), physical, Transform::from_xyz(0.0, 6.0, 0.0))).id();
    mount(&mut simulation, car, "unit", imu(), Transform::IDENTITY);
    register_all(&mut simulation.world);
    let mut suite = SensorSuite::new(&gpu);
    let mut forces = Vec::new();
    for _ in 0..900 {
        simulation.step();
        let got = capture(&mut suite, &mut simulation);
        let found = *got["car/unit"].reading::<ImuCapture>().expect("an IMU");
        forces.extend(found.valid.then_some(found.specific_force));
    }
    // Half a second of fall, with 0.001 kg/m of air at up to 5 m/s: 2e-5 m/s².
    for force in &forces[..25] {
        assert!(force.length() < 1e-3, "{force}");
    }
    assert!(forces.iter().any(|force| force.z > 2.0 * GRAVITY), "it hits the ground");
    // At rest: springs are still to 1e-6 m in 15 s, and turns of 32 bits.
    let rest = forces[forces.len() - 1];
    assert!((rest - DVec3::Z * GRAVITY).length() < 1e-2, "{rest}");
}

#[test]
fn a_lane_sensor_says_where_it_is_mounted() {
    let Some(gpu) = common::gpu() else { return };
    let mut simulation = Simulation::new();
    let points = vec![DVec3::ZERO, DVec3::Z * 300.0];
    let plan = RoutePlan { points, lanes: 2, lane_width: 3.0, ..RoutePlan::default() };
    simulation.world.insert_resource(Routes::new(vec![plan], false, 1));
    let driven = simulation.world.spawn((CAR, Name::new("car"), OnRoute::new(RouteId(0), 0, 10.0))).id();
    let lane = || Sensor::new(SensorKind::Lane(LaneSensor::default()));
    let at = Transform::from_xyz(0.25, 0.0, 1.0).with_rotation(Quat::from_rotation_y(0.2));
    mount(&mut simulation, driven, "lane", lane(), at);
    // By hand, 4.5 m beside the left lane and backward; and far from everything.
    let back = Transform::from_xyz(6.0, 0.0, 100.0).with_rotation(Quat::from_rotation_y(3.0));
    let yaw = Motion { yaw: 3.0, ..Motion::default() };
    let still = simulation.world.spawn((CAR, Name::new("other"), ManualControl, back, yaw)).id();
    mount(&mut simulation, still, "lane", lane(), Transform::IDENTITY);
    simulation.world.spawn((lane(), Name::new("post"), Transform::from_xyz(40.0, 0.0, 0.0)));
    register_all(&mut simulation.world);
    let mut suite = SensorSuite::new(&gpu);
    for _ in 0..90 {
        simulation.step();
    }
    let got = capture(&mut suite, &mut simulation);
    let motion = *simulation.world.get::<Motion>(driven).expect("a vehicle");
    let found = got["car/lane"].reading::<LaneReading>().expect("a lane sensor");
    assert!(found.valid && motion.speed > 1.0);
    assert_eq!((found.route, found.lane, found.width, found.speed), (0, 0, 3.0, motion.speed));
    // The right lane is 1.5 m to the right, where it drives but for its steering's roundings; 32 bits of the mount.
    assert!((found.offset - 0.25).abs() < 1e-4, "{found:?}");
    assert!((found.heading_error - 0.2).abs() < 1e-4 && found.curvature == 0.0, "{found:?}");
    assert!((found.along - (motion.place.z + 1.0)).abs() < 1e-4, "{found:?}");
    let found = got["other/lane"].reading::<LaneReading>().expect("a lane sensor");
    assert!(found.valid && found.lane == 1 && found.speed == 0.0, "{found:?}");
    assert!((found.offset - 4.5).abs() < 1e-6 && (found.heading_error - 3.0).abs() < 2e-6, "{found:?}");
    assert_eq!(got["post"].reading::<LaneReading>(), Some(&Default::default()));
}

#[test]
fn a_barometer_measures_the_air_where_it_is_on_earth() {
    let mut simulation = Simulation::new();
    let sensor = || Sensor::new(SensorKind::Barometer(BarometerSensor::default()));
    let mut add = |name: &'static str, y: f32| {
        simulation.world.spawn((sensor(), Name::new(name), Transform::from_xyz(0.0, y, 0.0)));
    };
    add("low", 0.0);
    add("high", 10.0);
    register_all(&mut simulation.world);
    // No picture is asked for: no device is opened.
    let mut suite = SensorSuite::default();
    let mut pressures = |simulation: &mut Simulation| {
        let got = suite.capture(simulation).expect("captured");
        ["low", "high"].map(|name| got[name].reading::<BarometerCapture>().expect("a barometer").pressure)
    };
    let [low, high] = pressures(&mut simulation);
    assert_eq!(low, 101_325.0);
    // ρ g h is 1.2250 kg/m³ · 9.80665 m/s² · 10 m = 120.13 Pa; half of 10/8434 less, as the air thins on the way.
    assert!((low - high - 120.06).abs() < 0.02, "{high}");
    let place = Geodetic { latitude_degrees: 48.0, longitude_degrees: 11.0, altitude: 1000.0 };
    simulation.world.insert_resource(GeoOrigin { place, at: DVec3::ZERO });
    let [low, _] = pressures(&mut simulation);
    assert!((low - 89_876.0).abs() < 1.0, "{low}");
}
