//! Time of a step with 10,000 and 100,000 vehicles that follow each other, change lanes and wait at signals; each has
//! four wheels that turn and eight lamps with lights.
//!
//! `rings`: closed roads of three lanes, 1,000 m round. `town`: a grid of streets of one lane, a crossing with signals
//! every 160 m, where vehicles go straight on or turn.
//!
//! `wall/…` is the time that passes, `cpu/…` that of all threads together, which other programs do not lengthen. After
//! each follow the medians of the systems of a step, one by one, and bytes per vehicle in columns and beside them.
//!
//! `cargo bench --bench traffic -- cpu/rings` runs a part of it.

mod common;

use bevy_ecs::prelude::*;
use bevy_ecs::schedule::SingleThreadedExecutor;
use common::{Clock, CpuTime};
use cpu_time::ProcessTime;
use criterion::measurement::WallTime;
use criterion::{Criterion, criterion_group, criterion_main};
use glam::Vec3;
use std::time::{Duration, Instant};
use systems::Simulation;
use systems::assets::{Library, Material, shapes};
use systems::ecs::clock;
use systems::ecs::sub_steps::SubStep;
use systems::lights::Light;
use systems::space::Transform;
use systems::vehicles::lamps::LampKind;
use systems::vehicles::parts::{Movement, Part, PartLamp};
use systems::vehicles::routes::{RoutePlan, Routes, Stop, Wait};
use systems::vehicles::signals::{Signal, Signals};
use systems::vehicles::{
    OnRoute, RouteId, Vehicle, VehicleType, VehicleTypeId, VehicleTypes, driving, ground, lamps, parts, signals,
};

/// A body, four wheels, eight lamps.
fn car(world: &mut World) -> VehicleTypeId {
    let mut library = world.resource_mut::<Library>();
    let cube = library.add_mesh(shapes::cube(Vec3::ONE));
    let paint = library.add_material(Material::default());
    let lit = library.add_material(Material { emissive_factor: Vec3::ONE, ..Material::default() });
    let part = |x: f32, y: f32, z: f32| Part {
        rest: Transform::from_xyz(x, y, z),
        drawn: Some((cube, paint)),
        ..Part::default()
    };
    let mut parts = vec![part(0.0, 0.8, 1.3)];
    for (x, z) in [(0.75, 0.0), (-0.75, 0.0), (0.75, 2.6), (-0.75, 2.6)] {
        let movement = Some(Movement::Wheel { radius: 0.33, steers: z > 0.0 });
        parts.push(Part { movement, ..part(x, 0.33, z) });
    }
    let kinds = [LampKind::Head, LampKind::Tail, LampKind::IndicatorLeft, LampKind::IndicatorRight];
    for (kind, x) in kinds.into_iter().flat_map(|kind| [(kind, -0.7), (kind, 0.7)]) {
        let light = Some(Light::spot(4.0, 20.0, 0.6));
        let lamp = Some(PartLamp { kind, light, lit: Some(lit) });
        parts.push(Part { lamp, ..part(x, 0.7, if kind == LampKind::Head { 3.5 } else { -0.9 }) });
    }
    let kind = VehicleType { name: "car".into(), parts, ..VehicleType::default() };
    world.resource_mut::<VehicleTypes>().add(kind)
}

/// Rings of three lanes with `vehicles` on them, 100 on each ring.
fn rings(vehicles: usize) -> Vec<RoutePlan> {
    let side = (vehicles as f32 / 100.0).sqrt().ceil() as usize;
    let ring = |i: usize| {
        let center = Vec3::new((i % side) as f32, 0.0, (i / side) as f32) * 350.0;
        let points = (0..48).map(|k| {
            let angle = k as f32 / 48.0 * std::f32::consts::TAU;
            (center + Vec3::new(angle.sin(), 0.0, angle.cos()) * 159.0).as_dvec3()
        });
        RoutePlan { points: points.collect(), spline: true, closed: true, lanes: 3, ..RoutePlan::default() }
    };
    (0..vehicles / 100).map(ring).collect()
}

/// Streets of a square town between crossings, both ways, and the ways across every crossing.
fn town(vehicles: usize) -> (Vec<RoutePlan>, Vec<Signal>) {
    // Streets hold eight vehicles each.
    let side = (((vehicles as f32 / 8.0) / 4.0).sqrt().ceil() as i32).max(2);
    let (block, half) = (160.0, 12.0);
    let crossing = |x: i32, z: i32| (z.rem_euclid(side) * side + x.rem_euclid(side)) as usize;
    let steps = [(0, 1), (1, 0), (0, -1), (-1, 0)];
    let arms = (side * side * 4) as usize;
    // Routes: for each crossing and way out, the street to the next crossing; then for each way in, three ways across.
    let street = |at: usize, way: usize| RouteId((at * 4 + way) as u16);
    let across = |at: usize, way: usize, turn: usize| RouteId((arms + (at * 4 + way) * 3 + turn) as u16);
    let (mut streets, mut turns) = (Vec::new(), Vec::new());
    for at in 0..(side * side) as usize {
        let (x, z) = (at as i32 % side, at as i32 / side);
        let middle = Vec3::new(x as f32, 0.0, z as f32) * block;
        let direction = |way: usize| Vec3::new(steps[way].0 as f32, 0.0, steps[way].1 as f32);
        let beside = |way: usize| direction((way + 3) % 4) * -1.8;
        #[allow(clippy::needless_range_loop)]
        for way in 0..4 {
            let next = crossing(x + steps[way].0, z + steps[way].1);
            let from = middle + direction(way) * half + beside(way);
            let to = middle + direction(way) * (block - half) + beside(way);
            let stop = Stop {
                at: block - 2.0 * half - 1.0,
                wait: Wait::Signal((next * 2 + way % 2) as u32),
                clear: 2.0 * half + 1.0,
            };
            // Out of the town: back to where the street begins.
            let leaves = [x + steps[way].0, z + steps[way].1].iter().any(|at| !(0..side).contains(at));
            let then = (0..3).filter(|_| !leaves).map(|turn| across(next, way, turn)).collect();
            streets.push(RoutePlan {
                points: vec![from.as_dvec3(), to.as_dvec3()],
                stops: vec![stop],
                then,
                ..RoutePlan::default()
            });
            let enter = middle - direction(way) * half + beside(way);
            for turn in [0, 1, 3] {
                let out = (way + turn) % 4;
                let leave = middle + direction(out) * half + beside(out);
                let (a, b) = (enter + direction(way) * 8.0, leave - direction(out) * 8.0);
                let points = if turn == 0 {
                    vec![enter, leave]
                } else {
                    vec![enter, a.lerp(enter, 0.5), (a + b) * 0.5, b.lerp(leave, 0.5), leave]
                };
                turns.push(RoutePlan {
                    points: points.into_iter().map(Vec3::as_dvec3).collect(),
                    spline: turn != 0,
                    then: vec![street(at, out)],
                    ..RoutePlan::default()
                });
            }
        }
    }
    streets.extend(turns);
    let signal = |i: usize| Signal {
        name: format!("{i}"),
        green: vec![15.0, 15.0],
        amber: 3.0,
        red: 2.0,
        offset: (i * 7 % 40) as f32,
    };
    (streets, (0..(side * side) as usize).map(signal).collect())
}

/// The scene, and what its steps took.
struct Scene {
    simulation: Simulation,
    vehicles: usize,
    /// Resident bytes that the scene took.
    bytes: f64,
}

fn resident() -> f64 {
    let status = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    status.split(' ').nth(1).and_then(|pages| pages.parse::<f64>().ok()).unwrap_or(0.0) * 4096.0
}

impl Scene {
    fn new(name: &str, vehicles: usize) -> Self {
        let before = resident();
        let mut simulation = Simulation::new();
        let world = &mut simulation.world;
        let kind = car(world);
        let (plans, signals) = if name == "rings" { (rings(vehicles), Vec::new()) } else { town(vehicles) };
        let streets = if name == "rings" { plans.len() } else { signals.len() * 4 };
        world.insert_resource(Routes::new(plans, false, 1));
        world.insert_resource(Signals::new(signals));
        let each = vehicles.div_ceil(streets);
        for i in 0..vehicles {
            // Along one road after another, as the generators of scenes do.
            let (road, place) = (i / each, i % each);
            let id = RouteId(road as u16);
            let (length, lanes) = world.resource::<Routes>().get(id).map_or((1.0, 1), |r| (r.length, r.lanes()));
            let at = (place as f64 + 0.5) * (length - 10.0) / each as f64;
            world.spawn((Vehicle::of(kind), OnRoute::new(id, place as u8 % lanes, at)));
        }
        // Until they drive as they will.
        (0..300).for_each(|_| simulation.step());
        let bytes = resident() - before;
        Self { simulation, vehicles, bytes }
    }

    /// Medians of systems run one by one, and memory.
    fn report(&mut self, name: &str) {
        let world = &mut self.simulation.world;
        let mut systems: Vec<(&str, Schedule, Vec<f64>)> = vec![
            ("signals", one((clock::tick, next_step, signals::tick_signals, signals::light_heads).chain()), Vec::new()),
            ("ground", one(ground::update_grounds), Vec::new()),
            ("drive", one(driving::drive), Vec::new()),
            ("parts", one(parts::move_parts), Vec::new()),
            ("switches", one(lamps::switch_lamps), Vec::new()),
            ("lamps", one(lamps::light_lamps), Vec::new()),
        ];
        let mut cpu = vec![Vec::new(); systems.len()];
        for _ in 0..120 {
            for ((_, schedule, times), cpu) in systems.iter_mut().zip(&mut cpu) {
                let (start, started) = (ProcessTime::now(), Instant::now());
                schedule.run(world);
                times.push(started.elapsed().as_secs_f64() * 1e3);
                cpu.push(start.elapsed().as_secs_f64() * 1e3);
            }
        }
        let median = |times: &mut Vec<f64>| {
            times.sort_by(f64::total_cmp);
            times.get(times.len() / 2).copied().unwrap_or_default()
        };
        print!("{name}/{}:", self.vehicles);
        for ((name, _, times), cpu) in systems.iter_mut().zip(&mut cpu) {
            print!("  {name} {:.3} wall {:.3} cpu", median(times), median(cpu));
        }
        println!(" ms; {:.0} bytes of the process per vehicle", self.bytes / self.vehicles as f64);
    }
}

/// Advances the world's time before vehicles drive: theirs is the whole step.
fn next_step(clock: Res<clock::Clock>, mut now: ResMut<SubStep>) {
    SubStep::of(&clock).for_each(|part| *now = part);
}

fn one<M>(systems: impl IntoScheduleConfigs<bevy_ecs::system::ScheduleSystem, M>) -> Schedule {
    let mut schedule = Schedule::default();
    schedule.set_executor(SingleThreadedExecutor::new());
    schedule.add_systems(systems);
    schedule
}

fn steps<C: Clock>(criterion: &mut Criterion<C>) {
    for name in ["rings", "town"] {
        for vehicles in [10_000, 100_000] {
            let mut group = criterion.benchmark_group(format!("{}/{name}", C::NAME));
            group.sample_size(20).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(3));
            let mut scene = None;
            group.bench_function(vehicles.to_string(), |bencher| {
                let scene = scene.get_or_insert_with(|| Scene::new(name, vehicles));
                bencher.iter(|| scene.simulation.step());
            });
            if let Some(scene) = &mut scene {
                scene.report(name);
            }
        }
    }
}

criterion_group!(by_wall, steps::<WallTime>);
criterion_group!(name = by_cpu; config = Criterion::default().with_measurement(CpuTime); targets = steps::<CpuTime>);
criterion_main!(by_wall, by_cpu);
