//! A process that goes on drawing what moves does not grow.

#![cfg(target_os = "linux")]

mod common;

use glam::Vec3;
use relief::frames::Headless;
use relief::prelude::{Camera, Library, Light, Simulation, Transform, shapes};
use relief::renderer::{Occlusion, Renderer, Settings};

/// Resident memory in MiB (VmRSS in proc(5)).
fn resident() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("this process");
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).expect("a line for it");
    line.split_whitespace().next().and_then(|kib| kib.parse::<u64>().ok()).expect("a number") >> 10
}

/// Mesa's software driver kept a copy of the culling shader in every frame, 0.4 MB, as long as a branch of it hung on
/// nothing but uniforms.
#[test]
fn hundreds_of_frames_take_no_more_memory_than_some() {
    let Some(gpu) = common::gpu() else { return };
    for (occlusion, samples) in [(Occlusion::Off, 1), (Occlusion::Off, 4), (Occlusion::On, 1)] {
        let mut simulation = Simulation::new();
        let cube = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE));
        let object = simulation.world.spawn(cube).id();
        simulation.world.spawn((Light::point(4.0, 10.0), Transform::from_xyz(1.0, 2.0, 1.0)));
        let eye = Transform::from_xyz(0.0, 1.0, 4.0).looking_at(Vec3::ZERO, Vec3::Y);
        let camera = simulation.world.spawn((Camera::default(), eye)).id();
        let settings = Settings { occlusion, samples, ..Settings::default() };
        let mut headless = Headless { renderer: Renderer::new(&gpu), settings };
        let mut draw = |frames: u32| {
            for frame in 0..frames {
                simulation.world.get_mut::<Transform>(object).expect("lives").translation.x = frame as f32 * 1e-3;
                headless.draw(&mut simulation, camera, (16, 16)).expect("a picture");
            }
            resident()
        };
        let some = draw(60);
        let many = draw(300);
        assert!(many < some + 24, "{some} MB after 60 frames, {many} after 300 more: {occlusion:?}, {samples} samples");
    }
}
