//! Pictures with known answers: what one pixel must be, worked out by hand.

use crate::common::square::{SIZE, Square, assert_near, matte};
use crate::common::{self, prelude::*};
use glam::Affine2;

#[test]
fn phong_and_blinn_highlights_are_not_coloured_by_the_base() {
    let material = Material {
        base_factor: Vec4::new(1.0, 0.0, 0.0, 1.0),
        specular_factor: Vec3::new(0.1, 0.2, 0.3),
        shininess: 10.0,
        ..Material::default()
    };
    let Some(mut square) = Square::new(material) else { return };
    let angle = 0.4f32;
    square.light(Light::directional(1.0), Transform::from_rotation(Quat::from_rotation_y(angle)));
    let diffuse = Vec3::X * angle.cos();
    let specular = Vec3::new(0.1, 0.2, 0.3);
    assert_near(square.middle(), diffuse + specular * angle.cos().powi(10));
    square.edit(|m| m.shading = Shading::Blinn);
    assert_near(square.middle(), diffuse + specular * (angle / 2.0).cos().powi(10));
}

/// glTF 2.0, appendix B.3, with the light's π.
fn ggx(base: Vec3, metallic: f32, roughness: f32, angle: f32) -> Vec3 {
    let alpha2 = roughness.powi(4);
    let (n_l, n_v, n_h, v_h) = (angle.cos(), 1.0f32, (angle / 2.0).cos(), (angle / 2.0).cos());
    let f0 = Vec3::splat(0.04).lerp(base, metallic);
    let fresnel = f0 + (1.0 - f0) * (1.0 - v_h).powi(5);
    let d = alpha2 / (std::f32::consts::PI * (n_h * n_h * (alpha2 - 1.0) + 1.0).powi(2));
    let g = |n: f32| 2.0 * n / (n + (alpha2 + (1.0 - alpha2) * n * n).sqrt());
    // The uncorrelated form differs from the correlated one away from normal view; at n·v = 1 they agree.
    let v = g(n_l) * g(n_v) / (4.0 * n_l * n_v);
    let diffuse = (1.0 - fresnel) * base * (1.0 - metallic) / std::f32::consts::PI;
    std::f32::consts::PI * n_l * (diffuse + fresnel * d * v)
}

#[test]
fn metallic_roughness_follows_the_gltf_formula() {
    let base = Vec3::new(0.9, 0.6, 0.3);
    let material = Material { shading: Shading::MetallicRoughness, ..matte(base) };
    let Some(mut square) = Square::new(Material { specular_factor: Vec3::ONE, ..material }) else { return };
    let angle = 0.5f32;
    square.light(Light::directional(1.0), Transform::from_rotation(Quat::from_rotation_y(angle)));
    for (metallic, roughness) in [(0.0, 1.0), (0.0, 0.5), (1.0, 0.6), (0.5, 0.8)] {
        square.edit(|m| (m.metallic, m.roughness) = (metallic, roughness));
        assert_near(square.middle(), ggx(base, metallic, roughness, angle));
    }
}

#[test]
fn specular_glossiness_is_a_dielectric_or_metal_by_its_colours() {
    let shading = Shading::SpecularGlossiness;
    let dielectric =
        Material { shading, specular_factor: Vec3::splat(0.04), glossiness: 0.4, ..matte(Vec3::splat(0.5)) };
    let Some(mut square) = Square::new(dielectric) else { return };
    square.light(Light::directional(1.0), Transform::from_rotation(Quat::from_rotation_y(0.5)));
    assert_near(square.middle(), ggx(Vec3::splat(0.5 * 0.96), 0.0, 0.6, 0.5));
    let gold = Vec3::new(1.0, 0.7, 0.3);
    square.edit(|m| (m.base_factor, m.specular_factor) = (Vec4::ZERO, gold));
    assert_near(square.middle(), ggx(gold, 1.0, 0.6, 0.5));
}

#[test]
fn metals_mirror_the_sky_and_are_not_black() {
    let material = Material { shading: Shading::MetallicRoughness, roughness: 0.2, ..matte(Vec3::ONE) };
    let Some(mut square) = Square::new(Material { specular_factor: Vec3::ONE, ..material }) else { return };
    square.simulation.world.resource_mut::<Environment>().horizon = Vec3::new(0.2, 0.4, 0.8);
    let seen = square.middle();
    // Blue is four times red in the sky, and a white metal mirrors both alike. Two half floats, 2⁻¹⁰ each, of 4.
    assert!(seen.x > 0.1 && (seen.z / seen.x - 4.0).abs() < 0.01, "{seen}");
}

#[test]
fn unlit_emission_exposure_and_tone_map() {
    let Some(mut square) = Square::new(Material { shading: Shading::Unlit, ..matte(Vec3::new(0.5, 1.0, 0.0)) }) else {
        return;
    };
    square.assert_byte_near([188, 255, 0, 255]);
    square.edit(|m| {
        m.shading = Shading::Phong;
        m.emissive_factor = Vec3::new(0.25, 3.0, 0.0);
    });
    // The classic model: base · emission; glTF's: emission as it is.
    assert_near(square.middle(), Vec3::new(0.125, 3.0, 0.0));
    square.edit(|m| m.shading = Shading::MetallicRoughness);
    assert_near(square.middle(), Vec3::new(0.25, 3.0, 0.0));
    square.simulation.world.resource_mut::<Environment>().exposure = 2.0;
    square.assert_byte_near([188, 255, 0, 255]);
    for curve in [ToneMap::Aces, ToneMap::Agx] {
        square.simulation.world.resource_mut::<Environment>().tone_map = curve;
        let [_, green, ..] = square.middle_byte();
        assert!((200..=255).contains(&green), "{curve:?} keeps bright bright: {green}");
        square.edit(|m| m.emissive_factor = Vec3::ZERO);
        assert!(square.middle_byte()[1] <= 2, "{curve:?} keeps black black");
        square.edit(|m| m.emissive_factor = Vec3::new(0.25, 3.0, 0.0));
    }
}

#[test]
fn mask_cuts_blend_mixes_and_opaque_ignores_alpha() {
    let Some(mut square) = Square::new(Material { shading: Shading::Unlit, ..matte(Vec3::X) }) else { return };
    let mut library = square.simulation.world.resource_mut::<Library>();
    let behind = library.add_material(Material { shading: Shading::Unlit, ..matte(Vec3::Z) });
    let mesh = *square.simulation.world.get::<MeshId>(square.square).expect("a mesh");
    let mut place = *square.simulation.world.get::<Transform>(square.square).expect("a place");
    place.translation.z = -1.0;
    square.simulation.world.spawn((mesh, behind, place));
    square.edit(|m| m.base_factor.w = 0.25);
    assert_near(square.middle(), Vec3::X);
    square.edit(|m| m.alpha = AlphaMode::Blend);
    assert_near(square.middle(), Vec3::new(0.25, 0.0, 0.75));
    square.edit(|m| m.alpha = AlphaMode::Mask);
    assert_near(square.middle(), Vec3::Z);
    square.edit(|m| m.alpha_cutoff = 0.2);
    assert_near(square.middle(), Vec3::X);
}

#[test]
fn back_faces_are_culled_or_lit_from_their_own_side() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    square.light(Light::directional(1.0), Transform::default());
    square.simulation.world.get_mut::<Transform>(square.square).expect("a place").rotation =
        Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    assert_near(square.middle(), Vec3::ZERO);
    square.edit(|m| m.double_sided = true);
    assert_near(square.middle(), Vec3::ONE);
}

/// A normal map that leans by an angle toward +U.
fn leaning(square: &mut Square, lean: f32) -> Map {
    let byte = |v: f32| (v * 127.5 + 127.5).round() as u8;
    let texel = vec![byte(lean.sin()), 128, byte(lean.cos()), 255];
    square.add_image(Image::rgba8("leaning", 1, 1, ImageKind::Normal, texel))
}

#[test]
fn a_mirrored_object_still_shows_its_front_and_its_relief() {
    // A normal map that leans 30° toward +U, lit from +X: brighter than flat. Mirrored in X, it leans toward −X:
    // darker.
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    let (lean, light) = (30f32.to_radians(), 45f32.to_radians());
    let map = leaning(&mut square, lean);
    square.edit(|m| m.normal_map = Some(map));
    square.light(Light::directional(1.0), Transform::from_rotation(Quat::from_rotation_y(light)));
    // Half a step of 8 bits, 1/255, in each component of the normal: √3/255, and 2⁻¹⁰ for half floats.
    let near = |got: Vec4, wanted: f32| assert!((got.x - wanted).abs() < 0.01, "{got} {wanted}");
    near(square.middle(), (light - lean).cos());
    square.simulation.world.get_mut::<Transform>(square.square).expect("a place").scale.x = -1.0;
    near(square.middle(), (light + lean).cos());
    // Non-uniform scale: a flat surface stays flat, the map's lean stays in tangent space.
    square.simulation.world.get_mut::<Transform>(square.square).expect("a place").scale = Vec3::new(3.0, 5.0, 1.0);
    near(square.middle(), (light - lean).cos());
    square.headless.settings.technique = Some(Technique::Off);
    near(square.middle(), light.cos());
}

#[test]
fn relief_turns_with_its_uv_transform_and_follows_its_uv_set() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    let (lean, light) = (30f32.to_radians(), 45f32.to_radians());
    let map = leaning(&mut square, lean);
    square.light(Light::directional(1.0), Transform::from_rotation(Quat::from_rotation_y(light)));
    // A normal of 8 bits, √3/255, and half floats, 2⁻¹⁰.
    let near = |got: Vec4, wanted: f32, what: &str| assert!((got.x - wanted).abs() < 0.01, "{what}: {got} {wanted}");
    let (toward, away, across) = ((light - lean).cos(), (light + lean).cos(), light.cos() * lean.cos());
    let turned = |angle: f32| Affine2::from_angle(angle);
    let cases = [
        ("as it is", Affine2::IDENTITY, toward),
        ("repeated", Affine2::from_scale(Vec2::new(3.0, 2.0)), toward),
        ("turned half", turned(std::f32::consts::PI), away),
        ("turned a quarter", turned(std::f32::consts::FRAC_PI_2), across),
        ("mirrored in u", Affine2::from_scale(Vec2::new(-1.0, 1.0)), away),
        ("mirrored in v", Affine2::from_scale(Vec2::new(1.0, -1.0)), toward),
    ];
    for (what, image_from_mesh_uv, wanted) in cases {
        square.edit(|m| m.normal_map = Some(Map { image_from_mesh_uv, ..map }));
        near(square.middle(), wanted, what);
    }
    // The second set runs the other way, and the mesh says that its normal map is placed by it.
    let mut mesh = shapes::plane(Vec2::splat(2.0), UVec2::ONE);
    mesh.uvs[1] = mesh.uvs[0].iter().map(|uv| 1.0 - *uv).collect();
    mesh.tangent_uv_set = 1;
    let mesh = square.simulation.world.resource_mut::<Library>().add_mesh(mesh);
    square.simulation.world.entity_mut(square.square).insert(mesh);
    square.edit(|m| m.normal_map = Some(Map { uv_set: 1, ..map }));
    near(square.middle(), away, "second set");
}

#[test]
fn an_object_flattened_to_nothing_is_still_lit() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    square.light(Light::directional(1.0), Transform::default());
    square.simulation.world.get_mut::<Transform>(square.square).expect("a place").scale.y = 0.0;
    assert_near(square.middle(), Vec3::ONE);
}

#[test]
fn one_renderer_draws_two_worlds_in_turn() {
    let (Some(mut red), Some(mut blue)) = (Square::new(matte(Vec3::X)), Square::new(matte(Vec3::Z))) else { return };
    for square in [&mut red, &mut blue] {
        square.simulation.world.resource_mut::<Environment>().ambient = Vec3::ONE;
    }
    assert_near(red.middle(), Vec3::X);
    std::mem::swap(&mut red.headless, &mut blue.headless);
    assert_near(blue.middle(), Vec3::Z);
    std::mem::swap(&mut red.headless, &mut blue.headless);
    assert_near(red.middle(), Vec3::X);
}

#[test]
fn perturbed_normals_are_those_of_the_height_fields_slope() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    square.light(Light::directional(1.0), Transform::default());
    square.edit(|m| m.technique = Technique::PerturbedNormal);
    assert_near(square.middle(), Vec3::ONE);
    // Height rises from 0 to 1 along u over 2 m; depth 0.25 of the square's width = 0.5 m: slope 1/4.
    let ramp = (0..256 * 256u32).flat_map(|i| [(i % 256) as u8, 0, 0, 255]).collect();
    let map = square.add_image(Image::rgba8("ramp", 256, 256, ImageKind::Data, ramp));
    square.edit(|m| (m.height_map, m.height_scale_uv) = (Some(map), 0.25));
    let cosine = 1.0 / (1.0f32 + 0.25 * 0.25).sqrt();
    let got = square.middle();
    // 255 steps over 256 texels make the slope 0.001 steeper; heights are read within a sixteenth of a texel at worst,
    // 18 texels apart, which is 0.002. A quarter of that is the cosine's, and half floats have 2⁻¹⁰.
    assert!((got.x - cosine).abs() < 0.005, "{got} {cosine}");
    square.headless.settings.debug = DebugView::Normal;
    let normal = square.middle().truncate() * 2.0 - 1.0;
    // Rising toward +X, the surface leans toward −X. The slope's 0.003, and twice 2⁻¹⁰ in each component.
    assert!((normal - Vec3::new(-0.25, 0.0, 1.0).normalize()).length() < 0.02, "{normal}");
}

#[test]
fn heights_of_sixteen_bits_lean_as_they_rise() {
    // On every kind of adapter: with 32-bit floats that are filtered, with 16-bit integers alone.
    let kinds = [wgpu::Features::FLOAT32_FILTERABLE, wgpu::Features::TEXTURE_FORMAT_16BIT_NORM];
    for kind in kinds {
        let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
        let gpu = Gpu::headless_with(Gpu::USED.difference(kinds[0].union(kinds[1])).union(kind)).expect("an adapter");
        if !gpu.device.features().contains(kind) {
            common::skip_always(&format!("the adapter lacks {kind:?}"));
            continue;
        }
        square.headless.renderer = relief::renderer::SingleView::new(&gpu);
        square.light(Light::directional(1.0), Transform::default());
        // 8/65535 from texel to texel, where half floats are 32/65535 apart.
        let heights: Vec<f32> = (0..256).map(|i| (58_000.0 + 8.0 * (i % 16) as f32) / 65535.0).collect();
        let map = square.add_image(Image::heights("ramp", 16, 16, &heights));
        // Over texels of 2 m / 16, at 256 m from black to white.
        let slope = 256.0 * 8.0 / 65535.0 / 0.125;
        square.edit(|m| {
            (m.technique, m.height_map, m.height_scale_uv) = (Technique::PerturbedNormal, Some(map), 128.0);
        });
        square.headless.settings.debug = DebugView::Normal;
        let normal = square.middle().truncate() * 2.0 - 1.0;
        let expected = Vec3::new(-slope, 0.0, 1.0).normalize();
        // Filters weigh in steps of 1/256 of a texel or less, and the linear picture holds half floats: both below a
        // hundredth.
        assert!((normal - expected).length() < 0.02, "{kind:?}: {normal}, {expected}");
    }
}

/// White leaves on clear black, 2 × 2 texels each, cover a half from near by and from afar, whatever a mask's cut-off.
#[test]
fn a_half_of_clear_black_is_a_half_of_white() {
    let leaves = |kind| {
        let texel = |i: u32| if (i % 64 / 2 + i / 64 / 2).is_multiple_of(2) { [255; 4] } else { [0; 4] };
        Image::rgba8("leaves", 64, 64, kind, (0..64 * 64).flat_map(texel).collect())
    };
    let material = Material { shading: Shading::Unlit, ..matte(Vec3::ONE) };
    let Some(mut square) = Square::new(material) else { return };
    let sum = |square: &mut Square, side: u32| {
        square.headless.draw(&mut square.simulation, square.camera, (side, side)).expect("a picture");
        let pixels = square.headless.renderer.read_linear().expect("linear colours");
        pixels.iter().map(|pixel| f64::from(pixel[0])).sum::<f64>()
    };
    // Sides of the picture: at the second a texel is smaller than a pixel by far.
    let (near, far) = (512, 8);
    let whole = [sum(&mut square, near), sum(&mut square, far)];
    let cutoffs = [None, Some(0.1), Some(0.3), Some(0.5), Some(0.8)];
    for cutoff in cutoffs {
        let kind = cutoff.map_or(ImageKind::Blended, |cutoff| ImageKind::masked(cutoff, 1.0));
        let map = square.add_image(leaves(kind));
        square.edit(|m| {
            m.base_map = Some(map);
            m.alpha = if cutoff.is_some() { AlphaMode::Mask } else { AlphaMode::Blend };
            m.alpha_cutoff = cutoff.unwrap_or(0.5);
        });
        let part = [sum(&mut square, near) / whole[0], sum(&mut square, far) / whole[1]];
        // A leaf is some 8 pixels wide: an edge that is a tenth of a pixel off on each side would be a fortieth.
        assert!((part[0] - 0.5).abs() < 0.025, "{cutoff:?} near by: {part:?}");
        // From afar a mask of a half, all texels alike, shows everything; half floats hold the rest to a 2048th.
        let expected = if cutoff.is_some() { 1.0 } else { 0.5 };
        assert!((part[1] - expected).abs() < 0.01, "{cutoff:?} from afar: {part:?}");
    }
}

#[test]
fn outputs_give_depth_normal_and_entity() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    square.middle();
    let outputs = square.headless.renderer.draw_outputs(OutputSet::ALL).expect("outputs");
    let (middle, corner) = ((SIZE * SIZE / 2) as usize, 0);
    let depths = outputs.depths();
    // A depth of 32 bits is near / distance: some roundings of 2⁻²⁴. Half floats hold +Z, and small numbers to 2⁻¹⁰.
    assert!((depths[middle] - 3.0).abs() < 1e-3, "{}", depths[middle]);
    assert_eq!(depths[corner], f32::INFINITY);
    assert_eq!(outputs.entities()[middle], Some(square.square.index().index()));
    assert_eq!(outputs.entities()[corner], None);
    assert!((Vec3::from(outputs.normals()[middle]) - Vec3::Z).length() < 1e-3);
}

#[test]
fn a_sky_of_one_colour_is_the_gradient_between_three_equal_ones() {
    let Some(mut square) = Square::new(Material { base_factor: Vec4::ONE, ..Material::default() }) else { return };
    for (exposure, samples) in [(1.0, 1), (2.25, 4)] {
        square.headless.settings.samples = samples;
        let mut picture = |zenith: Vec3| {
            let dusk = Vec3::new(0.03, 0.4, 0.07);
            let environment =
                Environment { exposure, zenith: dusk + zenith, horizon: dusk, ground: dusk, ..Environment::default() };
            square.simulation.world.insert_resource(environment);
            square.headless.draw(&mut square.simulation, square.camera, (SIZE, SIZE)).expect("a picture");
            square.headless.renderer.read_linear().expect("linear colours")
        };
        // The difference is less than a step of the target's half floats, of 11 bits, but there is a gradient to draw.
        let (plain, gradient) = (picture(Vec3::ZERO), picture(Vec3::splat(1e-6)));
        let steps = plain.iter().flatten().zip(gradient.iter().flatten()).map(|(a, b)| (a - b).abs() / a);
        let most = steps.fold(0.0, f32::max);
        assert!(most <= 2f32.powi(-10), "{most} of a colour apart");
        let corner = Vec4::from_array(plain[0]);
        let expected = (Vec3::new(0.03, 0.4, 0.07) * exposure).extend(1.0);
        // A half float below 1, rounded toward 0.
        assert!((corner - expected).abs().max_element() < 1e-3, "{corner}");
    }
}
