//! Vehicles that something outside moves, at a rate of its own, against what is known of their ways.

mod others;
mod stamps;

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
fn pedals_of_before_light_no_brake_lamps() {
    let mut led = Led::new();
    let controls = Controls { brake: 1.0, ..Controls::default() };
    led.push(Drive { vehicle: led.id, controls });
    apply_queued(&mut led.simulation.world);
    led.run(6, 12, &|seconds| along(0.0, 5.0 * seconds, 5.0), |_| {});
    assert!(!led.is_lit(LampKind::Brake) && led.get::<Controls>().brake == 0.0);
}
