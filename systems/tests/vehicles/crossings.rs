//! Crossings that are kept clear, lanes for turning, and ways that part.

use super::*;

const LINE: f32 = 80.0;

fn plan(name: &str, points: &[(f32, f32)], then: &[u16]) -> RoutePlan {
    RoutePlan {
        name: name.into(),
        points: points.iter().map(|&(x, z)| Vec3::new(x, 0.0, z).as_dvec3()).collect(),
        then: then.iter().map(|&id| RouteId(id)).collect(),
        ..RoutePlan::default()
    }
}

fn stop(head: u32) -> Vec<Stop> {
    vec![Stop { at: LINE, wait: Wait::Signal(head), clear: 60.0 }]
}

/// Toward +Z over a crossing of 20 m, 85 m from the beginning, straight on or to the left; a road that crosses it
/// toward +X, with a line of its own. The first group's signal is green for ever.
fn world(then: &[u16]) -> Simulation {
    world_of(plans(then), vec![1e6, 1.0])
}

fn world_of(plans: Vec<RoutePlan>, green: Vec<f32>) -> Simulation {
    let mut simulation = Simulation::new();
    simulation.world.insert_resource(Routes::new(plans, false, 3));
    simulation.world.insert_resource(Signals::new(vec![signal(&green)]));
    simulation
}

fn plans(then: &[u16]) -> Vec<RoutePlan> {
    let mut main = plan("main", &[(0.0, 0.0), (0.0, 85.0)], then);
    main.stops = stop(0);
    let mut side = plan("side", &[(-95.0, 95.0), (-10.0, 95.0)], &[6]);
    side.stops = stop(1);
    vec![
        main,
        plan("straight", &[(0.0, 85.0), (0.0, 105.0)], &[3]),
        RoutePlan {
            spline: true,
            ..plan("left", &[(0.0, 85.0), (0.0, 90.0), (2.0, 97.0), (7.0, 101.0), (20.0, 101.0)], &[4])
        },
        plan("on", &[(0.0, 105.0), (0.0, 305.0)], &[]),
        plan("off", &[(20.0, 101.0), (220.0, 101.0)], &[]),
        side,
        plan("across", &[(-10.0, 95.0), (10.0, 95.0)], &[7]),
        plan("away", &[(10.0, 95.0), (210.0, 95.0)], &[]),
    ]
}

fn drive(simulation: &mut Simulation, number: u32, route: u16, at: f32, speed: f32) -> Entity {
    super::drive(simulation, (CAR, VehicleNumber(number), OnRoute::new(RouteId(route), 0, at)), speed)
}

fn park(simulation: &mut Simulation, number: u32, at: Transform) -> Entity {
    simulation.world.spawn((CAR, VehicleNumber(number), at)).id()
}

fn steps(simulation: &mut Simulation, seconds: usize) {
    (0..60 * seconds).for_each(|_| simulation.step());
}

fn on(simulation: &Simulation, entity: Entity) -> (u16, f32) {
    let on = simulation.world.get::<OnRoute>(entity).expect("one");
    (on.route.0, on.at as f32)
}

#[test]
fn nobody_drives_into_a_crossing_that_they_cannot_leave() {
    let kind = VehicleType::default();
    let length = kind.front() + kind.rear();
    // Beyond the crossing, which ends at 105 m, stands one; so much room is left before it.
    let end = |room: f32| {
        let mut simulation = world(&[1]);
        let parked = park(&mut simulation, 1, Transform::from_xyz(0.0, 0.0, 105.0 + room + kind.rear()));
        let entity = drive(&mut simulation, 0, 0, 10.0, 10.0);
        steps(&mut simulation, 40);
        let stands = on(&simulation, entity);
        assert_eq!(simulation.world.get::<Motion>(entity).expect("one").speed, 0.0);
        simulation.world.despawn(parked);
        steps(&mut simulation, 20);
        assert_eq!(on(&simulation, entity).0, 3, "it goes on when there is room");
        stands
    };
    let needed = length + kind.driver.gap;
    let (route, at) = end(needed - 0.5);
    assert!(route == 0 && at + kind.front() < LINE, "it waits before the line: {route} {at}");
    let (route, at) = end(needed + 0.5);
    assert!(route == 3 && at > kind.rear() - 0.5, "it stands beyond the crossing: {route} {at}");
}

#[test]
fn who_waits_in_vain_for_room_takes_another_way() {
    let mut simulation = world(&[1, 2]);
    let number = (0..100).find(|&number| next(&simulation, number, 0, 4.0) == 1).expect("one goes straight on");
    park(&mut simulation, 1000, Transform::from_xyz(0.0, 0.0, 107.0));
    let entity = drive(&mut simulation, number, 0, 10.0, 10.0);
    steps(&mut simulation, 60);
    assert_eq!(on(&simulation, entity).0, 4);
}

/// One stands in the crossing, held by something before it: not in the way itself, but it may move on. Another waits.
#[track_caller]
fn is_waited_for(mut simulation: Simulation, (route, at): (u16, f32), previous: Option<u16>, parked: f32) {
    let entity = drive(&mut simulation, 0, 0, 10.0, 10.0);
    let other = drive(&mut simulation, 1, route, at, 0.0);
    simulation.world.get_mut::<OnRoute>(other).expect("one").previous[0] = previous.map(|id| (RouteId(id), 0));
    let parked = Transform::from_xyz(parked, 0.0, 95.0).looking_to(-Vec3::X, Vec3::Y);
    let parked = park(&mut simulation, 2, parked);
    steps(&mut simulation, 40);
    assert_eq!(on(&simulation, other).0, route);
    let (first, at) = on(&simulation, entity);
    assert!(first == 0 && at < LINE, "it waits: {first} {at}");
    simulation.world.despawn(parked);
    steps(&mut simulation, 25);
    assert_eq!(on(&simulation, entity).0, 3);
}

#[test]
fn nobody_drives_into_a_crossing_in_which_one_of_another_group_is() {
    is_waited_for(world(&[1]), (6, 2.0), Some(5), 9.0);
    // Past its line with its front alone.
    let mut shallow = plans(&[1]);
    shallow[5].stops.clear();
    shallow[6].stops = vec![Stop { at: 0.5, ..stop(1)[0] }];
    is_waited_for(world_of(shallow, vec![1e6, 1.0]), (5, 84.0), None, -5.0);
    // Over the seam of a closed route, which begins in the crossing, and comes back to it from behind.
    let mut closed = plans(&[1]);
    let round = [(-6.0, 95.0), (60.0, 95.0), (60.0, 200.0), (-60.0, 200.0), (-60.0, 95.0), (-8.0, 95.0)];
    closed[5] = RoutePlan { closed: true, ..plan("round", &round, &[]) };
    let length = Routes::new(closed.clone(), false, 3).get(RouteId(5)).expect("one").length as f32;
    closed[5].stops = vec![Stop { at: length - 2.0, wait: Wait::Signal(1), clear: 30.0 }];
    is_waited_for(world_of(closed, vec![1e6, 1.0]), (5, 1.0), Some(5), 3.0);
}

#[test]
fn two_lines_of_one_signal_do_not_wait_for_each_other() {
    let stops = [(70.0, 0, 20.0), (96.0, 1, 8.0)];
    let stops = stops.map(|(at, head, clear)| Stop { at, wait: Wait::Signal(head), clear });
    let main = RoutePlan { stops: stops.to_vec(), ..plan("main", &[(0.0, 0.0), (0.0, 300.0)], &[]) };
    let mut simulation = world_of(vec![main], vec![8.0, 8.0]);
    let all: Vec<Entity> = (0..5).map(|i| drive(&mut simulation, i, 0, 50.0 - 8.0 * i as f32, 5.0)).collect();
    let mut passed = vec![false; all.len()];
    for _ in 0..90 {
        steps(&mut simulation, 1);
        passed.iter_mut().zip(&all).for_each(|(passed, &entity)| *passed |= on(&simulation, entity).1 > 110.0);
    }
    assert_eq!(passed, [true; 5]);
}

fn next(simulation: &Simulation, number: u32, lane: u8, length: f32) -> u16 {
    let fork = Fork { route: RouteId(0), lane, choices: 0 };
    simulation.world.resource::<Routes>().next(fork, Chooser { number, length }).0
}

#[test]
fn ways_are_chosen_by_lane_and_length() {
    let way = |name: &str, from_lanes: Vec<u8>, longest: f32| RoutePlan {
        from_lanes,
        longest,
        ..plan(name, &[(0.0, 100.0), (0.0, 120.0)], &[])
    };
    let routes = vec![
        RoutePlan { lanes: 3, ..plan("main", &[(0.0, 0.0), (0.0, 100.0)], &[1, 2, 3]) },
        way("right", vec![0], 8.0),
        way("straight", vec![0, 1], f32::INFINITY),
        way("left", vec![1], 8.0),
    ];
    let mut simulation = Simulation::new();
    simulation.world.insert_resource(Routes::new(routes, false, 9));
    let chosen = |lane: u8, length: f32| {
        let mut all: Vec<u16> = (0..200).map(|number| next(&simulation, number, lane, length)).collect();
        all.sort();
        all.dedup();
        all
    };
    assert_eq!(chosen(0, 4.0), [1, 2]);
    assert_eq!(chosen(1, 8.0), [2, 3]);
    assert_eq!(chosen(0, 8.1), [2]);
    assert_eq!(chosen(2, 4.0), [1, 2, 3], "no way is for that lane: any");
}

#[test]
fn who_turned_off_is_in_the_way_until_the_ways_have_parted() {
    let mut simulation = world(&[1, 2]);
    let take = |simulation: &Simulation, way: u16| (0..100).find(|&n| next(simulation, n, 0, 4.0) == way).expect("one");
    let (left, straight) = (take(&simulation, 2), take(&simulation, 1));
    // The first has to stop just after it turned off; it is not in the lane any more that both came from.
    let kind = VehicleType::default();
    let parked = park(&mut simulation, 1000, Transform::from_xyz(2.6, 0.0, 99.0).looking_to(-Vec3::X, Vec3::Y));
    let first = drive(&mut simulation, left, 2, 0.6 + kind.rear(), 0.0);
    simulation.world.get_mut::<OnRoute>(first).expect("one").previous[0] = Some((RouteId(0), 0));
    let second = drive(&mut simulation, straight, 0, 60.0, 8.0);
    steps(&mut simulation, 30);
    assert_eq!(on(&simulation, first).0, 2);
    let rear = simulation.world.get::<Transform>(first).expect("one").translation.z - kind.rear();
    let (route, at) = on(&simulation, second);
    let front = at + kind.front() + if route == 1 { 85.0 } else { 0.0 };
    assert!(front < rear + 0.3, "{front} m, behind {rear} m");
    simulation.world.despawn(parked);
    steps(&mut simulation, 30);
    assert_eq!((on(&simulation, first).0, on(&simulation, second).0), (4, 3));
}
