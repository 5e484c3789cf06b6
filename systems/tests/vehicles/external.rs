//! Vehicles that something outside moves, at a rate of its own, against what is known of their ways.

use super::*;
use glam::DQuat;
use std::f64::consts::FRAC_PI_2;
use systems::run::inputs::{Input, SavedInput};
use systems::run::registry::{EntityRegistry, StateId, register_all};
use systems::run::standard_inputs::{Drive, MoveVehicle, ReleaseVehicle, SetManualControl, SetTransform};
use systems::run::state::StateList;
use systems::run::state_hash::{StateHash, hash};
use systems::sensors::ImuSensor;
use systems::sensors::philox::Noise;
use systems::space::{GRAVITY, Interpolated};
use systems::vehicles::external::STALE;
use systems::vehicles::traffic::Traffic;
use systems::vehicles::{MotionSource, StampedMotion};

/// A world with a vehicle that poses are given for.
struct Led {
    simulation: Simulation,
    car: Entity,
    id: StateId,
}

impl Led {
    fn new() -> Self {
        Self::of(Simulation::new(), Transform::IDENTITY)
    }

    fn of(mut simulation: Simulation, at: Transform) -> Self {
        let car = simulation.world.spawn((CAR, at)).id();
        register_all(&mut simulation.world);
        let id = simulation.world.resource::<EntityRegistry>().id(car).expect("registered");
        Self { simulation, car, id }
    }

    fn seconds(&self) -> f64 {
        self.simulation.world.resource::<Clock>().seconds()
    }

    fn give(&mut self, motion: StampedMotion) {
        self.push(MoveVehicle { vehicle: self.id, motion });
        apply_queued(&mut self.simulation.world);
    }

    /// Takes steps; every so many of them the way comes from outside as it is then.
    fn run(&mut self, every: u64, steps: u64, way: &dyn Fn(f64) -> StampedMotion, mut each: impl FnMut(&Self)) {
        for step in 0..steps {
            if step % every == 0 {
                self.give(StampedMotion { stamp: self.seconds(), ..way(self.seconds()) });
            }
            self.simulation.step();
            each(self);
        }
    }

    fn get<T: Component + Clone>(&self) -> T {
        state(&self.simulation, self.car)
    }

    /// An input of the next step.
    fn push(&mut self, input: impl Input) {
        self.simulation.world.resource_mut::<Inputs>().push(input);
    }

    fn motion(&self) -> Motion {
        self.get()
    }

    fn jumps(&self) -> u32 {
        self.get::<Interpolated>().jumps()
    }

    fn is_lit(&self, kind: LampKind) -> bool {
        self.get::<Switches>().level(kind) > 0.0
    }
}

/// Measurements of a quiet IMU at each step, from the third on.
#[derive(Default)]
struct Imu {
    poses: Vec<(DVec3, DQuat)>,
}

impl Imu {
    fn note(&mut self, led: &Led) {
        let motion = led.motion();
        self.poses.push((motion.place, DQuat::from_rotation_y(motion.yaw)));
    }

    /// Specific force (forward, left, up) and rate about up.
    fn readings(&self) -> impl Iterator<Item = (DVec3, f64)> {
        self.poses.windows(3).map(|poses| {
            let found = ImuSensor::default().measure(&[poses[0], poses[1], poses[2]], STEP, Noise::new(0, 0, 0));
            (found.specific_force, found.angular_velocity.z)
        })
    }
}

/// Along a line, with a speed and way of its own.
fn along(yaw: f64, way: f64, speed: f64) -> StampedMotion {
    let forward = DVec3::new(yaw.sin(), 0.0, yaw.cos());
    let start = DVec3::new(100.0, 0.0, 50.0);
    StampedMotion { place: start + forward * way, yaw, velocity: forward * speed, ..StampedMotion::default() }
}

/// Along a line, at 10 m/s.
fn steady(seconds: f64) -> StampedMotion {
    along(0.0, 10.0 * seconds, 10.0)
}

#[test]
fn a_straight_way_at_constant_speed_is_met_between_stamps_of_any_rate() {
    for every in [1, 3, 6, 7] {
        let (mut led, mut imu) = (Led::new(), Imu::default());
        let way = |seconds: f64| along(0.3, 10.0 * seconds, 10.0);
        led.run(every, 120, &way, |led| {
            let (motion, seconds) = (led.motion(), led.seconds());
            // Sums of 120 steps, each of which rounds places of up to 130 m by 2⁻⁴⁶.
            assert!(motion.place.distance(way(seconds).place) < 1e-10, "{every}: {motion:?}");
            assert!((motion.speed - 10.0).abs() < 1e-10 && motion.acceleration.abs() < 1e-6, "{every}: {motion:?}");
            // The wheels turn by the way.
            assert!((motion.rolled - 10.0 * seconds).abs() < 1e-10 && motion.steering == 0.0, "{every}: {motion:?}");
            imu.note(led);
        });
        for (force, rate) in imu.readings() {
            // Roundings of places, four times 2⁻⁴⁶ m times 3600.
            assert!((force - DVec3::Z * GRAVITY).length() < 1e-6 && rate.abs() < 1e-9, "{every}: {force} {rate}");
        }
        // Put to where it was given for the first time, and that alone.
        assert_eq!(led.jumps(), 1);
    }
}

#[test]
fn on_a_circle_it_has_the_steering_angle_the_rate_and_the_force_of_the_circle() {
    let (radius, rate) = (20.0, 0.4);
    for (every, way_round) in [(3, 1.0), (6, -1.0), (7, 1.0)] {
        let way = |seconds: f64| {
            let yaw = way_round * rate * seconds;
            let turn = DQuat::from_rotation_y(yaw);
            StampedMotion {
                place: turn * DVec3::new(-way_round * radius, 0.0, 0.0) + DVec3::X * 80.0,
                yaw: steering::yaw(turn.as_quat()),
                velocity: turn * DVec3::Z * rate * radius,
                yaw_rate: way_round * rate,
                ..StampedMotion::default()
            }
        };
        let (mut led, mut imu) = (Led::new(), Imu::default());
        led.run(every, 240, &way, |led| {
            let (motion, given) = (led.motion(), way(led.seconds()));
            // The heading that is given comes from a quaternion of 32 bits: 2⁻²³ each.
            assert!(motion.place.distance(given.place) < 1e-5 && (motion.speed - 8.0).abs() < 1e-5, "{motion:?}");
            imu.note(led);
        });
        for (force, found) in imu.readings() {
            // Chords: v²/r, less by (ωh/2)²/3.
            let half = 0.5 * rate * STEP;
            let to_left = way_round * rate * rate * radius * (half.sin() / half).powi(2);
            // Corrections of headings by 5e-7 rad within 3 steps: 6·5e-7 · 8 m/s / 0.05 s, and 5e-7/0.05 s · 1.5.
            assert!((force - DVec3::new(0.0, to_left, GRAVITY)).length() < 1e-3, "{every}: {force}");
            assert!((found - way_round * rate).abs() < 5e-5, "{every}: {found}");
        }
        let wheelbase = f64::from(VehicleType::default().wheelbase);
        let angle = (wheelbase / radius).atan() * way_round;
        assert!((f64::from(led.motion().steering) - angle).abs() < 1e-6, "{every}: {}", led.motion().steering);
    }
}

#[test]
fn braking_lights_its_lamps_and_ends_where_it_is_given_without_a_jump() {
    // 15 m/s until 1 s, then −3 m/s² until it stands at 6 s, 15 + 37.5 m on.
    let way = |seconds: f64| {
        let t = (seconds - 1.0).clamp(0.0, 5.0);
        along(0.0, 15.0 * seconds.min(1.0) + 15.0 * t - 1.5 * t * t, 15.0 - 3.0 * t)
    };
    let (mut led, mut imu) = (Led::new(), Imu::default());
    led.run(6, 480, &way, |led| {
        let (motion, seconds) = (led.motion(), led.seconds());
        let is_on = led.is_lit(LampKind::Brake);
        // A stamp after it began, at 1.1 s, it is known.
        assert_eq!(is_on, seconds > 1.1 + 0.5 * STEP, "{seconds}: {motion:?}");
        // From the second on that says so until it stands, it is as it is there; sums as above.
        if seconds > 1.3 && seconds < 6.0 {
            let given = way(seconds);
            assert!((motion.speed - given.velocity.z).abs() < 1e-6, "{seconds}: {motion:?} {given:?}");
            assert!(motion.place.distance(given.place) < 1e-6, "{seconds}: {motion:?} {given:?}");
            assert!((motion.acceleration + 3.0).abs() < 1e-5, "{seconds}: {motion:?}");
        }
        imu.note(led);
    });
    assert_eq!((led.motion().speed, led.jumps()), (0.0, 1));
    assert!(led.motion().place.distance(way(9.0).place) < 1e-6);
    let forces: Vec<f64> = imu.readings().map(|(force, _)| force.x).collect();
    // Reading i is of step i + 2: of the time in its middle, (i + 2)/60 s.
    assert!(forces[80..355].iter().all(|force| (force + 3.0).abs() < 1e-6), "{forces:?}");
    // Where it begins the way is 0.015 m and 0.3 m/s off: a cubic over 0.1 s has at most (6·0.015 + 4·0.03)/0.01.
    assert!(forces.iter().all(|force| force.abs() < 21.0 + 3.0), "{forces:?}");
}

#[test]
fn in_reverse_and_with_an_indicator_it_shows_so() {
    let mut led = Led::new();
    let controls = Controls { indicator: Indicator::Left, ..Controls::default() };
    led.push(Drive { vehicle: led.id, controls });
    let mut lit = [0; 3];
    let back = |seconds: f64| along(0.0, -2.0 * seconds, -2.0);
    led.run(6, 60, &back, |led| {
        let kinds = [LampKind::Reverse, LampKind::IndicatorLeft, LampKind::IndicatorRight];
        kinds.iter().zip(&mut lit).for_each(|(kind, lit)| *lit += u32::from(led.is_lit(*kind)));
    });
    // Indicators are on for half of the time, in thirds of a second.
    assert!(lit[0] == 60 && (20..=40).contains(&lit[1]) && lit[2] == 0, "{lit:?}");
    assert!((led.motion().speed + 2.0).abs() < 1e-9 && (led.motion().rolled + 2.0).abs() < 1e-9, "{:?}", led.motion());
}

#[test]
fn a_pose_beside_the_way_takes_over_within_an_interval_without_a_jump() {
    // 0.4 m to the left at 1 s, with the same velocity.
    let way = |seconds: f64| {
        let straight = along(0.0, 10.0 * seconds, 10.0);
        StampedMotion { place: straight.place + DVec3::X * if seconds < 0.99 { 0.0 } else { 0.4 }, ..straight }
    };
    let (mut led, mut places) = (Led::new(), Vec::new());
    led.run(6, 90, &way, |led| places.push(led.motion().place - way(0.0).place));
    assert_eq!(led.jumps(), 1);
    for pair in places.windows(2) {
        let step = pair[1] - pair[0];
        // The cubic's slope is 1.5 times 0.4 m / 0.1 s at most.
        assert!((step.z - 10.0 * STEP).abs() < 1e-9 && (-1e-12..=6.0 * STEP).contains(&step.x), "{step}");
    }
    // Place i is after step i + 1: 0.1 s after the stamp it is there.
    assert!(places[58].x < 1e-9 && places[60].x > 0.0 && (places[65].x - 0.4).abs() < 1e-9, "{places:?}");
}

#[test]
fn what_could_not_have_got_there_has_jumped() {
    for (off, jumps) in [(0.9, 1), (1.4, 1), (1.6, 2), (50.0, 2)] {
        // Half of what it drives in 0.1 s, and a metre: 1.5 m.
        let way = |seconds: f64| {
            let straight = along(0.0, 10.0 * seconds, 10.0);
            StampedMotion { place: straight.place + DVec3::X * if seconds < 0.99 { 0.0 } else { off }, ..straight }
        };
        let mut led = Led::new();
        led.run(6, 90, &way, |_| {});
        assert_eq!(led.jumps(), jumps, "{off}");
        assert!(led.motion().place.distance(way(1.5).place) < 1e-9);
    }
    // Put there by something else, it goes on from there, until a pose has it back.
    let mut led = Led::new();
    led.run(6, 60, &steady, |_| {});
    let transform = Transform::from_xyz(0.0, 0.0, 500.0).with_rotation(Quat::from_rotation_y(FRAC_PI_2 as f32));
    led.push(SetTransform { entity: led.id, transform });
    steps(&mut led.simulation, 2);
    // Headings of quaternions of 32 bits.
    assert!(led.motion().place.distance(DVec3::new(20.0 * STEP, 0.0, 500.0)) < 1e-6, "{:?}", led.motion());
    led.run(6, 6, &steady, |_| {});
    assert!(led.motion().place.distance(steady(led.seconds()).place) < 1e-9 && led.jumps() == 3);
}

#[test]
fn a_source_that_falls_silent_is_told_and_its_vehicle_brakes_to_a_standstill() {
    let mut led = Led::new();
    led.run(1000, 1, &steady, |_| {});
    let stale = |led: &Led| led.simulation.world.resource::<Traffic>().stale.clone();
    while led.seconds() < STALE - 1.5 * STEP {
        led.simulation.step();
    }
    assert_eq!((stale(&led), led.is_lit(LampKind::Brake)), (vec![], false));
    steps(&mut led.simulation, 600);
    assert_eq!(stale(&led), [led.car], "told once");
    assert_eq!(led.motion().speed, 0.0);
    // v·STALE + v²/2b. When it became stale is known to a step, in which the last one stops: 10 m/s · 2/60 s.
    let braking = f64::from(Driver::default().braking);
    let expected = 10.0 * STALE + 100.0 / (2.0 * braking);
    let driven = led.motion().place.z - steady(0.0).place.z;
    assert!((driven - expected).abs() < 20.0 * STEP, "{driven} for {expected}");
    // When the source is back, it is where that has it.
    led.run(6, 60, &steady, |_| {});
    assert!(led.motion().place.distance(steady(led.seconds()).place) < 1e-9);
    assert_eq!(stale(&led), [led.car]);
}

#[test]
fn stamps_that_are_no_newer_or_of_another_time_change_nothing() {
    let mut led = Led::new();
    led.run(6, 180, &steady, |_| {});
    let before = hash(&mut led.simulation.world);
    let last = led.seconds() - 0.1;
    for stamp in [last, last - 0.5, led.seconds() + STALE + 0.01, -1.0] {
        led.give(StampedMotion { stamp, ..steady(0.0) });
        assert_eq!(hash(&mut led.simulation.world), before, "{stamp}");
    }
    // Numbers that are none, or too large.
    let sound = StampedMotion { stamp: led.seconds(), ..steady(3.0) };
    for motion in [
        StampedMotion { place: DVec3::X * f64::NAN, ..sound },
        StampedMotion { place: DVec3::X * 1e8, ..sound },
        StampedMotion { velocity: DVec3::X * 1e4, ..sound },
        StampedMotion { yaw: f64::INFINITY, ..sound },
        StampedMotion { tilt: Some([0.0, f64::NAN]), ..sound },
        StampedMotion { yaw_rate: 1e3, ..sound },
        StampedMotion { stamp: f64::NAN, ..sound },
    ] {
        led.give(motion);
        assert_eq!(hash(&mut led.simulation.world), before, "{motion:?}");
    }
    led.give(sound);
    assert_ne!(hash(&mut led.simulation.world), before);
}

#[test]
fn stamps_ahead_and_behind_the_clock_are_of_their_times() {
    for late in [-0.3, 0.25] {
        let mut led = Led::new();
        for step in 0..60 {
            if step % 6 == 0 {
                let stamp = led.seconds() - late;
                led.give(StampedMotion { stamp, ..steady(stamp) });
            }
            led.simulation.step();
            assert!(led.motion().place.distance(steady(led.seconds()).place) < 1e-9, "{late} after {step}");
        }
    }
}

#[test]
fn it_stands_on_the_ground_or_as_it_is_given() {
    // Rises by 0.1 along +X.
    let corner = |x: f32, z: f32| Vec3::new(x, 0.1 * x, z);
    let slope = [[corner(-500.0, -500.0), corner(500.0, -500.0), corner(0.0, 900.0)]];
    let mut simulation = Simulation::new();
    simulation.world.insert_resource(Grounds::new(slope));
    let mut led = Led::of(simulation, Transform::IDENTITY);
    // The height is that of the ground where it begins, and counts no more then.
    let way = |seconds: f64| {
        let level = along(FRAC_PI_2, 10.0 * seconds, 10.0);
        StampedMotion { place: level.place.with_y(10.5), ..level }
    };
    led.run(6, 60, &way, |_| {});
    let (motion, at) = (led.motion(), led.get::<Transform>());
    // Heights of triangles a kilometre long are of 32 bits, 1e-4 m; angles of that over the wheelbase.
    assert!((motion.place.y - 0.1 * motion.place.x).abs() < 1e-3, "{motion:?}");
    let forward = at.rotation * Vec3::Z;
    assert!((forward.y / forward.x - 0.1).abs() < 1e-3, "{forward}");
    assert_eq!(at.translation, motion.place.as_vec3());
    let given = |seconds: f64| {
        let place = way(seconds).place.with_y(25.0 + seconds);
        StampedMotion { place, velocity: DVec3::new(10.0, 1.0, 0.0), tilt: Some([0.1, -0.2]), ..way(seconds) }
    };
    led.run(6, 60, &given, |_| {});
    let at = led.get::<Transform>();
    let expected = steering::posture(FRAC_PI_2 as f32, 0.1, -0.2);
    assert!(at.rotation.abs_diff_eq(expected, 1e-6), "{at:?}");
    assert!(led.motion().place.distance(given(led.seconds()).place) < 1e-9, "{:?}", led.motion());
}

#[test]
fn a_follower_keeps_its_gap_and_stops_behind_it() {
    let limit = 20.0;
    let points = vec![DVec3::new(100.0, 0.0, 0.0), DVec3::new(100.0, 0.0, 4000.0)];
    let mut simulation = roads(vec![RoutePlan { points, speed_limit: limit, ..RoutePlan::default() }]);
    let follower = simulation.world.spawn((CAR, on_road(10.0))).id();
    let mut led = Led::of(simulation, Transform::from_xyz(0.0, 0.0, -100.0));
    // 10 m/s for two minutes, then −2 m/s² for 5 s.
    let way = |seconds: f64| {
        let t = (seconds - 120.0).clamp(0.0, 5.0);
        along(0.0, 10.0 * seconds.min(120.0) + 10.0 * t - t * t, 10.0 - 2.0 * t)
    };
    let length = f64::from(VehicleType::default().size.z);
    let follows = |led: &Led| {
        let motion = *led.simulation.world.get::<Motion>(follower).expect("one");
        (motion.speed, led.motion().place.z - motion.place.z - length)
    };
    let mut since = 0.0;
    led.run(6, 60 * 120, &way, |led| since = led.seconds());
    let (speed, gap) = follows(&led);
    let driver = Driver::default();
    // Where the model's acceleration is 0: (s0 + v·T) / √(1 − (v/v0)^δ).
    let expected = (driver.gap + 10.0 * driver.headway) / (1.0 - (10.0 / limit).powf(driver.exponent)).sqrt();
    // As between two on routes.
    assert!((speed - 10.0).abs() < 0.02 && (gap - f64::from(expected)).abs() < 0.1, "{speed} {gap} for {expected}");
    assert!(since > 119.9);
    for _ in 0..60 * 30 {
        let stamp = led.seconds();
        led.give(StampedMotion { stamp, ..way(stamp) });
        led.simulation.step();
        assert!(follows(&led).1 > 0.5, "{:?}", follows(&led));
    }
    // It stands within about the gap of the model.
    let (speed, gap) = follows(&led);
    assert!(speed == 0.0 && (1.0..4.0).contains(&gap), "{speed} {gap}");
}

#[test]
fn what_moves_it_is_known_and_it_is_given_back() {
    let mut led = Led::of(roads(vec![straight(2000.0)]), Transform::from_xyz(0.0, 0.0, 10.0));
    let source = |led: &Led| MotionSource::of(&led.simulation.world, led.car);
    assert_eq!(source(&led), MotionSource::Manual);
    led.simulation.world.entity_mut(led.car).insert(on_road(10.0));
    assert_eq!(source(&led), MotionSource::Route);
    let way =
        |seconds: f64| StampedMotion { place: DVec3::new(0.0, 0.0, 300.0 + 8.0 * seconds), ..along(0.0, 0.0, 8.0) };
    led.run(6, 30, &way, |_| {});
    assert_eq!(source(&led), MotionSource::External);
    for manual in [true, false] {
        led.push(SetManualControl { vehicle: led.id, manual });
    }
    led.simulation.step();
    assert_eq!(source(&led), MotionSource::External);
    led.push(ReleaseVehicle(led.id));
    led.simulation.step();
    assert_eq!(source(&led), MotionSource::Route);
    let (on, motion) = (led.get::<OnRoute>(), led.motion());
    // It goes on from where it is; the route's numbers are of 32 bits in parts.
    assert!((on.at - motion.place.z).abs() < 1e-3 && motion.speed > 7.9, "{on:?} {motion:?}");
    steps(&mut led.simulation, 120);
    assert!(led.motion().place.z > 310.0 && led.jumps() == 1);
}

#[test]
fn a_physical_vehicle_is_no_body_meanwhile_and_bodies_are_pushed_by_it() {
    let mut led = Led::new();
    led.simulation.world.entity_mut(led.car).insert(Physical::default());
    let in_the_way = Transform::from_xyz(100.0, 0.0, 62.0);
    let pushed = led.simulation.world.spawn((CAR, Physical::default(), in_the_way)).id();
    led.simulation.step();
    let bodies = |led: &Led| led.simulation.world.resource::<Physics>().len();
    assert_eq!(bodies(&led), 2);
    let way = |seconds: f64| along(0.0, 5.0 * seconds, 5.0);
    led.run(6, 180, &way, |led| assert_eq!(bodies(led), 1));
    assert!(led.motion().place.distance(way(led.seconds()).place) < 1e-9);
    let place = led.simulation.world.get::<Motion>(pushed).expect("one").place;
    let length = f64::from(VehicleType::default().size.z);
    // Rapier lets them sink into each other by some millimetres.
    assert!(place.z > led.motion().place.z + length - 0.05, "{place}");
    led.push(ReleaseVehicle(led.id));
    led.simulation.step();
    assert_eq!(bodies(&led), 2);
    assert!((led.motion().speed - 5.0).abs() < 0.5, "{:?}", led.motion());
}

/// Vehicles from outside among others, physical and on a ring, spawned in an order of tables.
fn busy(is_swapped: bool) -> Simulation {
    let mut simulation = roads(vec![ring(60.0, 1)]);
    let world = &mut simulation.world;
    if is_swapped {
        // Other tables come first.
        let others =
            [world.spawn((CAR, on_road(0.0), Physical::default())).id(), world.spawn((CAR, on_road(0.0))).id()];
        others.into_iter().for_each(|vehicle| _ = world.despawn(vehicle));
        world.insert_resource(systems::vehicles::NextVehicleNumber(0));
    }
    for i in 0..6 {
        let mut vehicle = world.spawn((CAR, on_road(f64::from(i) * 50.0)));
        if i % 3 == 1 {
            vehicle.insert(Physical::default());
        }
    }
    register_all(world);
    simulation
}

/// Inputs after a step: two are led along the ring, the second for a while.
fn inputs_at(simulation: &Simulation) -> Vec<SavedInput> {
    let (step, stamp) = (simulation.world.resource::<Clock>().step, simulation.world.resource::<Clock>().seconds());
    let vehicles: Vec<StateId> = {
        let registry = simulation.world.resource::<EntityRegistry>();
        let is_vehicle = |entity: &Entity| simulation.world.get::<Vehicle>(*entity).is_some();
        registry.iter().filter(|(_, entity)| is_vehicle(entity)).map(|(id, _)| id).collect()
    };
    let mut inputs = Vec::new();
    for (i, every, until) in [(2, 6, u64::MAX), (4, 5, 150)] {
        if step % every == 0 && step < until {
            let (yaw, rate) = (FRAC_PI_2 + 0.1 * stamp + 0.6 * i as f64, 0.1);
            let turn = DQuat::from_rotation_y(yaw);
            let place = turn * DVec3::NEG_X * 60.0 + DVec3::X * 0.1 * (stamp * 7.0).sin();
            let velocity = turn * DVec3::Z * 6.0;
            let motion = StampedMotion { stamp, place, yaw, tilt: None, velocity, yaw_rate: rate };
            inputs.push(SavedInput::of(&MoveVehicle { vehicle: vehicles[i], motion }));
        }
    }
    if step == 230 {
        inputs.push(SavedInput::of(&ReleaseVehicle(vehicles[4])));
    }
    inputs
}

fn step(simulation: &mut Simulation, inputs: Vec<SavedInput>) -> StateHash {
    inputs.into_iter().for_each(|input| simulation.world.resource_mut::<Inputs>().push_saved(input));
    simulation.step();
    state_hash::hash(&mut simulation.world)
}

#[test]
fn a_run_is_the_same_again_from_its_inputs_from_a_snapshot_and_in_another_order_of_tables() {
    let mut whole = busy(false);
    let (mut hashes, mut recorded, mut saved) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..300 {
        if i == 100 {
            saved = snapshot::save(&mut whole.world);
        }
        let inputs = inputs_at(&whole);
        hashes.push(step(&mut whole, inputs.clone()));
        recorded.push(inputs);
    }
    assert!(hashes.windows(2).all(|pair| pair[0] != pair[1]));
    for is_swapped in [false, true] {
        let mut again = busy(is_swapped);
        for (i, inputs) in recorded.iter().enumerate() {
            assert_eq!(step(&mut again, inputs.clone()), hashes[i], "step {i}");
        }
        // Back from the end, and from the beginning.
        for mut other in [again, busy(is_swapped)] {
            snapshot::restore(&mut other.world, &saved).expect("of this scene");
            assert_eq!(snapshot::save(&mut other.world), saved);
            for (i, inputs) in recorded.iter().enumerate().skip(100) {
                assert_eq!(step(&mut other, inputs.clone()), hashes[i], "step {i}");
            }
        }
    }
}

#[test]
fn files_without_such_vehicles_are_as_they_were_before_there_were_any() {
    let has_it = |bytes: &[u8]| bytes.windows(8).any(|part| part == b"external");
    let mut led = Led::new();
    let before = snapshot::save(&mut led.simulation.world);
    assert!(!has_it(&before));
    assert!(!StateList::standard().names().any(|name| name == "external"));
    led.run(6, 6, &steady, |_| {});
    let led_on = snapshot::save(&mut led.simulation.world);
    assert!(has_it(&led_on));
    let list = StateList::standard();
    let names: Vec<&str> = list.names().collect();
    let difference = |more: &[&str]| list.difference(names.iter().chain(more).copied());
    assert_eq!((difference(&[]), difference(&["external"])), (None, None));
    let twice = difference(&["external"; 2]);
    assert_eq!(twice.as_deref(), Some("duplicate state \"external\""));
    // Without it nothing from outside moves it any more.
    snapshot::restore(&mut led.simulation.world, &before).expect("of this scene");
    assert_eq!(MotionSource::of(&led.simulation.world, led.car), MotionSource::Manual);
    snapshot::restore(&mut led.simulation.world, &led_on).expect("of this scene");
    assert_eq!(MotionSource::of(&led.simulation.world, led.car), MotionSource::External);
}

/// Angle by which it is turned from level and straight ahead.
fn leaning_by(led: &Led) -> f32 {
    2.0 * led.get::<Transform>().rotation.xyz().length().asin()
}

#[test]
fn a_roll_of_nearly_a_whole_turn_is_a_small_one() {
    let mut led = Led::new();
    let whole = 2.0 * std::f64::consts::PI;
    let leaning = |_| StampedMotion { tilt: Some([0.0, whole - 0.08]), ..along(0.0, 0.0, 0.0) };
    // Single floats turn a unit vector by 6e-8.
    led.run(6, 60, &leaning, |led| assert!((leaning_by(led) - 0.08).abs() < 1e-6, "{}", leaning_by(led)));
}

#[test]
fn coming_down_to_the_ground_is_a_jump_by_a_pose_and_by_release() {
    let high = |_| StampedMotion { place: DVec3::Y * 25.0, tilt: Some([0.0; 2]), ..along(0.0, 0.0, 0.0) };
    let ground = |_| along(0.0, 0.0, 0.0);
    for lands in [true, false] {
        let mut led = Led::new();
        led.run(6, 30, &high, |_| {});
        let before = led.jumps();
        assert!(led.motion().place.y > 24.0);
        if lands {
            led.run(6, 1, &ground, |_| {});
        } else {
            led.push(ReleaseVehicle(led.id));
            apply_queued(&mut led.simulation.world);
            led.simulation.step();
        }
        // Released, it stands until it drives.
        assert!(led.jumps() > before && (!lands || led.motion().place.y < 1.0), "{lands}: {:?}", led.motion().place);
    }
}

#[test]
fn stamps_ahead_of_the_clock_are_led_back_by_no_more_than_an_interval() {
    let mut led = Led::new();
    led.run(6, 6, &|_| along(0.0, 0.0, 0.0), |_| {});
    for (ahead, yaw_rate) in [(0.5, 0.1), (0.505, 0.15)] {
        let stamp = led.seconds() + ahead;
        led.give(StampedMotion { stamp, yaw_rate, ..along(0.0, 0.0, 0.0) });
    }
    // Back by half a second at no more than 0.15 rad/s, and forward again.
    for _ in 0..30 {
        led.simulation.step();
        assert!(led.motion().yaw.abs() < 0.15 * 0.51, "{}", led.motion().yaw);
    }
}

#[test]
fn stamps_next_to_each_other_make_no_infinity() {
    let mut led = Led::new();
    for (stamp, yaw_rate) in [(0.0, 0.0), (f64::from_bits(1), 1.0)] {
        led.give(StampedMotion { stamp, yaw_rate, ..along(0.0, 0.0, 3.0) });
    }
    steps(&mut led.simulation, 10);
    assert!(led.motion().yaw.is_finite() && led.motion().speed > 2.0, "{:?}", led.motion());
    let saved = snapshot::save(&mut led.simulation.world);
    snapshot::restore(&mut led.simulation.world, &saved).expect("a state that can be kept");
}

#[test]
fn pedals_of_before_light_no_brake_lamps() {
    let mut led = Led::new();
    let controls = Controls { brake: 1.0, ..Controls::default() };
    led.push(Drive { vehicle: led.id, controls });
    apply_queued(&mut led.simulation.world);
    led.run(6, 12, &|seconds| along(0.0, 5.0 * seconds, 5.0), |_| {});
    assert!(!led.is_lit(LampKind::Brake) && led.get::<Controls>().brake == 0.0);
}
