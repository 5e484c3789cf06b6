//! A thousand steps of busy traffic, and the hash of the whole state after each: a ring of three lanes, a crossing with
//! signals, trailers, physical vehicles on sloping ground.
//!
//! `scripts/same-in-release` compares what a debug and a release build of this print.

use glam::{Quat, UVec2, Vec2, Vec3};
use std::f32::consts::TAU;
use systems::Simulation;
use systems::assets::{Library, shapes};
use systems::physics::Physical;
use systems::run::{registry, state_hash};
use systems::space::{Spin, Transform};
use systems::vehicles::ground::Ground;
use systems::vehicles::routes::{RoutePlan, Routes, Stop, Wait};
use systems::vehicles::signals::{Signal, Signals};
use systems::vehicles::types::Trailer;
use systems::vehicles::{Motion, OnRoute, RouteId, Vehicle, VehicleType, VehicleTypes};

/// A ring of three lanes, and within it a crossing: out along each arm, round, and back.
fn routes() -> (Vec<RoutePlan>, Signal) {
    let ring = (0..48).map(|k| k as f32 / 48.0 * TAU);
    let mut plans = vec![RoutePlan {
        points: ring.map(|a| (Vec3::new(a.sin(), 0.0, a.cos()) * 150.0).as_dvec3()).collect(),
        spline: true,
        closed: true,
        lanes: 3,
        ..RoutePlan::default()
    }];
    for arm in 0..4u16 {
        let turn = Quat::from_rotation_y(f32::from(arm) * TAU / 4.0);
        let line =
            |points: &[(f32, f32)]| points.iter().map(|&(x, z)| (turn * Vec3::new(x, 0.0, z)).as_dvec3()).collect();
        let (ahead, left) = (2 + 3 * arm, 3 + 3 * arm);
        let out = |arm: u16| RouteId(1 + 3 * (arm % 4));
        plans.push(RoutePlan {
            // From the crossing outward, round, and back to it.
            points: line(&[(-4.0, 20.0), (-4.0, 60.0), (-30.0, 100.0), (-12.0, 128.0), (4.0, 90.0), (4.0, 20.0)]),
            spline: true,
            stops: vec![Stop { at: 210.0, wait: Wait::Signal(u32::from(arm)), clear: 100.0 }],
            then: vec![RouteId(ahead), RouteId(left)],
            ..RoutePlan::default()
        });
        plans.push(RoutePlan {
            points: line(&[(4.0, 20.0), (4.0, -20.0)]),
            then: vec![out(arm + 2)],
            ..RoutePlan::default()
        });
        plans.push(RoutePlan {
            points: line(&[(4.0, 20.0), (4.0, 10.0), (0.0, -2.0), (-10.0, -4.0), (-20.0, -4.0)]),
            spline: true,
            then: vec![out(arm + 3)],
            ..RoutePlan::default()
        });
    }
    (plans, Signal { name: "crossing".into(), green: vec![6.0; 4], amber: 2.0, red: 1.0, offset: 0.0 })
}

fn main() {
    let mut simulation = Simulation::new();
    let world = &mut simulation.world;
    let (plans, signal) = routes();
    let routes = Routes::new(plans, false, 11);
    let mut types = world.resource_mut::<VehicleTypes>();
    let car = VehicleType::default();
    let truck = VehicleType {
        size: Vec3::new(2.5, 3.5, 6.0),
        trailer: Some(Trailer { hitch: 0.2, length: 7.0, end: 9.5 }),
        ..car.clone()
    };
    let kinds = [car, truck].map(|kind| types.add(kind));
    let ground = world.resource_mut::<Library>().add_mesh(shapes::plane(Vec2::splat(600.0), UVec2::splat(8)));
    world.spawn((ground, Ground, Transform::from_rotation(Quat::from_rotation_x(0.02))));
    world.spawn((Transform::default(), Spin { axis: Vec3::Y, rate: 1.0, start: Quat::IDENTITY }));
    let mut count = 0;
    for (id, route) in routes.iter().filter(|(_, route)| route.length > 100.0) {
        for lane in 0..route.lanes() {
            for place in 1..(route.length / 22.0) as u32 {
                let on = OnRoute::new(id, lane, place as f32 * 22.0 - 10.0);
                let at = routes.stand(&on);
                let speed = f64::from(count % 7);
                let kind = kinds[usize::from(count % 9 == 8)];
                let entity = world.spawn((Vehicle::of(kind), on, at)).id();
                world.entity_mut(entity).entry::<Motion>().and_modify(|mut motion| motion.speed = speed);
                if count % 10 == 3 {
                    world.entity_mut(entity).insert(Physical::default());
                }
                count += 1;
            }
        }
    }
    world.insert_resource(routes);
    world.insert_resource(Signals::new(vec![signal]));
    registry::register_all(world);
    for step in 1..=1000 {
        simulation.step();
        println!("{step} {}", state_hash::hash(&mut simulation.world));
    }
}
