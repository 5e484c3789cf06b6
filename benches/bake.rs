//! Time of a bake: normal, height and occlusion maps of 2048² texels from a million triangles. Not criterion: one run
//! says it.
//!
//! `cargo bench --bench bake`; with a folder as argument (`-- FOLDER`), the two meshes are also written there as
//! `low.glb` and `high.glb`, for `relief map bake`.

#[path = "../tests/common/models.rs"]
mod models;

use cpu_time::ProcessTime;
use glam::Affine3A;
use relief::tools::maps::bake::{BakeOptions, Reach, Role, Surface, Target, bake};
use std::path::Path;
use std::time::Instant;

fn main() {
    let (low, high) = (models::coarse_torus(), models::fine_torus(1024, 512));
    if let Some(folder) = std::env::args().skip(1).find(|argument| !argument.starts_with("--")) {
        for (name, mesh) in [("low.glb", &low), ("high.glb", &high)] {
            std::fs::write(Path::new(&folder).join(name), models::glb(&[(mesh, [1.0, 1.0, 1.0])])).expect("written");
        }
    }
    let low = Surface::of_mesh(&low, &Affine3A::IDENTITY, Role::Low { uv_set: 0 }).expect("UVs");
    let high = Surface::of_mesh(&high, &Affine3A::IDENTITY, Role::High).expect("a mesh");
    let (started, cpu) = (Instant::now(), ProcessTime::now());
    let target = Target::new(&high).expect("a surface");
    println!(
        "BVH of {} triangles: {:.2} s, CPU {:.2} s",
        high.triangles.len(),
        started.elapsed().as_secs_f64(),
        cpu.elapsed().as_secs_f64()
    );
    for (size, rays) in [(1024, 24), (2048, 24), (1024, 96)] {
        let options =
            BakeOptions { size: (size, size), rays, reach: Some(Reach::Cage(0.15)), ..BakeOptions::default() };
        let (started, cpu) = (Instant::now(), ProcessTime::now());
        let baked = bake(&low, &target, &options, &|_, _| {}).expect("baked");
        let (wall, cpu) = (started.elapsed().as_secs_f64(), cpu.elapsed().as_secs_f64());
        let rate = baked.report.rays as f64 / cpu / 1e6;
        println!(
            "{size}² texels, {rays} rays for occlusion: {wall:.2} s, CPU {cpu:.2} s, {rate:.2} million rays per CPU second"
        );
        print!("{}", baked.report);
    }
}
