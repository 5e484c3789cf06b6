//! What drivers and signals keep to, against what the rules say.

use bevy_ecs::prelude::*;
use glam::DVec3;
use systems::Simulation;
use systems::assets::MaterialId;
use systems::ecs::clock::Clock;
use systems::lights::Light;
use systems::vehicles::lane_changes::SAFE_BRAKING;
use systems::vehicles::routes::{RoutePlan, Routes};
use systems::vehicles::signals::{Aspect, Signal, SignalHead, SignalLamp, Signals};
use systems::vehicles::types::Driver;
use systems::vehicles::{Motion, OnRoute, RouteId, Vehicle, VehicleNumber, VehicleType, VehicleTypeId};

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
        let plan = RoutePlan { points: vec![DVec3::ZERO, DVec3::Z * 1000.0], lanes: 2, ..RoutePlan::default() };
        let mut simulation = Simulation::new();
        simulation.world.insert_resource(Routes::new(vec![plan], false, 0));
        let mut spawn = |number: u32, lane: u8, at: f32, speed: f32| {
            let vehicle =
                (Vehicle::of(VehicleTypeId::STAND_IN), VehicleNumber(number), OnRoute::new(RouteId(0), lane, at));
            let entity = simulation.world.spawn(vehicle).id();
            simulation.world.get_mut::<Motion>(entity).expect("one").speed = speed.into();
            entity
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
