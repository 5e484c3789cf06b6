//! Properties of materials that rays meet: sides, masks, colours.

use super::{Scene, at, lidar};
use crate::common::prelude::*;
use relief::sense::RayWarnings;
use systems::assets::{Filter, Sampler};
use systems::lights::LUMINANCE;

#[test]
fn faces_with_one_side_are_met_from_their_front_however_they_are_placed() {
    // The plane's front is up; what the transform makes of it.
    let up_again = Quat::from_rotation_x(std::f32::consts::PI);
    let cases = [
        (Transform::IDENTITY, true),
        (Transform::from_scale(Vec3::new(-1.0, 1.0, 1.0)), true),
        (Transform::from_scale(Vec3::new(2.0, -0.5, 30.0)), false),
        (Transform::from_rotation(up_again), false),
        (Transform { rotation: up_again, scale: Vec3::new(1.0, -1.0, 1.0), ..Transform::IDENTITY }, true),
        (Transform::from_scale(Vec3::new(-1e-3, 2e-3, -1e3)), true),
    ];
    for (place, front_is_up) in cases {
        for double_sided in [false, true] {
            let mut scene = Scene::new();
            let material =
                scene.material(Material { double_sided, base_factor: Vec4::splat(0.5), ..Material::default() });
            scene.add(shapes::plane(Vec2::splat(10.0), UVec2::splat(3)), material, place);
            let rays = scene.rays();
            let from = |y: f64| rays.nearest(DVec3::new(1e-4, 2.0 * y, 1e-4), DVec3::new(0.0, -y, 0.0), 0.1, 50.0);
            let (above, below) = (from(1.0), from(-1.0));
            assert_eq!(above.is_some(), front_is_up || double_sided, "{place:?}");
            assert_eq!(below.is_some(), !front_is_up || double_sided, "{place:?}");
            for met in [above, below].into_iter().flatten() {
                // Half a turn is a float as well.
                assert!((met.range - 2.0).abs() < 1e-6 && (met.cosine - 1.0).abs() < 1e-6, "{met:?}");
                assert_eq!(met.albedo, 0.5);
            }
        }
    }
}

/// A map whose left half is clear.
fn half_clear(scene: &mut Scene, kind: ImageKind) -> ImageId {
    let texels = [[255, 255, 255, 0], [255; 4]].concat();
    scene.simulation.world.resource_mut::<Library>().add_image(Image::rgba8("half", 2, 1, kind, texels))
}

/// By mode and map: what beams onto the left and the right half of a plane meet, above a floor.
fn through(alpha: AlphaMode, alpha_of_base: f32, release: bool) -> ([&'static str; 2], RayWarnings) {
    let mut scene = Scene::new();
    let image = half_clear(&mut scene, ImageKind::Masked { least: 128 });
    let sampler = Sampler { mag: Filter::Nearest, ..Sampler::default() };
    let material = scene.material(Material {
        alpha,
        base_factor: Vec4::new(1.0, 1.0, 1.0, alpha_of_base),
        base_map: Some(Map { sampler, ..Map::new(image) }),
        ..Material::default()
    });
    let grey = scene.grey();
    let plane = scene.add(shapes::plane(Vec2::splat(4.0), UVec2::ONE), material, Transform::from_xyz(0.0, 1.0, 0.0));
    let floor = scene.add(shapes::plane(Vec2::splat(40.0), UVec2::ONE), grey, Transform::IDENTITY);
    let mut library = scene.simulation.world.resource_mut::<Library>();
    library.keep_texels(!release);
    library.release_texels(image);
    let rays = scene.rays();
    let named = [-1.0, 1.0].map(|x| {
        let met = rays.nearest(DVec3::new(x, 3.0, 0.3), DVec3::NEG_Y, 0.1, 50.0).map(|met| met.entity);
        if met == Some(plane.index_u32()) {
            "plane"
        } else if met == Some(floor.index_u32()) {
            "floor"
        } else {
            "nothing"
        }
    });
    (named, rays.warnings())
}

#[test]
fn masks_let_rays_through_their_holes_and_clear_surfaces_through_all_of_them() {
    let none = RayWarnings::default();
    assert_eq!(through(AlphaMode::Opaque, 1.0, false), (["plane", "plane"], none));
    assert_eq!(through(AlphaMode::Mask, 1.0, false), (["floor", "plane"], none));
    // 0.4 of the alpha is below the mask's cut-off, and below a half.
    assert_eq!(through(AlphaMode::Mask, 0.4, false), (["floor", "floor"], none));
    assert_eq!(through(AlphaMode::Blend, 1.0, false), (["floor", "plane"], none));
    assert_eq!(through(AlphaMode::Blend, 0.4, false), (["floor", "floor"], none));
}

#[test]
fn masks_without_texels_are_solid_and_said_to_be() {
    let solid = RayWarnings { solid_masks: 1, ..RayWarnings::default() };
    assert_eq!(through(AlphaMode::Mask, 1.0, true), (["plane", "plane"], solid));
    let plain = RayWarnings { plain_maps: 1, ..RayWarnings::default() };
    assert_eq!(through(AlphaMode::Opaque, 1.0, true), (["plane", "plane"], plain));
}

#[test]
fn intensity_is_albedo_times_cosine_and_fades() {
    let mut scene = Scene::new();
    let color = Vec3::new(0.8, 0.4, 0.2);
    let image = Image::rgba8("white and black", 2, 1, ImageKind::Color, [[255u8; 4], [0, 0, 0, 255]].concat());
    let image = scene.simulation.world.resource_mut::<Library>().add_image(image);
    let sampler = Sampler { mag: Filter::Nearest, ..Sampler::default() };
    let material = scene.material(Material {
        base_factor: color.extend(1.0),
        base_map: Some(Map { sampler, ..Map::new(image) }),
        ..Material::default()
    });
    let mut wall = shapes::plane(Vec2::splat(40.0), UVec2::ONE);
    // A quarter of the light on the left edge, all of it on the right.
    wall.colors = wall.positions.iter().map(|p| Vec3::splat(if p.x < 0.0 { 0.25 } else { 1.0 }).extend(1.0)).collect();
    // Its front toward the lidar, turned by 30° about the vertical.
    let facing = Quat::from_rotation_y(30f32.to_radians()) * Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    scene.add(wall, material, Transform::from_xyz(0.0, 0.0, 10.0).with_rotation(facing));
    let lidar = LidarSensor { attenuation: 0.05, ..lidar(&[0.0], 360) };
    let scan = scene.scan(&lidar, at(0.0, 0.0, 0.0));
    let mut seen = [0; 2];
    for column in [340usize, 350, 355, 5, 10, 20] {
        let toward = (column as f64).to_radians();
        let direction = DVec3::new(-toward.sin(), 0.0, toward.cos());
        let front = facing.as_dquat() * DVec3::Y;
        let range = DVec3::new(0.0, 0.0, 10.0).dot(front) / direction.dot(front);
        let local = facing.as_dquat().inverse() * (direction * range - DVec3::new(0.0, 0.0, 10.0));
        let white = local.x < 0.0;
        seen[usize::from(white)] += 1;
        let shade = 0.25 + 0.75 * (local.x + 20.0) / 40.0;
        let albedo = if white { f64::from(color.dot(LUMINANCE)) * shade } else { 0.0 };
        let expected = albedo * direction.dot(front).abs() * (-0.05 * range).exp();
        assert_eq!(scan.hit[column], 1);
        // The place is right to 1e-6 of 20 m, and the shade changes by 2 % in a metre.
        assert!((f64::from(scan.intensity[column]) - expected).abs() < 2e-6, "{column}: {}", scan.intensity[column]);
    }
    assert_eq!(seen, [3, 3]);
}
