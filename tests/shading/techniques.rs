//! Bump techniques with known answers.

use crate::common::bumps::{Stage, difference, hills};
use crate::common::prelude::*;
use glam::Affine2;

/// Techniques whose picture of a flat field is that of the smooth surface.
const EXACT: [Technique; 11] = [
    Technique::Normal,
    Technique::PerturbedNormal,
    Technique::Parallax,
    Technique::Relief,
    Technique::Horizon,
    Technique::ParallaxHorizon,
    Technique::ReliefHorizon,
    Technique::ZCorrectParallax,
    Technique::ZCorrect,
    Technique::Combined,
    Technique::Emboss,
];

/// The largest difference of two pictures in a channel.
fn apart(a: &[Vec4], b: &[Vec4]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max)
}

fn set_technique(stage: &mut Stage, technique: Technique) {
    stage.headless.settings.technique = Some(technique);
}

/// A torus and a turned, stretched cube under three lights.
fn shapes_stage(material: impl FnOnce(&mut Stage) -> Material) -> Option<Stage> {
    let mut stage = Stage::new((96, 72))?;
    stage.three_lights();
    let material = material(&mut stage);
    let torus = shapes::with_uv_scale(shapes::torus(0.6, 0.25, 48, 24), Vec2::new(4.0, 2.0));
    stage.spawn(torus, material.clone(), Transform::from_rotation(Quat::from_rotation_x(0.9)));
    let turned = Transform::from_xyz(0.0, 0.1, 0.1).with_rotation(Quat::from_euler(EulerRot::XYZ, 0.4, 0.6, 0.2));
    stage.spawn(shapes::cube(Vec3::splat(0.5)), material, turned.with_scale(Vec3::new(1.4, 0.8, 1.0)));
    Some(stage)
}

#[test]
fn flat_maps_give_exactly_the_smooth_picture() {
    // The surface lies at the map's level: white at 1, black at 0, and half floats know 0.5.
    for level in [1.0, 0.0, 0.5] {
        let material = |stage: &mut Stage| Material {
            height_rest: level,
            specular_factor: Vec3::ZERO,
            ..stage.material(8, 0.08, |_, _| level)
        };
        let Some(mut stage) = shapes_stage(material) else { return };
        set_technique(&mut stage, Technique::Off);
        let smooth = stage.linear();
        assert!(smooth.iter().filter(|p| p.x > 0.05).count() > 800, "the scene is lit");
        for technique in EXACT {
            set_technique(&mut stage, technique);
            let far = apart(&smooth, &stage.linear());
            // The lights add up to less than 2: a step of the half floats of the target, whichever way they are
            // rounded.
            assert!(far <= 1.0 / 1024.0, "{technique:?} at level {level}: {far}");
        }
        for technique in [Technique::Dot3, Technique::EmbossMultipass] {
            set_technique(&mut stage, technique);
            let far = apart(&smooth, &stage.linear());
            // Two roundings to 8 bits on the way: 1/255 and half of that, of less than 2. And vectors get shorter
            // between vertices that are up to 36° apart as the nearest light sees them: 1 − cos 18° of less than 1.
            // Sums in half floats: four for each light's alpha, which is doubled, and one each for what it gives and
            // for what they have given so far; each is off by 2⁻¹⁰ of its size at the most.
            let allowed = if technique == Technique::Dot3 { 0.06 } else { 10.0 / 1024.0 };
            assert!(far <= allowed, "{technique:?} at level {level}: {far}");
        }
    }
}

#[test]
fn missing_maps_are_flat() {
    let Some(mut stage) = shapes_stage(|_| Material { specular_factor: Vec3::ZERO, ..Material::default() }) else {
        return;
    };
    set_technique(&mut stage, Technique::Off);
    let smooth = stage.linear();
    for technique in EXACT {
        set_technique(&mut stage, technique);
        let far = apart(&smooth, &stage.linear());
        // A step of half floats, as above.
        assert!(far <= 1.0 / 1024.0, "{technique:?}: {far}");
    }
}

#[test]
fn a_mesh_without_uvs_is_drawn_and_smooth_where_maps_move() {
    let Some(mut stage) = Stage::new((64, 48)) else { return };
    stage.three_lights();
    let material = stage.material(16, 0.06, hills);
    let mut sphere = shapes::sphere(0.8, 32, 16);
    sphere.uvs = [Vec::new(), Vec::new()];
    stage.spawn(sphere, Material { normal_map: None, specular_factor: Vec3::ZERO, ..material }, Transform::IDENTITY);
    set_technique(&mut stage, Technique::Off);
    let smooth = stage.linear();
    for (name, technique) in Technique::ALL {
        set_technique(&mut stage, technique);
        let pixels = stage.linear();
        assert!(pixels.iter().all(|p| p.is_finite()), "{name}");
        if EXACT.contains(&technique) {
            let far = apart(&smooth, &pixels);
            // Here, too, no more than a step of half floats, 2⁻¹⁰.
            assert!(far < 1.0 / 255.0, "{name}: {far}");
        }
    }
}

#[test]
fn bumps_show_in_every_technique() {
    let Some(mut stage) = shapes_stage(|stage| Material { emboss_step_texels: 3.0, ..stage.material(64, 0.06, hills) })
    else {
        return;
    };
    // What perturbed_uv mirrors.
    stage.simulation.world.resource_mut::<Environment>().zenith = Vec3::ONE;
    set_technique(&mut stage, Technique::Off);
    let smooth = stage.picture();
    for (name, technique) in Technique::ALL {
        if technique != Technique::Off {
            set_technique(&mut stage, technique);
            let (_, changed) = difference(&smooth, &stage.picture(), 8);
            assert!(changed > 300, "{name}: {changed} pixels differ");
        }
    }
}

#[test]
fn emboss_in_one_pass_is_emboss_in_many() {
    let bumps = |stage: &mut Stage| Material { emboss_step_texels: 3.0, ..stage.material(64, 0.06, hills) };
    let Some(mut stage) = shapes_stage(bumps) else { return };
    for samples in [1, 4] {
        stage.headless.settings.samples = samples;
        for occlusion in [Occlusion::Off, Occlusion::On] {
            stage.headless.settings.occlusion = occlusion;
            set_technique(&mut stage, Technique::Emboss);
            let single = stage.linear();
            set_technique(&mut stage, Technique::EmbossMultipass);
            // Twice: in two phases, the second frame draws early what the first has seen.
            stage.picture();
            let multi = stage.linear();
            let far =
                single.iter().zip(&multi).map(|(a, b)| (*a - *b).truncate().abs().max_element()).fold(0.0, f32::max);
            // Sums in half floats, rounded toward 0 at worst: in alpha seven of 2⁻¹², doubled, of lights that are less
            // than 2.2 together; then seven of 2⁻¹⁰, of what each gives, of what they have given so far, and of the
            // single pass.
            assert!(far <= 15.0 / 1024.0, "{samples} samples, {occlusion:?}: {far}");
        }
    }
}

/// Each light as two of half its intensity, so that an object has six: those beyond three, of whose vectors none are
/// interpolated and for which there are no passes, give what the others do.
#[test]
fn six_half_lights_are_three_whole_ones_in_every_technique() {
    let bumps = |stage: &mut Stage| Material {
        emboss_step_texels: 3.0,
        specular_factor: Vec3::ZERO,
        ..stage.material(64, 0.06, hills)
    };
    let Some(mut stage) = shapes_stage(bumps) else { return };
    stage.simulation.world.insert_resource(LightPolicies::forced(LightPolicy::All));
    let by_technique = |stage: &mut Stage| {
        Technique::ALL.map(|(name, technique)| {
            set_technique(stage, technique);
            (name, stage.linear())
        })
    };
    let whole = by_technique(&mut stage);
    let world = &mut stage.simulation.world;
    let lights: Vec<Entity> = world.query_filtered::<Entity, With<Light>>().iter(world).collect();
    for &light in &lights {
        world.get_mut::<Light>(light).expect("a light").intensity *= 0.5;
        world.entity_mut(light).clone_and_spawn();
    }
    assert!(lights.len() == 3, "{lights:?}");
    for ((name, halves), (_, whole)) in by_technique(&mut stage).iter().zip(&whole) {
        let far = halves.iter().zip(whole).map(|(a, b)| (*a - *b).truncate().abs().max_element());
        // dot3 rounds each light to 8 bits, at other places of its curve, and interpolates between vertices; sums in
        // half floats are rounded for each light of emboss in passes. All far below what a light gives.
        let (sum, count) = far.fold((0.0, 0.0), |(sum, count), far| (sum + far, count + 1.0));
        assert!(sum / count < 0.01, "{name}: {}", sum / count);
    }
}

#[test]
fn what_is_unlit_stays_so() {
    let unlit = |stage: &mut Stage| Material {
        shading: Shading::Unlit,
        base_factor: Vec4::new(0.2, 0.4, 0.6, 1.0),
        ..stage.material(16, 0.05, hills)
    };
    let Some(mut stage) = shapes_stage(unlit) else { return };
    set_technique(&mut stage, Technique::Off);
    let plain = stage.picture();
    for (name, technique) in Technique::ALL {
        set_technique(&mut stage, technique);
        assert_eq!(difference(&plain, &stage.picture(), 0).0, 0, "{name}");
    }
}

#[test]
fn maps_shrunk_to_a_point_are_drawn() {
    let shrunk = |stage: &mut Stage| {
        let to_point =
            |map: Option<Map>| map.map(|map| Map { image_from_mesh_uv: Affine2::from_scale(Vec2::ZERO), ..map });
        let m = stage.material(16, 0.05, hills);
        let (normal_map, height_map) = (to_point(m.normal_map), to_point(m.height_map));
        Material { normal_map, height_map, horizon_maps: m.horizon_maps.map(to_point), ..m }
    };
    let Some(mut stage) = shapes_stage(shrunk) else { return };
    for (name, technique) in Technique::ALL {
        set_technique(&mut stage, technique);
        let pixels = stage.linear();
        assert!(pixels.iter().all(|p| p.is_finite() && p.max_element() < 10.0), "{name}");
        assert!(pixels.iter().filter(|p| p.x > 0.02).count() > 800, "{name}: the objects show");
    }
}

#[test]
fn what_stands_out_before_its_bounds_is_not_taken_for_hidden() {
    let mut pictures = Vec::new();
    for occlusion in [Occlusion::Off, Occlusion::On] {
        let Some(mut stage) = Stage::new((64, 64)) else { return };
        stage.three_lights();
        stage.headless.settings.occlusion = occlusion;
        // A tenth of an image 2 m wide, raised by 0.6 m: before the sheet that hides the mesh.
        let (mesh, at) = Stage::facing(Vec2::splat(0.2));
        let raised = Material { height_rest: 0.0, ..stage.material(8, 0.3, |_, _| 1.0) };
        let raised = Material { technique: Technique::ZCorrect, ..raised };
        stage.spawn(shapes::with_uv_scale(mesh, Vec2::splat(0.1)), raised, at);
        let (mesh, at) = Stage::facing(Vec2::splat(2.4));
        stage.spawn(mesh, Material::default(), Transform::from_xyz(0.0, 0.0, 0.3) * at);
        // Something has to move, or what is in sight is not looked for again.
        let moving =
            stage.spawn(shapes::cube(Vec3::splat(0.1)), Material::default(), Transform::from_xyz(0.0, 0.7, 0.5));
        for frame in 0..4 {
            stage.simulation.world.get_mut::<Transform>(moving).expect("placed").translation.x = 0.1 * frame as f32;
            stage.picture();
        }
        pictures.push(stage.picture());
    }
    assert_eq!(difference(&pictures[0], &pictures[1], 0).0, 0);
    assert!(pictures[0].get_pixel(32, 32) != pictures[0].get_pixel(40, 40), "the raised square is before the sheet");
}

#[test]
fn emboss_is_diffuse_light_plus_the_difference_of_two_heights() {
    let Some(mut stage) = Stage::new((17, 17)) else { return };
    // Height rises along u, one unit per width; the light comes from the left at 45 degrees.
    let ramp = stage.material(256, 0.1, |u, _| u);
    let (mesh, at) = Stage::facing(Vec2::splat(2.0));
    let material = Material { technique: Technique::Emboss, emboss_step_texels: 32.0, ..ramp };
    stage.spawn(mesh, Material { specular_factor: Vec3::splat(9.0), ..material }, at);
    let from_left = Transform::from_xyz(-1.0, 0.0, 1.0).looking_at(Vec3::ZERO, Vec3::Y);
    stage.simulation.world.spawn((Light::directional(0.8), from_left));
    let middle = stage.linear()[17 * 17 / 2];
    let slant = std::f32::consts::FRAC_1_SQRT_2;
    // Toward the light the ground falls by 32 texels of 256, times the light's part along it.
    let expected = 0.8 * (slant + 32.0 / 256.0 * slant);
    // A half float between 0.5 and 1, and two heights: half floats hold the ramp and its mip levels exactly; weights of
    // 8 bits put them 2⁻⁸ of a texel off, of the coarsest level that is read: 32 of 256.
    assert!((middle.x - expected).abs() < 2e-3, "{middle} {expected}");
}

#[test]
fn the_shadow_of_a_step_ends_where_geometry_says() {
    // Seen from the front in parallel projection, 5 mm per pixel: a step at the middle of 2 m, up to the right, where
    // the light comes from.
    let Some(mut stage) = Stage::new((400, 3)) else { return };
    stage.orthographic(3.0 / 400.0);
    let step = stage.material(256, 0.1, |u, _| if u < 0.5 { 0.0 } else { 1.0 });
    let (mesh, at) = Stage::facing(Vec2::splat(2.0));
    stage.spawn(mesh, Material { normal_map: None, specular_factor: Vec3::ZERO, ..step }, at);
    for degrees in [20.0f32, 35.0, 50.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let from_right = Transform::from_xyz(cos, 0.0, sin).looking_at(Vec3::ZERO, Vec3::Y);
        let light = stage.simulation.world.spawn((Light::directional(1.0), from_right)).id();
        for technique in [Technique::Horizon, Technique::ReliefHorizon, Technique::Relief, Technique::ZCorrect] {
            set_technique(&mut stage, technique);
            let row = stage.linear()[400..800].to_vec();
            let lit = row.iter().take(195).rposition(|p| p.x > 0.5 * sin).expect("light left of the shadow");
            let found = (200.0 - lit as f32 - 1.0) / 200.0;
            // 0.1 of 2 m is 0.2 m high.
            let expected = 0.2 / degrees.to_radians().tan();
            // The ground rises over half a texel on either side of the step; a march toward the light takes steps of a
            // texel or a 48th of its way, which ends a little lower than the light; and pixels are whole.
            let (texel, pixel) = (2.0 / 256.0, 2.0 / 400.0);
            let step = f32::max(texel, 0.2 / (degrees.to_radians() - 0.04).tan() / 48.0);
            let allowed = 0.5 * texel + step + pixel;
            assert!((found - expected).abs() <= allowed, "{technique:?} {degrees}: {found} m, not {expected} m");
            // Half floats below 1.
            assert!(row[190].x < 0.01 && (row[20].x - sin).abs() < 2e-3, "{technique:?}: {} {}", row[190], row[20]);
            assert!((row[300].x - sin).abs() < 2e-3, "the upper side is lit");
        }
        stage.simulation.world.despawn(light);
    }
}

#[test]
fn a_field_at_one_height_is_a_plane_at_that_height() {
    // A pattern without symmetry, seen from the side: on a plane at half of 0.1 of 2 m below its mesh, and on one
    // there.
    let pattern = |u: f32, v: f32| (hills(u, v) * 200.0) as u8;
    let texels = (0..64 * 64u32).flat_map(|i| {
        let (u, v) = ((i % 64) as f32 / 64.0, (i / 64) as f32 / 64.0);
        [pattern(u, v), pattern(v, u), (i % 64 * 3) as u8, 255]
    });
    let texels: Vec<u8> = texels.collect();
    for turn in [Quat::from_rotation_x(-0.8), Quat::from_rotation_y(0.8), Quat::from_rotation_y(-0.6)] {
        let mut pictures = Vec::new();
        for technique in [Technique::Off, Technique::Relief, Technique::ZCorrect] {
            let Some(mut stage) = Stage::new((120, 120)) else { return };
            stage.three_lights();
            let image = Image::rgba8("pattern", 64, 64, ImageKind::Color, texels.clone());
            let base_map = stage.add(image);
            let material = Material { technique, base_map, ..stage.material(8, 0.1, |_, _| 0.5) };
            let (mesh, at) = Stage::facing(Vec2::splat(2.0));
            let down = if technique == Technique::Off { 0.1 } else { 0.0 };
            let at = Transform::from_rotation(turn) * Transform::from_xyz(0.0, 0.0, -down) * at;
            stage.spawn(mesh, material, at);
            pictures.push(image::imageops::crop_imm(&stage.picture(), 40, 40, 40, 40).to_image());
        }
        for (picture, name) in pictures[1..].iter().zip(["relief", "z_correct"]) {
            // Drivers encode sRGB to 0.6 of a step. Weights have 8 bits, 4 at the least: a sixteenth of 21, which
            // neighbouring texels differ by, along both axes.
            let (far, _) = difference(&pictures[0], picture, 2);
            assert!(far <= 4, "{name}: {far} of 255 apart");
        }
    }
}

#[test]
fn an_image_twice_as_wide_as_high_has_square_texels() {
    // A plane of 2 m by 1 m with a step across v, lit along v: 0.1 widths of the image are 0.2 m.
    let Some(mut stage) = Stage::new((3, 200)) else { return };
    stage.orthographic(0.5);
    let (wide, high) = (256usize, 128usize);
    let add = |stage: &mut Stage, texel: &dyn Fn(usize) -> Vec4| {
        let texels: Vec<Vec4> = (0..wide * high).map(|i| texel(i / wide)).collect();
        let image = Image::rgba16("wide", wide as u32, high as u32, ImageKind::Data, &texels);
        stage.add(image)
    };
    // Up above the middle, where the light comes from; clamped, so that the lower edge does not rise again.
    let is_up = |row: usize| row < high / 2;
    let height_map = add(&mut stage, &|row| Vec4::splat(f32::from(is_up(row))));
    let elevation = |row: usize| {
        let texels = row as f32 - (high / 2) as f32 + 1.0;
        if is_up(row) { 0.0 } else { (0.1 * wide as f32 / texels).atan() / std::f32::consts::FRAC_PI_2 }
    };
    // Image-up is 90 degrees, the third channel of the first map.
    let first = add(&mut stage, &|row| Vec4::new(0.0, 0.0, elevation(row), 0.0));
    let second = add(&mut stage, &|_| Vec4::ZERO);
    let material = Material {
        height_map,
        horizon_maps: [first, second],
        height_scale_uv: 0.1,
        specular_factor: Vec3::ZERO,
        ..Material::default()
    };
    let (mesh, at) = Stage::facing(Vec2::new(2.0, 1.0));
    stage.spawn(mesh, material, at);
    let (sin, cos) = 45f32.to_radians().sin_cos();
    let from_above = Transform::from_xyz(0.0, cos, sin).looking_at(Vec3::ZERO, Vec3::Y);
    stage.simulation.world.spawn((Light::directional(1.0), from_above));
    for technique in [Technique::Relief, Technique::Horizon] {
        set_technique(&mut stage, technique);
        let column: Vec<Vec4> = stage.linear().chunks(3).map(|row| row[1]).collect();
        let lit = column.iter().skip(105).position(|p| p.x > 0.5 * sin).expect("light below the shadow") + 105;
        let found = (lit as f32 - 100.0) / 200.0;
        // As above, half a texel for the step, one of a march or of the map, 2 m / 256 each, and a pixel of 1 m / 200.
        assert!((found - 0.2).abs() < 0.02, "{technique:?}: the shadow is {found} m long");
    }
}

#[test]
fn z_correct_surfaces_meet_where_the_displaced_ones_do() {
    // A ground at half height, 0.25 m below its square, and a smooth sheet through it that slants by 45 degrees.
    for (technique, expected) in
        [(Technique::Relief, 0.0), (Technique::ZCorrect, -0.25), (Technique::ZCorrectParallax, -0.25)]
    {
        let Some(mut stage) = Stage::new((201, 3)) else { return };
        stage.orthographic(3.0 / 201.0);
        let ground = stage.material(8, 0.25, |_, _| 0.5);
        let (mesh, at) = Stage::facing(Vec2::splat(2.0));
        let ground = stage.spawn(mesh, Material { technique, ..ground }, at);
        let (mesh, at) = Stage::facing(Vec2::splat(4.0));
        let slanted = Transform::from_rotation(Quat::from_rotation_y(-std::f32::consts::FRAC_PI_4)) * at;
        stage.spawn(mesh, Material::default(), slanted);
        stage.picture();
        let outputs = stage.headless.renderer.draw_outputs(OutputSet { id: true, ..OutputSet::NONE }).expect("outputs");
        let ids = outputs.entities();
        let row = &ids[201..402];
        let is_ground = |id: &Option<u32>| *id == Some(ground.index_u32());
        let edge = row.iter().position(|id| !is_ground(id)).expect("the sheet shows");
        assert!(row[edge..].iter().all(|id| !is_ground(id)), "one line");
        let found = (edge as f32 - 100.5) * 2.0 / 201.0;
        // Two pixels of 2 m / 201: the one that the line is in, and one beside it where vertices are rounded.
        assert!((found - expected).abs() < 0.02, "{technique:?}: the line is at {found}, not {expected}");
    }
}

#[test]
fn perturbed_normals_are_near_those_of_the_derived_map() {
    // A square: on a curved mesh the map's slopes are those of its image, whichever way that is stretched there.
    let Some(mut stage) = Stage::new((320, 240)) else { return };
    let (mesh, at) = Stage::facing(Vec2::splat(2.0));
    let material = stage.material(64, 0.06, hills);
    stage.spawn(mesh, material, Transform::from_rotation(Quat::from_rotation_x(-0.5)) * at);
    set_technique(&mut stage, Technique::Normal);
    let mapped = stage.normals();
    set_technique(&mut stage, Technique::Off);
    let smooth = stage.normals();
    set_technique(&mut stage, Technique::PerturbedNormal);
    let perturbed = stage.normals();
    let degrees = |a: &Vec3, b: &Vec3| a.angle_between(*b).to_degrees();
    let mut angles: Vec<f32> = Vec::new();
    let mut bumps: Vec<f32> = Vec::new();
    for ((mapped, perturbed), smooth) in mapped.iter().zip(&perturbed).zip(&smooth).filter(|(_, s)| s.length() > 0.5) {
        angles.push(degrees(mapped, perturbed));
        bumps.push(degrees(mapped, smooth));
    }
    angles.sort_by(f32::total_cmp);
    bumps.sort_by(f32::total_cmp);
    let at = |of: &[f32], part: f32| of[(of.len() as f32 * part) as usize];
    assert!(angles.len() > 5000 && at(&bumps, 0.5) > 8.0, "{} {}", angles.len(), at(&bumps, 0.5));
    // Between texels, heights rise straight and the map's slopes change straight: they differ by up to half of what a
    // slope changes from texel to texel, which is 0.056 along v and 0.037 along u: 0.033, evenly spread, so half of
    // them by half of it. Heights half a pixel to either side differ by 85 steps of a weight's 8 bits, of which one may
    // be lost: a hundredth of a slope of 0.4; half floats, 0.002.
    let (half, most) = (at(&angles, 0.5), at(&angles, 0.99));
    let allowed = |straight: f32| (straight + 0.004 + 0.002).to_degrees();
    assert!(half < allowed(0.017) && most < allowed(0.033), "half are within {half} degrees, 99 in 100 within {most}");
}

/// A map of one colour.
fn constant(stage: &mut Stage, color: [u8; 4], kind: ImageKind) -> Option<Map> {
    let image = Image::rgba8("constant", 1, 1, kind, color.to_vec());
    stage.add(image)
}

#[test]
fn an_offset_turns_the_mirror() {
    let Some(mut stage) = Stage::new((17, 17)) else { return };
    stage.orthographic(0.5);
    // All around, from +Z by −X, −Z and +X to +Z again: green grows with the angle.
    let columns: Vec<u8> = (0..256u32).flat_map(|x| [0, x as u8, 0, 255]).collect();
    let columns = Image::rgba8("columns", 256, 1, ImageKind::Data, columns);
    let environment = stage.add(columns);
    for (du, matrix) in [(128u8, 1.0), (192, 1.0), (64, 1.0), (192, 0.5)] {
        let offset_map = constant(&mut stage, [du, 128, 0, 255], ImageKind::Data);
        let (mesh, at) = Stage::facing(Vec2::splat(2.0));
        let material = Material {
            technique: Technique::PerturbedUv,
            offset_map,
            environment_map: environment,
            offset_matrix: glam::Mat2::from_diagonal(Vec2::splat(matrix)),
            specular_factor: Vec3::ONE,
            ..Material::default()
        };
        let square = stage.spawn(mesh, material, at);
        let middle = stage.linear()[17 * 17 / 2];
        stage.simulation.world.despawn(square);
        // The normal moves to (d, 0, sqrt(1 - d^2)): the mirrored ray turns by twice its angle, from +Z toward +X.
        let angle = 2.0 * (matrix * (f32::from(du) - 128.0) / 127.0).asin();
        let (x, z) = angle.sin_cos();
        let expected = (x.atan2(-z) / std::f32::consts::TAU + 0.5) * 256.0 / 255.0;
        // The formula leaves out half a column, 0.002; a half float is 2⁻¹¹ off; arctangents are 4096 units in the last
        // place off (Vulkan), 0.0001 of a turn. At no offset +Z is where the picture's ends meet.
        let apart = (middle.y - expected).rem_euclid(1.0);
        assert!(apart.min(1.0 - apart) < 0.01 || du == 128, "{du}: {middle} {expected}");
    }
}

#[test]
fn an_offset_moves_what_lies_behind() {
    let Some(mut stage) = Stage::new((201, 5)) else { return };
    stage.orthographic(5.0 / 201.0);
    // Behind: dark to the left of x = 0, bright to the right.
    let glow = |value: f32| Material {
        shading: Shading::Unlit,
        base_factor: Vec4::new(value, value, value, 1.0),
        ..Material::default()
    };
    let (mesh, at) = Stage::facing(Vec2::splat(4.0));
    stage.spawn(mesh.clone(), glow(0.0), Transform::from_xyz(-2.0, 0.0, -1.0) * at);
    stage.spawn(mesh, glow(0.5), Transform::from_xyz(2.0, 0.0, -1.0) * at);
    let mut edges = Vec::new();
    for du in [128, 255] {
        let offset_map = constant(&mut stage, [du, 128, 0, 255], ImageKind::Data);
        let (mesh, at) = Stage::facing(Vec2::splat(2.0));
        let material = Material {
            technique: Technique::PerturbedUv,
            alpha: AlphaMode::Blend,
            base_factor: Vec4::new(1.0, 1.0, 1.0, 0.25),
            specular_factor: Vec3::ZERO,
            offset_map,
            height_scale_uv: 0.1,
            ..Material::default()
        };
        let pane = stage.spawn(mesh, material, at);
        for samples in [1, 4] {
            stage.headless.settings.samples = samples;
            let row = stage.linear()[402..603].to_vec();
            // Three quarters of what is behind; the pane itself is dark. Two half floats below 0.5, 2⁻¹² each.
            assert!(row[2].x == 0.0 && (row[198].x - 0.375).abs() < 1e-3, "{} {}", row[2], row[198]);
            edges.push(row.iter().position(|p| p.x > 0.19).expect("an edge"));
        }
        stage.simulation.world.despawn(pane);
    }
    // The pane is 0.1 of its 2 m thick; an offset of 1 reads 0.2 m to the right: 20 pixels of 2 m / 201, the last of
    // which is mixed with the next.
    let moved = |i: usize| edges[i] as i32 - edges[i + 2] as i32;
    assert!((edges[0] as i32 - 100).abs() <= 1 && (edges[0] as i32 - edges[1] as i32).abs() <= 1, "{edges:?}");
    assert!((moved(0) - 20).abs() <= 1 && (moved(1) - 20).abs() <= 1, "{edges:?}");
}

#[test]
fn dot3_computes_with_bytes() {
    for technique in [Technique::Dot3, Technique::Dot3Constant] {
        let Some(mut stage) = Stage::new((9, 9)) else { return };
        stage.orthographic(0.01);
        let (mesh, at) = Stage::facing(Vec2::splat(2.0));
        let normal_map = constant(&mut stage, [200, 128, 220, 255], ImageKind::Normal);
        let material = Material { technique, normal_map, specular_factor: Vec3::ZERO, ..Material::default() };
        stage.spawn(mesh, material, at);
        let direction = Vec3::new(0.48, 0.6, 0.64);
        let place = Transform::from_translation(direction).looking_at(Vec3::ZERO, Vec3::Y);
        stage.simulation.world.spawn((Light::directional(1.0), place));
        let middle = stage.linear()[40];
        let byte = |v: Vec3| (v.clamp(Vec3::ZERO, Vec3::ONE) * 255.0 + 0.5).floor() / 255.0;
        let light = byte(direction * 0.5 + 0.5) * 2.0 - 1.0;
        let normal = Vec3::new(200.0, 128.0, 220.0) / 255.0 * 2.0 - 1.0;
        // Neither vector is unit: normal · light as the combiner has it, in 8 bits. What is rounded is not within 0.1
        // of where the next step begins; a half float is 2⁻¹¹ off.
        let expected = byte(Vec3::splat(normal.dot(light))).x;
        assert!((middle.x - expected).abs() < 1e-3, "{technique:?}: {middle} {expected}");
    }
}

#[test]
fn a_technique_is_a_draw_and_not_a_draw_per_object() {
    let Some(mut stage) = Stage::new((64, 48)) else { return };
    stage.three_lights();
    let material = stage.material(16, 0.05, hills);
    let mut library = stage.simulation.world.resource_mut::<Library>();
    let mesh = library.add_mesh(shapes::cube(Vec3::splat(0.1)));
    let materials: Vec<_> = Technique::ALL
        .iter()
        .map(|&(_, technique)| library.add_material(Material { technique, ..material.clone() }))
        .collect();
    for i in 0..20 * materials.len() {
        let at = Transform::from_xyz((i % 20) as f32 * 0.12 - 1.2, (i / 20) as f32 * 0.12 - 1.0, 0.0);
        stage.simulation.world.spawn((mesh, materials[i % materials.len()], at));
    }
    stage.picture();
    let stats = stage.headless.renderer.stats();
    // One each, and the sixteen passes that the historic emboss takes.
    assert_eq!(stats.draws as usize, Technique::ALL.len() + 16);
    assert_eq!(stage.headless.renderer.read_visible_counts().objects, 320);
}
