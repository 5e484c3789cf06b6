//! Times that poses are given for, and sources that fall silent.

use super::*;

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
