//! A camera and a lidar on a car, spawned by a program: what they measure, step by step, as arrays.
//!
//! `cargo run --release --example sensors`

use relief::prelude::*;
use relief::renderer::Gpu;
use relief::sense::SensorSuite;
use relief::session::{LoadOptions, Session};
use std::error::Error;
use std::path::Path;
use systems::run::registry::register_all;
use systems::sensors::{Beams, CameraOutput, CameraSensor, Instance, LidarSensor, Sensor};

fn main() -> Result<(), Box<dyn Error>> {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/traffic.ron");
    let mut stage = Session::load(&scene, &LoadOptions::default())?;
    let simulation = &mut stage.simulation;

    // On the first vehicle: ahead is its +Z, where a camera looks along its own −Z.
    let world = &mut simulation.world;
    let car = world.query_filtered::<Entity, (With<Instance>, With<Children>)>().iter(world).next();
    let car = car.ok_or("expected a vehicle in the scene")?;
    world.entity_mut(car).insert(Name::new("ego"));
    let camera = CameraSensor { size: (160, 120), samples: 1, ..CameraSensor::default() }
        .with(CameraOutput::Depth)
        .with(CameraOutput::Instance);
    let ahead = Transform::from_xyz(0.0, 1.4, 3.0).with_rotation(Quat::from_rotation_y(std::f32::consts::PI));
    world.spawn((Sensor::camera(camera).every(6), Name::new("front"), ahead, ChildOf(car)));
    let lidar = LidarSensor { beams: Beams::Vlp16, range: (2.0, 100.0), ..LidarSensor::default() };
    world.spawn((Sensor::lidar(lidar).every(6), Name::new("top"), Transform::from_xyz(0.0, 4.5, 0.0), ChildOf(car)));
    // Numbers for what is new, as a scene's loader gives them.
    register_all(world);

    let mut sensors = SensorSuite::new(&Gpu::headless()?);
    for _ in 0..18 {
        simulation.step();
        let capture = sensors.capture(simulation)?;
        let Some(front) = capture.get("ego/front").and_then(|sensor| sensor.camera()) else { continue };
        let nearest = front.depth.iter().copied().fold(f32::INFINITY, f32::min);
        let mut things = front.instance.clone();
        things.sort_unstable();
        things.dedup();
        let returns =
            capture["ego/top"].lidar().map_or(0, |lidar| lidar.scan.hit.iter().filter(|hit| **hit == 1).count());
        let (step, things) = (capture.step, things.len());
        println!(
            "step {step}: {things} numbers in the picture, nearest {nearest:.2} m; {returns} returns of the lidar"
        );
    }
    Ok(())
}
