//! How long the choice of lights takes, in nanoseconds per object, on one thread.
//!
//! `cargo bench --bench light_selection -- city/1000000` runs a part of it. `floor` is what memory alone costs: every
//! sphere read, every selection written.

use cpu_time::ThreadTime;
use criterion::measurement::{Measurement, ValueFormatter, WallTime};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use relief::bench::Night;
use std::hint::black_box;
use std::time::Duration;
use systems::bounds::Sphere;
use systems::light_search::{Level, Scratch, select};
use systems::light_tree::LightTree;
use systems::lights::{LightPolicy, ScoredLight, Selection};
use systems::object_order::along_the_curve;

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
    for (name, scene) in [("scattered", Night::scattered as fn(usize, usize, u64) -> Night), ("city", Night::city)] {
        for objects in [10_000, 100_000, 1_000_000] {
            let mut group = criterion.benchmark_group(format!("{name}/{objects}"));
            group.throughput(Throughput::Elements(objects as u64));
            group.sample_size(10).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(2));
            for lights in [100, 1_000, 10_000, 100_000] {
                let night = scene(objects, lights, 1);
                let scored: Vec<ScoredLight> = night.records().iter().map(ScoredLight::new).collect();
                let spheres = along_the_curve(&night.objects);
                let mut out = vec![Selection::default(); objects];
                let mut tree = LightTree::new(&scored);
                group.bench_function(BenchmarkId::new("tree", lights), |b| b.iter(|| tree.build(black_box(&scored))));
                for (kind, policy) in
                    [("three alone", LightPolicy::Hard), ("weights and remainder", LightPolicy::Three)]
                {
                    let mut scratch = Scratch::default();
                    group.bench_function(BenchmarkId::new(kind, lights), |b| {
                        b.iter(|| {
                            select(Level::new(), &tree, &scored, policy, (black_box(&spheres), &mut out), &mut scratch)
                        });
                    });
                }
            }
            let spheres = vec![Sphere::default(); objects];
            let mut out = vec![Selection::default(); objects];
            group.bench_function("floor", |b| b.iter(|| touch(black_box(&spheres), black_box(&mut out))));
        }
    }
}

/// Reads and writes what a search reads and writes at least.
fn touch(spheres: &[Sphere], out: &mut [Selection]) {
    for (sphere, out) in spheres.iter().zip(out) {
        *out = Selection { remainder_ambient: sphere.center, dropped: sphere.radius, ..Selection::default() };
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().with_measurement(PerObject);
    targets = searches
}
criterion_main!(benches);
