//! Views in which nothing moves.

use super::*;

#[test]
fn a_still_view_is_drawn_whole_when_the_picture_or_a_surface_changes() {
    let Some(mut renderer) = renderer() else { return };
    let mut scene = Scene::new();
    for i in 0..50 {
        scene.spawn(i % 3, 0, Transform::from_xyz(i as f32 * 0.1 - 2.5, 0.0, -6.0 - i as f32));
    }
    // A masked pane before them, of which everything shows.
    scene.spawn(0, 2, Transform::from_xyz(0.0, 0.0, -3.0).with_scale(Vec3::new(9.0, 9.0, 0.1)));
    scene.simulation.frame();
    for occlusion in [Occlusion::Off, Occlusion::On] {
        let on = with(occlusion);
        for _ in 0..3 {
            scene.draw_with(&mut renderer, on);
        }
        let seen = scene.draw_with(&mut renderer, on);
        assert_eq!(seen.1.objects, if occlusion == Occlusion::On { 1 } else { 51 });
        scene.draw_with(&mut renderer, Settings { samples: 1, ..on });
        assert!(scene.draw_with(&mut renderer, on) == seen, "samples, and back");
        let view = Viewpoint::Camera(scene.camera).view(&scene.simulation.world, (SIZE.0 * 2, SIZE.1 * 2));
        scene.simulation.with_frame(|frame| renderer.prepare(frame, &view, &on)).expect("it fits");
        let large = renderer.draw_picture();
        let mut fresh = SingleView::new(renderer.gpu());
        scene.simulation.with_frame(|frame| fresh.prepare(frame, &view, &with(Occlusion::Off))).expect("it fits");
        assert!(large == fresh.draw_picture(), "a larger picture");
        for _ in 0..3 {
            scene.draw_with(&mut renderer, on);
        }
        // Nothing shows of the pane any more.
        let mask = scene.materials[2];
        let edit = |scene: &mut Scene, alpha| {
            scene.simulation.world.resource_mut::<Library>().edit_material(mask, |m| m.base_factor.w = alpha);
            scene.simulation.frame();
        };
        edit(&mut scene, 0.1);
        assert!(scene.draw_with(&mut renderer, on).1.objects > 10, "what was hidden shows");
        edit(&mut scene, 0.5);
    }
}

#[test]
fn a_still_view_keeps_what_rounding_puts_before_its_own_bounds() {
    let Some(mut renderer) = renderer() else { return };
    let mut random = random();
    let mut fresh = SingleView::new(renderer.gpu());
    for i in 0..60 {
        let mut scene = Scene::new();
        // A face of no thickness far from the origin, close to the eye and straight before it.
        let turn = Quat::from_rotation_y(unit(&mut random) * 3.0);
        let origin = Vec3::new(unit(&mut random), 0.3, unit(&mut random)) * [400.0, 1_000.0, 9_000.0][i % 3];
        let distance = [1.0, 3.0][i / 3 % 2];
        let wall = shapes::plane(Vec2::splat(8.0), UVec2::ONE);
        let up = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
        let place = Transform::from_translation(origin + turn * Vec3::NEG_Z * distance).with_rotation(turn * up);
        scene.add(wall, Material::default(), place);
        let elsewhere = scene.spawn(0, 1, Transform::from_translation(origin + turn * Vec3::Z * 50.0));
        scene.look(Transform::from_translation(origin).with_rotation(turn));
        let (expected, _) = scene.draw_with(&mut fresh, with(Occlusion::Off));
        // Something changes after the first or the second frame, so that the view is culled four or five times.
        for frame in 0..6 {
            if frame == 1 + i % 2 {
                scene.simulation.world.get_mut::<Transform>(elsewhere).expect("a place").translation.y += 1.0;
                scene.simulation.frame();
            }
            let (picture, _) = scene.draw(&mut renderer, Occlusion::On);
            assert!(picture == expected, "{i}, frame {frame}: {origin} {turn}, {distance} m");
        }
    }
}

#[test]
fn a_still_view_shows_what_another_technique_uncovers() {
    let Some(mut renderer) = renderer() else { return };
    let mut scene = Scene::new();
    // A plate whose surface lies far below the mesh, and a box in that hollow.
    scene.add_sunk_plate(8.0, Material { height_scale_uv: 0.5, ..Material::default() }, 1.0);
    scene.spawn(0, 0, Transform::from_xyz(0.0, 0.0, -6.5));
    scene.simulation.frame();
    let technique = |technique, occlusion| Settings { technique: Some(technique), ..with(occlusion) };
    for _ in 0..4 {
        scene.draw_with(&mut renderer, technique(Technique::Off, Occlusion::On));
    }
    let drawn = scene.draw_with(&mut renderer, technique(Technique::Off, Occlusion::On)).1;
    assert_eq!(drawn.objects, 1, "the plate hides the box");
    let (picture, drawn) = scene.draw_with(&mut renderer, technique(Technique::ZCorrect, Occlusion::On));
    assert_eq!(drawn.objects, 2);
    assert!(picture == scene.draw_afresh(renderer.gpu(), technique(Technique::ZCorrect, Occlusion::Off)));
}

#[test]
fn what_is_sunk_stands_out_from_behind() {
    let Some(mut renderer) = renderer() else { return };
    let mut scene = Scene::new();
    // Seen from behind, this surface lies half a metre nearer than its mesh, before the plate between them.
    let technique = Technique::ZCorrect;
    let sunk = Material { height_scale_uv: 0.2, double_sided: true, technique, ..Material::default() };
    scene.add_sunk_plate(3.0, sunk, -1.0);
    scene.spawn(0, 0, Transform::from_xyz(0.0, 0.0, -4.8).with_scale(Vec3::new(20.0, 20.0, 0.1)));
    scene.simulation.frame();
    let expected = scene.draw_afresh(renderer.gpu(), with(Occlusion::Off));
    let center = expected.get_pixel(SIZE.0 / 2, SIZE.1 / 2);
    assert!(center.0[0].abs_diff(center.0[1]) < 9, "the white surface is seen, not the red plate: {center:?}");
    for frame in 0..5 {
        assert!(scene.draw(&mut renderer, Occlusion::On).0 == expected, "frame {frame}");
    }
}
