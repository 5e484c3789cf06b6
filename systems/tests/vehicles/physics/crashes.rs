//! Bodies that meet each other, obstacles and the end of the world; the same in every run.

use super::*;

#[test]
fn a_crash_keeps_the_momentum() {
    let mut simulation = simulation();
    let slippery = Physical { friction: Some(0.0), ..AIRLESS };
    let fast = spawn(&mut simulation, Physical { mass: Some(1000.0), ..slippery }, Transform::IDENTITY, 15.0);
    let slow =
        spawn(&mut simulation, Physical { mass: Some(2000.0), ..slippery }, Transform::from_xyz(0.0, 0.0, 12.0), 0.0);
    [fast, slow].into_iter().for_each(|vehicle| want(&mut simulation, vehicle, 0.1, 0.0));
    let momentum = |simulation: &Simulation| {
        let physics = simulation.world.resource::<Physics>();
        let of = |vehicle| physics.velocity(*simulation.world.get::<VehicleNumber>(vehicle).unwrap()).unwrap();
        of(fast) * 1000.0 + of(slow) * 2000.0
    };
    simulation.step();
    let before = momentum(&simulation);
    steps(&mut simulation, 90);
    assert!(motion(&simulation, slow).speed > 4.0, "they never met");
    assert!(motion(&simulation, slow).speed >= motion(&simulation, fast).speed);
    let after = momentum(&simulation);
    assert!((after.z / before.z - 1.0).abs() < 0.02, "{before} became {after}");
}

#[test]
fn kinematic_vehicles_and_obstacles_stand_in_the_way() {
    for obstacle in [false, true] {
        let mut simulation = simulation();
        let vehicle = rolling(&mut simulation, AIRLESS, 10.0);
        want(&mut simulation, vehicle, 0.1, 0.0);
        if obstacle {
            let cube = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::splat(2.0)));
            simulation.world.spawn((cube, Obstacle::Box, Transform::from_xyz(0.0, 1.0, 15.0)));
        } else {
            simulation.world.spawn((CAR, Transform::from_xyz(0.0, 0.0, 15.0)));
        }
        steps(&mut simulation, 180);
        let front = place(&simulation, vehicle).translation.z + VehicleType::default().front();
        assert!((12.0..14.3).contains(&front), "its front is at {front}");
    }
}

#[test]
fn thrown_out_of_the_world_it_is_frozen_and_named_once() {
    let mut simulation = simulation();
    slope(&mut simulation, 0.0);
    let vehicle = spawn(&mut simulation, AIRLESS, Transform::from_xyz(0.0, 0.0, 195.0), 20.0);
    want(&mut simulation, vehicle, 1.0, 0.0);
    let odd = spawn(&mut simulation, AIRLESS, Transform::from_xyz(f32::NAN, 0.0, 0.0), 20.0);
    let mad = spawn(&mut simulation, AIRLESS, Transform::from_xyz(50.0, 0.0, 0.0), f32::INFINITY);
    want(&mut simulation, mad, f32::NAN, f32::NAN);
    steps(&mut simulation, 900);
    let warnings = simulation.world.resource_mut::<Physics>().take_warnings();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings.iter().any(|text| text.contains("vehicle 1") && text.contains("left the world")), "{warnings:?}");
    assert!(place(&simulation, vehicle).is_finite() && place(&simulation, mad).is_finite());
    // Those whose numbers never made sense are told by what moves vehicles, and are no bodies.
    assert!([odd, mad].into_iter().all(|vehicle| simulation.world.get::<Stalled>(vehicle).is_some()));
    assert!(simulation.world.resource::<Physics>().is_empty());
    let rest = place(&simulation, vehicle);
    steps(&mut simulation, 60);
    assert_eq!(place(&simulation, vehicle), rest);
    assert!(simulation.world.resource_mut::<Physics>().take_warnings().is_empty());
}

#[test]
fn obstacles_that_come_move_and_go_are_there_where_they_are() {
    // A cube hung below something far away that is not in the way itself; what is done to them before the vehicle
    // comes.
    type Change = fn(&mut World, Entity, Entity);
    let cases: [(&str, bool, Change); 5] = [
        ("left alone", true, |_, _, _| {}),
        ("what is above is moved", false, |world, above, _| {
            world.get_mut::<Transform>(above).expect("one").translation.x += 20.0;
        }),
        ("gone", false, |world, _, cube| _ = world.despawn(cube)),
        ("no obstacle", false, |world, _, cube| _ = world.entity_mut(cube).remove::<Obstacle>()),
        ("without a mesh", false, |world, _, cube| _ = world.entity_mut(cube).remove::<MeshId>()),
    ];
    for (what, stops, change) in cases {
        let mut simulation = simulation();
        let vehicle = rolling(&mut simulation, AIRLESS, 10.0);
        want(&mut simulation, vehicle, 0.1, 0.0);
        let mesh = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::splat(2.0)));
        let above = simulation.world.spawn(Transform::from_xyz(0.0, 0.0, 100.0)).id();
        let at = Transform::from_xyz(0.0, 1.0, -75.0);
        let cube = simulation.world.spawn((mesh, Obstacle::Box, at, ChildOf(above))).id();
        steps(&mut simulation, 10);
        change(&mut simulation.world, above, cube);
        steps(&mut simulation, 240);
        let z = place(&simulation, vehicle).translation.z;
        assert_eq!(z < 22.0, stops, "{what}: it is at {z}");
    }
}

/// Vehicles that crash into each other on bumpy ground; in that order of spawning.
fn melee(order: &[u32]) -> Simulation {
    let mut simulation = simulation();
    let mut mesh: Mesh = shapes::plane(Vec2::splat(120.0), glam::UVec2::splat(40));
    mesh.positions.iter_mut().for_each(|p| p.y = 0.2 * (p.x * 0.7).sin() * (p.z * 0.5).cos());
    let mesh = simulation.world.resource_mut::<Library>().add_mesh(mesh);
    simulation.world.spawn((mesh, Ground));
    for &number in order {
        let angle = number as f32 * 0.7;
        let turned = Quat::from_rotation_y(angle + std::f32::consts::PI);
        let at = Transform::from_translation(Quat::from_rotation_y(angle) * Vec3::new(0.0, 0.5, 25.0 + number as f32));
        let vehicle = (CAR, VehicleNumber(number), Motion { speed: 8.0, ..Motion::default() });
        let vehicle = simulation.world.spawn((vehicle, at.with_rotation(turned))).id();
        if number % 4 != 3 {
            simulation.world.entity_mut(vehicle).insert(Physical::default());
            want(&mut simulation, vehicle, 1.0, 0.05);
        }
    }
    simulation
}

fn state(simulation: &Simulation) -> Vec<u64> {
    let mut state = Vec::new();
    simulation.world.resource::<Physics>().state(|bits| state.push(bits));
    state
}

#[test]
fn runs_are_equal_to_the_bit_whatever_the_order_of_spawning() {
    let order: Vec<u32> = (0..24).collect();
    let (mut one, mut two) = (melee(&order), melee(&order));
    let reversed: Vec<u32> = order.iter().rev().copied().collect();
    let mut three = melee(&reversed);
    for step in 0..400 {
        [&mut one, &mut two, &mut three].into_iter().for_each(Simulation::step);
        assert_eq!(state(&one), state(&two), "step {step}");
        assert_eq!(state(&one), state(&three), "step {step}");
    }
    assert!(one.world.resource::<Physics>().len() > 12);
}

#[test]
fn a_restored_run_goes_on_as_if_nothing_had_been() {
    // Before they meet, and while they are in contact.
    [150, 260].into_iter().for_each(a_run_restored_after);
}

fn a_run_restored_after(done: usize) {
    let order: Vec<u32> = (0..16).collect();
    let mut kept = melee(&order);
    registry::register_all(&mut kept.world);
    steps(&mut kept, done);
    let saved = snapshot::save(&mut kept.world);
    let mut other = melee(&order);
    registry::register_all(&mut other.world);
    snapshot::restore(&mut other.world, &saved).expect("a snapshot of this scene");
    assert_eq!(snapshot::save(&mut other.world), saved);
    for step in 0..300 {
        [&mut kept, &mut other].into_iter().for_each(Simulation::step);
        assert_eq!(state_hash::hash(&mut kept.world), state_hash::hash(&mut other.world), "step {step} after {done}");
    }
    assert_eq!(state(&kept), state(&other));
}

#[test]
fn bodies_come_and_go_in_the_middle_of_a_run() {
    let mut simulation = simulation();
    let spawn = |simulation: &mut Simulation, x: f32, is_body: bool| {
        let vehicle = (CAR, Transform::from_xyz(x, 0.3, 0.0));
        let mut entity = simulation.world.spawn(vehicle);
        if is_body {
            entity.insert(Physical::default());
        }
        entity.id()
    };
    let stays = spawn(&mut simulation, 0.0, true);
    for round in 0..12 {
        let others = [4.0, 8.0, -4.0].map(|x| spawn(&mut simulation, x, round % 2 == 0));
        steps(&mut simulation, 3);
        simulation.world.despawn(others[round % 3]);
        let again = spawn(&mut simulation, 12.0, true);
        steps(&mut simulation, 2);
        others.iter().chain([&again]).for_each(|&other| _ = simulation.world.try_despawn(other));
        steps(&mut simulation, 1);
    }
    let height = simulation.world.get::<Transform>(stays).unwrap().translation.y;
    assert!(height.abs() < 0.3, "{height}");
}
