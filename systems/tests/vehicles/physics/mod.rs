//! Physical vehicles against closed forms, and what must hold whatever happens to them.

mod crashes;
mod on_roads;

use super::*;
use bevy_ecs::name::Name;
use systems::assets::Mesh;
use systems::ecs::sub_steps::Parts;
use systems::physics::{GRAVITY, Obstacle};
use systems::run::registry;
use systems::vehicles::ground::Ground;
use systems::vehicles::{Wanted, driving};

/// The box of a car's size, without air.
const AIRLESS: Physical = Physical {
    mass: None,
    friction: None,
    engine_force: None,
    brake_force: None,
    drag: Some(0.0),
    stiffness: None,
    damping: None,
    rest_length: None,
};

fn spawn(simulation: &mut Simulation, physical: Physical, at: Transform, speed: f32) -> Entity {
    let motion = Motion { speed: speed.into(), ..Motion::default() };
    simulation.world.spawn((CAR, physical, at, motion)).id()
}

fn want(simulation: &mut Simulation, vehicle: Entity, acceleration: f32, steering: f32) {
    let wanted = Wanted { acceleration, steering };
    // In the place of a route's driver: after the pedals, which nobody touches.
    let controls = Controls { throttle: f32::from(acceleration > 0.0), ..Controls::default() };
    simulation.world.entity_mut(vehicle).insert((Wish(wanted), controls));
}

/// Value that [`obey`] writes over the [`Wanted`] of the pedals.
#[derive(Component, Clone, Copy)]
struct Wish(Wanted);

fn obey(mut wishes: Query<(&Wish, &mut Wanted)>) {
    wishes.iter_mut().for_each(|(wish, mut wanted)| *wanted = wish.0);
}

fn simulation() -> Simulation {
    let mut simulation = Simulation::new();
    let mut schedules = simulation.world.resource_mut::<Schedules>();
    schedules.add_systems(Parts, obey.after(driving::drive).before(systems::physics::update_ground));
    simulation
}

fn motion(simulation: &Simulation, vehicle: Entity) -> Motion {
    super::state(simulation, vehicle)
}

fn place(simulation: &Simulation, vehicle: Entity) -> Transform {
    super::state(simulation, vehicle)
}

/// Settled on its springs, then as fast as that along +Z.
fn rolling(simulation: &mut Simulation, physical: Physical, speed: f32) -> Entity {
    spawn(simulation, physical, Transform::IDENTITY, speed)
}

#[test]
fn it_stands_as_its_model_does_and_springs_give_by_its_weight() {
    let mut simulation = simulation();
    let soft = Physical { stiffness: Some(20_000.0), ..AIRLESS };
    let vehicle = spawn(&mut simulation, soft, Transform::from_xyz(0.0, 0.8, 0.0), 0.0);
    steps(&mut simulation, 600);
    let number = *simulation.world.get::<VehicleNumber>(vehicle).unwrap();
    let at = place(&simulation, vehicle);
    // Springs of m·g / 4k at the height where the type has its wheels: the vehicle stands where its model does.
    assert!(at.translation.length() < 0.01, "{at:?}");
    assert!((at.rotation * Vec3::Y).y > 0.99999);
    let physics = simulation.world.resource::<Physics>();
    assert_eq!(physics.wheels_on_ground(number), Some(4));
    assert!(physics.velocity(number).unwrap().length() < 1e-3);
    // And with another load on the same springs it stands lower by the difference of m·g / 4k.
    let deflection = |mass: f32| f64::from(mass) * GRAVITY / (4.0 * 20_000.0);
    let tuning = |mass: f32| {
        let kind = VehicleType::default();
        systems::physics::Tuning::of(&Physical { mass: Some(mass), ..soft }, &kind, 4).static_deflection(4)
    };
    assert!((tuning(2000.0) - deflection(2000.0)).abs() < 1e-6);
}

/// Things that stand stay, and those that roll keep their speed and height, whatever their mass, springs, dampers and
/// the step: springs that the step cannot hold are as stiff as it can.
#[test]
fn whatever_its_springs_and_the_step_it_stands_and_rolls_evenly() {
    let stiffnesses = [None, Some(100.0), Some(2e5), Some(1e6), Some(5e6), Some(1e8)];
    let dampings = [None, Some(1.0), Some(5e4), Some(1e8)];
    let masses = [10.0, 200.0, 1400.0, 7e4, 1e6];
    for step in [0.001, 1.0 / 240.0, 1.0 / 60.0, 0.05, 0.2, 1.0] {
        let mut simulation = simulation();
        simulation.world.resource_mut::<Clock>().step_seconds = step;
        let mut vehicles = Vec::new();
        for (i, stiffness) in stiffnesses.into_iter().enumerate() {
            for (j, damping) in dampings.into_iter().enumerate() {
                for (k, mass) in masses.into_iter().enumerate() {
                    let physical = Physical { stiffness, damping, mass: Some(mass), ..AIRLESS };
                    let lane = (i * dampings.len() + j) * masses.len() + k;
                    // Those that are hardly damped would go on bouncing.
                    let height = if matches!(damping, Some(1.0 | 5e4)) { 0.0 } else { 0.02 };
                    let speed = if lane.is_multiple_of(2) { 0.0 } else { 10.0 };
                    let at = Transform::from_xyz(8.0 * lane as f32, height, 0.0);
                    let vehicle = spawn(&mut simulation, physical, at, speed);
                    want(&mut simulation, vehicle, 0.0, 0.0);
                    vehicles.push((vehicle, f64::from(speed), physical));
                }
            }
        }
        // Of the least damped ones that are let fall, e⁻⁴ of 0.1 m/s is left then.
        steps(&mut simulation, (2.0f64 / step).ceil() as usize);
        let velocity = |simulation: &Simulation, vehicle: Entity| {
            let number = *simulation.world.get::<VehicleNumber>(vehicle).expect("a vehicle");
            simulation.world.resource::<Physics>().velocity(number).expect("a body")
        };
        for _ in 0..(0.5f64 / step).ceil() as usize {
            let before: Vec<DVec3> = vehicles.iter().map(|row| velocity(&simulation, row.0)).collect();
            simulation.step();
            for ((vehicle, speed, physical), before) in vehicles.iter().zip(before) {
                let now = velocity(&simulation, *vehicle);
                let off = now - DVec3::Z * *speed;
                assert!(off.length() < 0.02, "{now} m/s at a step of {step} s: {physical:?}");
                // The ground's force is m·g: nothing accelerates, up to 0.3 m/s².
                assert!(now.distance(before) / step < 0.3, "{before} to {now} in {step} s: {physical:?}");
                let height = place(&simulation, *vehicle).translation.y;
                assert!(height.abs() < 0.005, "{height} m high at a step of {step} s: {physical:?}");
            }
        }
    }
}

/// Springs that are too short or too soft to carry a vehicle carry it all the same.
#[test]
fn springs_are_stiff_enough_to_carry_their_vehicle() {
    for (mass, stiffness, rest_length) in [(1400.0, None, 0.05), (7e4, Some(2e4), 0.3), (1e6, Some(100.0), 2.0)] {
        let mut simulation = simulation();
        let rest_length = Some(rest_length);
        let physical = Physical { mass: Some(mass), stiffness, rest_length, ..AIRLESS };
        let vehicle = spawn(&mut simulation, physical, Transform::from_xyz(0.0, 0.02, 0.0), 0.0);
        steps(&mut simulation, 600);
        let number = *simulation.world.get::<VehicleNumber>(vehicle).expect("a vehicle");
        let physics = simulation.world.resource::<Physics>();
        assert_eq!(physics.wheels_on_ground(number), Some(4), "{physical:?}");
        assert!(physics.velocity(number).expect("a body").length() < 1e-3, "{physical:?}");
        // It stands as its model does, to the millimetre.
        assert!(place(&simulation, vehicle).translation.length() < 1e-3, "{physical:?}");
    }
}

#[test]
fn braking_distances_are_those_of_the_brakes_and_of_the_road() {
    for (speed, friction, brake_force) in [(20.0f32, 2.0f32, 1400.0 * 5.0f32), (20.0, 0.4, 1e6), (30.0, 0.8, 1e6)] {
        let mut simulation = simulation();
        let physical = Physical { friction: Some(friction), brake_force: Some(brake_force), ..AIRLESS };
        let vehicle = rolling(&mut simulation, physical, speed);
        want(&mut simulation, vehicle, 0.0, 0.0);
        steps(&mut simulation, 60);
        let (start, speed) = (place(&simulation, vehicle).translation.z, motion(&simulation, vehicle).speed as f32);
        want(&mut simulation, vehicle, -100.0, 0.0);
        steps(&mut simulation, 600);
        let deceleration = (brake_force / 1400.0).min(friction * GRAVITY as f32);
        let expected = speed * speed / (2.0 * deceleration);
        let distance = place(&simulation, vehicle).translation.z - start;
        assert!((distance / expected - 1.0).abs() < 0.03, "{distance} m, expected {expected} m");
        assert!(motion(&simulation, vehicle).speed.abs() < 1e-3);
    }
}

#[test]
fn drag_and_engine_come_to_a_steady_speed() {
    let mut simulation = simulation();
    // Where F = c·v², v is the square root of F / c.
    let physical = Physical { drag: Some(2.0), engine_force: Some(1800.0), ..AIRLESS };
    let vehicle = rolling(&mut simulation, physical, 20.0);
    want(&mut simulation, vehicle, 100.0, 0.0);
    steps(&mut simulation, 60 * 120);
    let speed = motion(&simulation, vehicle).speed;
    assert!((speed - 30.0).abs() < 0.1, "{speed}");
}

#[test]
fn wanted_acceleration_is_what_it_gets() {
    let mut simulation = simulation();
    let vehicle = rolling(&mut simulation, AIRLESS, 0.0);
    steps(&mut simulation, 60);
    want(&mut simulation, vehicle, 2.0, 0.0);
    steps(&mut simulation, 300);
    let motion = motion(&simulation, vehicle);
    assert!((motion.speed - 10.0).abs() < 0.2, "{motion:?}");
    assert!((motion.rolled - 25.0).abs() < 1.0, "{motion:?}");
}

#[test]
fn it_turns_in_the_circle_of_the_bicycle_model() {
    let mut simulation = simulation();
    let vehicle = rolling(&mut simulation, AIRLESS, 3.0);
    let steering = 0.3f32;
    want(&mut simulation, vehicle, 0.01, steering);
    steps(&mut simulation, 240);
    let places: Vec<Vec2> = (0..3)
        .map(|_| {
            steps(&mut simulation, 120);
            let at = place(&simulation, vehicle).translation;
            Vec2::new(at.x, at.z)
        })
        .collect();
    // The radius of the circle through three places of the rear axle.
    let [a, b, c] = [places[1] - places[0], places[2] - places[1], places[0] - places[2]];
    let radius = a.length() * b.length() * c.length() / (2.0 * a.perp_dot(b).abs());
    let expected = VehicleType::default().wheelbase / steering.tan();
    assert!((radius / expected - 1.0).abs() < 0.05, "{radius} m, expected {expected} m");
    // To the left: from +Z toward +X.
    assert!(motion(&simulation, vehicle).yaw > 0.0 || places[1].x > places[0].x);
}

/// A square of ground, 400 m wide, tilted about X: it rises toward −Z.
fn slope(simulation: &mut Simulation, degrees: f32) {
    let mesh = shapes::plane(Vec2::splat(400.0), glam::UVec2::splat(8));
    let mesh = simulation.world.resource_mut::<Library>().add_mesh(mesh);
    simulation.world.spawn((mesh, Ground, Transform::from_rotation(Quat::from_rotation_x(degrees.to_radians()))));
}

#[test]
fn brakes_hold_on_a_slope_along_and_across() {
    for heading in [0.0f32, 90.0, 37.0] {
        let mut simulation = simulation();
        slope(&mut simulation, 12.0);
        let turned = Quat::from_rotation_x(12f32.to_radians()) * Quat::from_rotation_y(heading.to_radians());
        let vehicle = spawn(&mut simulation, AIRLESS, Transform::from_rotation(turned), 2.0);
        want(&mut simulation, vehicle, -3.0, 0.0);
        steps(&mut simulation, 600);
        let before = place(&simulation, vehicle).translation;
        steps(&mut simulation, 600);
        let crept = place(&simulation, vehicle).translation.distance(before);
        assert!(crept < 0.005, "{crept} m in 10 s, heading {heading}°");
    }
}

#[test]
fn without_brakes_it_rolls_down_a_slope_at_g_times_the_sine() {
    let mut simulation = simulation();
    slope(&mut simulation, 6.0);
    let tilted = Transform::from_rotation(Quat::from_rotation_x(6f32.to_radians()));
    let vehicle = spawn(&mut simulation, AIRLESS, tilted, 1.0);
    want(&mut simulation, vehicle, 1e-6, 0.0);
    steps(&mut simulation, 60);
    let before = motion(&simulation, vehicle).speed;
    steps(&mut simulation, 120);
    let gained = motion(&simulation, vehicle).speed - before;
    let expected = 2.0 * GRAVITY * 6f64.to_radians().sin();
    assert!((gained / expected - 1.0).abs() < 0.03, "{gained}, expected {expected}");
}

#[test]
fn none_sinks_through_the_ground() {
    for (velocity, height) in [(0.0f32, 130.0f32), (50.0, 1.0), (50.0, 60.0)] {
        let mut simulation = simulation();
        slope(&mut simulation, 0.0);
        let vehicle = spawn(&mut simulation, AIRLESS, Transform::from_xyz(0.0, height, -150.0), velocity);
        for _ in 0..400 {
            simulation.step();
            assert!(place(&simulation, vehicle).translation.y > -1.0, "{:?}", place(&simulation, vehicle));
        }
    }
}

#[test]
fn what_cannot_stand_on_its_wheels_stays_kinematic() {
    let mut simulation = simulation();
    let bicycle = VehicleType { name: "bicycle".into(), track: 0.0, ..VehicleType::default() };
    let kind = simulation.world.resource_mut::<VehicleTypes>().add(bicycle);
    let vehicle = simulation.world.spawn((Vehicle::of(kind), AIRLESS, Name::new("the postman's"))).id();
    steps(&mut simulation, 60);
    assert_eq!(place(&simulation, vehicle), Transform::IDENTITY);
    let warnings = simulation.world.resource_mut::<Physics>().take_warnings();
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].contains("in a row") && warnings[0].starts_with("the postman's is"), "{warnings:?}");
}

#[test]
fn a_long_step_of_the_clock_is_done_in_several() {
    let mut simulation = simulation();
    simulation.world.resource_mut::<Clock>().step_seconds = 0.1;
    let vehicle = spawn(&mut simulation, AIRLESS, Transform::from_xyz(0.0, 1.0, 0.0), 0.0);
    steps(&mut simulation, 100);
    assert!(place(&simulation, vehicle).translation.length() < 0.01);
}

#[test]
fn ground_and_obstacles_follow_their_meshes() {
    let plane = |height: f32| {
        let mut mesh: Mesh = shapes::plane(Vec2::splat(60.0), glam::UVec2::ONE);
        mesh.positions.iter_mut().for_each(|p| p.y = height);
        mesh
    };
    let mut simulation = simulation();
    let mesh = simulation.world.resource_mut::<Library>().add_mesh(plane(0.0));
    simulation.world.spawn((mesh, Ground));
    let vehicle = spawn(&mut simulation, AIRLESS, Transform::from_xyz(0.0, 0.2, 0.0), 0.0);
    let kinematic = simulation.world.spawn((CAR, Transform::from_xyz(15.0, 0.2, 0.0), Motion::default())).id();
    steps(&mut simulation, 240);
    let heights = |simulation: &Simulation| [vehicle, kinematic].map(|it| place(simulation, it).translation.y);
    let before = heights(&simulation);
    let saved = snapshot::save(&mut simulation.world);
    for _ in 0..2 {
        simulation.world.resource_mut::<Library>().replace_mesh(mesh, plane(-0.5));
        steps(&mut simulation, 240);
        // A millimetre: it has come to rest on its springs, as it had before.
        heights(&simulation).iter().zip(before).for_each(|(now, before)| {
            assert!((now - before + 0.5).abs() < 1e-3, "from {before} to {now}");
        });
        // A snapshot of before has other colliders: those of the mesh as it is now take their place.
        snapshot::restore(&mut simulation.world, &saved).expect("of this world");
    }
    simulation.world.resource_mut::<Library>().remove_mesh(mesh);
    steps(&mut simulation, 120);
    assert!(heights(&simulation)[0] < before[0] - 1.0, "nothing is below it");
}
