//! Ten thousand bump-mapped objects and a hundred lights: how few draws that takes, and how little a still frame costs.
//!
//! `cargo run --release --example many_objects [COUNT]` writes `many_objects.png`.

use relief::prelude::*;
use relief::systems::assets::{Image, ImageKind};
use relief::systems::ecs::stats::FrameStats;

/// A normal map of round studs, so that there is something to bump.
fn studs(side: u32) -> Image {
    let pixels = (0..side * side).flat_map(|i| {
        let p = Vec2::new((i % side) as f32, (i / side) as f32) / side as f32 * 4.0;
        let q = (p.fract() - 0.5) * Vec2::new(2.2, -2.2);
        let n = if q.length() < 1.0 { q.extend((1.0 - q.length_squared()).sqrt()) } else { Vec3::Z };
        let [x, y, z] = (n * 127.5 + 127.5).to_array().map(|v| v as u8);
        [x, y, z, 255]
    });
    Image::rgba8("studs", side, side, ImageKind::Normal, pixels.collect())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let count: u32 = std::env::args().nth(1).map_or(Ok(10_000), |text| text.parse())?;
    let side = count.isqrt().max(1);
    let mut simulation = Simulation::new();
    let mut library = simulation.world.resource_mut::<Library>();
    let meshes = [
        library.add_mesh(shapes::cube(Vec3::ONE)),
        library.add_mesh(shapes::sphere(0.6, 16, 8)),
        library.add_mesh(shapes::torus(0.5, 0.2, 16, 8)),
        library.add_mesh(shapes::cylinder(0.5, 1.0, 16)),
    ];
    let normal_map = Some(Map::new(library.add_image(studs(128))));
    let materials: Vec<MaterialId> = (0..16)
        .map(|i| {
            let hue = i as f32 / 16.0 * std::f32::consts::TAU;
            let base = Vec3::new(hue.cos(), (hue - 2.1).cos(), (hue + 2.1).cos()) * 0.35 + 0.5;
            library.add_material(Material { base_factor: base.extend(1.0), normal_map, ..Material::default() })
        })
        .collect();

    let place = |i: u32| Vec3::new((i % side) as f32 - side as f32 / 2.0, 0.0, -((i / side) as f32)) * 1.6;
    simulation.world.spawn_batch(
        (0..count).map(move |i| {
            (meshes[i as usize % 4], materials[i as usize / 4 % 16], Transform::from_translation(place(i)))
        }),
    );
    simulation.world.spawn_batch((0..100).map(move |i| {
        // A large prime spreads them over the field.
        let above = place((i * 7919) % count.max(1)) + Vec3::Y * 2.0;
        (Light::point(6.0, 12.0), Transform::from_translation(above))
    }));
    simulation
        .world
        .spawn((Light::directional(0.25), Transform::default().looking_to(Vec3::new(1.0, -2.0, -1.0), Vec3::Y)));
    let eye = Transform::from_xyz(0.0, 14.0, 12.0).looking_at(Vec3::new(0.0, 0.0, -16.0), Vec3::Y);
    let camera = simulation.world.spawn((Camera::default(), eye)).id();

    let mut headless = Headless::new()?;
    headless.draw(&mut simulation, camera, (1280, 720))?.save("many_objects.png")?;
    let first = headless.renderer.stats();
    headless.draw(&mut simulation, camera, (1280, 720))?;
    let still = headless.renderer.stats();
    let drawn = headless.renderer.read_visible_counts();
    println!("{} objects in view, {} draws, {} triangles", drawn.objects, still.draws, drawn.triangles);
    println!("first frame: {} bytes uploaded; a still frame: {}", first.uploaded_bytes(), still.uploaded_bytes());
    println!("CPU of a still frame: {:.2} ms", simulation.world.resource::<FrameStats>().cpu_ms());
    Ok(())
}
