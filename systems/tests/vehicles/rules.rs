//! Behaviour of drivers and signals, against the rules.

use super::*;
use systems::run::standard_inputs::SetSignal;
use systems::vehicles::lane_changes::SAFE_BRAKING;
use systems::vehicles::signals::{HeldSignals, SignalHead, SignalLamp};

#[test]
fn signals_go_through_their_phases() {
    let signal = Signal { name: "s".into(), green: vec![10.0, 5.0], amber: 3.0, red: 2.0, offset: 1.0 };
    assert_eq!(signal.cycle(), 25.0);
    // `offset` seconds on.
    let shows = |seconds: f64| [signal.aspect(0, seconds - 1.0), signal.aspect(1, seconds - 1.0)];
    assert_eq!(shows(0.0), [(Aspect::Green, 10.0), (Aspect::Red, 15.0)]);
    assert_eq!(shows(11.0), [(Aspect::Amber, 2.0), (Aspect::Red, 4.0)]);
    assert_eq!(shows(14.0), [(Aspect::Red, 11.0), (Aspect::Red, 1.0)]);
    assert_eq!(shows(16.0), [(Aspect::Red, 9.0), (Aspect::Green, 4.0)]);
    assert_eq!(shows(21.5), [(Aspect::Red, 3.5), (Aspect::Amber, 1.5)]);
    assert_eq!(shows(25.0 * 1e6)[0].0, Aspect::Green);
    let never = Signal { green: vec![], ..signal };
    assert_eq!(never.aspect(0, 5.0).0, Aspect::Red);
}

#[test]
fn heads_show_what_their_signal_does_over_a_whole_cycle() {
    let signal = Signal { name: "s".into(), green: vec![4.0, 2.5], amber: 1.5, red: 1.0, offset: 2.3 };
    let mut simulation = Simulation::new();
    simulation.world.insert_resource(Signals::new(vec![signal.clone()]));
    let (dark, lit) = (MaterialId::from_slot(1), MaterialId::from_slot(2));
    let world = &mut simulation.world;
    let head = |world: &mut World, group: u32| {
        let root = world.spawn(SignalHead { head: group, shown: None }).id();
        [Aspect::Red, Aspect::Amber, Aspect::Green].map(|aspect| {
            let glass = Some((dark, lit));
            // Not the head's own child: models hang their lamps below other nodes.
            let node = world.spawn(ChildOf(root)).id();
            let lamp = (SignalLamp { aspect, glass }, Light::point(1.0, 5.0), dark, ChildOf(node));
            (aspect, world.spawn(lamp).id())
        })
    };
    let heads = [head(world, 0), head(world, 1)];
    let mut shown = Vec::new();
    for _ in 0..(signal.cycle() * 60.0) as usize + 60 {
        simulation.step();
        let world = &simulation.world;
        let seconds = world.resource::<Clock>().seconds();
        for (group, lamps) in heads.iter().enumerate() {
            let wanted = signal.aspect(group, seconds).0;
            for &(aspect, lamp) in lamps {
                let (light, glass) = (world.get::<Light>(lamp).expect("one"), world.get::<MaterialId>(lamp));
                assert_eq!(light.enabled, aspect == wanted, "group {group}, {aspect:?} at {seconds} s");
                assert_eq!(glass, Some(if aspect == wanted { &lit } else { &dark }), "group {group} at {seconds} s");
            }
            shown.push((group, wanted));
        }
    }
    shown.sort_by_key(|(group, aspect)| (*group, *aspect as u8));
    shown.dedup();
    assert_eq!(shown.len(), 6, "each group showed each aspect");
}

#[test]
fn a_held_signal_shows_what_it_was_told_until_it_is_released() {
    let signal = |name: &str| Signal { name: name.into(), green: vec![2.0, 3.0], amber: 1.0, red: 1.0, offset: 0.0 };
    let mut simulation = Simulation::new();
    simulation.world.insert_resource(Signals::new(vec![signal("other"), signal("s")]));
    let head = simulation.world.spawn(SignalHead { head: 3, shown: None }).id();
    let lamp = (SignalLamp { aspect: Aspect::Green, glass: None }, Light::point(1.0, 5.0), ChildOf(head));
    let lamp = simulation.world.spawn(lamp).id();
    let set = |simulation: &mut Simulation, name: &str, shows: Option<&[Aspect]>| {
        let input = SetSignal { signal: name.into(), shows: shows.map(<[Aspect]>::to_vec) };
        simulation.world.resource_mut::<Inputs>().push(input);
        apply_queued(&mut simulation.world);
    };
    let heads = |simulation: &Simulation| simulation.world.resource::<Signals>().heads().to_vec();
    let held = |simulation: &Simulation| simulation.world.resource::<HeldSignals>().0.len();
    let by_time = |simulation: &Simulation| {
        let seconds = simulation.world.resource::<Clock>().seconds();
        [0, 1, 0, 1].map(|group| signal("s").aspect(group, seconds))
    };
    let seen = |simulation: &Simulation| simulation.world.get::<Light>(lamp).expect("one").enabled;

    let wanted = [Aspect::Amber, Aspect::Green];
    set(&mut simulation, "s", Some(&wanted));
    assert!(seen(&simulation), "pictures between steps show it, too");
    let mut lit = 0;
    for step in 0..600 {
        // Between steps too, and the other one goes on.
        let [first, second, ..] = by_time(&simulation);
        assert_eq!(heads(&simulation)[..2], [first, second], "step {step}");
        assert_eq!(heads(&simulation)[2..], wanted.map(|aspect| (aspect, f32::INFINITY)), "step {step}");
        simulation.step();
        lit += usize::from(seen(&simulation));
    }
    assert_eq!(lit, 600);
    // Neither of these is one of its.
    set(&mut simulation, "t", Some(&wanted));
    set(&mut simulation, "s", Some(&[Aspect::Red]));
    assert_eq!((heads(&simulation)[2].0, held(&simulation)), (Aspect::Amber, 1));
    // As a file could have it.
    simulation.world.resource_mut::<HeldSignals>().0.insert("other".into(), vec![Aspect::Red]);
    simulation.step();
    assert_eq!(heads(&simulation)[..2], by_time(&simulation)[..2]);
    simulation.world.resource_mut::<HeldSignals>().0.remove("other");
    set(&mut simulation, "s", None);
    assert_eq!(heads(&simulation), by_time(&simulation));
    assert_eq!(held(&simulation), 0);
    simulation.step();
    assert_eq!(heads(&simulation), by_time(&simulation));
}

/// Drivers keep to what a held signal shows, not to its times. At an amber that may last for ever they stop if they
/// can.
#[test]
fn drivers_keep_to_what_held_signals_show() {
    let line = 80.0;
    // By its times, the first group is green for the whole run, and the second never is.
    let passes = |group: u32, shows: Option<Aspect>, at: f32, speed: f64| {
        let stops = vec![Stop { at: line, wait: Wait::Signal(group), clear: 0.0 }];
        let mut simulation = roads(vec![RoutePlan { stops, ..straight(500.0) }]);
        simulation.world.insert_resource(Signals::new(vec![signal(&[1e6, 1.0])]));
        if let Some(shows) = shows {
            let input = SetSignal { signal: "s".into(), shows: Some(vec![shows; 2]) };
            simulation.world.resource_mut::<Inputs>().push(input);
        }
        let car = drive(&mut simulation, (CAR, VehicleNumber(0), on_road(at)), speed);
        // So short that none comes to the route's end.
        (0..60 * 15).for_each(|_| simulation.step());
        let at = simulation.world.get::<OnRoute>(car).expect("one").at as f32;
        at + VehicleType::default().front() > line
    };
    for (group, shows, expected) in [
        (0, None, true),
        (0, Some(Aspect::Red), false),
        (0, Some(Aspect::Amber), false),
        (0, Some(Aspect::Green), true),
        (1, None, false),
        (1, Some(Aspect::Red), false),
        (1, Some(Aspect::Amber), false),
        (1, Some(Aspect::Green), true),
    ] {
        assert_eq!(passes(group, shows, 0.0, 10.0), expected, "group {group}, {shows:?}");
    }
    // Two metres before the line nobody stops from 10 m/s.
    let close = line - 2.0 - VehicleType::default().front();
    assert!(passes(0, Some(Aspect::Amber), close, 10.0));
}

/// The gap at which a driver behind a leader brakes so hard: that where a·(s*/s)² is as much.
fn gap_of_braking(driver: &Driver, speed: f32, leader_speed: f32, braking: f32) -> f32 {
    let approach = speed * (speed - leader_speed) / (2.0 * (driver.acceleration * driver.braking).sqrt());
    let wanted = driver.gap + (speed * driver.headway + approach).max(0.0);
    wanted * (driver.acceleration / braking).sqrt()
}

#[test]
fn nobody_changes_lanes_where_the_one_behind_would_have_to_brake_harder_than_is_safe() {
    let kind = VehicleType::default();
    // Behind a slow one; whether it changes depends on what comes on the other lane.
    let changes = |speed: f32, behind_speed: f32, gap: f32| {
        let mut simulation = roads(vec![RoutePlan { lanes: 2, ..straight(1000.0) }]);
        let mut spawn = |number: u32, lane: u8, at: f32, speed: f32| {
            drive(&mut simulation, (CAR, VehicleNumber(number), OnRoute::new(RouteId(0), lane, at)), speed)
        };
        // Numbers decide who considers when: twice a second, this one in the first step.
        let entity = spawn(29, 0, 500.0, speed);
        spawn(1, 0, 500.0 + kind.size.z + 12.0, speed - 4.0);
        spawn(2, 1, 500.0 - kind.size.z - gap, behind_speed);
        simulation.step();
        simulation.world.get::<OnRoute>(entity).expect("one").change.is_some()
    };
    for (speed, behind_speed) in [(10.0, 10.0), (10.0, 14.0), (13.0, 15.0), (12.0, 11.0)] {
        let safe = gap_of_braking(&kind.driver, behind_speed, speed, SAFE_BRAKING);
        assert!(!changes(speed, behind_speed, safe - 0.02), "{behind_speed} m/s behind {speed} m/s, {safe} m");
        assert!(changes(speed, behind_speed, safe + 0.02), "{behind_speed} m/s behind {speed} m/s, {safe} m");
    }
}
