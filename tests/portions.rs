//! Passes over many triangles are cut into portions where that saves memory; the picture is the same.

mod common;

use glam::Vec3;
use relief::frames::Headless;
use relief::prelude::{Camera, Library, Light, Simulation, Transform, shapes};
use relief::renderer::{Occlusion, Renderer, Settings};
use std::num::NonZeroU32;
use systems::library::{AlphaMode, Material, MaterialId, Technique};

/// Cubes, spheres and a few blended objects in 16 rows; a directional light; a camera that sees them all.
fn field(columns: u32) -> (Simulation, bevy_ecs::entity::Entity) {
    let mut simulation = Simulation::new();
    let mut library = simulation.world.resource_mut::<Library>();
    let meshes = [shapes::cube(Vec3::ONE), shapes::sphere(0.5, 24, 16)].map(|mesh| library.add_mesh(mesh));
    let mut material = |red: f32, alpha| {
        let base_factor = Vec3::new(red, 0.5, 0.2).extend(0.5);
        library.add_material(Material { base_factor, alpha, ..Material::default() })
    };
    let materials: [MaterialId; 3] =
        [material(0.9, AlphaMode::Opaque), material(0.1, AlphaMode::Mask), material(0.5, AlphaMode::Blend)];
    for i in 0..16 * columns {
        let kind = if i % 50 == 0 { 2 } else { (i % 2) as usize };
        let place = Vec3::new((i % columns) as f32 - columns as f32 / 2.0, 0.0, -1.5 * (i / columns) as f32);
        let turned = Transform::from_translation(place).with_rotation(glam::Quat::from_rotation_y(i as f32));
        simulation.world.spawn((meshes[i as usize / 3 % 2], materials[kind], turned));
    }
    simulation.world.spawn((Light::directional(1.0), Transform::default().looking_to(-Vec3::ONE, Vec3::Y)));
    let eye = Transform::from_xyz(0.0, 14.0, 16.0).looking_at(Vec3::NEG_Z * 10.0, Vec3::Y);
    let camera = simulation.world.spawn((Camera::default(), eye)).id();
    (simulation, camera)
}

#[test]
fn a_picture_is_the_same_in_portions() {
    let Some(gpu) = common::gpu() else { return };
    for (occlusion, samples, technique) in [
        (Occlusion::On, 1, None),
        (Occlusion::Off, 1, None),
        (Occlusion::On, 4, None),
        (Occlusion::On, 1, Some(Technique::EmbossMultipass)),
    ] {
        let settings = Settings { occlusion, samples, technique, ..Settings::default() };
        let case = format!("{occlusion:?}, {samples} samples, {technique:?}");
        let (mut simulation, camera) = field(24);
        let mut drawers = [None, NonZeroU32::new(2000)].map(|triangles| {
            let mut renderer = Renderer::new(&gpu);
            renderer.cut_passes(triangles);
            Headless { renderer, settings }
        });
        // Still at first, and again at the end.
        for frame in 0..9 {
            let moved = (frame as f32).clamp(3.0, 6.0);
            simulation.world.get_mut::<Transform>(camera).expect("lives").translation.x = moved;
            let [whole, cut] =
                drawers.each_mut().map(|drawer| drawer.draw(&mut simulation, camera, (128, 72)).expect("a picture"));
            assert!(whole.pixels().any(|pixel| pixel != whole.get_pixel(0, 0)), "{case}: nothing to see");
            assert!(whole == cut, "{case}: frame {frame} differs");
            let [whole, cut] = drawers.each_ref().map(|drawer| drawer.renderer.stats());
            assert_eq!(whole.draws, cut.draws, "{case}: frame {frame}");
            // Emboss passes add up over all that the others left: they stay whole.
            let is_cut = technique != Some(Technique::EmbossMultipass);
            assert!(whole.passes <= 2 && (cut.passes >= 6) == is_cut, "{case}: frame {frame}: {} passes", cut.passes);
        }
    }
}

/// In the first frame nobody knows what is in view; in the next ones what the late phase drew is drawn early. In each of
/// them, no pass is over many more triangles than it may be.
#[test]
fn portions_are_of_the_size_that_was_asked_for() {
    let Some(gpu) = common::gpu() else { return };
    let mut renderer = Renderer::new(&gpu);
    let settings = Settings { occlusion: Occlusion::On, ..Settings::default() };
    const PORTION: u32 = 1500;
    renderer.cut_passes(NonZeroU32::new(PORTION));
    let mut headless = Headless { renderer, settings };
    let (mut simulation, camera) = field(64);
    for frame in 0..6 {
        headless.draw(&mut simulation, camera, (128, 72)).expect("a picture");
        let (drawn, passes) = (headless.renderer.read_drawn(), headless.renderer.stats().passes);
        let fewest = drawn.triangles as u32 / PORTION;
        assert!(drawn.triangles > 10 * u64::from(PORTION), "frame {frame}: {drawn:?}");
        // In the second frame the early phase draws what was late in the first; that nothing is late then, nobody knows.
        let phases = if frame == 1 { 2 } else { 1 };
        assert!(passes >= phases * fewest, "frame {frame}: {passes} passes, {drawn:?}");
        // In the still view it is known what is in view; not all draws fill their last portion.
        assert!(frame < 4 || passes <= 2 * fewest, "frame {frame}: {passes} passes, {drawn:?}");
    }
}
