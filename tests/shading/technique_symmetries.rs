//! Bump techniques under mirroring, stretching, from behind and through other UVs: pictures that must be equal.

use crate::common::bumps::{Stage, difference, hills};
use crate::common::prelude::*;
use glam::Affine2;
use image::RgbaImage;
use image::imageops::flip_horizontal;

const SIDE: usize = 64;

/// Calls for every technique, with the stage set to it.
fn each(stage: &mut Stage, mut check: impl FnMut(&mut Stage, Technique, &'static str)) {
    for (name, technique) in Technique::ALL {
        stage.headless.settings.technique = Some(technique);
        check(stage, technique, name);
    }
}

fn mirrored(at: Transform) -> Transform {
    // x turned around on both sides of the rotation: (x, y, z, w) to (x, -y, -z, w).
    let q = at.rotation;
    Transform {
        translation: at.translation * Vec3::new(-1.0, 1.0, 1.0),
        rotation: Quat::from_xyzw(q.x, -q.y, -q.z, q.w),
        scale: at.scale,
    }
}

fn tilted() -> Transform {
    Transform::from_xyz(0.05, 0.1, 0.0).with_rotation(Quat::from_euler(glam::EulerRot::XYZ, 0.6, 0.3, 0.1))
}

/// One object under three lights; `mirror` turns the world around at x = 0.
fn scene(mirror: bool) -> Option<Stage> {
    let mut stage = Stage::new((96, 72))?;
    let lights = stage.three_lights();
    let material = stage.material(SIDE, 0.06, hills);
    let torus = shapes::with_uv_scale(shapes::torus(0.6, 0.25, 48, 24), Vec2::new(4.0, 2.0));
    let object = stage.spawn(torus, Material { emboss_step_texels: 3.0, ..material }, tilted());
    if mirror {
        let mut turn = |entity: Entity| {
            let at = *stage.simulation.world.get::<Transform>(entity).expect("placed");
            *stage.simulation.world.get_mut::<Transform>(entity).expect("placed") = mirrored(at);
        };
        lights.into_iter().for_each(&mut turn);
        turn(object);
        // The mesh itself, too: a negative scale.
        stage.simulation.world.get_mut::<Transform>(object).expect("placed").scale.x = -1.0;
    }
    Some(stage)
}

/// All pictures of a stage, by technique.
fn pictures(stage: &mut Stage) -> Vec<(&'static str, RgbaImage)> {
    let mut all = Vec::new();
    each(stage, |stage, _, name| all.push((name, stage.picture())));
    all
}

/// Few pixels, at silhouettes and shadows' edges, may fall on the other side: vertices are rounded to a sixteenth of a
/// pixel at worst, and edges of figures are no longer than the picture's border, which is a twentieth of its pixels.
/// Weights of 8 bits move edges on the surface by 2⁻⁸ of a texel, which is about a pixel: 1 in 256, had every pixel
/// such an edge.
#[track_caller]
fn assert_same(name: &str, a: &RgbaImage, b: &RgbaImage) {
    // Rounded weights move normals by 2⁻⁸ of 0.1, by which they lean from texel to texel; highlights make up to five
    // times that of it, 0.002 of a light. In the dark, at 0.03 of linear light, sRGB makes 2 of 255 of it; the last is
    // rounding. What is packed along the surface, or along the world's axes, rounds the other way when it is turned
    // around: 128 of 255 is not the middle. That is 2/255 in each of three components, and 1/255 for the combiner:
    // 0.018, 15 of 255 there; in highlights with an exponent of 12 and a reflectance of 0.4, 0.07 of 0.5, which are 12.
    let allowed = if name.starts_with("dot3") { 20 } else { 3 };
    let (_, far) = difference(a, b, allowed);
    let all = (a.width() * a.height()) as usize;
    assert!(far * 100 <= all, "{name}: {far} of {all} pixels differ");
}

#[test]
fn a_mirrored_world_gives_a_mirrored_picture() {
    let (Some(mut plain), Some(mut mirrored)) = (scene(false), scene(true)) else { return };
    for ((name, plain), (_, mirrored)) in pictures(&mut plain).iter().zip(&pictures(&mut mirrored)) {
        assert_same(name, plain, &flip_horizontal(mirrored));
    }
}

/// A square of two metres with a material, lit and tilted.
fn square(edit: impl FnOnce(&mut Stage) -> (systems::assets::Mesh, Material, Transform)) -> Option<Stage> {
    let mut stage = Stage::new((96, 72))?;
    stage.three_lights();
    let (mesh, material, at) = edit(&mut stage);
    stage.spawn(mesh, Material { emboss_step_texels: 3.0, ..material }, tilted() * at);
    Some(stage)
}

#[track_caller]
fn assert_same_pictures(a: Option<Stage>, b: Option<Stage>) {
    let (Some(mut a), Some(mut b)) = (a, b) else { return };
    for ((name, a), (_, b)) in pictures(&mut a).iter().zip(&pictures(&mut b)) {
        assert_same(name, a, b);
    }
}

#[test]
fn a_stretched_square_is_a_longer_square() {
    let long = |stage: &mut Stage| {
        let (mesh, at) = Stage::facing(Vec2::new(2.0, 1.0));
        (mesh, stage.material(SIDE, 0.06, hills), at)
    };
    let stretched = |stage: &mut Stage| {
        let (mesh, at) = Stage::facing(Vec2::ONE);
        (mesh, stage.material(SIDE, 0.06, hills), Transform::from_scale(Vec3::new(2.0, 1.0, 1.0)) * at)
    };
    assert_same_pictures(square(long), square(stretched));
}

#[test]
fn mirrored_uvs_show_the_mirrored_map() {
    let plain = |stage: &mut Stage| {
        let (mesh, at) = Stage::facing(Vec2::splat(1.5));
        (mesh, stage.material(SIDE, 0.06, hills), at)
    };
    let mirrored = |stage: &mut Stage| {
        let (mut mesh, at) = Stage::facing(Vec2::splat(1.5));
        mesh.uvs[0].iter_mut().for_each(|uv| uv.x = 1.0 - uv.x);
        (mesh, stage.material(SIDE, 0.06, |u, v| hills(1.0 - u, v)), at)
    };
    assert_same_pictures(square(plain), square(mirrored));
}

#[test]
fn a_transform_of_the_maps_is_one_of_the_uvs() {
    let of_mesh = |stage: &mut Stage| {
        let (mesh, at) = Stage::facing(Vec2::splat(1.5));
        let mut mesh = shapes::with_uv_scale(mesh, Vec2::splat(2.0));
        // A quarter turn: the image's right is the mesh's down.
        mesh.uvs[0].iter_mut().for_each(|uv| *uv = Vec2::new(uv.y, -uv.x));
        (mesh, stage.material(SIDE, 0.06, hills), at)
    };
    let of_maps = |stage: &mut Stage| {
        let (mesh, at) = Stage::facing(Vec2::splat(1.5));
        let quarter = glam::Mat2::from_cols(Vec2::new(0.0, -2.0), Vec2::new(2.0, 0.0));
        let turn = |map: Option<Map>| map.map(|map| Map { image_from_mesh_uv: Affine2::from_mat2(quarter), ..map });
        let m = stage.material(SIDE, 0.06, hills);
        let material = Material {
            normal_map: turn(m.normal_map),
            height_map: turn(m.height_map),
            horizon_maps: m.horizon_maps.map(turn),
            offset_map: turn(m.offset_map),
            ..m
        };
        (mesh, material, at)
    };
    assert_same_pictures(square(of_mesh), square(of_maps));
}

#[test]
fn a_sheet_from_behind_has_its_heights_turned_around() {
    // Without horizon maps, which tell of the front only.
    let front = |stage: &mut Stage| {
        let (mesh, at) = Stage::facing(Vec2::splat(1.5));
        let material = stage.material(SIDE, 0.06, |u, v| 1.0 - hills(1.0 - u, v));
        (mesh, Material { horizon_maps: [None; 2], height_rest: 0.5, ..material }, at)
    };
    let behind = |stage: &mut Stage| {
        let (mesh, at) = Stage::facing(Vec2::splat(1.5));
        let material = stage.material(SIDE, 0.06, hills);
        let material = Material { horizon_maps: [None; 2], height_rest: 0.5, double_sided: true, ..material };
        (mesh, material, Transform::from_rotation(Quat::from_rotation_y(std::f32::consts::PI)) * at)
    };
    let (Some(mut front), Some(mut behind)) = (square(front), square(behind)) else { return };
    for ((name, front), (_, behind)) in pictures(&mut front).iter().zip(&pictures(&mut behind)) {
        // The offset map of a sheet from behind is mirrored along one axis only, like its image.
        if *name != "perturbed_uv" {
            assert_same(name, front, behind);
        }
    }
}

#[test]
fn every_technique_is_lit_by_every_kind_of_light_and_by_several() {
    let Some(mut stage) = scene(false) else { return };
    let lights: Vec<Entity> =
        stage.simulation.world.query_filtered::<Entity, With<Light>>().iter(&stage.simulation.world).collect();
    each(&mut stage, |stage, technique, name| {
        let mut parts = Vec::new();
        let on = |stage: &mut Stage, wanted: &dyn Fn(usize) -> bool| {
            for (i, &light) in lights.iter().enumerate() {
                stage.simulation.world.get_mut::<Light>(light).expect("a light").enabled = wanted(i);
            }
            stage.linear()
        };
        for i in 0..lights.len() {
            let part = on(stage, &|light| light == i);
            assert!(part.iter().filter(|p| p.truncate().max_element() > 0.05).count() > 100, "{name}: light {i}");
            parts.push(part);
        }
        let together = on(stage, &|_| true);
        // Light adds up. The parts together are off by 2⁻¹⁰ of their sum, half floats rounded toward 0, and that by as
        // much; where passes add the lights up, once for each.
        let far = (0..together.len()).filter(|&i| {
            let sum = parts.iter().map(|part| part[i]).sum::<glam::Vec4>();
            (sum - together[i]).truncate().abs().max_element() > 4e-3 * together[i].truncate().max_element().max(1.0)
        });
        assert_eq!(far.count(), 0, "{technique:?}");
    });
}
