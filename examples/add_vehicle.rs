//! Vehicles from a file of types: one line spawns one, with its wheels, its lamps and their light; then it is driven.
//!
//! `cargo run --release --example add_vehicle [TYPE]` writes `add_vehicle.png`; TYPE is `car`, `van`, `bus`, ….

use relief::prelude::*;
use relief::systems::vehicles::Controls;
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let types = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/vehicles.ron");
    let mut simulation = Simulation::new();
    load_vehicle_types(&types, &mut simulation)?;
    let wanted = std::env::args().nth(1).unwrap_or_else(|| "car".to_owned());
    let kind =
        simulation.world.resource::<VehicleTypes>().find(&wanted).ok_or(format!("unknown vehicle type {wanted:?}"))?;
    let turned = Transform::from_rotation(Quat::from_rotation_y(0.9));
    let vehicle = simulation.world.spawn((Vehicle::of(kind), turned)).id();

    let mut library = simulation.world.resource_mut::<Library>();
    let ground = library.add_mesh(shapes::plane(Vec2::splat(4.0), UVec2::splat(4)));
    for tile in 0..100 {
        let place = Vec3::new((tile % 10) as f32 - 3.5, 0.0, (tile / 10) as f32 - 3.5) * 4.0;
        simulation.world.spawn((ground, Transform::from_translation(place)));
    }
    // Evening, so that lamps show.
    let evening = Environment {
        ambient: Vec3::splat(0.03),
        zenith: Vec3::new(0.02, 0.03, 0.08),
        horizon: Vec3::new(0.10, 0.10, 0.14),
        ground: Vec3::splat(0.02),
        ..Environment::default()
    };
    simulation.world.insert_resource(evening);
    let moon = Light::directional(0.25).with_color(Vec3::new(0.6, 0.7, 1.0));
    simulation.world.spawn((moon, Transform::default().looking_to(Vec3::new(-1.0, -1.5, -1.0), Vec3::Y)));
    let eye = Transform::from_xyz(11.0, 3.0, 1.0).looking_at(Vec3::new(4.2, 0.6, 3.4), Vec3::Y);
    let camera = simulation.world.spawn((Camera::default(), eye)).id();

    // A second and a half of full throttle, to the left: wheels, lamps and their light come along.
    if let Some(mut controls) = simulation.world.get_mut::<Controls>(vehicle) {
        (controls.throttle, controls.steer) = (1.0, 0.4);
    }
    (0..90).for_each(|_| simulation.step());
    Headless::new()?.draw(&mut simulation, camera, (1280, 720))?.save("add_vehicle.png")?;
    Ok(())
}
