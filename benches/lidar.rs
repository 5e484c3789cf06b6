//! Beams that a lidar fires in a second in the town, on one thread and on two. It has 128 beams in 1,024 columns and
//! stands in the middle of the main street.
//!
//! `wall/…` is the time that passes, `cpu/…` that of all threads together, which other programs do not lengthen.
//! `nothing` is the same scan where there is nothing to meet: what a beam costs beside its rays. `meshes` makes all
//! trees; `update` is what each capture costs before its first beam where nothing has moved, `moved` where vehicles
//! have.
//!
//! `cargo bench --bench lidar -- cpu/town` runs a part of it.

mod common;

use bevy_tasks::TaskPoolBuilder;
use common::{Clock, CpuTime};
use criterion::measurement::WallTime;
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use relief::scene;
use relief::sense::{Pose, RayScene, lidar};
use std::cell::RefCell;
use std::path::Path;
use std::time::Duration;
use systems::Simulation;
use systems::sensors::philox::Noise;
use systems::sensors::{Beams, LidarSensor};

/// On the right lane of the main street, at the height of a car's roof.
const PLACE: DVec3 = DVec3::new(-20.0, 1.9, 3.2);

fn town() -> Simulation {
    let mut simulation = Simulation::new();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/town.ron");
    scene::load(&path, &mut simulation).expect("the town");
    simulation.frame();
    simulation
}

fn beams<C: Clock>(criterion: &mut Criterion<C>) {
    let town = town();
    let sensor = LidarSensor { beams: Beams::Os1With128, columns: 1024, range: (0.5, 120.0), ..LidarSensor::default() };
    let columns = sensor.revolution();
    let poses = [Pose { translation: PLACE, ..Pose::default() }; 2];
    let mut rays = RayScene::default();
    rays.update(&town);
    let scan = lidar::scan(&rays, &sensor, &poses, columns, Noise::new(0, 0, 0));
    let hits = scan.hit.iter().filter(|&&hit| hit == 1).count();
    println!("{} objects, {hits} of {} beams met something, {:?}", rays.objects(), scan.len(), rays.warnings());

    let mut group = criterion.benchmark_group(C::NAME);
    group.sample_size(20).measurement_time(Duration::from_secs(4));
    group.throughput(Throughput::Elements(scan.len() as u64));
    for (name, rays) in [("town", &rays), ("nothing", &RayScene::default())] {
        for threads in [1, 2] {
            let pool = TaskPoolBuilder::new().num_threads(threads).build();
            group.bench_function(format!("{name}/{threads}"), |bencher| {
                bencher.iter(|| lidar::scan_on(&pool, rays, &sensor, &poses, columns, Noise::new(0, 0, 0)));
            });
        }
    }
    group.sample_size(10);
    group.bench_function("update", |bencher| bencher.iter(|| rays.update(&town)));
    group.bench_function("meshes", |bencher| bencher.iter(|| RayScene::default().update(&town)));
    let town = RefCell::new(town);
    let step = || {
        town.borrow_mut().step();
        town.borrow_mut().frame();
    };
    group.bench_function("moved", |bencher| {
        bencher.iter_batched(step, |()| rays.update(&town.borrow()), BatchSize::PerIteration);
    });
}

criterion_group!(by_wall, beams::<WallTime>);
criterion_group!(name = by_cpu; config = Criterion::default().with_measurement(CpuTime); targets = beams::<CpuTime>);
criterion_main!(by_wall, by_cpu);
