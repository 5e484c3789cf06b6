//! Collision sensors, with boxes and meshes whose places are known.

use super::{CAR, capture, mount};
use crate::common::{self, prelude::*};
use systems::physics::{Obstacle, Physical};
use systems::sensors::collision::Collision;
use systems::sensors::{CollisionSensor, SensorKind};
use systems::vehicles::{ManualControl, Motion};

fn collision() -> Sensor {
    Sensor::new(SensorKind::Collision(CollisionSensor::default()))
}

/// A world with a car at the origin that has a collision sensor, and another 4.15 m ahead, of 4.4 m.
fn two_cars() -> (Simulation, Entity) {
    let mut simulation = Simulation::new();
    let motion = Motion { speed: 5.0, ..Motion::default() };
    let own = simulation.world.spawn((CAR, Name::new("own"), motion)).id();
    let ahead = DVec3::Z * 4.15;
    let at = Transform::from_translation(ahead.as_vec3());
    let other = simulation.world.spawn((CAR, at, Motion { place: ahead, speed: 2.0, ..Motion::default() })).id();
    mount(&mut simulation, own, "touch", collision(), Transform::from_xyz(0.0, 0.5, 3.0));
    (simulation, other)
}

fn cube(simulation: &mut Simulation, size: Vec3, at: Vec3, obstacle: Obstacle) -> Entity {
    let mesh: MeshId = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(size));
    simulation.world.spawn((mesh, Transform::from_translation(at), obstacle)).id()
}

fn touched(suite: &mut SensorSuite, simulation: &mut Simulation) -> Vec<Collision> {
    let got = capture(suite, simulation);
    got["own/touch"].records::<Collision>().expect("a collision sensor").to_vec()
}

#[test]
fn boxes_that_overlap_are_collisions_by_depth_way_and_speed() {
    let Some(gpu) = common::gpu() else { return };
    let (mut simulation, other) = two_cars();
    // 1.8 m wide: 0.1 m of a post to the left, by a box; a kerb that is driven over; a room whose walls are elsewhere.
    let post = cube(&mut simulation, Vec3::splat(1.0), Vec3::new(1.3, 0.5, 1.0), Obstacle::Box);
    cube(&mut simulation, Vec3::new(1.0, 0.1, 1.0), Vec3::new(0.0, 0.05, 1.0), Obstacle::Box);
    let room = cube(&mut simulation, Vec3::splat(30.0), Vec3::new(0.0, 15.0, 0.0), Obstacle::Mesh);
    register_all(&mut simulation.world);
    let number = |simulation: &Simulation, entity| {
        simulation.world.resource::<EntityRegistry>().id(entity).map_or(0, |id| id.0 + 1)
    };
    let mut suite = SensorSuite::new(&gpu);
    let found = touched(&mut suite, &mut simulation);
    let numbers: Vec<u32> = found.iter().map(|collision| collision.instance).collect();
    assert_eq!(numbers, [number(&simulation, other), number(&simulation, post)], "{found:?}");
    let near = |found: f64, expected: f64| (found - expected).abs() < 1e-6;
    // Types have their sizes in 32 bits.
    assert!(near(found[0].depth, 0.25) && near(found[0].speed, 3.0), "{found:?}");
    assert!(found[0].normal.abs_diff_eq(DVec3::NEG_X, 1e-12), "{found:?}");
    assert!(near(found[1].depth, 0.1) && near(found[1].speed, 0.0), "{found:?}");
    // The post is to the left.
    assert!(found[1].normal.abs_diff_eq(DVec3::NEG_Y, 1e-12), "{found:?}");
    // As a box, the room is where the car is.
    simulation.world.entity_mut(room).insert(Obstacle::Box);
    assert_eq!(touched(&mut suite, &mut simulation).len(), 3);
    // Its wall is touched where it is: the front at 3.5 m, the wall 0.1 m in it.
    simulation.world.entity_mut(room).insert((Obstacle::Mesh, Transform::from_xyz(0.0, 15.0, -11.6)));
    simulation.world.despawn(other);
    let found = touched(&mut suite, &mut simulation);
    assert_eq!(found.len(), 2, "{found:?}");
    let wall = found.iter().find(|found| found.instance == number(&simulation, room)).expect("the wall");
    assert!(wall.normal.abs_diff_eq(DVec3::NEG_X, 1e-6), "{wall:?}");
    // The place of the room, 32 bits.
    assert!((wall.depth - 0.1).abs() < 1e-5, "{wall:?}");
    assert!(near(wall.speed, 5.0), "{wall:?}");
}

#[test]
fn a_physical_car_that_drives_into_a_wall_touches_it_as_it_stops() {
    let Some(gpu) = common::gpu() else { return };
    let mut simulation = Simulation::new();
    let motion = Motion { speed: 8.0, ..Motion::default() };
    let controls = Controls { throttle: 0.5, ..Controls::default() };
    let car = (CAR, Name::new("own"), Physical::default(), ManualControl, motion, controls);
    let own = simulation.world.spawn(car).id();
    mount(&mut simulation, own, "touch", collision(), Transform::IDENTITY);
    let wall = cube(&mut simulation, Vec3::new(20.0, 4.0, 1.0), Vec3::new(0.0, 2.0, 12.0), Obstacle::Box);
    register_all(&mut simulation.world);
    let number = simulation.world.resource::<EntityRegistry>().id(wall).map(|id| id.0 + 1);
    let mut suite = SensorSuite::new(&gpu);
    let (mut first, mut stopped) = (None, None);
    for step in 0..120 {
        let before = simulation.world.get::<Motion>(own).expect("a vehicle").speed;
        simulation.step();
        let motion = *simulation.world.get::<Motion>(own).expect("a vehicle");
        let found = touched(&mut suite, &mut simulation);
        if let [collision] = &found[..] {
            assert_eq!(Some(collision.instance), number);
            // The front is at the wall: 11.5 m, less 3.5 m; its nose dips by little.
            assert!((motion.place.z - 8.0).abs() < 0.2, "{motion:?}");
            first = first.or(Some(step));
        } else {
            assert!(found.is_empty());
            assert!(motion.place.z < 8.1, "it is through: {motion:?}");
        }
        if before - motion.speed > 4.0 {
            stopped = stopped.or(Some(step));
        }
    }
    let (first, stopped): (i32, i32) = (first.expect("touched"), stopped.expect("stopped"));
    assert!((first - stopped).abs() <= 1, "touched after {first}, stopped after {stopped}");
}
