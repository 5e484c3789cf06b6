//! The models that vehicles move by, against their closed forms.

use super::*;
use glam::DVec2;

#[test]
fn the_turning_circle_is_the_wheelbase_over_the_tangent_of_the_steering_angle() {
    for steering in [0.1f32, -0.3, 0.6] {
        let mut motion = Motion { steering, ..Motion::default() };
        let (mut at, wheelbase, mut points) = (DVec2::ZERO, 2.7, Vec::new());
        for _ in 0..2000 {
            at += steering::roll(&mut motion, wheelbase, None, 8.0, STEP);
            points.push(at);
        }
        let radius = f64::from(wheelbase / steering.tan());
        // The centre is to the left of the start, which looks along +Z.
        let center = DVec2::new(radius, 0.0);
        let worst = points.iter().map(|p| (p.distance(center) - radius.abs()).abs()).fold(0.0, f64::max);
        // A chord for an arc is t²/24 too long, t at most 0.034 in a step; the wheel's angle of 32 bits is 2⁻²⁴ off.
        assert!(worst < 0.01 * radius.abs(), "{steering}: {worst} of {radius}");
        assert!((motion.rolled - 2000.0 * 8.0 / 60.0).abs() < 1e-2);
    }
}

#[test]
fn a_trailer_follows_at_its_steady_angle() {
    // sin φ − h·κ·cos φ = −Lt·κ, for a hitch behind and one before the rear axle.
    for (hitch, length, steering) in [(-1.0f32, 4.0f32, 0.3f32), (0.4, 8.0, -0.2), (0.0, 6.0, 0.25)] {
        let (wheelbase, trailer) = (3.5f32, Trailer { hitch, length, end: length + 1.0 });
        let mut motion = Motion { steering, ..Motion::default() };
        (0..6000).for_each(|_| _ = steering::roll(&mut motion, wheelbase, Some(&trailer), 3.0, STEP));
        let curvature = f64::from(steering.tan() / wheelbase);
        let (hitch, length) = (f64::from(hitch), f64::from(length));
        let left = motion.hitch.sin() - hitch * curvature * motion.hitch.cos();
        // The steady angle is one that a step keeps. Roundings of 2⁻²⁴ add up, of which each step takes back 0.05 m / 8
        // m: 160.
        assert!((left + length * curvature).abs() < 1e-4, "{}: {left} {}", motion.hitch, -length * curvature);
        assert!(motion.hitch * f64::from(steering) < 0.0);
    }
}

#[test]
fn a_vehicle_driven_by_hand_turns_on_its_circle() {
    let mut simulation = Simulation::new();
    let entity = drive(&mut simulation, (CAR, ManualControl), 3.0);
    let kind = VehicleType::default();
    let steer = 0.5;
    let mut places = Vec::new();
    for _ in 0..2400 {
        let mut controls = simulation.world.get_mut::<Controls>(entity).expect("one");
        // So little that it only keeps rolling.
        *controls = Controls { throttle: 1e-6, steer, ..Controls::default() };
        simulation.step();
        places.push(state::<Transform>(&simulation, entity).translation);
    }
    let radius = kind.wheelbase / (steer * kind.limits.steering).tan();
    let recent = &places[places.len() - 1800..];
    let low = recent.iter().copied().reduce(Vec3::min).expect("some");
    let high = recent.iter().copied().reduce(Vec3::max).expect("some");
    // Places are 0.05 m apart: less than that is missed at either end.
    assert!(((high - low).x - 2.0 * radius).abs() < 0.05, "{} for {radius}", (high - low).x);
    assert!(high.x > 1.0, "it turned left");
}

#[test]
fn pedals_drive_brake_and_reverse() {
    let mut simulation = Simulation::new();
    let entity = simulation.world.spawn((CAR, ManualControl)).id();
    let mut press = |throttle: f32, brake: f32, count: usize| {
        *simulation.world.get_mut::<Controls>(entity).expect("one") =
            Controls { throttle, brake, ..Controls::default() };
        steps(&mut simulation, count);
        state::<Motion>(&simulation, entity)
    };
    assert!(press(1.0, 0.0, 120).speed > 5.0);
    let before = press(0.0, 0.0, 1).speed;
    assert!(press(0.0, 0.0, 60).speed < before - 0.15, "it rolls to a stop in the end");
    assert_eq!(press(0.0, 1.0, 60).speed, 0.0);
    let reversed = press(-1.0, 0.0, 240).speed;
    assert!((-6.0..-2.0).contains(&reversed), "{reversed}");
    assert!(press(f32::NAN, f32::NAN, 10).speed.is_finite());
}

#[test]
fn followers_settle_at_the_equilibrium_gap() {
    // Two on a ring so long that the second is free; the first may drive no faster than 12 m/s, the other wants 20.
    let limit = 20.0;
    let plan = RoutePlan { speed_limit: limit, ..ring(800.0, 1) };
    let mut simulation = roads(vec![plan]);
    let driver = Driver::default();
    let slow =
        VehicleType { name: "slow".into(), driver: Driver { speed_factor: 0.6, ..driver }, ..VehicleType::default() };
    let slow = simulation.world.resource_mut::<VehicleTypes>().add(slow);
    let spawn = |simulation: &mut Simulation, kind, at| simulation.world.spawn((Vehicle::of(kind), on_road(at))).id();
    let leader = spawn(&mut simulation, slow, 200.0);
    let follower = spawn(&mut simulation, VehicleTypeId::STAND_IN, 100.0);
    steps(&mut simulation, 60 * 120);
    let (ahead, behind) = (state::<OnRoute>(&simulation, leader).at, state::<OnRoute>(&simulation, follower).at);
    let length = f64::from(VehicleType::default().size.z);
    let gap = (ahead - behind).rem_euclid(simulation.world.resource::<Routes>().get(RouteId(0)).expect("one").length)
        - length;
    let speed = state::<Motion>(&simulation, follower).speed;
    assert!((speed - 12.0).abs() < 0.02, "{speed}");
    // Where the model's acceleration is 0: (s0 + v·T) / √(1 − (v/v0)^δ).
    let free = (12.0 / limit).powf(driver.exponent);
    let expected = f64::from((driver.gap + 12.0 * driver.headway) / (1.0 - free).sqrt());
    assert!((gap - expected).abs() < 0.1, "{gap} for {expected}");
}

#[test]
fn a_free_driver_accelerates_as_the_model_says() {
    let driver = Driver::default();
    let mut simulation = roads(vec![straight(5000.0)]);
    let entity = simulation.world.spawn((CAR, on_road(0.0))).id();
    let wanted = 50.0 / 3.6;
    let (mut speed, mut at) = (0.0f64, 0.0f64);
    for second in 1..=30 {
        steps(&mut simulation, 60);
        for _ in 0..1000 {
            let acceleration = f64::from(driver.acceleration) * (1.0 - (speed / wanted).powi(4));
            speed += acceleration * 1e-3;
            at += speed * 1e-3;
        }
        // Of Euler's method: what a step's acceleration is off decays as the speed does, so that it is never more than
        // half a step of the greatest; places are off by half a step of the speed, and by what the speed was off for 15
        // s.
        let motion = state::<Motion>(&simulation, entity);
        assert!((motion.speed - speed).abs() < 0.02, "{second} s: {} for {speed}", motion.speed);
        assert!((motion.rolled - at).abs() < 0.3, "{second} s: {} for {at}", motion.rolled);
    }
    assert!((speed - wanted).abs() < 0.1);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn who_meets_a_standing_obstacle_stops_behind_it(
        start in 0.0f32..100.0,
        speed in 0.0f32..20.0,
        // Shorter headways make the model swing about its gap: its damping ratio is T·√(a / 2·s0).
        (headway, gap, braking) in (1.0f32..2.5, 1.0f32..3.0, 1.0f32..4.0),
    ) {
        let plan = RoutePlan { speed_limit: 20.0, ..straight(400.0) };
        let mut simulation = roads(vec![plan]);
        let kind = VehicleType {
            name: "one".into(),
            driver: Driver { headway, gap, braking, ..Driver::default() },
            ..VehicleType::default()
        };
        let id = simulation.world.resource_mut::<VehicleTypes>().add(kind.clone());
        let entity = drive(&mut simulation, (Vehicle::of(id), on_road(start)), speed);
        // Across the lane, under manual control: 300 m ahead is its middle.
        let across = Transform::from_xyz(0.0, 0.0, 300.0).looking_to(Vec3::X, Vec3::Y);
        simulation.world.spawn((CAR, ManualControl, across));
        let mut hardest = 0.0f32;
        for _ in 0..60 * 90 {
            simulation.step();
            hardest = hardest.min(state::<Motion>(&simulation, entity).acceleration);
        }
        let front = state::<OnRoute>(&simulation, entity).at as f32 + kind.front();
        let left = 300.0 - 0.9 - front;
        prop_assert_eq!(state::<Motion>(&simulation, entity).speed, 0.0);
        prop_assert!((left - gap).abs() < 0.6, "{} m left, wanted {}", left, gap);
        prop_assert!(hardest > -2.0 * braking - 1.0, "it braked with {}", hardest);
    }
}

#[test]
fn pure_pursuit_keeps_to_a_circle() {
    let mut simulation = roads(vec![ring(30.0, 1)]);
    let entity = simulation.world.spawn((CAR, on_road(0.0))).id();
    // It starts on the circle, but with its wheels straight.
    steps(&mut simulation, 60 * 10);
    let mut worst = 0.0f32;
    for _ in 0..60 * 30 {
        simulation.step();
        let at = state::<Transform>(&simulation, entity).translation;
        worst = worst.max((at.length() - 30.0).abs());
    }
    let speed = state::<Motion>(&simulation, entity).speed;
    // The arc to a place on a circle is the circle. Its 48 points are 3.93 m apart: a chord between them is 0.064 m
    // inside.
    assert!(worst < 0.1, "{worst} m beside the line");
    // 2.5 m/s² sideways.
    assert!((speed - (30.0f64 * 2.5).sqrt()).abs() < 0.2, "{speed}");
}

#[test]
fn pitch_and_roll_are_those_of_an_inclined_plane() {
    // A plane that rises by 0.2 along +Z and by 0.1 along +X.
    let height = |x: f32, z: f32| 0.1 * x + 0.2 * z;
    let corner = |x: f32, z: f32| Vec3::new(x, height(x, z), z);
    let (a, b, c, d) = (corner(-99.0, -99.0), corner(99.0, -99.0), corner(99.0, 99.0), corner(-99.0, 99.0));
    let grounds = Grounds::new([[a, c, b], [a, d, c]]);
    let normal = Vec3::new(-0.1, 1.0, -0.2).normalize();
    for yaw in [0.0f32, 0.7, 1.6, 3.0, -2.0] {
        let at = Vec3::new(3.0, height(3.0, -4.0) - 0.3, -4.0);
        let (y, pitch, roll) = grounds.posture(at, yaw, 2.6, 1.5).expect("ground");
        // Roundings at 99 m, 4e-6 each.
        assert!((y - height(3.0, -4.0)).abs() < 1e-4, "{y}");
        let (sin, cos) = yaw.sin_cos();
        assert!((pitch.tan() - (0.1 * sin + 0.2 * cos)).abs() < 1e-4, "{pitch}");
        let up = steering::posture(yaw, pitch, roll) * Vec3::Y;
        assert!(up.distance(normal) < 1e-3, "{up} for {normal}");
    }
    assert_eq!(grounds.height(Vec3::new(0.0, -5.0, 0.0), 1.0), None, "below it");
    assert_eq!(grounds.height(Vec3::new(120.0, 50.0, 0.0), 1.0), None, "beside it");
    // A bridge above does not count for what is below.
    let flat = |y: f32| [Vec3::new(-9.0, y, -9.0), Vec3::new(0.0, y, 20.0), Vec3::new(9.0, y, -9.0)];
    let grounds = Grounds::new([flat(0.0), flat(6.0)]);
    assert_eq!(grounds.height(Vec3::new(0.0, 0.3, 0.0), 1.0), Some(0.0));
    assert_eq!(grounds.height(Vec3::new(0.0, 6.3, 0.0), 1.0), Some(6.0));
}
