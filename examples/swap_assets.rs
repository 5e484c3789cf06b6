//! Meshes and images that come and go while they are drawn: a ball becomes a torus, its image another one, then both
//! are unloaded. Prints what the library and the device hold.
//!
//! `cargo run --release --example swap_assets` writes `swap_assets_1.png` and `swap_assets_2.png`.

use relief::prelude::*;
use relief::renderer::HeldBytes;
use relief::systems::assets::{Image, ImageKind, LibraryBytes};

const SIZE: (u32, u32) = (640, 360);

/// Squares of a colour.
fn checkered(side: u32, rgb: [u8; 3]) -> Image {
    let texel = |i: u32| {
        let light = if (i % side / 16 + i / side / 16).is_multiple_of(2) { 1 } else { 3 };
        let [r, g, b] = rgb.map(|value| value / light);
        [r, g, b, 255]
    };
    Image::rgba8("checkered", side, side, ImageKind::Color, (0..side * side).flat_map(texel).collect())
}

fn print_memory(what: &str, simulation: &Simulation, headless: &Headless) {
    let LibraryBytes { meshes, images } = simulation.library().bytes();
    let HeldBytes { meshes: on_device, textures, .. } = headless.renderer.held_bytes();
    let kib = |bytes: u64| bytes.div_ceil(1024);
    println!(
        "{what:9} meshes {:5} KiB, {:5} KiB on the device; images {:5} KiB, {:5} KiB on the device",
        kib(meshes),
        kib(on_device),
        kib(images),
        kib(textures)
    );
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut simulation = Simulation::new();
    let mut library = simulation.world.resource_mut::<Library>();
    let floor = library.add_mesh(shapes::plane(Vec2::splat(8.0), UVec2::splat(8)));
    let shape = library.add_mesh(shapes::sphere(0.8, 256, 128));
    let image = library.add_image(checkered(256, [230, 120, 60]));
    let material = library.add_material(Material { base_map: Some(Map::new(image)), ..Material::default() });

    let world = &mut simulation.world;
    world.spawn(floor);
    world.spawn((shape, material, Transform::from_xyz(0.0, 0.8, 0.0)));
    world.spawn((Light::point(6.0, 12.0), Transform::from_xyz(1.5, 2.5, 2.5)));
    let eye = Transform::from_xyz(2.5, 2.0, 3.5).looking_at(Vec3::Y * 0.4, Vec3::Y);
    let camera = world.spawn((Camera::default(), eye)).id();
    let mut headless = Headless::new()?;
    headless.draw(&mut simulation, camera, SIZE)?.save("swap_assets_1.png")?;
    print_memory("loaded", &simulation, &headless);

    // What uses them is drawn with the new ones: ids stay.
    let mut library = simulation.world.resource_mut::<Library>();
    library.replace_mesh(shape, shapes::torus(0.7, 0.3, 64, 32));
    library.replace_image(image, checkered(128, [80, 140, 230]));
    headless.draw(&mut simulation, camera, SIZE)?.save("swap_assets_2.png")?;
    print_memory("replaced", &simulation, &headless);

    // The object is not drawn any more. Its ids name nothing, also when others take their slots.
    let mut library = simulation.world.resource_mut::<Library>();
    library.remove_mesh(shape);
    library.remove_material(material);
    library.remove_image(image);
    headless.draw(&mut simulation, camera, SIZE)?;
    print_memory("unloaded", &simulation, &headless);
    Ok(())
}
