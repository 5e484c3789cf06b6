//! A process that goes on drawing what moves does not grow.

#![cfg(target_os = "linux")]

mod common;

use crate::common::prelude::*;
use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};
use systems::run::spawn::Spawn;
use systems::run::standard_inputs::Despawn;

/// The memory is the process's: one test at a time.
static ALONE: Mutex<()> = Mutex::new(());

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
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(gpu) = common::gpu() else { return };
    for (occlusion, samples) in [(Occlusion::Off, 1), (Occlusion::Off, 4), (Occlusion::On, 1)] {
        let mut simulation = Simulation::new();
        let cube = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE));
        let object = simulation.world.spawn(cube).id();
        simulation.world.spawn((Light::point(4.0, 10.0), Transform::from_xyz(1.0, 2.0, 1.0)));
        let eye = Transform::from_xyz(0.0, 1.0, 4.0).looking_at(Vec3::ZERO, Vec3::Y);
        let camera = simulation.world.spawn((Camera::default(), eye)).id();
        let settings = Settings { occlusion, samples, ..Settings::default() };
        let mut headless = Headless { renderer: SingleView::new(&gpu), settings };
        let mut draw = |frames: u32| {
            for frame in 0..frames {
                simulation.world.get_mut::<Transform>(object).expect("lives").translation.x = frame as f32 * 1e-3;
                headless.draw(&mut simulation, camera, (16, 16)).expect("a picture");
            }
            resident()
        };
        let some = draw(60);
        let many = draw(300);
        // A fifth of what 300 copies of the shader take: no frame keeps as much as a quarter of one.
        assert!(many < some + 24, "{some} MB after 60 frames, {many} after 300 more: {occlusion:?}, {samples} samples");
    }
}

/// Despawned entities are forgotten everywhere: by the world, the registry, the light and object tables, the adapter.
#[test]
fn what_comes_and_goes_leaves_nothing_behind() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(gpu) = common::gpu() else { return };
    let mut simulation = Simulation::new();
    let cube = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::ONE));
    simulation.world.spawn(cube);
    let eye = Transform::from_xyz(0.0, 4.0, 9.0).looking_at(Vec3::ZERO, Vec3::Y);
    let camera = simulation.world.spawn((Camera::default(), eye)).id();
    register_all(&mut simulation.world);
    let mut headless = Headless { renderer: SingleView::new(&gpu), settings: Settings::default() };
    let mut living: VecDeque<StateId> = VecDeque::new();
    let mut draw = |frames: u32| {
        for frame in 0..frames {
            let transform = Transform::from_xyz((frame % 7) as f32 - 3.0, 0.0, 0.0);
            let (name, kind, controls) = (format!("passing {frame}"), "box".to_owned(), Controls::default());
            let lamp = Spawn::Light { name: name.clone(), transform, light: Light::point(2.0, 5.0) };
            let vehicle = Spawn::Vehicle { name, transform, kind, paint: 0, controls, manual: true };
            for spawn in [lamp, vehicle] {
                let next = simulation.world.resource::<EntityRegistry>().iter().last().map_or(0, |(id, _)| id.0 + 1);
                let mut inputs = simulation.world.resource_mut::<Inputs>();
                inputs.push(spawn);
                living.push_back(StateId(next));
                if living.len() > 20 {
                    living.pop_front().into_iter().for_each(|oldest| inputs.push(Despawn(oldest)));
                }
                simulation.step();
            }
            headless.draw(&mut simulation, camera, (16, 16)).expect("a picture");
        }
        (resident(), simulation.world.entities().count_spawned())
    };
    let (some, entities) = draw(60);
    let (many, later) = draw(300);
    assert!(later <= entities + 20, "{entities} entities, {later} later");
    assert!(many < some + 24, "{some} MB after 60 frames, {many} after 300 more");
}
