//! Time of the CPU half of a frame: [`Simulation::frame`] with cubes on a square grid, 3 m apart, of 16 materials.
//! Spread over them are 1,000 point lights of 10 m range. Nothing moves, one object in a hundred, or all of them.
//!
//! `…/100000 in tens` has ten cubes below each entity that moves.
//!
//! `wall/…` is the time that passes, `cpu/…` that of all threads together, which other programs do not lengthen. After
//! each follow the medians of the stages, and the milliseconds that only moving the objects takes (writing their
//! `Transform`s, outside of the frame).
//!
//! `cargo bench --bench frame -- wall/1000000` runs a part of it.

mod common;

use bevy_ecs::prelude::*;
use common::{Clock, CpuTime};
use criterion::measurement::WallTime;
use criterion::{Criterion, criterion_group, criterion_main};
use glam::{Vec3, Vec4};
use std::time::{Duration, Instant};
use systems::Simulation;
use systems::assets::{Library, Material, shapes};
use systems::ecs::stats::{FrameStats, Stage};
use systems::lights::Light;
use systems::space::Transform;

/// Metres between two cubes.
const SPACING: f32 = 3.0;
const LIGHTS: usize = 1_000;

/// Marks an object that moves.
#[derive(Component, Clone, Copy)]
struct Moving;

/// The scene, and what its frames took.
struct Scene {
    simulation: Simulation,
    moving: QueryState<(Entity, &'static mut Transform), With<Moving>>,
    frames: usize,
    stages: [Vec<f64>; Stage::ALL.len()],
    moves: Vec<f64>,
}

impl Scene {
    fn new(objects: usize, below_one: usize) -> Self {
        let mut simulation = Simulation::new();
        let mut library = simulation.world.resource_mut::<Library>();
        let cube = library.add_mesh(shapes::cube(Vec3::ONE));
        let material = |i: usize| Material { base_factor: Vec4::splat(i as f32 / 16.0), ..Material::default() };
        let materials: Vec<_> = (0..16).map(|i| library.add_material(material(i))).collect();
        let side = (objects as f32).sqrt().ceil() as usize;
        let place = move |i: usize| Vec3::new((i % side) as f32, 0.0, (i / side) as f32) * SPACING;
        let object = |i: usize| (cube, materials[i % 16], Transform::from_translation(place(i)));
        if below_one == 0 {
            simulation.world.spawn_batch((0..objects).map(|i| (object(i), Moving)));
        } else {
            for first in (0..objects).step_by(below_one) {
                let above = simulation.world.spawn((Transform::IDENTITY, Moving)).id();
                simulation.world.spawn_batch((first..first + below_one).map(|i| (object(i), ChildOf(above))));
            }
        }
        let above = |i: usize| Transform::from_translation(place(i * objects / LIGHTS) + Vec3::Y * 2.0);
        simulation.world.spawn_batch((0..LIGHTS).map(|i| (Light::point(1.0, 10.0), above(i))));
        let moving = simulation.world.query_filtered();
        let mut scene = Self { simulation, moving, frames: 0, stages: Default::default(), moves: Vec::new() };
        (0..3).for_each(|_| scene.simulation.frame());
        scene
    }

    /// Moves one object in `part`, if any, and makes a frame.
    fn frame(&mut self, part: Option<usize>, clock: &impl Clock) -> Duration {
        let moving = Instant::now();
        if let Some(part) = part {
            let step = Vec3::Y * if self.frames.is_multiple_of(2) { 0.1 } else { -0.1 };
            let objects = self.moving.iter_mut(&mut self.simulation.world);
            objects.step_by(part).for_each(|(_, mut place)| place.translation += step);
        }
        self.moves.push(moving.elapsed().as_secs_f64() * 1e3);
        self.frames += 1;
        let started = clock.start();
        self.simulation.frame();
        let took = clock.end(started);
        let stats = self.simulation.world.resource::<FrameStats>();
        self.stages.iter_mut().zip(stats.stage_ms).for_each(|(all, ms)| all.push(ms));
        took
    }

    fn report(&mut self) {
        let median = |times: &mut Vec<f64>| {
            times.sort_by(f64::total_cmp);
            let median = times.get(times.len() / 2).copied().unwrap_or_default();
            times.clear();
            median
        };
        for ((name, _), times) in Stage::ALL.iter().zip(&mut self.stages) {
            print!("{name} {:.3}  ", median(times));
        }
        println!("ms; moving {:.3} ms", median(&mut self.moves));
    }
}

const MOVING: [(&str, Option<usize>); 3] = [("still", None), ("one in a hundred", Some(100)), ("all", Some(1))];

fn frames<C: Clock>(criterion: &mut Criterion<C>) {
    for (scene, objects, below_one) in
        [("100000", 100_000, 0), ("100000 in tens", 100_000, 10), ("1000000", 1_000_000, 0)]
    {
        let mut group = criterion.benchmark_group(format!("{}/{scene}", C::NAME));
        group.sample_size(20).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(3));
        let mut scene = None;
        for (name, part) in MOVING {
            group.bench_function(name, |bencher| {
                let scene = scene.get_or_insert_with(|| Scene::new(objects, below_one));
                bencher.iter_custom(|n| (0..n).map(|_| scene.frame(part, &C::CLOCK)).sum());
            });
            if let Some(scene) = &mut scene {
                scene.report();
            }
        }
    }
}

criterion_group!(by_wall, frames::<WallTime>);
criterion_group!(name = by_cpu; config = Criterion::default().with_measurement(CpuTime); targets = frames::<CpuTime>);
criterion_main!(by_wall, by_cpu);
