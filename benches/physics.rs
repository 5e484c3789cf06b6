//! Cost of physically simulated vehicles and their memory: a step of 100 and of 1,000, apart and in a crowd.
//!
//! `cargo bench --bench physics`

use criterion::{Criterion, criterion_group, criterion_main};
use glam::{Quat, Vec3};
use std::f32::consts::TAU;
use systems::Simulation;
use systems::physics::{Physical, Physics};
use systems::space::Transform;
use systems::vehicles::{Controls, Vehicle, VehicleTypeId};

/// Stand-ins on the plane that drive in circles of 15 m at full throttle, so many metres from one to the next: 40
/// apart, or 12, where they crash into each other.
fn vehicles(count: usize, spacing: f32) -> Simulation {
    let mut simulation = Simulation::new();
    let columns = (count as f32).sqrt().ceil() as usize;
    for i in 0..count {
        let place = Vec3::new((i % columns) as f32, 0.0, (i / columns) as f32) * spacing;
        let turned = Quat::from_rotation_y(TAU * (i as f32 * 0.618).fract());
        let controls = Controls { throttle: 0.3, steer: 0.3, ..Controls::default() };
        let at = Transform::from_translation(place).with_rotation(turned);
        simulation.world.spawn((Vehicle::of(VehicleTypeId::STAND_IN), Physical::default(), controls, at));
    }
    simulation
}

fn step(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("physics");
    group.sample_size(20);
    for (name, spacing) in [("apart", 40.0), ("crowd", 12.0)] {
        for count in [100, 1000] {
            let before = resident();
            let mut simulation = vehicles(count, spacing);
            (0..120).for_each(|_| simulation.step());
            assert_eq!(simulation.world.resource::<Physics>().len(), count);
            let each = (resident() - before) / count as f64;
            println!("{count} {name}: {each:.0} bytes each, its entities included");
            group.bench_function(format!("step/{count}/{name}"), |bencher| bencher.iter(|| simulation.step()));
        }
    }
}

/// Bytes of memory that the process holds; 0 where the system does not say.
fn resident() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kib = line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0.0f64);
    kib * 1024.0
}

criterion_group!(benches, step);
criterion_main!(benches);
