//! Busy roads: none overlaps, none passes a red light, and neither threads nor the order of tables show.

use super::*;
use systems::vehicles::types::Limits;

/// Car, van, bus, truck with trailer, of that much variety.
fn add_types(world: &mut World) -> Vec<VehicleTypeId> {
    let mut types = world.resource_mut::<VehicleTypes>();
    let plain = VehicleType::default();
    let slow = Driver { speed_factor: 0.7, headway: 1.6, acceleration: 1.0, ..Driver::default() };
    let bus = VehicleType {
        name: "bus".into(),
        size: Vec3::new(2.5, 3.0, 11.0),
        rear_overhang: 2.8,
        wheelbase: 5.6,
        driver: slow,
        limits: Limits { lateral_acceleration: 1.5, ..Limits::default() },
        ..plain.clone()
    };
    let truck = VehicleType {
        name: "truck".into(),
        size: Vec3::new(2.5, 3.5, 6.0),
        rear_overhang: 1.2,
        wheelbase: 3.6,
        driver: slow,
        trailer: Some(Trailer { hitch: 0.2, length: 7.0, end: 9.5 }),
        ..plain.clone()
    };
    [plain, bus, truck].into_iter().map(|kind| types.add(kind)).collect()
}

/// A crossing with signals: four arms of that length, from each of which one may go straight on or turn, and roads that
/// lead from each exit round to the next entry.
fn crossing(arm: f32, lanes: u8, speed_limit: f32) -> (Vec<RoutePlan>, Signals) {
    let side = 2.2 * f32::from(lanes) + 2.5;
    let turned = |arm: usize, v: Vec2| match arm {
        0 => v,
        1 => Vec2::new(v.y, -v.x),
        2 => -v,
        _ => Vec2::new(-v.y, v.x),
    };
    let at = |arm: usize, along: f32, left: f32| {
        let v = turned(arm, Vec2::new(left, along));
        Vec3::new(v.x, 0.0, v.y)
    };
    let inner = 3.0 * side;
    let plan = |name: String, points: Vec<Vec3>, spline, then: Vec<usize>| RoutePlan {
        name,
        points: points.into_iter().map(Vec3::as_dvec3).collect(),
        spline,
        lanes,
        // Long vehicles sweep over more than a usual lane in bends.
        lane_width: 4.2,
        speed_limit,
        then: then.into_iter().map(|id| RouteId(id as u16)).collect(),
        ..RoutePlan::default()
    };
    let mut plans = Vec::new();
    // 0..4 entries, 4..8 exits, 8.. ways across, 24.. roads back.
    for i in 0..4 {
        let mut entry = plan(
            format!("in {i}"),
            vec![at(i, -inner - arm, -side), at(i, -inner, -side)],
            false,
            (0..3).map(|k| 8 + 3 * i + k).collect(),
        );
        entry.stops = vec![Stop { at: arm - 1.0, wait: Wait::Signal(i as u32), clear: 2.0 * inner + 1.0 }];
        plans.push(entry);
    }
    for i in 0..4 {
        plans.push(plan(format!("out {i}"), vec![at(i, inner, -side), at(i, inner + arm, -side)], false, vec![20 + i]));
    }
    for i in 0..4 {
        // Straight on, left, right: the exits of the arms that look that way.
        let from = at(i, -inner, -side);
        let (left, right) = ((i + 1) % 4, (i + 3) % 4);
        plans.push(plan(format!("straight {i}"), vec![from, at(i, inner, -side)], false, vec![4 + i]));
        // From the middle of a lane to that of the lane at the edge.
        let middle = |lane: u8| (f32::from(lane) - 0.5 * f32::from(lanes - 1)) * 4.2;
        let bend = |to: usize, lane: u8, name: &str| {
            let from = at(i, -inner, middle(lane) - side);
            let end = at(to, inner, middle(0) - side);
            let dir = |arm| at(arm, 1.0, 0.0);
            let reach = 0.55 * from.distance(end) * 0.5f32.sqrt() * 1.4;
            let points = (0..=8).map(|k| {
                let t = k as f32 / 8.0;
                let (p1, p2) = (from + dir(i) * reach * 0.7, end - dir(to) * reach * 0.7);
                let u = 1.0 - t;
                from * u * u * u + p1 * 3.0 * u * u * t + p2 * 3.0 * u * t * t + end * t * t * t
            });
            plan(format!("{name} {i}"), points.collect(), true, vec![4 + to])
        };
        // The lane at the edge turns right, the one in the middle left; all go straight on.
        plans.push(RoutePlan { lanes: 1, from_lanes: vec![lanes - 1], ..bend(left, lanes - 1, "left") });
        plans.push(RoutePlan { lanes: 1, from_lanes: vec![0], ..bend(right, 0, "right") });
    }
    for i in 0..4 {
        // A wide loop back into the same arm, far out: a bend to the right, then nearly a circle to the left.
        let outer = inner + arm;
        let radius = 40.0f32;
        let lean = ((radius + side) / (2.0 * radius)).acos();
        let bend = |k: usize| lean * k as f32 / 6.0;
        let out = (0..=6).map(|k| (-side - radius * (1.0 - bend(k).cos()), 20.0 + radius * bend(k).sin()));
        let top = 20.0 + 2.0 * radius * lean.sin();
        let circle = (1..=12).map(|k| {
            let first = std::f32::consts::FRAC_PI_2 - lean;
            let angle = first + (std::f32::consts::PI - first) * k as f32 / 12.0;
            (-radius * angle.sin(), top - radius * angle.cos())
        });
        let half: Vec<(f32, f32)> = [(-side, 0.0)].into_iter().chain(out).chain(circle).collect();
        let back = half.iter().rev().skip(1).map(|&(left, out)| (-left, out));
        let points: Vec<Vec3> = half.iter().copied().chain(back).map(|(left, out)| at(i, outer + out, left)).collect();
        plans.push(plan(format!("back {i}"), points, true, vec![(i + 2) % 4]));
    }
    let times = Signal { name: "crossing".into(), green: vec![10.0; 4], amber: 3.0, red: 4.0, offset: 0.0 };
    (plans, Signals::new(vec![times]))
}

/// Distribution of vehicles on routes: random kinds and gaps.
#[derive(Clone, Debug)]
struct Filling {
    seed: u64,
    spacing: f32,
}

fn random(state: &mut u64) -> f32 {
    *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*state >> 40) as f32 / (1u64 << 24) as f32
}

/// Vehicles on all lanes of the routes, none nearer than it should be.
fn fill(world: &mut World, routes: &[RouteId], filling: &Filling) -> Vec<(VehicleNumber, Vehicle, OnRoute, f32)> {
    let types = add_types(world);
    let mut state = filling.seed;
    let mut all = Vec::new();
    for &id in routes {
        let (length, lanes) =
            world.resource::<Routes>().get(id).map(|r| (r.length as f32, r.lanes())).expect("a route");
        for lane in 0..lanes {
            let mut at = 14.0;
            while at < length - 30.0 {
                let kind = types[(random(&mut state) * 3.3) as usize % 3];
                let number = VehicleNumber(all.len() as u32);
                all.push((number, Vehicle::of(kind), OnRoute::new(id, lane, at), random(&mut state) * 5.0));
                at += 20.0 + filling.spacing * random(&mut state);
            }
        }
    }
    all
}

fn spawn(world: &mut World, vehicles: &[(VehicleNumber, Vehicle, OnRoute, f32)]) -> Vec<Entity> {
    let spawn = |&(number, vehicle, on, speed): &(VehicleNumber, Vehicle, OnRoute, f32)| {
        let entity = world.spawn((vehicle, number, on)).id();
        world.get_mut::<Motion>(entity).expect("one").speed = speed.into();
        entity
    };
    vehicles.iter().map(spawn).collect()
}

/// Rectangles on the ground, a little smaller than the vehicles (without trailers, which cut corners).
fn outline(world: &World, entity: Entity) -> (Vec2, Vec2, f32, f32) {
    let kind = world.resource::<VehicleTypes>().get(world.get::<Vehicle>(entity).expect("one").kind);
    let at = world.get::<Transform>(entity).expect("one").translation;
    let forward = steering::forward(world.get::<Motion>(entity).expect("one").yaw as f32);
    let middle = Vec2::new(at.x, at.z) + forward * (kind.front() - kind.rear_overhang) * 0.5;
    (middle, forward, kind.size.z * 0.5 - 0.1, kind.size.x * 0.5 - 0.1)
}

/// Separating axes.
fn overlap(a: (Vec2, Vec2, f32, f32), b: (Vec2, Vec2, f32, f32)) -> bool {
    let off = b.0 - a.0;
    let side = |v: Vec2| Vec2::new(v.y, -v.x);
    let reach = |(_, forward, length, width): (Vec2, Vec2, f32, f32), axis: Vec2| {
        forward.dot(axis).abs() * length + side(forward).dot(axis).abs() * width
    };
    [a.1, side(a.1), b.1, side(b.1)].into_iter().all(|axis| off.dot(axis).abs() < reach(a, axis) + reach(b, axis))
}

/// The first pair that overlaps.
fn collision(world: &World, entities: &[Entity]) -> Option<String> {
    let outlines: Vec<_> = entities.iter().map(|&entity| outline(world, entity)).collect();
    for (i, a) in outlines.iter().enumerate() {
        for (j, b) in outlines.iter().enumerate().skip(i + 1) {
            if a.0.distance_squared(b.0) < 150.0 && overlap(*a, *b) {
                let told = |i: usize| {
                    format!("{:?} {:?}", world.get::<OnRoute>(entities[i]), world.get::<Motion>(entities[i]))
                };
                return Some(format!("{i}: {}\n{j}: {}", told(i), told(j)));
            }
        }
    }
    None
}

fn cases(count: u32) -> ProptestConfig {
    // `PROPTEST_CASES` asks for more.
    let cases = if std::env::var_os("PROPTEST_CASES").is_some() { ProptestConfig::default().cases } else { count };
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(cases(6))]

    #[test]
    fn nobody_overlaps_on_a_busy_ring(
        seed in any::<u64>(), spacing in 2.0f32..60.0, lanes in 1u8..4, radius in 60.0f32..200.0,
    ) {
        let mut simulation = Simulation::new();
        simulation.world.insert_resource(Routes::new(vec![ring(radius, lanes)], false, seed));
        let vehicles = fill(&mut simulation.world, &[RouteId(0)], &Filling { seed, spacing });
        let entities = spawn(&mut simulation.world, &vehicles);
        let mut changes = 0;
        for step in 0..4000 {
            simulation.step();
            if step % 10 == 0 {
                let found = collision(&simulation.world, &entities);
                prop_assert!(found.is_none(), "step {}: {}", step, found.unwrap_or_default());
            }
            changes += entities.iter().filter(|&&e| simulation.world.get::<OnRoute>(e).expect("one").change.is_some()).count();
        }
        let moved: f64 = entities.iter().map(|&e| simulation.world.get::<Motion>(e).expect("one").rolled).sum();
        prop_assert!(moved > 60.0 * entities.len() as f64, "they drive: {moved} m by {}", entities.len());
        prop_assert!(lanes == 1 || spacing < 40.0 || changes > 0, "none changed lanes");
    }

    #[test]
    fn nobody_overlaps_and_nobody_passes_red_at_a_crossing(
        seed in any::<u64>(), spacing in 10.0f32..60.0, lanes in 1u8..3, speed_limit in 8.0f32..17.0,
    ) {
        let mut simulation = Simulation::new();
        let (plans, signals) = crossing(120.0, lanes, speed_limit);
        simulation.world.insert_resource(Routes::new(plans, false, seed));
        simulation.world.insert_resource(signals);
        let filled: Vec<RouteId> = (0..8).map(RouteId).collect();
        let vehicles = fill(&mut simulation.world, &filled, &Filling { seed, spacing });
        let entities = spawn(&mut simulation.world, &vehicles);
        let before = |world: &World, entity: Entity| {
            let on = *world.get::<OnRoute>(entity).expect("one");
            let kind = world.resource::<VehicleTypes>().get(world.get::<Vehicle>(entity).expect("one").kind);
            (on.route, on.at as f32 + kind.front() < 119.0)
        };
        let mut seen: Vec<_> = entities.iter().map(|&e| before(&simulation.world, e)).collect();
        for step in 0..5000 {
            simulation.step();
            let world = &simulation.world;
            for (seen, &entity) in seen.iter_mut().zip(&entities) {
                let now = before(world, entity);
                if seen.0.0 < 4 && seen.1 && !now.1 && now.0 == seen.0 {
                    // Red for 55 s. One that goes at amber and then meets another may be slower than it thought.
                    let (aspect, left) = world.resource::<Signals>().heads()[usize::from(now.0.0)];
                    let passes = aspect != Aspect::Red || left > 54.0;
                    prop_assert!(passes, "step {}: {left} s, {:?}", step, world.get::<OnRoute>(entity));
                }
                *seen = now;
            }
            if step % 10 == 0 {
                let found = collision(world, &entities);
                prop_assert!(found.is_none(), "step {}: {}", step, found.unwrap_or_default());
            }
        }
        let moved: f64 = entities.iter().map(|&e| simulation.world.get::<Motion>(e).expect("one").rolled).sum();
        prop_assert!(moved > 50.0 * entities.len() as f64, "they drive: {moved} m by {}", entities.len());
    }
}

/// Everything that a step writes, by vehicle.
fn states(simulation: &mut Simulation) -> Vec<(u32, Vec<u64>)> {
    let mut query = simulation.world.query::<(&VehicleNumber, &Transform, &Motion, &OnRoute)>();
    let mut all: Vec<_> = query
        .iter(&simulation.world)
        .map(|(number, at, motion, on)| {
            let bits = at.translation.to_array().into_iter().chain(at.rotation.to_array());
            let bits = bits.chain([motion.steering]).map(|value| u64::from(value.to_bits()));
            let more = [motion.speed, motion.yaw, motion.hitch, motion.rolled, on.at].into_iter();
            let more = more.chain(motion.place.to_array()).map(f64::to_bits);
            let ids = [u64::from(on.route.0), on.lane.into(), on.choices.into()];
            (number.0, bits.chain(more).chain(ids).collect())
        })
        .collect();
    all.sort();
    all
}

#[test]
fn neither_the_order_of_tables_nor_how_vehicles_are_spread_over_them_matters() {
    #[derive(Component)]
    struct Marked;
    let run = |order: &dyn Fn(usize) -> usize, marked: bool| {
        let mut simulation = Simulation::new();
        let (mut plans, signals) = crossing(150.0, 2, 14.0);
        plans.push(ring(150.0, 3));
        let ring = RouteId(plans.len() as u16 - 1);
        simulation.world.insert_resource(Routes::new(plans, false, 7));
        simulation.world.insert_resource(signals);
        let filled: Vec<RouteId> = (0..8).map(RouteId).chain([ring]).collect();
        let vehicles = fill(&mut simulation.world, &filled, &Filling { seed: 3, spacing: 9.0 });
        let mut ordered = vehicles.clone();
        ordered.sort_by_key(|v| order(v.0.0 as usize));
        let entities = spawn(&mut simulation.world, &ordered);
        let mut hashes = Vec::new();
        for step in 0..1500 {
            // Rows move between tables on the way.
            if marked && step % 100 == 50 {
                for &entity in entities.iter().skip(step / 100).step_by(3) {
                    simulation.world.entity_mut(entity).insert(Marked);
                }
            }
            simulation.step();
            if step % 250 == 249 {
                hashes.push(states(&mut simulation));
            }
        }
        hashes
    };
    let first = run(&|i| i, false);
    assert!(first[0] != first[1]);
    assert!(first == run(&|i| (i * 7919) % 10_007, false), "another order of spawning");
    assert!(first == run(&|i| 100_000 - i, true), "the order of tables changed on the way");
}

#[test]
fn a_bus_waits_at_its_stop_and_goes_on() {
    let stops = vec![Stop { at: 150.0, wait: Wait::Dwell(5.0), clear: 0.0 }];
    let plan = RoutePlan { stops, ..straight(400.0) };
    let mut simulation = roads(vec![plan]);
    let entity = simulation.world.spawn((CAR, on_road(20.0))).id();
    let (mut stood, mut place) = (0, 0.0);
    for _ in 0..60 * 60 {
        simulation.step();
        if simulation.world.get::<Motion>(entity).expect("one").speed == 0.0 {
            stood += 1;
            place = simulation.world.get::<OnRoute>(entity).expect("one").at + 3.5;
        }
        if simulation.world.get::<OnRoute>(entity).expect("one").at > 300.0 {
            break;
        }
    }
    assert!((300..=302).contains(&stood), "{stood} steps");
    assert!((147.0..149.0).contains(&place), "{place}");
    assert_eq!(simulation.world.get::<OnRoute>(entity).expect("one").waited, 0.0);
}

#[test]
fn nobody_drives_through_the_one_driven_by_hand() {
    let mut simulation = roads(vec![ring(80.0, 1)]);
    let vehicles = fill(&mut simulation.world, &[RouteId(0)], &Filling { seed: 1, spacing: 40.0 });
    let mut entities = spawn(&mut simulation.world, &vehicles);
    // One of them is taken over and left standing.
    simulation.world.entity_mut(entities[3]).insert(ManualControl);
    simulation.world.get_mut::<Controls>(entities[3]).expect("one").brake = 1.0;
    (0..3000).for_each(|_| simulation.step());
    assert_eq!(collision(&simulation.world, &entities), None);
    let speed = |simulation: &Simulation, entity| simulation.world.get::<Motion>(entity).expect("one").speed;
    assert!(entities.iter().all(|&entity| speed(&simulation, entity) == 0.0), "all wait behind it");
    // Given back to its route, it drives on.
    let taken = entities.swap_remove(3);
    simulation.world.entity_mut(taken).remove::<ManualControl>();
    (0..1200).for_each(|_| simulation.step());
    assert!(speed(&simulation, taken) > 3.0 && speed(&simulation, entities[0]) > 3.0);
}

#[test]
fn turning_and_changing_lanes_is_indicated() {
    let (plans, signals) = crossing(100.0, 1, 12.0);
    let mut simulation = Simulation::new();
    let routes = Routes::new(plans, false, 5);
    let next = |routes: &Routes, number| {
        routes.next(Fork { route: RouteId(0), lane: 0, choices: 0 }, Chooser { number, length: 4.0 })
    };
    let turns = (0..40u32).map(|number| next(&routes, number).0 - 8).collect::<Vec<_>>();
    assert!((0..3).all(|way| turns.contains(&way)), "{turns:?}");
    simulation.world.insert_resource(routes);
    simulation.world.insert_resource(signals);
    for (way, expected) in [(0, Indicator::Off), (1, Indicator::Left), (2, Indicator::Right)] {
        let number = VehicleNumber(turns.iter().position(|turn| *turn == way).expect("one") as u32);
        let mut shown = |at: f32| {
            let vehicle = CAR;
            let entity = simulation.world.spawn((vehicle, number, on_road(at))).id();
            simulation.step();
            let shown = simulation.world.get::<Controls>(entity).expect("one").indicator;
            simulation.world.despawn(entity);
            shown
        };
        assert_eq!(shown(40.0), Indicator::Off, "too early");
        assert_eq!(shown(80.0), expected);
    }
}

#[test]
fn one_whose_numbers_make_no_sense_is_stopped_and_the_rest_goes_on() {
    let mut simulation = roads(vec![ring(100.0, 1)]);
    let vehicles = fill(&mut simulation.world, &[RouteId(0)], &Filling { seed: 1, spacing: 90.0 });
    let entities = spawn(&mut simulation.world, &vehicles);
    (0..120).for_each(|_| simulation.step());
    let place = *simulation.world.get::<Transform>(entities[2]).expect("one");
    simulation.world.get_mut::<Transform>(entities[2]).expect("one").translation.x = f32::NAN;
    simulation.world.get_mut::<Motion>(entities[4]).expect("one").speed = f64::INFINITY;
    (0..600).for_each(|_| simulation.step());
    let world = &simulation.world;
    let stalled: Vec<_> = entities.iter().filter(|&&e| world.get::<Stalled>(e).is_some()).collect();
    assert_eq!(stalled, [&entities[2], &entities[4]]);
    assert_eq!(world.resource::<systems::vehicles::traffic::Traffic>().faults.len(), 2, "each once");
    assert!(world.get::<Transform>(entities[2]).expect("one").translation.distance(place.translation) < 0.5);
    assert_eq!(collision(world, &entities), None);
    let all_finite = entities.iter().all(|&e| world.get::<Transform>(e).expect("one").is_finite());
    assert!(all_finite);
}
