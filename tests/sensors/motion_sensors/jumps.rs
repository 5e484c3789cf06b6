//! A thing that was put elsewhere did not move there: no sensor measures a motion over that, however rarely it is due.

use super::{CAR, STEP, capture, gnss, imu, mount};
use crate::common::{self, prelude::*};
use glam::DQuat;
use relief::sense::{GnssCapture, ImuCapture};
use systems::run::standard_inputs::{MoveVehicle, SetTransform};
use systems::sensors::{Beam, Beams};
use systems::space::GeoOrigin;
use systems::vehicles::routes::{RoutePlan, Routes};
use systems::vehicles::{ManualControl, Motion, OnRoute, RouteId, StampedMotion};

const RATES: [u32; 4] = [1, 6, 25, 60];

fn swept(columns: u32) -> LidarSensor {
    let beams = Beams::List(vec![Beam::default()]);
    LidarSensor { beams, columns, sweep: true, ..LidarSensor::default() }
}

/// A car with sensors of all rates, and what captures them.
struct Drive {
    simulation: Simulation,
    car: Entity,
    suite: SensorSuite,
    /// Its place after each step.
    places: Vec<DVec3>,
}

impl Drive {
    /// `make`: the car.
    fn new(make: impl FnOnce(&mut Simulation) -> Entity) -> Option<Self> {
        let gpu = common::gpu()?;
        let mut simulation = Simulation::new();
        let car = make(&mut simulation);
        for every in RATES {
            let at = Transform::from_xyz(0.0, 1.0, 0.5);
            mount(&mut simulation, car, &format!("imu {every}"), imu().every(every), at);
            mount(&mut simulation, car, &format!("gnss {every}"), gnss().every(every), at);
            mount(&mut simulation, car, &format!("top {every}"), Sensor::lidar(swept(90)).every(every), at);
        }
        simulation.world.insert_resource(GeoOrigin::default());
        register_all(&mut simulation.world);
        Some(Self { simulation, car, suite: SensorSuite::new(&gpu), places: Vec::new() })
    }

    /// Captures, and compares what is said to be known with whether the car jumped. `jumps`: the steps in which it did.
    fn check(&mut self, jumps: &[usize]) {
        let step = self.places.len();
        self.places.push(self.simulation.world.get::<Motion>(self.car).expect("a car").place);
        let got = capture(&mut self.suite, &mut self.simulation);
        for every in RATES.map(|every| every as usize).into_iter().filter(|every| step.is_multiple_of(*every)) {
            let has_moved = |intervals: usize| {
                let since = step.checked_sub(intervals * every);
                since.is_some_and(|since| !jumps.iter().any(|jump| (since + 1..=step).contains(jump)))
            };
            let fix = *got[&*format!("car/gnss {every}")].reading::<GnssCapture>().expect("a receiver");
            assert_eq!(fix.has_velocity, has_moved(1), "every {every}, step {step}");
            if fix.has_velocity {
                let moved = self.places[step] - self.places[step - every];
                let (found, expected) = (fix.velocity.length(), moved.length() / (every as f64 * STEP));
                // What is on the car is turned in 32 bits, half a metre from its middle.
                assert!((found - expected).abs() < 1e-4, "every {every}, step {step}: {found} for {expected}");
            }
            let unit = got[&*format!("car/imu {every}")].reading::<ImuCapture>().expect("an IMU");
            assert_eq!(unit.valid, has_moved(2), "every {every}, step {step}");
            let scan = got[&*format!("car/top {every}")].lidar().expect("a lidar");
            assert_eq!(scan.is_before_known, has_moved(1), "every {every}, step {step}");
            let swept = scan.poses[0].translation.distance(scan.poses[1].translation);
            // Places that are drawn are of 32 bits, some tens of metres.
            let moved = if has_moved(1) { self.places[step].distance(self.places[step - every]) } else { 0.0 };
            assert!((swept - moved).abs() < 2e-5, "every {every}, step {step}: {swept} for {moved}");
        }
    }
}

#[test]
fn a_vehicle_that_begins_its_route_anew_has_jumped_for_sensors_of_every_rate() {
    let make = |simulation: &mut Simulation| {
        let plan = RoutePlan { points: vec![DVec3::ZERO, DVec3::Z * 40.0], ..RoutePlan::default() };
        simulation.world.insert_resource(Routes::new(vec![plan], false, 1));
        let motion = Motion { speed: 10.0, ..Motion::default() };
        simulation.world.spawn((CAR, Name::new("car"), OnRoute::new(RouteId(0), 0, 28.0), motion)).id()
    };
    let Some(mut drive) = Drive::new(make) else { return };
    let mut jumps = Vec::new();
    drive.check(&jumps);
    for step in 1..=300 {
        drive.simulation.step();
        let now = drive.simulation.world.get::<Motion>(drive.car).expect("a car").place;
        if now.z < drive.places[step - 1].z {
            jumps.push(step);
        }
        drive.check(&jumps);
    }
    assert!(!jumps.is_empty(), "it never began anew");
}

#[test]
fn a_vehicle_that_is_put_elsewhere_has_jumped_however_near_and_by_whom() {
    let make = |simulation: &mut Simulation| {
        let motion = Motion { speed: 3.0, ..Motion::default() };
        simulation.world.spawn((CAR, Name::new("car"), ManualControl, motion)).id()
    };
    let Some(mut drive) = Drive::new(make) else { return };
    let id = drive.simulation.world.resource::<EntityRegistry>().id(drive.car).expect("registered");
    drive.check(&[]);
    for step in 1..=260 {
        let mut at = *drive.simulation.world.get::<Transform>(drive.car).expect("placed");
        at.translation += Vec3::X * 0.25;
        if step == 70 {
            drive.simulation.world.resource_mut::<Inputs>().push(SetTransform { entity: id, transform: at });
        } else if step == 131 {
            // By a program.
            drive.simulation.world.entity_mut(drive.car).insert(at);
        }
        drive.simulation.step();
        drive.check(&[70, 131]);
    }
}

#[test]
fn a_vehicle_from_outside_moves_between_its_stamps_and_jumps_where_it_is_put() {
    let make = |simulation: &mut Simulation| simulation.world.spawn((CAR, Name::new("car"))).id();
    let Some(mut drive) = Drive::new(make) else { return };
    let vehicle = drive.simulation.world.resource::<EntityRegistry>().id(drive.car).expect("registered");
    drive.check(&[]);
    for step in 1..=260 {
        if step % 6 == 1 {
            // Straight on at 8 m/s. A first place far from where it stood, and another from step 133 on.
            let (stamp, yaw) = ((step - 1) as f64 * STEP, 0.3);
            let velocity = DQuat::from_rotation_y(yaw) * DVec3::Z * 8.0;
            let place = DVec3::X * if step < 130 { 50.0 } else { 62.0 } + velocity * stamp;
            let motion = StampedMotion { stamp, place, yaw, velocity, ..StampedMotion::default() };
            drive.simulation.world.resource_mut::<Inputs>().push(MoveVehicle { vehicle, motion });
        }
        drive.simulation.step();
        drive.check(&[1, 133]);
    }
}

#[test]
fn a_scan_is_of_the_time_of_its_first_column() {
    let Some(gpu) = common::gpu() else { return };
    let mut simulation = Simulation::new();
    let lidars = [("whole", 90, 6, 0), ("part", 90, 4, 0), ("odd", 1001, 1, 0), ("late", 997, 7, 3)];
    for (name, columns, every, phase) in lidars {
        let sensor = Sensor { phase, ..Sensor::lidar(swept(columns)).every(every) };
        simulation.world.spawn((sensor, Name::new(name), Transform::IDENTITY));
    }
    register_all(&mut simulation.world);
    let mut suite = SensorSuite::new(&gpu);
    let mut ends = [0u64; 4];
    for step in 0..=31u64 {
        let got = capture(&mut suite, &mut simulation);
        for ((name, columns, every, phase), end) in lidars.into_iter().zip(&mut ends) {
            let Some(scan) = got.get(name).map(|sensor| sensor.lidar().expect("a lidar")) else { continue };
            let begin = step.saturating_sub(every.into());
            // Column c fires at c / (10 · columns): the first that is not before the interval is the scan's.
            let first = (begin * 10 * u64::from(columns)).div_ceil(60);
            assert_eq!((scan.columns.first, step % u64::from(every)), (first, u64::from(phase)), "{name}, step {step}");
            if step == 0 {
                assert_eq!((scan.columns.count, scan.nanoseconds), (0, got.nanoseconds), "{name}");
                continue;
            }
            let expected = first as f64 * 1e8 / f64::from(columns);
            // Rounded to nanoseconds once; a double of some 1e9 is 1e-7.
            assert!((scan.nanoseconds as f64 - expected).abs() <= 0.5 + 1e-6, "{name}, step {step}");
            // One follows the other by a column, and nothing is measured later than the capture.
            let last = scan.nanoseconds as f64 + f64::from(*scan.scan.time.last().expect("columns")) * 1e9;
            // Times are floats, of up to 2⁻²⁷ s.
            assert!(last < got.nanoseconds as f64 + 8.0, "{name}, step {step}");
            assert!(scan.nanoseconds >= *end, "{name}, step {step}");
            *end = last as u64;
            assert_eq!(scan.is_before_known, step > u64::from(phase), "{name}, step {step}");
        }
        simulation.step();
        assert_eq!(simulation.world.resource::<Clock>().step, step + 1);
    }
}
