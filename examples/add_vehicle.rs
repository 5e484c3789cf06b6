//! A vehicle from a glTF file, with lamps as entities at the file's named nodes: they follow it when it moves.
//!
//! `cargo run --release --example add_vehicle [MODEL]` writes `add_vehicle.png`.

use relief::prelude::*;
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let shipped = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/models/vehicle_van.glb");
    let file = std::env::args().nth(1).unwrap_or_else(|| shipped.to_owned());
    let mut simulation = Simulation::new();
    let model = load_model(Path::new(&file), &mut simulation.world.resource_mut::<Library>())?;
    let vehicle = model.spawn(&mut simulation.world, Transform::from_rotation(Quat::from_rotation_y(0.9)));

    // Every node of the file is an entity with a name; a lamp becomes the child of one and shines along its −Z.
    let mut named = simulation.world.query::<(Entity, &Name)>();
    let lamps: Vec<Entity> = named
        .iter(&simulation.world)
        .filter(|(_, name)| name.starts_with("lamp_head"))
        .map(|(entity, _)| entity)
        .collect();
    for lamp in lamps {
        let beam = Light::spot(8.0, 20.0, 0.5).with_color(Vec3::new(1.0, 0.9, 0.7));
        simulation.world.spawn((beam, ChildOf(lamp)));
    }

    let mut library = simulation.world.resource_mut::<Library>();
    let ground = library.add_mesh(shapes::plane(Vec2::splat(4.0), UVec2::splat(4)));
    for tile in 0..100 {
        let place = Vec3::new((tile % 10) as f32 - 4.5, 0.0, (tile / 10) as f32 - 4.5) * 4.0;
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
    let moon = Light::directional(0.15).with_color(Vec3::new(0.6, 0.7, 1.0));
    simulation.world.spawn((moon, Transform::default().looking_to(Vec3::new(-1.0, -1.5, -1.0), Vec3::Y)));
    let eye = Transform::from_xyz(8.0, 2.6, -2.6).looking_at(Vec3::new(2.4, 0.6, 1.9), Vec3::Y);
    let camera = simulation.world.spawn((Camera::default(), eye)).id();

    let mut headless = Headless::new()?;
    headless.draw(&mut simulation, camera, (1280, 720))?;
    // Driving is moving the entity: wheels, lamps and their light come along.
    if let Some(mut transform) = simulation.world.get_mut::<Transform>(vehicle) {
        let forward = transform.rotation * Vec3::Z;
        transform.translation += forward;
    }
    headless.draw(&mut simulation, camera, (1280, 720))?.save("add_vehicle.png")?;
    Ok(())
}
