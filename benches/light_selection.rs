//! Time of the choice of lights, in nanoseconds of processor time per object, which other programs do not lengthen.
//!
//! `scattered/…` and `city/…` search for all objects on one thread: `three alone` is the hard choice, `tree` what the
//! light tree costs, `floor` what memory alone costs, every sphere read and every selection written. `frame/…` runs the
//! frame's own systems on a world of entities, all threads added up, after nothing moved, one in a hundred objects and
//! lights (spread over the world, or next to each other), or all of them. `shadow maps/…` ranks all lights of a city for
//! 32 maps: seen from its middle; turned away from all of it, where no bound leaves a light out; and with the lights in
//! such an order that each is more important than those before it.
//!
//! `cargo bench --bench light_selection -- city/1000000` runs a part of it.

use bevy_ecs::prelude::*;
use bevy_ecs::schedule::SingleThreadedExecutor;
use cpu_time::{ProcessTime, ThreadTime};
use criterion::measurement::{Measurement, ValueFormatter, WallTime};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{Affine3A, Quat, Vec3};
use relief::tools::bench::{Movers, NightLights};
use std::hint::black_box;
use std::time::Duration;
use systems::Simulation;
use systems::assets::{Library, Mesh};
use systems::draw::{Camera, Environment, View, update_light_table};
use systems::lights::search::{Level, Scratch, select};
use systems::lights::{
    LightPolicy, LightTable, LightTree, Policies, ScoredLight, SelectedLights, along_the_curve, rank, select_lights,
};
use systems::space::{GlobalTransform, Sphere};

/// Processor time of this thread, which other programs do not lengthen, shown per object.
struct PerObject;

impl Measurement for PerObject {
    type Intermediate = ThreadTime;
    type Value = Duration;

    fn start(&self) -> ThreadTime {
        ThreadTime::now()
    }

    fn end(&self, start: ThreadTime) -> Duration {
        start.elapsed()
    }

    fn add(&self, a: &Duration, b: &Duration) -> Duration {
        *a + *b
    }

    fn zero(&self) -> Duration {
        Duration::ZERO
    }

    fn to_f64(&self, value: &Duration) -> f64 {
        value.as_nanos() as f64
    }

    fn formatter(&self) -> &dyn ValueFormatter {
        self
    }
}

impl ValueFormatter for PerObject {
    fn scale_values(&self, typical: f64, values: &mut [f64]) -> &'static str {
        WallTime.formatter().scale_values(typical, values)
    }

    fn scale_throughputs(&self, _typical: f64, throughput: &Throughput, values: &mut [f64]) -> &'static str {
        let Throughput::Elements(objects) = throughput else { return "ns" };
        values.iter_mut().for_each(|value| *value /= *objects as f64);
        "ns/object"
    }

    fn scale_for_machines(&self, values: &mut [f64]) -> &'static str {
        WallTime.formatter().scale_for_machines(values)
    }
}

fn searches(criterion: &mut Criterion<PerObject>) {
    println!("instruction set: {:?}", Level::new());
    for (name, scene) in
        [("scattered", NightLights::scattered as fn(usize, usize, u64) -> NightLights), ("city", NightLights::city)]
    {
        for objects in [10_000, 100_000, 1_000_000] {
            let mut group = criterion.benchmark_group(format!("{name}/{objects}"));
            group.throughput(Throughput::Elements(objects as u64));
            group.sample_size(10).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(2));
            for lights in [100, 1_000, 10_000, 100_000] {
                let night = scene(objects, lights, 1);
                let scored: Vec<ScoredLight> = night.records().iter().map(ScoredLight::new).collect();
                let spheres = along_the_curve(&night.objects);
                let mut out = vec![SelectedLights::default(); objects];
                let mut tree = LightTree::new(&scored);
                group.bench_function(BenchmarkId::new("tree", lights), |b| b.iter(|| tree.build(black_box(&scored))));
                let kinds = [
                    ("three alone", LightPolicy::Hard),
                    ("weights and residual", LightPolicy::Three),
                    ("enough", LightPolicy::ENOUGH),
                ];
                for (kind, policy) in kinds {
                    let policies = Policies::Same(policy);
                    let mut scratch = Scratch::default();
                    group.bench_function(BenchmarkId::new(kind, lights), |b| {
                        b.iter(|| {
                            let work = (black_box(&spheres[..]), &mut out[..]);
                            select(Level::new(), &tree, &scored, policies, work, &mut scratch)
                        });
                    });
                }
            }
            let spheres = vec![Sphere::default(); objects];
            let mut out = vec![SelectedLights::default(); objects];
            group.bench_function("floor", |b| b.iter(|| touch(black_box(&spheres), black_box(&mut out))));
        }
    }
}

/// A world with the objects and lights of a night, and the systems that choose lights.
struct Frames {
    world: World,
    schedule: Schedule,
    objects: Vec<Entity>,
    lights: Vec<Entity>,
    night: NightLights,
}

/// Transform that gives a mesh whose bounds are the unit sphere these bounds.
fn filling(bounds: Sphere) -> GlobalTransform {
    Affine3A::from_scale_rotation_translation(Vec3::splat(bounds.radius), Quat::IDENTITY, bounds.center).into()
}

impl Frames {
    fn new(night: NightLights) -> Self {
        let mut world = Simulation::new().world;
        let ball = Mesh { positions: vec![Vec3::X, Vec3::NEG_X], ..Mesh::default() };
        let ball = world.resource_mut::<Library>().add_mesh(ball);
        let placed = night.objects.iter().map(|&sphere| (ball, filling(sphere))).collect::<Vec<_>>();
        let objects = world.spawn_batch(placed).collect();
        let placed = night.lights.iter().map(|(light, place)| (light.clone(), GlobalTransform::from(*place)));
        let lights = world.spawn_batch(placed.collect::<Vec<_>>()).collect();
        let mut schedule = Schedule::default();
        schedule.set_executor(SingleThreadedExecutor::new());
        schedule.add_systems((update_light_table, select_lights).chain());
        schedule.run(&mut world);
        Self { world, schedule, objects, lights, night }
    }

    /// Moves objects and lights, and times the systems.
    fn run(&mut self, movers: &Movers) -> Duration {
        self.night.advance(movers);
        for &i in &movers.objects {
            *self.world.get_mut::<GlobalTransform>(self.objects[i]).unwrap() = filling(self.night.objects[i]);
        }
        for &i in &movers.lights {
            *self.world.get_mut::<GlobalTransform>(self.lights[i]).unwrap() = self.night.lights[i].1.into();
        }
        let start = ProcessTime::now();
        self.schedule.run(&mut self.world);
        start.elapsed()
    }
}

fn frames(criterion: &mut Criterion<PerObject>) {
    for (name, scene) in
        [("scattered", NightLights::scattered as fn(usize, usize, u64) -> NightLights), ("city", NightLights::city)]
    {
        let (objects, lights) = (1_000_000, 100_000);
        let mut group = criterion.benchmark_group(format!("frame/{name}/{objects}"));
        group.throughput(Throughput::Elements(objects as u64));
        group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(4));
        let mut frames = None;
        type Choice = fn(&NightLights) -> Movers;
        let kinds: [(&str, Choice); 4] = [
            ("still", |_| Movers::default()),
            ("one in a hundred", |night| night.some(100)),
            ("one in a hundred, a district", |night| night.district(100)),
            ("all", NightLights::all),
        ];
        for (kind, movers) in kinds {
            group.bench_function(BenchmarkId::new(kind, lights), |b| {
                let frames = frames.get_or_insert_with(|| Frames::new(scene(objects, lights, 1)));
                let movers = movers(&frames.night);
                b.iter_custom(|n| (0..n).map(|_| frames.run(&movers)).sum());
            });
        }
    }
}

fn shadow_maps(criterion: &mut Criterion<PerObject>) {
    let lights = 100_000;
    let mut group = criterion.benchmark_group("shadow maps");
    group.throughput(Throughput::Elements(lights as u64));
    group.sample_size(20).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(2));
    let mut night = NightLights::city(0, lights, 1);
    let middle = night.lights.iter().map(|(_, place)| place.translation).sum::<Vec3>() / lights as f32;
    let away = Vec3::X * 2.0 * middle.x;
    let seen = [("city", middle, Vec3::X), ("turned away", away, Vec3::X), ("ascending", away, Vec3::NEG_X)];
    for (name, eye, direction) in seen {
        let place = Affine3A::from_rotation_translation(Quat::from_rotation_arc(Vec3::NEG_Z, direction), eye);
        let view = View::new(&place, &Camera::default(), 1280, 720).shadow_view(&Environment::default());
        if name == "ascending" {
            night.lights.sort_by(|(_, a), (_, b)| a.translation.x.total_cmp(&b.translation.x));
        }
        let world = with_shadows(&night);
        let table = world.resource::<LightTable>();
        group.bench_function(BenchmarkId::new(name, lights), |b| {
            b.iter(|| rank(black_box(table.shadow_lights()), black_box(&view), 32));
        });
    }
}

/// A world with the lights of a night, all of which cast shadows.
fn with_shadows(night: &NightLights) -> World {
    let mut world = Simulation::new().world;
    let placed =
        night.lights.iter().map(|(light, place)| (light.clone().with_shadows(), GlobalTransform::from(*place)));
    world.spawn_batch(placed.collect::<Vec<_>>());
    let mut schedule = Schedule::default();
    schedule.set_executor(SingleThreadedExecutor::new());
    schedule.add_systems(update_light_table);
    schedule.run(&mut world);
    world
}

/// Reads and writes what a search reads and writes at least.
fn touch(spheres: &[Sphere], out: &mut [SelectedLights]) {
    for (sphere, out) in spheres.iter().zip(out) {
        *out = bytemuck::cast([sphere.center.x.to_bits(), sphere.radius.to_bits(), 0, 0, 0, 0, 0, 0, 0, 0]);
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().with_measurement(PerObject);
    targets = searches, frames, shadow_maps
}
criterion_main!(benches);
