//! Such vehicles among others, on roads and as bodies, and in runs that are had again.

use super::*;

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
