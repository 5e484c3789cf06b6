//! Memory of an object. A process with a single object is compared with processes of many, each a scene of its own.
//!
//! `cargo bench --bench memory` prints the columns of an object in its table, and bytes per object of what the process
//! holds (VmRSS) and of the most that it held (VmHWM): `spawned`, before any frame; the `world` alone after a few
//! frames; and `drawn` by a renderer, whose buffers a software adapter keeps in the same memory.

use glam::{Vec3, Vec4};
use relief::prelude::*;
use std::process::Command;
use systems::space::Transform;

const OBJECTS: [usize; 3] = [1, 100_000, 1_000_000];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    if let [mode, objects] = &arguments[..] {
        return scene(mode, objects.parse()?);
    }
    print_columns();
    for mode in ["spawned", "world", "drawn"] {
        let mut one = None;
        for objects in OBJECTS {
            let output = Command::new(std::env::current_exe()?).args([mode, &objects.to_string()]).output()?;
            let text = String::from_utf8(output.stdout)?;
            let held: Vec<f64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
            let [rss, peak] = held[..] else {
                println!("{mode}, {objects} objects: {}", String::from_utf8_lossy(&output.stderr));
                continue;
            };
            let (rss_one, peak_one) = *one.get_or_insert((rss, peak));
            let each = |kib: f64| kib * 1024.0 / (objects - 1).max(1) as f64;
            println!(
                "{mode}, {objects} objects: {:.1} MB held, {:.1} MB at most; per object {:.0} B held, {:.0} B at most",
                rss / 1e3,
                peak / 1e3,
                each(rss - rss_one),
                each(peak - peak_one)
            );
        }
    }
    Ok(())
}

/// Builds a scene, makes some frames of it, and prints KiB held and the most held.
fn scene(mode: &str, objects: usize) -> Result<(), Box<dyn std::error::Error>> {
    let (mut simulation, camera) = grid(objects);
    let mut headless = if mode == "drawn" { Some(Headless::new()?) } else { None };
    for _ in 0..if mode == "spawned" { 0 } else { 4 } {
        match &mut headless {
            Some(headless) => _ = headless.draw(&mut simulation, camera, (64, 36))?,
            None => simulation.frame(),
        }
    }
    let status = std::fs::read_to_string("/proc/self/status")?;
    let field = |name: &str| status.lines().find_map(|line| line.strip_prefix(name)?.split_whitespace().next());
    println!("{} {}", field("VmRSS:").ok_or("no VmRSS")?, field("VmHWM:").ok_or("no VmHWM")?);
    Ok(())
}

/// Cubes 3 m apart, 16 materials, 1,000 lights.
fn grid(objects: usize) -> (Simulation, Entity) {
    let mut simulation = Simulation::new();
    let mut library = simulation.world.resource_mut::<Library>();
    let cube = library.add_mesh(shapes::cube(Vec3::ONE));
    let material = |i: usize| Material { base_factor: Vec4::splat(i as f32 / 16.0), ..Material::default() };
    let materials: Vec<MaterialId> = (0..16).map(|i| library.add_material(material(i))).collect();
    let side = objects.isqrt().max(1);
    let place = move |i: usize| Transform::from_xyz((i % side) as f32 * 3.0, 0.0, -3.0 * (i / side) as f32);
    simulation.world.spawn_batch((0..objects).map(move |i| (cube, materials[i % 16], place(i))));
    let above = move |i: usize| place(i * objects / 1000) * Transform::from_xyz(0.0, 2.0, 0.0);
    simulation.world.spawn_batch((0..1000).map(move |i| (Light::point(1.0, 10.0), above(i))));
    let camera = simulation.world.spawn((Camera::default(), Transform::from_xyz(0.0, 30.0, 30.0))).id();
    (simulation, camera)
}

/// The columns that an object has in its table: 8 bytes of each row are change ticks.
fn print_columns() {
    let (simulation, _) = grid(1);
    let world = &simulation.world;
    let Some(archetype) = world.archetypes().iter().find(|archetype| {
        archetype.components().iter().any(|&id| {
            world.components().get_info(id).is_some_and(|info| info.type_id() == Some(std::any::TypeId::of::<MeshId>()))
        }) && !archetype.is_empty()
    }) else {
        return;
    };
    let mut all = 0;
    for &id in archetype.components() {
        let Some(info) = world.components().get_info(id) else { continue };
        println!("{:4} + 8  {}", info.layout().size(), info.name());
        all += info.layout().size() + 8;
    }
    println!("{all} bytes per object in columns");
}
