//! Objects that no sample of a picture meets.

use super::*;

/// Small things far apart, in random poses. All in one colour, so that it does not matter which is in front. From the
/// middles of the meshes to their own origins it is `mesh_origin`.
fn dust(origin: Vec3, mesh_origin: Vec3, count: usize, alpha: AlphaMode) -> Scene {
    let mut random = random();
    let mut scene = Scene::new();
    let mut library = scene.simulation.world.resource_mut::<Library>();
    for mesh in &mut scene.meshes {
        let mut moved = library.mesh(*mesh).expect("there").mesh.clone();
        moved.positions.iter_mut().for_each(|position| *position -= mesh_origin);
        *mesh = library.add_mesh(moved);
    }
    let white = Material { base_factor: Vec4::ONE, alpha, ..Material::new(Shading::Unlit) };
    scene.materials = vec![library.add_material(white)];
    for i in 0..count {
        // As many at every scale of distance.
        let distance = 3.0 * 100f32.powf(random.random::<f32>());
        let aside = Vec3::new(unit(&mut random), unit(&mut random) * 0.6, 0.0) * distance;
        let place = random_place(&mut random, 0.0).with_scale(Vec3::splat(0.02 + 0.2 * random.random::<f32>()));
        let to_mesh = place.rotation * (place.scale * mesh_origin);
        let place = place.with_translation(origin + aside - Vec3::Z * distance + to_mesh);
        scene.spawn(i % 3, 0, place);
    }
    scene.look(Transform::from_translation(origin));
    scene
}

#[test]
fn what_lies_between_samples_is_not_drawn_and_nobody_sees_it() {
    let Some(mut renderer) = renderer() else { return };
    let far = Vec3::new(10_000.0, -50.0, 3_000.0);
    for (origin, mesh_origin) in [(Vec3::ZERO, Vec3::ZERO), (far, Vec3::ZERO), (Vec3::ZERO, far)] {
        // Blended objects are drawn whatever their size.
        let dust = |alpha| dust(origin, mesh_origin, 3000, alpha);
        let (mut opaque, mut whole) = (dust(AlphaMode::Opaque), dust(AlphaMode::Blend));
        for projection in [
            Projection::Perspective { fov_y: 1.0, aspect: None },
            Projection::Orthographic { half_height: 15.0, aspect: None },
        ] {
            for scene in [&mut opaque, &mut whole] {
                scene.project(projection);
            }
            for (samples, occlusion) in
                [(1, Occlusion::Off), (4, Occlusion::Off), (1, Occlusion::On), (4, Occlusion::On)]
            {
                let settings = Settings { samples, ..with(occlusion) };
                let (expected, all) = whole.draw_with(&mut renderer, settings);
                let (picture, drawn) = opaque.draw_with(&mut renderer, settings);
                let different = picture.pixels().zip(expected.pixels()).filter(|(a, b)| a != b).count();
                assert_eq!(different, 0, "{origin}, {mesh_origin}, {projection:?}, {samples} samples, {occlusion:?}");
                // How many have a sample in the boxes around them follows from their sizes and the rasteriser's
                // rounding: at the most 0.37 with one sample and 0.67 with four, by the same distribution of 4,000
                // others; far from the origin, where a metre is known to 0.04, 0.51 and 0.91. The standard error of
                // 1,700 objects is 0.012.
                let share = if samples == 1 {
                    0.6
                } else if [origin, mesh_origin] == [Vec3::ZERO; 2] {
                    0.75
                } else {
                    0.95
                };
                let most = share * f64::from(all.objects);
                assert!(drawn.objects > 100 && f64::from(drawn.objects) < most, "{drawn:?} of {all:?}");
                // The outputs have one sample in each pixel's middle, whatever the picture has.
                let covered = |renderer: &mut SingleView| {
                    let outputs =
                        renderer.draw_outputs(OutputSet { id: true, ..OutputSet::NONE }).expect("a picture was drawn");
                    outputs.entities().iter().map(Option::is_some).collect::<Vec<_>>()
                };
                let seen = covered(&mut renderer);
                whole.draw_with(&mut renderer, settings);
                assert!(
                    seen == covered(&mut renderer),
                    "outputs of {origin}, {mesh_origin}, {projection:?}, {samples} samples"
                );
            }
        }
    }
}

/// A bar across four pixels, with the middles of two of them in it: the rectangle around it holds all four. Moved aside
/// by a little more than its thickness, it has none.
#[test]
fn what_only_the_rectangle_around_it_covers_is_not_drawn() {
    let Some(mut renderer) = renderer() else { return };
    // How far aside the bar's edge, 0.1 from its middle, is surely still beyond the two pixels' middles: vertices are
    // rounded by half of what they are rounded to, along both axes.
    let just_beyond = 0.1 - 0.01 - renderer.gpu().vertex_rounding() * std::f32::consts::FRAC_1_SQRT_2;
    let mut scene = Scene::new();
    // One unit is one pixel; (0, 0) is where four meet.
    scene.project(Projection::Orthographic { half_height: SIZE.1 as f32 / 2.0, aspect: None });
    let white = Material { base_factor: Vec4::ONE, ..Material::new(Shading::Unlit) };
    let bar = scene.add(shapes::cube(Vec3::ONE), white, Transform::default());
    let mut draw = |degrees: f32, aside: f32, settings: Settings| {
        let turn = Quat::from_rotation_z(degrees.to_radians());
        *scene.simulation.world.get_mut::<Transform>(bar).expect("lives") =
            Transform::from_translation(turn * Vec3::Y * aside - Vec3::Z * 5.0)
                .with_rotation(turn)
                .with_scale(Vec3::new(1.6, 0.2, 0.2));
        scene.simulation.frame();
        let (picture, drawn) = scene.draw_with(&mut renderer, settings);
        let background = *picture.get_pixel(0, 0);
        (picture.pixels().filter(|pixel| **pixel != background).count(), drawn.objects)
    };
    for occlusion in [Occlusion::Off, Occlusion::On] {
        let settings = Settings { samples: 1, ..with(occlusion) };
        for degrees in [45.0, 135.0] {
            assert_eq!(draw(degrees, 0.0, settings), (2, 1), "{degrees} degrees");
            assert_eq!(draw(degrees, just_beyond, settings), (2, 1), "{degrees} degrees, its edge just beyond");
            assert_eq!(draw(degrees, 0.22, settings), (0, 0), "{degrees} degrees, aside");
            assert_eq!(draw(degrees, -0.22, settings), (0, 0), "{degrees} degrees, to the other side");
        }
        // Upright, it is between two columns of samples either way.
        assert_eq!(draw(90.0, 0.0, settings), (0, 0));
        // Two of four samples in a pixel lie 0.18 aside of such a diagonal.
        let (pixels, drawn) = draw(45.0, 0.22, Settings { samples: 4, ..settings });
        assert!(pixels > 0 && drawn == 1, "four samples: {pixels} pixels");
    }
}
