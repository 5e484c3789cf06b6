//! Routes, signals and vehicles on them in scene files: what they become, what is refused and in which words.

use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use glam::Vec2;
use relief::scene;
use std::path::{Path, PathBuf};
use systems::Simulation;
use systems::transform::Transform;
use systems::vehicles::ground::{Ground, Grounds};
use systems::vehicles::routes::Routes;
use systems::vehicles::{Motion, OnRoute, Vehicle, VehicleTypes, steering};

/// A scene file, and its folder, which lives as long.
struct Scene(#[expect(dead_code, reason = "deleted when it is dropped")] tempfile::TempDir, PathBuf);

impl Scene {
    fn new(text: &str) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("roads.ron");
        std::fs::write(&path, text).expect("written");
        Self(folder, path)
    }

    fn problems(&self) -> Vec<String> {
        let text = |problem: &relief::problem::Problem| {
            let place = problem.line_column.map_or(String::new(), |(line, _)| format!("{line}: "));
            format!("{place}{}: {}", problem.place, problem.message)
        };
        scene::check(&self.1).iter().map(text).collect()
    }

    fn load(&self) -> (Simulation, Vec<String>) {
        let mut simulation = Simulation::new();
        let loaded = scene::load(&self.1, &mut simulation).expect("a scene");
        (simulation, loaded.warnings)
    }
}

#[test]
fn every_fault_of_a_road_is_named_with_its_line() {
    let scene = Scene::new(
        r#"(
    signals: { "s": (green_seconds: []), "t": (green_seconds: [5, 0]) },
    routes: {
        "one": (points: [(0, 0, 0), (0, 0, 0)]),
        "two": (points: [(0, 0, 0), (NaN, 0, 9)], lanes: 0),
        "three": (points: [(0, 0, 0), (0, 0, 50)], then: ["fuor"]),
        "four": (points: [(0, 0, 0), (0, 0, 50)], stops: [
            (at: 10, signal: "u"),
            (at: 10, signal: "t", group: 2),
            (at: 50.1, seconds: 3),
            (at: 20),
            (at: 30, seconds: 3, keep_clear: 10),
        ]),
        "six": (points: [(0, 0, 0), (0, 0, 50)], then: ["seven"], lanes: 2, limits: [(from: 50, kmh: 5), (from: 60, kmh: 9)]),
        "seven": (points: [(0, 0, 0), (0, 0, 50)], from_lanes: [2, 16], longest_vehicle: 0),
    },
    entities: [
        (vehicle: (type: "box", route: "tree")),
        (vehicle: (type: "box", route: "four", at: 50.1)),
        (vehicle: (type: "box", route: "four", lane: 1)),
        (signal_head: (signal: "t", group: 7)),
    ],
    generators: [(place: along(routes: ["five"], spacing: 0), vehicles: ["box"])],
)"#,
    );
    let problems = scene.problems();
    let expected = [
        "2: signals[\"s\"].green_seconds: expected from 1 to 64 groups, found 0",
        "2: signals[\"t\"].green_seconds[1]: expected a number from 0.1",
        "4: routes[\"one\"].points: expected at least two points that differ",
        "5: routes[\"two\"].points[1]: expected a point within",
        "5: routes[\"two\"].lanes: expected from 1 to 16 lanes, found 0",
        "6: routes[\"three\"].then[0]: no route \"fuor\"; did you mean \"four\"?",
        "8: routes[\"four\"].stops[0].signal: no signal \"u\"",
        "9: routes[\"four\"].stops[1].group: the signal \"t\" has 2 groups, counted from 0; found 2",
        "10: routes[\"four\"].stops[2].at: expected a number from 0 to 50.00, the route's length, found 50.1",
        "11: routes[\"four\"].stops[3]: expected either a signal (and its group) or seconds",
        "12: routes[\"four\"].stops[4].keep_clear: expected at a stop with a signal only",
        "14: routes[\"six\"].limits[1].from: expected a number from 0 to 50.00, the route's length, found 60",
        "14: routes[\"six\"].then[0]: \"seven\" is from the lanes [2, 16] only; this route has 2, counted from 0",
        "15: routes[\"seven\"].from_lanes[1]: expected a lane from 0 to 15, found 16",
        "15: routes[\"seven\"].longest_vehicle: expected a number from 0.1",
        "18: entities[0].vehicle.route: no route \"tree\"; did you mean \"three\"?",
        "19: entities[1].vehicle.at: expected a number from 0 to 50.00, the route's length, found 50.1",
        "20: entities[2].vehicle.lane: the route has 1 lanes, counted from 0; found 1",
        "21: entities[3].signal_head.group: the signal \"t\" has 2 groups",
        "23: generators[0].place.routes[0]: no route \"five\"",
        "23: generators[0].place.spacing: expected a number from 0.1",
    ];
    for expected in expected {
        assert!(problems.iter().any(|problem| problem.starts_with(expected)), "{expected}\n{problems:#?}");
    }
    assert_eq!(problems.len(), expected.len(), "{problems:#?}");
}

/// Curves are longer than the lines between their points; a closed route goes back to its beginning.
#[test]
fn places_on_a_route_are_within_its_length_as_it_is_driven() {
    let scene = |shape: &str, at: f32| {
        Scene::new(&format!(
            r#"(
    routes: {{ "bend": (points: [(0, 0, 0), (60, 0, 0), (60, 0, 60)], {shape},
        stops: [(at: {at}, seconds: 1)], limits: [(from: {at}, kmh: 30)]) }},
    entities: [(vehicle: (type: "box", route: "bend", at: {at}))],
)"#
        ))
    };
    for shape in ["closed: false", "closed: true", "shape: spline", "shape: spline, closed: true"] {
        let (simulation, _) = scene(shape, 0.0).load();
        let length = simulation.world.resource::<Routes>().iter().next().expect("a route").1.length;
        let (mut simulation, warnings) = scene(shape, length).load();
        assert_eq!(warnings, Vec::<String>::new(), "{shape}");
        (0..600).for_each(|_| simulation.step());
        let rolled = simulation.world.query::<&Motion>().single(&simulation.world).expect("a vehicle").rolled;
        assert!(rolled > 10.0, "{shape}: {rolled}");
        let problems = scene(shape, length + 0.1).problems();
        assert_eq!(problems.len(), 3, "{shape}: {problems:?}");
        let expected = format!("expected a number from 0 to {length:.2}, the route's length, found");
        assert!(problems.iter().all(|problem| problem.contains(&expected)), "{expected}: {problems:?}");
    }
    // One without a length has no end either.
    let scene = Scene::new(r#"(routes: { "a": (points: [(0, 0, 0), (inf, 0, 9)], limits: [(from: 300, kmh: 30)]) })"#);
    let problems = scene.problems();
    assert!(problems.len() == 2 && problems.iter().all(|problem| problem.contains("points")), "{problems:?}");
}

#[test]
fn a_route_that_crosses_itself_is_a_warning_that_names_the_place() {
    let crossing = |height: f32| {
        let points = format!("[(0, 0, 0), (0, 0, 40), (30, 0, 40), (30, {height}, 20), (-20, {height}, 20)]");
        let scene = Scene::new(&format!("(routes: {{ \"eight\": (points: {points}) }})"));
        scene.load().1
    };
    let warnings = crossing(0.0);
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].starts_with("routes[\"eight\"] crosses itself at (0."), "{warnings:?}");
    assert_eq!(crossing(6.0), Vec::<String>::new(), "a bridge does not cross");
}

#[test]
fn vehicles_of_a_scene_drive_on_their_routes_and_stand_on_its_ground() {
    let scene = Scene::new(
        r#"(
    meshes: { "land": plane(size: (400, 400)) },
    routes: { "loop": (points: [(-50, 0, -50), (50, 0, -50), (50, 0, 50), (-50, 0, 50)], shape: spline, closed: true, lanes: 2) },
    entities: [
        (mesh: "land", ground: true, transform: (translation: (0, 0.5, 0))),
        (vehicle: (type: "box", route: "loop", at: 25, lane: 1, speed_kmh: 36)),
    ],
    generators: [(place: along(spacing: 30, from: 60, lane: 0), vehicles: ["box"]), (place: along(spacing: 3, from: 200, lane: 1), vehicles: ["box"])],
)"#,
    );
    let (mut simulation, warnings) = scene.load();
    assert!(warnings.iter().any(|warning| warning.contains("no room")), "{warnings:?}");
    let mut vehicles = simulation.world.query::<(&OnRoute, &Motion, &Transform)>();
    let (on, motion, at) = vehicles.iter(&simulation.world).next().expect("a vehicle");
    assert_eq!((on.at, on.lane, motion.speed), (25.0, 1, 10.0));
    assert_eq!(*at, simulation.world.resource::<Routes>().stand(on));
    assert!(vehicles.iter(&simulation.world).count() > 12);
    (0..300).for_each(|_| simulation.step());
    assert!(!simulation.world.resource::<Grounds>().is_empty());
    for (_, motion, at) in vehicles.iter(&simulation.world) {
        assert!(motion.rolled > 3.0, "{motion:?}");
        assert!((at.translation.y - 0.5).abs() < 1e-3, "{at:?}");
    }
    assert_eq!(simulation.world.query::<&Ground>().iter(&simulation.world).count(), 1);
}

/// The middle of a vehicle on the ground, the way it looks, and half its length and width.
fn outline(world: &World, entity: Entity) -> (Vec2, Vec2, Vec2) {
    let kind = world.resource::<VehicleTypes>().get(world.get::<Vehicle>(entity).expect("one").kind);
    let at = world.get::<Transform>(entity).expect("one").translation;
    let forward = steering::forward(world.get::<Motion>(entity).expect("one").yaw);
    let middle = Vec2::new(at.x, at.z) + forward * (kind.front() - kind.rear_overhang) * 0.5;
    (middle, forward, Vec2::new(kind.size.z, kind.size.x) * 0.5)
}

/// Whether two come into each other by more than some metres: separating axes.
fn overlap(a: (Vec2, Vec2, Vec2), b: (Vec2, Vec2, Vec2), by: f32) -> bool {
    let reach = |o: (Vec2, Vec2, Vec2), axis: Vec2| o.1.dot(axis).abs() * o.2.x + o.1.perp_dot(axis).abs() * o.2.y;
    let axes = [a.1, a.1.perp(), b.1, b.1.perp()];
    axes.into_iter().all(|axis| (b.0 - a.0).dot(axis).abs() < reach(a, axis) + reach(b, axis) - by)
}

#[test]
fn two_hundred_vehicles_drive_through_the_town_and_none_into_another() {
    let mut simulation = Simulation::new();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/town.ron");
    let loaded = scene::load(&path, &mut simulation).expect("a scene");
    assert_eq!(loaded.warnings, Vec::<String>::new());
    let world = &mut simulation.world;
    let is_vehicle = |world: &World, entity: Entity| {
        let kind = world.get::<Vehicle>(entity).expect("one").kind;
        world.resource::<VehicleTypes>().get(kind).name != "person"
    };
    let mut vehicles: Vec<Entity> = world.query_filtered::<Entity, With<Vehicle>>().iter(world).collect();
    vehicles.retain(|&entity| is_vehicle(world, entity));
    let driving: Vec<Entity> = vehicles.iter().copied().filter(|&e| world.get::<OnRoute>(e).is_some()).collect();
    assert!(driving.len() >= 200, "{} vehicles drive", driving.len());
    // A whole cycle of every signal, and some.
    for step in 0..6000 {
        if step % 20 == 0 {
            let world = &simulation.world;
            let outlines: Vec<_> = driving.iter().map(|&entity| outline(world, entity)).collect();
            for (i, a) in outlines.iter().enumerate() {
                // Long ones sweep over a little of the lane beside theirs in bends.
                let by = |b: &(Vec2, Vec2, Vec2)| if a.2.x.max(b.2.x) > 3.5 { 0.6 } else { 0.2 };
                let other = (i + 1..outlines.len()).find(|&j| overlap(*a, outlines[j], by(&outlines[j])));
                let told = |i: usize| (world.get::<Name>(driving[i]), world.get::<OnRoute>(driving[i]));
                assert!(other.is_none(), "step {step}: {:?} in {:?}", told(i), other.map(told));
            }
        }
        simulation.step();
    }
    let rolled = |entity: &&Entity| simulation.world.get::<Motion>(**entity).expect("one").rolled < 20.0;
    let stood: Vec<_> = driving.iter().filter(rolled).map(|&e| simulation.world.get::<Name>(e)).collect();
    assert!(stood.is_empty(), "hardly moved: {stood:?}");
}
