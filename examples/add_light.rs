//! A world in twenty lines: a cube on a floor, a light, a camera, a picture. Then a second light, and another picture.
//!
//! `cargo run --release --example add_light` writes `add_light_1.png` and `add_light_2.png`.

use relief::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut simulation = Simulation::new();
    let mut library = simulation.world.resource_mut::<Library>();
    let cube = library.add_mesh(shapes::cube(Vec3::ONE));
    let floor = library.add_mesh(shapes::plane(Vec2::splat(8.0), UVec2::splat(8)));
    let clay = library.add_material(Material { base_factor: Vec4::new(0.8, 0.4, 0.25, 1.0), ..Material::default() });

    let world = &mut simulation.world;
    world.spawn(floor);
    world.spawn((cube, clay, Transform::from_xyz(0.0, 0.5, 0.0)));
    world.spawn((Light::point(4.0, 12.0), Transform::from_xyz(1.5, 2.0, 1.5)));
    let eye = Transform::from_xyz(2.5, 2.0, 3.5).looking_at(Vec3::Y * 0.4, Vec3::Y);
    let camera = world.spawn((Camera::default(), eye)).id();

    let mut headless = Headless::new()?;
    headless.draw(&mut simulation, camera, (640, 360))?.save("add_light_1.png")?;

    // A light is an entity like any other; what it reaches chooses anew in the next frame.
    let blue = Light::spot(20.0, 12.0, 0.5).with_color(Vec3::new(0.2, 0.4, 1.0));
    simulation.world.spawn((blue, Transform::from_xyz(-2.5, 2.5, 1.0).looking_at(Vec3::ZERO, Vec3::Y)));
    headless.draw(&mut simulation, camera, (640, 360))?.save("add_light_2.png")?;
    Ok(())
}
