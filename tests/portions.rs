//! Passes over many triangles are cut into portions where that saves memory; the picture is the same.

mod common;

use glam::Vec3;
use relief::frames::Headless;
use relief::prelude::{Camera, Library, Light, Simulation, Transform, shapes};
use relief::renderer::{Gpu, Occlusion, Settings, SingleView};
use std::num::NonZeroU32;
use systems::assets::{AlphaMode, Material, MaterialId, Technique};

/// Cubes, spheres and a few blended objects in 16 rows; a directional light; a camera that sees them all.
fn field(columns: u32) -> (Simulation, bevy_ecs::entity::Entity) {
    let mut simulation = Simulation::new();
    spawn(&mut simulation, columns, 0..16 * columns);
    simulation.world.spawn((Light::directional(1.0), Transform::default().looking_to(-Vec3::ONE, Vec3::Y)));
    let eye = Transform::from_xyz(0.0, 14.0, 16.0).looking_at(Vec3::NEG_Z * 10.0, Vec3::Y);
    let camera = simulation.world.spawn((Camera::default(), eye)).id();
    (simulation, camera)
}

/// Spawns some of the field's objects, with meshes and materials of their own.
fn spawn(simulation: &mut Simulation, columns: u32, some: std::ops::Range<u32>) {
    let mut library = simulation.world.resource_mut::<Library>();
    let meshes = [shapes::cube(Vec3::ONE), shapes::sphere(0.5, 24, 16)].map(|mesh| library.add_mesh(mesh));
    let mut material = |red: f32, alpha| {
        let base_factor = Vec3::new(red, 0.5, 0.2).extend(0.5);
        library.add_material(Material { base_factor, alpha, ..Material::default() })
    };
    let materials: [MaterialId; 3] =
        [material(0.9, AlphaMode::Opaque), material(0.1, AlphaMode::Mask), material(0.5, AlphaMode::Blend)];
    for i in some {
        let kind = if i % 50 == 0 { 2 } else { (i % 2) as usize };
        let place = Vec3::new((i % columns) as f32 - columns as f32 / 2.0, 0.0, -1.5 * (i / columns) as f32);
        let turned = Transform::from_translation(place).with_rotation(glam::Quat::from_rotation_y(i as f32));
        simulation.world.spawn((meshes[i as usize / 3 % 2], materials[kind], turned));
    }
}

#[test]
fn a_picture_is_the_same_in_portions() {
    let Some(gpu) = common::gpu() else { return };
    let plain = Gpu::headless_with(wgpu::Features::empty()).expect("the same adapter");
    for (occlusion, samples, technique) in [
        (Occlusion::On, 1, None),
        (Occlusion::Off, 1, None),
        (Occlusion::On, 4, None),
        (Occlusion::On, 1, Some(Technique::EmbossMultipass)),
    ] {
        let settings = Settings { occlusion, samples, technique, ..Settings::default() };
        let case = format!("{occlusion:?}, {samples} samples, {technique:?}");
        let (mut simulation, camera) = field(24);
        let drawer = |gpu: &Gpu, triangles| {
            let mut renderer = SingleView::new(gpu);
            renderer.cut_passes(NonZeroU32::new(triangles));
            Headless { renderer, settings }
        };
        let mut drawers = [drawer(&gpu, 0), drawer(&gpu, 1000), drawer(&plain, 1000)];
        // Still at first, and again at the end.
        for frame in 0..9 {
            let moved = (frame as f32).clamp(3.0, 6.0);
            simulation.world.get_mut::<Transform>(camera).expect("lives").translation.x = moved;
            if frame == 5 {
                spawn(&mut simulation, 24, 16 * 24..20 * 24);
            }
            let [whole, others @ ..] =
                drawers.each_mut().map(|drawer| drawer.draw(&mut simulation, camera, (128, 72)).expect("a picture"));
            assert!(whole.pixels().any(|pixel| pixel != whole.get_pixel(0, 0)), "{case}: nothing to see");
            for (cut, kind) in others.iter().zip(["", " without first instances"]) {
                assert!(whole == *cut, "{case}: frame {frame} differs{kind}");
            }
            let [whole, cut, plain] = drawers.each_ref().map(|drawer| drawer.renderer.stats());
            assert_eq!((whole.draws, whole.draws), (cut.draws, plain.draws), "{case}: frame {frame}");
            // Emboss passes add up over all that the others left: they stay whole.
            let is_cut = technique != Some(Technique::EmbossMultipass);
            for cut in [cut, plain] {
                assert!(
                    whole.passes <= 2 && (cut.passes >= 4) == is_cut,
                    "{case}: frame {frame}: {} passes",
                    cut.passes
                );
            }
        }
        // What is set outlasts the world.
        let (mut other, camera) = field(24);
        drawers.iter_mut().for_each(|drawer| _ = drawer.draw(&mut other, camera, (128, 72)).expect("a picture"));
        let [whole, cut, _] = drawers.each_ref().map(|drawer| drawer.renderer.stats().passes);
        assert!(whole <= 2 && (cut >= 4) == (technique != Some(Technique::EmbossMultipass)), "{case}: {cut} passes");
    }
}

/// In the first frame it is unknown what is in view; in the next one what the late phase drew is drawn early: there are
/// as many passes as the triangles take.
#[test]
fn portions_are_of_the_size_that_was_asked_for() {
    let Some(gpu) = common::gpu() else { return };
    let mut renderer = SingleView::new(&gpu);
    let settings = Settings { occlusion: Occlusion::On, ..Settings::default() };
    const PORTION: u32 = 2000;
    renderer.cut_passes(NonZeroU32::new(PORTION));
    let mut headless = Headless { renderer, settings };
    let (mut simulation, camera) = field(100);
    // From where more of it is in view.
    *simulation.world.get_mut::<Transform>(camera).expect("lives") =
        Transform::from_xyz(0.0, 40.0, 40.0).looking_at(Vec3::NEG_Z * 10.0, Vec3::Y);
    for frame in 0..6 {
        headless.draw(&mut simulation, camera, (256, 144)).expect("a picture");
        let (drawn, passes) = (headless.renderer.read_drawn(), headless.renderer.stats().passes);
        let fewest = drawn.triangles as u32 / PORTION;
        assert!(drawn.triangles > 10 * u64::from(PORTION), "frame {frame}: {drawn:?}");
        // A page of spheres is more than a portion. In the second frame the early phase draws what was late in the
        // first; that nothing is late then is not certain.
        let phases = if frame == 1 { 2 } else { 1 };
        assert!(4 * passes >= 3 * phases * fewest, "frame {frame}: {passes} passes, {drawn:?}");
        // In the still view it is known what is in view; not all draws fill their last portion.
        assert!(frame < 4 || passes <= 2 * fewest, "frame {frame}: {passes} passes, {drawn:?}");
    }
}

/// So many that the portions at the end of the list are larger than those at its beginning.
#[test]
fn a_picture_is_the_same_in_portions_that_grow() {
    let Some(gpu) = common::gpu() else { return };
    let plain = Gpu::headless_with(wgpu::Features::empty()).expect("the same adapter");
    const COLUMNS: u32 = 200;
    let mut simulation = Simulation::new();
    let cube = simulation.world.resource_mut::<Library>().add_mesh(shapes::cube(Vec3::splat(0.9)));
    let place = |i: u32| Vec3::new((i % COLUMNS) as f32 - 99.5, (i % 7) as f32 * 0.1, (i / COLUMNS) as f32 - 49.5);
    let cubes = (0..100 * COLUMNS).map(|i| (cube, Transform::from_translation(place(i))));
    simulation.world.spawn_batch(cubes.collect::<Vec<_>>());
    simulation.world.spawn((Light::directional(1.0), Transform::default().looking_to(-Vec3::ONE, Vec3::Y)));
    let eye = Transform::from_xyz(0.0, 170.0, 0.0).looking_at(Vec3::ZERO, Vec3::NEG_Z);
    let camera = simulation.world.spawn((Camera::default(), eye)).id();
    let settings = Settings { occlusion: Occlusion::On, samples: 1, ..Settings::default() };
    let mut drawers = [(&gpu, 0), (&gpu, 1), (&plain, 1)].map(|(gpu, triangles)| {
        let mut renderer = SingleView::new(gpu);
        renderer.cut_passes(NonZeroU32::new(triangles));
        Headless { renderer, settings }
    });
    for frame in 0..3 {
        let pictures =
            drawers.each_mut().map(|drawer| drawer.draw(&mut simulation, camera, (512, 288)).expect("a picture"));
        let drawn = drawers.each_ref().map(|drawer| drawer.renderer.read_drawn().objects);
        // 256 portions of 64, then larger ones.
        assert!(drawn.iter().all(|&objects| objects > 17_000), "frame {frame}: {drawn:?} drawn");
        assert!(pictures[0] == pictures[1] && pictures[0] == pictures[2], "frame {frame}");
    }
}
