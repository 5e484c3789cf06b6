//! Bodies that routes drive.

use super::*;

/// A straight level route of 600 m for 54 km/h, before whose end one waits.
fn add_road(simulation: &mut Simulation) {
    let stop = Stop { at: 550.0, wait: Wait::Dwell(1e9), clear: 0.0 };
    let plan = RoutePlan { speed_limit: 15.0, stops: vec![stop], ..straight(600.0) };
    simulation.world.insert_resource(Routes::new(vec![plan], false, 0));
}

#[test]
fn on_a_route_it_is_carried_by_its_forces_alone() {
    let (mut routed, mut free) = (simulation(), simulation());
    add_road(&mut routed);
    let driven = rolling(&mut routed, AIRLESS, 10.0);
    routed.world.entity_mut(driven).insert(on_road(0.0));
    let other = rolling(&mut free, AIRLESS, 10.0);
    let (mut fastest, mut dive, mut rise) = (0.0f64, 0.0f32, 0.0f32);
    for step in 0..60 * 90 {
        routed.step();
        // The same wishes to one that no route drives.
        let wanted = *routed.world.get::<Wanted>(driven).unwrap();
        let controls = Controls { throttle: 1.0, ..Controls::default() };
        free.world.entity_mut(other).insert((Wish(wanted), controls));
        free.step();
        assert_eq!(place(&routed, driven), place(&free, other), "step {step}");
        fastest = fastest.max(motion(&routed, driven).speed);
        let pitch = (place(&routed, driven).rotation * Vec3::Z).y;
        (dive, rise) = (dive.min(pitch), rise.max(pitch));
    }
    // The model of following comes to the limit, and nothing else takes anything from it.
    assert!((fastest - 15.0).abs() < 0.05, "{fastest}");
    let at = place(&routed, driven).translation.z;
    let front = VehicleType::default().front();
    assert!((at + front - 548.0).abs() < 1.0 && motion(&routed, driven).speed.abs() < 1e-3, "stands 2 m before: {at}");
    // A road that is level has no pitch: it is the springs' that it rises with 1.5 m/s² and dives with about 2.
    assert!(dive < -0.002 && rise > 0.001, "{dive} {rise}");
}

/// A route says where its line lies, not what is below: vehicles begin on the ground, up to a metre above it or far
/// below, and as steep as that is.
#[test]
fn on_a_route_it_begins_on_the_ground() {
    for (height, slope) in [(0.8f32, 0.0f32), (-3.0, 0.0), (0.0, 0.3), (0.3, -0.15)] {
        let mut simulation = simulation();
        add_road(&mut simulation);
        let corners = [(-50.0, -50.0), (-50.0, 700.0), (50.0, 700.0), (50.0, -50.0)];
        let positions = corners.map(|(x, z)| Vec3::new(x, height + slope * z, z)).to_vec();
        let mesh = Mesh { positions, indices: vec![0, 1, 2, 0, 2, 3], ..Mesh::default() };
        let mesh = simulation.world.resource_mut::<Library>().add_mesh(mesh);
        simulation.world.spawn((mesh, Ground));
        let vehicle = spawn(&mut simulation, AIRLESS, Transform::IDENTITY, 10.0);
        simulation.world.entity_mut(vehicle).insert(on_road(0.0));
        for step in 0..90 {
            simulation.step();
            let at = place(&simulation, vehicle);
            let above = at.translation.y - (height + slope * at.translation.z);
            // Springs of a car give some centimetres; the kinematic ones lie on the ground to the millimetre.
            assert!(above.abs() < 0.1, "{height} {slope}: {above} m above the ground after {step} steps");
            let lean = (at.rotation * Vec3::Y).dot(Vec3::new(0.0, 1.0, -slope).normalize());
            assert!(lean > 0.999, "{height} {slope}: leans {lean} after {step} steps");
        }
        assert!(place(&simulation, vehicle).translation.z > 10.0, "{height} {slope}: it drives on");
    }
}

#[test]
fn put_to_a_routes_beginning_it_goes_on_as_fast_the_way_that_begins_there() {
    let mut simulation = simulation();
    // A quarter of a circle: from +Z to +X.
    let points = (0..=18).map(|i| f64::to_radians(5.0 * f64::from(i)));
    let points = points.map(|angle| DVec3::new(1.0 - angle.cos(), 0.0, angle.sin()) * 60.0).collect();
    let plan = RoutePlan { points, spline: true, speed_limit: 10.0, ..RoutePlan::default() };
    simulation.world.insert_resource(Routes::new(vec![plan], false, 0));
    let vehicle = rolling(&mut simulation, AIRLESS, 10.0);
    simulation.world.entity_mut(vehicle).insert(on_road(0.0));
    let (mut jumps, mut before, mut speed) = (0, 0.0, 10.0);
    for _ in 0..60 * 25 {
        simulation.step();
        let at = simulation.world.get::<OnRoute>(vehicle).unwrap().at;
        let now = motion(&simulation, vehicle).speed;
        if at < before - 50.0 {
            jumps += 1;
            // No driver asks for more than 6 m/s², 0.1 m/s in a step.
            assert!((now - speed).abs() < 0.1, "{now} after {speed}");
        }
        (before, speed) = (at, now);
        let off = place(&simulation, vehicle).translation - Vec3::X * 60.0;
        assert!((off.length() - 60.0).abs() < 1.0, "on its circle: {off}");
    }
    // 250 m at the most on a route of 94 m.
    assert_eq!(jumps, 2);
}
