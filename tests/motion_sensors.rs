//! IMU, GNSS, collision and lane sensors against what is known of worlds that move, and their files.

mod common;

use bevy_ecs::name::Name;
use bevy_ecs::prelude::*;
use common::text;
use glam::{DVec2, DVec3, Quat, Vec3};
use relief::sensors::{Capture, Collision, SensorSuite};
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use systems::Simulation;
use systems::assets::{Library, MeshId, shapes};
use systems::ecs::clock::Clock;
use systems::physics::{Obstacle, Physical};
use systems::run::registry::{EntityRegistry, register_all};
use systems::sensors::wgs84::Geodetic;
use systems::sensors::{CollisionSensor, GeoOrigin, GnssSensor, ImuSensor, LaneSensor, Sensor, SensorKind};
use systems::space::origin::Origin;
use systems::space::{GRAVITY, Transform};
use systems::vehicles::routes::{RoutePlan, Routes};
use systems::vehicles::{Controls, ManualControl, Motion, OnRoute, RouteId, Vehicle, VehicleTypeId};

const STEP: f64 = 1.0 / 60.0;
/// Radians: some roundings of quaternions of 32 bits, of 2⁻²³ each.
const TURN: f64 = 5e-7;
const CAR: Vehicle = Vehicle { kind: VehicleTypeId::STAND_IN, paint: 0 };

fn imu() -> Sensor {
    Sensor::new(SensorKind::Imu(ImuSensor::default()))
}

fn gnss() -> Sensor {
    Sensor::new(SensorKind::Gnss(GnssSensor::default()))
}

fn collision() -> Sensor {
    Sensor::new(SensorKind::Collision(CollisionSensor::default()))
}

/// Puts a sensor on something, there and turned so.
fn mount(simulation: &mut Simulation, on: Entity, name: &str, sensor: Sensor, at: Transform) {
    simulation.world.spawn((sensor, Name::new(name.to_owned()), at, ChildOf(on)));
}

fn capture(suite: &mut SensorSuite, simulation: &mut Simulation) -> Capture {
    suite.capture(simulation).expect("captured")
}

/// A vehicle that a test moves by itself: on a circle about the origin, to the left.
struct Circle {
    simulation: Simulation,
    car: Entity,
    radius: f64,
    rate: f64,
}

impl Circle {
    fn new(radius: f64, rate: f64) -> Self {
        let mut simulation = Simulation::new();
        let car = simulation.world.spawn((CAR, Name::new("car"))).id();
        Self { simulation, car, radius, rate }
    }

    /// Where it is, and its yaw.
    fn at(&self, step: u64) -> (DVec3, f64) {
        let yaw = self.rate * step as f64 * STEP;
        let (sin, cos) = yaw.sin_cos();
        (DVec3::new(-cos, 0.0, sin) * self.radius, yaw)
    }

    fn go(&mut self, step: u64) {
        let (place, yaw) = self.at(step);
        self.simulation.world.resource_mut::<Clock>().step = step;
        let transform = Transform::from_translation(place.as_vec3()).with_rotation(Quat::from_rotation_y(yaw as f32));
        self.simulation.world.entity_mut(self.car).insert((Motion { place, yaw, ..Motion::default() }, transform));
    }
}

#[test]
fn a_car_on_a_circle_has_the_force_and_the_rates_of_the_circle() {
    let Some(gpu) = common::gpu() else { return };
    let (radius, rate) = (30.0, 0.4);
    let mut circle = Circle::new(radius, rate);
    let car = circle.car;
    mount(&mut circle.simulation, car, "each", imu(), Transform::IDENTITY);
    mount(&mut circle.simulation, car, "third", imu().every(3), Transform::IDENTITY);
    // Turned to the left: what was to the left is ahead.
    let turned = Transform::from_xyz(0.5, 1.0, 2.0).with_rotation(Quat::from_rotation_y(FRAC_PI_2 as f32));
    mount(&mut circle.simulation, car, "turned", imu(), turned);
    mount(&mut circle.simulation, car, "mast", gnss().every(2), Transform::IDENTITY);
    let place = Geodetic { latitude_degrees: 48.0, longitude_degrees: 11.0, altitude: 500.0 };
    let origin = GeoOrigin { place, at: DVec3::new(5_300_000.0, 0.0, 700_000.0) };
    circle.simulation.world.insert_resource(origin);
    circle.simulation.world.insert_resource(Origin(origin.at));
    register_all(&mut circle.simulation.world);
    let mut suite = SensorSuite::new(&gpu);
    for step in 0..=12 {
        circle.go(step);
        let got = capture(&mut suite, &mut circle.simulation);
        for (name, every) in [("car/each", 1), ("car/third", 3), ("car/turned", 1)] {
            let Some(sensor) = got.get(name) else { continue };
            let found = sensor.imu().expect("an IMU");
            assert_eq!(found.valid, step >= 2 * every, "{name} after {step}");
            if !found.valid {
                assert_eq!(found.reading, Default::default());
                continue;
            }
            let seconds = every as f64 * STEP;
            assert_eq!(found.nanoseconds, ((step - every) as f64 * STEP * 1e9).round() as u64);
            let half = rate * seconds / 2.0;
            // What is 2 m ahead and 0.5 m to the left is carried about the centre, too.
            let arm = if name == "car/turned" { DVec2::new(radius - 0.5, 2.0) } else { DVec2::new(radius, 0.0) };
            let [to_left, back] = (arm * rate * rate * (half.sin() / half).powi(2)).to_array();
            let expected = if name == "car/turned" {
                DVec3::new(to_left, back, GRAVITY)
            } else {
                DVec3::new(-back, to_left, GRAVITY)
            };
            // Turns are some roundings of 32 bits off: the arm of 2.1 m by that, four times, over h²; the force itself.
            let room = TURN * (2.0 * GRAVITY + arm.y * 4.2 / (seconds * seconds)) + 1e-9;
            let off = found.reading.specific_force - expected;
            assert!(off.length() < room, "{name} after {step}: {off}");
            let off = found.reading.angular_velocity - DVec3::Z * rate;
            assert!(off.length() < 2.0 * TURN / seconds, "{name} after {step}: {off}");
        }
        let Some(fix) = got.get("car/mast") else { continue };
        let found = fix.gnss().expect("a receiver");
        assert_eq!((found.valid, found.has_velocity), (true, step >= 2), "{step}");
        let at = circle.at(step).0;
        let truth = origin.geodetic(origin.at + at);
        // Places on a map of 5,000 km have 1e-9 m, which is 1e-14 degrees.
        assert!((found.reading.place.latitude_degrees - truth.latitude_degrees).abs() < 1e-12, "{found:?}");
        assert!((found.reading.place.longitude_degrees - truth.longitude_degrees).abs() < 1e-12, "{found:?}");
        if step >= 2 {
            let mean = (at - circle.at(step - 2).0) / (2.0 * STEP);
            // East is Z and north is X; 30 m turn them by less than 1e-5.
            let expected = DVec3::new(mean.z, mean.x, 0.0);
            assert!((found.reading.velocity - expected).length() < 1e-5 * mean.length() + 1e-6, "{found:?}");
        }
        // Asked again, all say the same.
        assert_eq!(capture(&mut suite, &mut circle.simulation), got);
    }
}

#[test]
fn a_physical_car_feels_its_fall_and_then_its_weight() {
    let Some(gpu) = common::gpu() else { return };
    let mut simulation = Simulation::new();
    let physical = Physical { drag: Some(0.001), ..Physical::default() };
    let car = simulation.world.spawn((CAR, Name::new("car"), physical, Transform::from_xyz(0.0, 6.0, 0.0))).id();
    mount(&mut simulation, car, "unit", imu(), Transform::IDENTITY);
    register_all(&mut simulation.world);
    let mut suite = SensorSuite::new(&gpu);
    let mut forces = Vec::new();
    for _ in 0..900 {
        simulation.step();
        let got = capture(&mut suite, &mut simulation);
        let found = *got["car/unit"].imu().expect("an IMU");
        forces.extend(found.valid.then_some(found.reading.specific_force));
    }
    // Half a second of fall, with 0.001 kg/m of air at up to 5 m/s: 2e-5 m/s².
    for force in &forces[..25] {
        assert!(force.length() < 1e-3, "{force}");
    }
    assert!(forces.iter().any(|force| force.z > 2.0 * GRAVITY), "it hits the ground");
    // At rest: springs are still to 1e-6 m in 15 s, and turns of 32 bits.
    let rest = forces[forces.len() - 1];
    assert!((rest - DVec3::Z * GRAVITY).length() < 1e-2, "{rest}");
}

#[test]
fn a_lane_sensor_says_where_it_is_mounted() {
    let Some(gpu) = common::gpu() else { return };
    let mut simulation = Simulation::new();
    let points = vec![DVec3::ZERO, DVec3::Z * 300.0];
    let plan = RoutePlan { points, lanes: 2, lane_width: 3.0, ..RoutePlan::default() };
    simulation.world.insert_resource(Routes::new(vec![plan], false, 1));
    let driven = simulation.world.spawn((CAR, Name::new("car"), OnRoute::new(RouteId(0), 0, 10.0))).id();
    let lane = || Sensor::new(SensorKind::Lane(LaneSensor::default()));
    let at = Transform::from_xyz(0.25, 0.0, 1.0).with_rotation(Quat::from_rotation_y(0.2));
    mount(&mut simulation, driven, "lane", lane(), at);
    // By hand, 4.5 m beside the left lane and backward; and far from everything.
    let back = Transform::from_xyz(6.0, 0.0, 100.0).with_rotation(Quat::from_rotation_y(3.0));
    let yaw = Motion { yaw: 3.0, ..Motion::default() };
    let still = simulation.world.spawn((CAR, Name::new("other"), ManualControl, back, yaw)).id();
    mount(&mut simulation, still, "lane", lane(), Transform::IDENTITY);
    simulation.world.spawn((lane(), Name::new("post"), Transform::from_xyz(40.0, 0.0, 0.0)));
    register_all(&mut simulation.world);
    let mut suite = SensorSuite::new(&gpu);
    for _ in 0..90 {
        simulation.step();
    }
    let got = capture(&mut suite, &mut simulation);
    let motion = *simulation.world.get::<Motion>(driven).expect("a vehicle");
    let found = got["car/lane"].lane().expect("a lane sensor");
    assert!(found.valid && motion.speed > 1.0);
    assert_eq!((found.route, found.lane, found.width, found.speed), (0, 0, 3.0, motion.speed));
    // The right lane is 1.5 m to the right, where it drives but for its steering's roundings; 32 bits of the mount.
    assert!((found.offset - 0.25).abs() < 1e-4, "{found:?}");
    assert!((found.heading_error - 0.2).abs() < 1e-4 && found.curvature == 0.0, "{found:?}");
    assert!((found.along - (motion.place.z + 1.0)).abs() < 1e-4, "{found:?}");
    let found = got["other/lane"].lane().expect("a lane sensor");
    assert!(found.valid && found.lane == 1 && found.speed == 0.0, "{found:?}");
    assert!((found.offset - 4.5).abs() < 1e-6 && (found.heading_error - 3.0).abs() < 2e-6, "{found:?}");
    assert_eq!(got["post"].lane(), Some(&Default::default()));
}

/// A world with a car at the origin that has a collision sensor, and another 4.15 m ahead, of 4.4 m.
fn two_cars() -> (Simulation, Entity, Entity) {
    let mut simulation = Simulation::new();
    let motion = Motion { speed: 5.0, ..Motion::default() };
    let own = simulation.world.spawn((CAR, Name::new("own"), motion)).id();
    let ahead = DVec3::Z * 4.15;
    let at = Transform::from_translation(ahead.as_vec3());
    let other = simulation.world.spawn((CAR, at, Motion { place: ahead, speed: 2.0, ..Motion::default() })).id();
    mount(&mut simulation, own, "touch", collision(), Transform::from_xyz(0.0, 0.5, 3.0));
    (simulation, own, other)
}

fn cube(simulation: &mut Simulation, size: Vec3, at: Vec3, obstacle: Obstacle) -> Entity {
    let mesh: MeshId = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(size));
    simulation.world.spawn((mesh, Transform::from_translation(at), obstacle)).id()
}

fn touched(suite: &mut SensorSuite, simulation: &mut Simulation) -> Vec<Collision> {
    let got = capture(suite, simulation);
    got["own/touch"].collisions().expect("a collision sensor").to_vec()
}

#[test]
fn boxes_that_overlap_are_collisions_by_depth_way_and_speed() {
    let Some(gpu) = common::gpu() else { return };
    let (mut simulation, _, other) = two_cars();
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
    let (first, stopped) = (first.expect("touched"), stopped.expect("stopped") as i32);
    assert!((first as i32 - stopped).abs() <= 1, "touched after {first}, stopped after {stopped}");
}

/// A car that drives round and round, with all of these sensors, and noise.
const SCENE: &str = r#"(
    seed: 5,
    geo_origin: (latitude_degrees: 48.1, longitude_degrees: 11.5, altitude: 500),
    meshes: { "post": cube(size: (1, 1, 1)) },
    routes: {
        "ring": (points: [(10, 0, 0), (0, 0, 10), (-10, 0, 0), (0, 0, -10)], spline: true, closed: true),
    },
    entities: [
        (name: "ego", vehicle: (type: "box", route: "ring"), children: [
            (name: "unit", transform: (translation: (0.1, 0.5, 1)), sensor: imu(every: 2, noise: (
                accelerometer_density: 0.02, gyroscope_density: 0.002, accelerometer_bias: (0.1, 0, 0),
            ))),
            (name: "car/mast", sensor: gnss(every: 3, phase: 1, noise: (horizontal_sigma: 2, velocity_sigma: 0.1))),
            (name: "lane", sensor: lane()),
            (name: "bumper", sensor: collision(margin: 0.5)),
        ]),
        (name: "still", vehicle: (type: "box", by_hand: true), transform: (translation: (12.2, 0, 0))),
    ],
)"#;

fn relief(args: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_relief")).args(args).current_dir(folder).output().expect("the binary runs")
}

fn scene_folder(scene: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("scene.ron"), scene).expect("written");
    folder
}

/// The files of the sensors of a run, by their paths.
fn rendered(folder: &Path, args: &[&str]) -> BTreeMap<PathBuf, Vec<u8>> {
    let whole = ["render", "scene.ron", "-o", "out", "--sensors", "all", "--format", "npy,npz"];
    let output = relief(&[&whole[..], args].concat(), folder);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let out = folder.join("out");
    let mut found = BTreeMap::new();
    for name in ["unit", "mast", "lane", "bumper"] {
        for entry in fs::read_dir(out.join("ego").join(name)).expect("a folder") {
            let path = entry.expect("a file").path();
            found.insert(path.strip_prefix(&out).expect("below").to_owned(), fs::read(&path).expect("read"));
        }
    }
    fs::remove_dir_all(out).expect("removed");
    found
}

#[test]
fn threads_parts_and_snapshots_of_a_run_make_the_bytes_of_the_run() {
    if common::gpu().is_none() {
        return;
    }
    let folder = scene_folder(SCENE);
    let expected = rendered(folder.path(), &["--frames", "20"]);
    assert_eq!(expected.len(), 2 * (10 + 7 + 20 + 20));
    assert!(rendered(folder.path(), &["--frames", "20", "--threads", "1"]) == expected);
    assert!(rendered(folder.path(), &["--frames", "20", "--threads", "2"]) == expected);
    let is_expected = |found: BTreeMap<PathBuf, Vec<u8>>, from: u64| {
        let is_from = |path: &Path| {
            let digits: String = path.to_string_lossy().chars().filter(char::is_ascii_digit).collect();
            digits.parse::<u64>().is_ok_and(|step| step >= from)
        };
        let compared: Vec<_> = found.iter().filter(|(path, _)| is_from(path)).collect();
        assert!(compared.len() > 20);
        compared.into_iter().for_each(|(path, bytes)| assert!(expected[path] == *bytes, "{}", path.display()));
    };
    is_expected(rendered(folder.path(), &["--frames", "9..20"]), 0);
    // After a snapshot, once two captures of the IMU are known: it is due after steps 10, 12 and 14.
    let saved = rendered(folder.path(), &["--frames", "10", "--save-snapshot", "at.snapshot"]);
    is_expected(saved, 0);
    let later = rendered(folder.path(), &["--frames", "10..20", "--from-snapshot", "at.snapshot"]);
    let unknown = Path::new("ego/unit/imu_00010.npy");
    assert_ne!(later[unknown], expected[unknown], "the poses before the snapshot are not known");
    is_expected(later, 14);
}

#[test]
fn others_read_the_files_and_the_log() {
    if common::gpu().is_none() {
        return;
    }
    let folder = scene_folder(SCENE);
    let log = ["render", "scene.ron", "-o", "run", "--sensors", "ego/unit,ego/mast", "--format", "npy,npz,mcap"];
    let output = relief(&[&log[..], &["--frames", "9"]].concat(), folder.path());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let modules = ["numpy", "mcap", "mcap_ros2"];
    let run = folder.path().join("run");
    let Some(output) = common::python("motion_sensors.py", &modules, &[run.as_os_str()]) else { return };
    // 5 captures of the IMU, of which the first two are not valid, and 3 of GNSS.
    assert_eq!(text(&output.stdout).trim(), "3 of imu, 3 of fix");
    let refused = ["render", "scene.ron", "-o", "no", "--sensors", "ego/lane", "--format", "mcap"];
    common::assert_fails(&relief(&refused, folder.path()), 2, &["sensor \"ego/lane\"", "lane"]);
    let refused = ["render", "scene.ron", "-o", "no", "--sensors", "ego/unit", "--format", "png,exr"];
    common::assert_fails(&relief(&refused, folder.path()), 2, &["sensor \"ego/unit\"", "imu"]);
}

#[test]
fn faults_of_these_sensors_name_their_place() {
    let earth = "geo_origin: (latitude_degrees: 48, longitude_degrees: 11),";
    let cases = [
        (earth, "imu(every: 0)", "sensor.every: expected steps from 1"),
        (earth, "imu(noise: (gyroscope_density: -1))", "sensor: noise.gyroscope_density: expected 0 to 100, found -1"),
        (earth, "imu(noise: (accelerometer_bias: (0, 1e9, 0)))", "noise.accelerometer_bias: expected -100 to 100"),
        (earth, "imu(rate: 3)", "rate"),
        (earth, "gnss(noise: (vertical_sigma: -0.5))", "noise.vertical_sigma: expected 0 to 10000, found -0.5"),
        (earth, "gnss(every: 2, phase: 2)", "sensor.phase: expected less than every"),
        ("", "gnss()", "sensor: expected the scene to have a geo_origin"),
        (earth, "collision(margin: -1)", "margin: expected 0 to 10, found -1"),
        (earth, "lane(reach: 0)", "reach: expected above 0 to 15, found 0"),
        ("geo_origin: (latitude_degrees: 91, longitude_degrees: 0),", "imu()", "geo_origin.latitude_degrees: expected"),
        ("geo_origin: (latitude_degrees: 1),", "imu()", "longitude_degrees"),
        (
            "geo_origin: (latitude_degrees: 1, longitude_degrees: 1, at: (0, 1e9, 0)),",
            "imu()",
            "geo_origin.at[1]: expected a number from",
        ),
    ];
    for (of_scene, sensor, expected) in cases {
        let folder = scene_folder(&format!("({of_scene} entities: [(name: \"eye\", sensor: {sensor})])"));
        let output = relief(&["check", "scene.ron"], folder.path());
        let said = text(&output.stdout) + &text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{sensor}: {said}");
        assert!(said.contains(expected), "{expected} is not in: {said}");
    }
    let folder = scene_folder(SCENE);
    let output = relief(&["check", "scene.ron"], folder.path());
    assert!(output.status.success(), "{}", text(&output.stdout));
}
