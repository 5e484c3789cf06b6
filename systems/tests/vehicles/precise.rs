//! Nothing adds up wrongly: vehicles far from the origin, in steps from 0.1 ms to 1 s, kinematic and physical.

use super::*;

/// A straight road of 2 km that begins there, along +Z, for 10 m/s; in steps of so many seconds.
fn road(start: DVec3, step_seconds: f64, plan: RoutePlan) -> Simulation {
    let points = vec![start, start + DVec3::Z * 2000.0];
    let mut simulation = roads(vec![RoutePlan { points, speed_limit: 10.0, ..plan }]);
    simulation.world.resource_mut::<Clock>().step_seconds = step_seconds;
    simulation
}

fn run(simulation: &mut Simulation, seconds: f64) {
    let steps = (seconds / simulation.world.resource::<Clock>().step_seconds).round() as u64;
    (0..steps).for_each(|_| simulation.step());
}

/// Seconds of a run in steps so short: enough steps that 32 bits would have lost their way, few enough for a test.
fn seconds_for(step_seconds: f64) -> f64 {
    (step_seconds * 20_000.0).clamp(10.0, 100.0)
}

#[test]
fn a_kilometre_is_a_kilometre_wherever_and_however_short_or_long_the_steps() {
    for start in [DVec3::ZERO, DVec3::new(-14_000.3, 0.0, 17_900.7)] {
        for step_seconds in [1e-4, 1e-3, 1.0 / 60.0, 0.1, 1.0] {
            let mut simulation = road(start, step_seconds, RoutePlan::default());
            let entity = drive(&mut simulation, (CAR, on_road(10.0)), 10.0);
            let before = state::<Motion>(&simulation, entity).place;
            let seconds = seconds_for(step_seconds);
            run(&mut simulation, seconds);
            let (motion, on) = (state::<Motion>(&simulation, entity), state::<OnRoute>(&simulation, entity));
            // It drives as fast as it may, where the model's acceleration is 0: to 1 mm per km.
            let (driven, most) = (10.0 * seconds, 1e-6 * 10.0 * seconds);
            let way = motion.place - before;
            assert!((way - DVec3::Z * driven).length() < most, "{start} {step_seconds}: {way} for {driven}");
            assert!((motion.rolled - driven).abs() < most && (on.at - 10.0 - driven).abs() < most, "{motion:?} {on:?}");
            // What is drawn is the nearest that there is in 32 bits.
            assert_eq!(state::<Transform>(&simulation, entity).translation, motion.place.as_vec3());
        }
    }
}

#[test]
fn what_drives_by_hand_or_as_a_body_keeps_its_way_far_from_the_origin_in_short_steps() {
    // Straight on without friction of any kind. Of 10,000 sums each is off by 2⁻³⁹ m at the most, 18 km away: 2·10⁻⁸ m.
    let airless = Physical { drag: Some(0.0), ..Physical::default() };
    for (physical, step_seconds) in [(false, 1e-4), (false, 1e-3), (true, 1e-4), (true, 1e-3)] {
        let mut simulation = Simulation::new();
        simulation.world.resource_mut::<Clock>().step_seconds = step_seconds;
        let at = Transform::from_xyz(-14_000.0, 0.0, 17_900.0);
        let motion = Motion { speed: 10.0, ..Motion::default() };
        // The throttle that keeps the speed it has, but for what it takes not to roll out.
        let controls = Controls { throttle: 1e-6, ..Controls::default() };
        let entity = simulation.world.spawn((CAR, ManualControl, at, motion, controls)).id();
        if physical {
            simulation.world.entity_mut(entity).insert(airless);
        }
        let before = state::<Motion>(&simulation, entity);
        run(&mut simulation, 1.0);
        let after = state::<Motion>(&simulation, entity);
        let (way, rolled) = ((after.place - before.place).z, after.rolled - before.rolled);
        // A body that rocks on its springs goes up and down meanwhile, which is no way along the road.
        assert!((way - rolled).abs() < if physical { 1e-3 } else { 1e-7 }, "{physical} {step_seconds}: {way} {rolled}");
        assert!((way - 10.0).abs() < 0.05, "{physical} {step_seconds}: {way}");
    }
}

#[test]
fn a_body_in_steps_of_a_tenth_of_a_millisecond_stands_and_sets_off_as_it_should() {
    let mut simulation = Simulation::new();
    simulation.world.resource_mut::<Clock>().step_seconds = 1e-4;
    let controls = Controls { throttle: 1.0, ..Controls::default() };
    let entity = simulation.world.spawn((CAR, ManualControl, Physical::default(), controls)).id();
    run(&mut simulation, 1.0);
    // The throttle gives the type's acceleration, less with speed: v = V·(1 − exp(−a·t / V)) without air.
    let limits = VehicleType::default().limits;
    let (most, acceleration) = (f64::from(limits.speed), f64::from(limits.acceleration));
    let expected = most * (1.0 - (-acceleration / most).exp());
    let motion = state::<Motion>(&simulation, entity);
    assert!((motion.speed - expected).abs() < 0.05, "{} for {expected}", motion.speed);
    assert!(motion.place.y.abs() < 0.02, "{}", motion.place);
}

#[test]
fn where_somebody_writes_a_transform_the_place_follows() {
    let mut simulation = road(DVec3::ZERO, 1e-4, RoutePlan::default());
    let entity = drive(&mut simulation, (CAR, on_road(10.0)), 10.0);
    run(&mut simulation, 0.01);
    simulation.world.get_mut::<Transform>(entity).expect("one").translation.z += 5.0;
    let before = state::<Transform>(&simulation, entity).translation.z;
    run(&mut simulation, 0.01);
    let place = state::<Motion>(&simulation, entity).place;
    assert!((place.z - f64::from(before) - 0.1).abs() < 1e-6, "{place} after {before}");
}

/// Its front stands before the line: a driver who stops keeps about the gap of the model. A body on its springs rocks.
fn stands_before(line: f64, entity: Entity, simulation: &Simulation) {
    let kind = VehicleType::default();
    let (motion, on) = (state::<Motion>(simulation, entity), state::<OnRoute>(simulation, entity));
    let left = line - on.at - f64::from(kind.front());
    let gap = f64::from(Driver::default().gap);
    let rocks = simulation.world.get::<Physical>(entity).is_some();
    assert!(motion.speed.abs() <= if rocks { 1e-3 } else { 0.0 }, "{motion:?} {on:?}");
    assert!((0.5 * gap..2.0 * gap).contains(&left), "{left} m before the line");
}

#[test]
fn long_steps_do_not_run_over_stops_signals_and_each_other() {
    for physical in [false, true] {
        for step_seconds in [1.0 / 60.0, 0.25, 0.5, 1.0] {
            let stops = vec![Stop { at: 300.0, wait: Wait::Signal(0), clear: 0.0 }];
            let mut simulation = road(DVec3::ZERO, step_seconds, RoutePlan { stops, ..RoutePlan::default() });
            // Its other group is green for ever.
            let signal = Signal { name: "s".into(), green: vec![1.0, 1e6], amber: 1.0, red: 1.0, offset: 5.0 };
            simulation.world.insert_resource(Signals::new(vec![signal]));
            let first = drive(&mut simulation, (CAR, on_road(100.0)), 10.0);
            let second = drive(&mut simulation, (CAR, on_road(60.0)), 10.0);
            if physical {
                for entity in [first, second] {
                    simulation.world.entity_mut(entity).insert(Physical::default());
                }
            }
            run(&mut simulation, 60.0);
            stands_before(300.0, first, &simulation);
            let rear = state::<OnRoute>(&simulation, first).at - f64::from(VehicleType::default().rear());
            stands_before(rear, second, &simulation);
        }
    }
}

#[test]
fn nobody_is_put_across_a_gap() {
    let plan = |name: &str, from: DVec3, then: Vec<RouteId>| RoutePlan {
        name: name.into(),
        points: vec![from, from + DVec3::Z * 100.0],
        speed_limit: 10.0,
        then,
        ..RoutePlan::default()
    };
    let far = DVec3::X * 1000.0;
    // What follows begins far away; near enough to drive over; far, beside one that does not.
    for (then, follows) in [(vec![1], None), (vec![2], Some(2)), (vec![1, 2], Some(2))] {
        let then = then.into_iter().map(RouteId).collect();
        let near = DVec3::new(2.0, 0.0, 105.0);
        let plans = vec![plan("a", DVec3::ZERO, then), plan("b", far, vec![RouteId(1)]), plan("c", near, vec![])];
        let mut simulation = roads(plans);
        let entity = drive(&mut simulation, (CAR, on_road(10.0)), 10.0);
        let mut before = state::<Motion>(&simulation, entity).place;
        for _ in 0..60 * 15 {
            simulation.step();
            let now = state::<Motion>(&simulation, entity).place;
            assert!(before.distance(now) < 0.2, "{before} to {now}");
            before = now;
        }
        let on = state::<OnRoute>(&simulation, entity);
        match follows {
            Some(next) => assert_eq!(on.route, RouteId(next)),
            None => {
                assert_eq!(on.route, RouteId(0));
                stands_before(100.0, entity, &simulation);
            }
        }
    }
    // A route that follows itself says that it begins anew.
    let mut simulation = roads(vec![plan("a", DVec3::ZERO, vec![RouteId(0)])]);
    let entity = drive(&mut simulation, (CAR, on_road(90.0)), 10.0);
    run(&mut simulation, 2.0);
    let on = state::<OnRoute>(&simulation, entity);
    assert!((on.at - 10.0).abs() < 0.5, "{on:?}");
}
