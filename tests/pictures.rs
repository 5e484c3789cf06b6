//! Pictures with known answers: what one pixel must be, worked out by hand.

mod common;

use bevy_ecs::prelude::*;
use bevy_transform::components::Transform;
use glam::{Affine2, Quat, UVec2, Vec2, Vec3, Vec4};
use relief::frames::Headless;
use relief::renderer::{DebugView, Gpu, HeatScale, Renderer, Settings};
use systems::Simulation;
use systems::components::{Camera, Environment, Light, LightKind, ToneMap};
use systems::images::{Image, ImageKind};
use systems::library::{AlphaMode, Library, Map, Material, MaterialId, MeshId, Shading, Technique};
use systems::lights::LightPolicy;
use systems::shapes;

const SIZE: u32 = 17;

/// A square of 2 m that faces the camera, 3 m away, in the dark.
struct Square {
    simulation: Simulation,
    headless: Headless,
    camera: Entity,
    square: Entity,
}

impl Square {
    fn new(material: Material) -> Option<Self> {
        let gpu = common::gpu()?;
        let mut simulation = Simulation::new();
        let dark = Environment {
            ambient: Vec3::ZERO,
            zenith: Vec3::ZERO,
            horizon: Vec3::ZERO,
            ground: Vec3::ZERO,
            exposure: 1.0,
            tone_map: ToneMap::Clamp,
        };
        simulation.world.insert_resource(dark);
        let mut library = simulation.world.resource_mut::<Library>();
        let mesh = library.add_mesh(shapes::plane(Vec2::splat(2.0), UVec2::ONE));
        let material = library.add_material(material);
        let facing = Transform::from_rotation(Quat::from_rotation_x(std::f32::consts::FRAC_PI_2));
        let square = simulation.world.spawn((mesh, material, facing)).id();
        let camera = simulation.world.spawn((Camera::default(), Transform::from_xyz(0.0, 0.0, 3.0))).id();
        let settings = Settings { samples: 1, ..Settings::default() };
        Some(Self { simulation, headless: Headless { renderer: Renderer::new(&gpu), settings }, camera, square })
    }

    fn light(&mut self, light: Light, place: Transform) -> Entity {
        self.simulation.world.spawn((light, place)).id()
    }

    fn add_image(&mut self, image: Image) -> Map {
        Map::new(self.simulation.world.resource_mut::<Library>().add_image(image))
    }

    fn edit(&mut self, edit: impl FnOnce(&mut Material)) {
        let id = *self.simulation.world.get::<MaterialId>(self.square).expect("a material");
        assert!(self.simulation.world.resource_mut::<Library>().edit_material(id, edit));
    }

    /// The middle pixel, linear.
    fn middle(&mut self) -> Vec4 {
        self.headless.draw(&mut self.simulation, self.camera, (SIZE, SIZE)).expect("a picture");
        let pixels = self.headless.renderer.read_linear().expect("linear colours");
        Vec4::from_array(pixels[(SIZE * SIZE / 2) as usize])
    }

    /// The middle pixel of the picture.
    fn middle_byte(&mut self) -> [u8; 4] {
        let picture = self.headless.draw(&mut self.simulation, self.camera, (SIZE, SIZE)).expect("a picture");
        picture.get_pixel(SIZE / 2, SIZE / 2).0
    }

    /// Drivers round the sRGB curve differently by one.
    #[track_caller]
    fn assert_byte_near(&mut self, wanted: [u8; 4]) {
        let got = self.middle_byte();
        assert!(got.iter().zip(wanted).all(|(g, w)| g.abs_diff(w) <= 1), "got {got:?}, wanted {wanted:?}");
    }
}

#[track_caller]
fn assert_near(got: Vec4, wanted: Vec3) {
    let error = (got.truncate() - wanted).abs().max_element();
    assert!(error <= 2e-3 * wanted.max_element().max(1.0), "got {got}, wanted {wanted}");
}

fn matte(base: Vec3) -> Material {
    Material { base_factor: base.extend(1.0), specular_factor: Vec3::ZERO, ..Material::default() }
}

/// From the camera to the square.
fn head_on() -> Transform {
    Transform::from_xyz(0.0, 0.0, 3.0)
}

#[test]
fn diffuse_light_falls_off_with_angle_distance_and_range() {
    let base = Vec3::new(0.8, 0.4, 0.2);
    let Some(mut square) = Square::new(matte(base)) else { return };
    assert_near(square.middle(), Vec3::ZERO);
    square.simulation.world.resource_mut::<Environment>().ambient = Vec3::splat(0.1);
    assert_near(square.middle(), base * 0.1);
    square.simulation.world.resource_mut::<Environment>().ambient = Vec3::ZERO;

    let sun = square.light(Light::directional(0.5), Transform::default());
    assert_near(square.middle(), base * 0.5);
    let slanted = Transform::from_rotation(Quat::from_rotation_y(60f32.to_radians()));
    square.simulation.world.entity_mut(sun).insert(slanted);
    assert_near(square.middle(), base * 0.25);
    square.simulation.world.entity_mut(sun).insert(Transform::from_rotation(Quat::from_rotation_y(3.0)));
    assert_near(square.middle(), Vec3::ZERO);
    square.simulation.world.despawn(sun);

    let mut bulb = Light::point(2.0, f32::INFINITY);
    bulb.attenuation = Vec3::new(0.5, 0.25, 0.125);
    bulb.ambient = Vec3::new(0.0, 0.0, 0.3);
    let lamp = square.light(bulb.clone(), Transform::from_xyz(0.0, 0.0, 2.0));
    let attenuation = 1.0 / (0.5 + 0.25 * 2.0 + 0.125 * 4.0);
    assert_near(square.middle(), base * attenuation * (Vec3::splat(2.0) + Vec3::new(0.0, 0.0, 0.3)));
    bulb.range = 4.0;
    square.simulation.world.entity_mut(lamp).insert(bulb.clone());
    let window = (1.0f32 - (4.0f32 / 16.0).powi(2)).powi(2);
    assert_near(square.middle(), base * attenuation * window * (Vec3::splat(2.0) + Vec3::new(0.0, 0.0, 0.3)));
    bulb.range = 1.9;
    square.simulation.world.entity_mut(lamp).insert(bulb);
    assert_near(square.middle(), Vec3::ZERO);
}

#[test]
fn a_spot_gives_nothing_outside_its_cone_and_its_profile_inside() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    let kind = LightKind::Spot { outer: 0.5, inner: None, exponent: 8.0 };
    let classic = Light { kind, attenuation: Vec3::X, ..Light::point(1.0, f32::INFINITY) };
    let turned = |angle| head_on().with_rotation(Quat::from_rotation_y(angle));
    let lamp = square.light(classic.clone(), turned(0.3));
    assert_near(square.middle(), Vec3::splat(0.3f32.cos().powi(8)));
    square.simulation.world.entity_mut(lamp).insert(turned(0.51));
    assert_near(square.middle(), Vec3::ZERO);
    let kind = LightKind::Spot { outer: 0.5, inner: Some(0.2), exponent: 0.0 };
    square.simulation.world.entity_mut(lamp).insert((Light { kind, ..classic }, turned(0.3)));
    let step = (0.3f32.cos() - 0.5f32.cos()) / (0.2f32.cos() - 0.5f32.cos());
    assert_near(square.middle(), Vec3::splat(step * step));
}

/// The first light with a cone or an ambient colour needs other shaders than were compiled for those before it.
#[test]
fn a_light_unlike_those_before_it_is_seen_from_the_frame_on_in_which_it_comes() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    square.light(Light::directional(0.2), Transform::default());
    assert_near(square.middle(), Vec3::splat(0.2));
    // Shines at the square's edge and past its middle, which a point light would light.
    let aside = Transform::from_xyz(0.0, 0.0, 3.0).looking_at(Vec3::X, Vec3::Y);
    square.light(Light::spot(5.0, 20.0, 0.2), aside);
    assert_near(square.middle(), Vec3::splat(0.2));
    let sun = square.light(Light { ambient: Vec3::splat(0.1), ..Light::directional(0.3) }, Transform::default());
    assert_near(square.middle(), Vec3::splat(0.6));
    // From behind, only its ambient colour.
    *square.simulation.world.get_mut::<Transform>(sun).expect("placed") =
        Transform::from_rotation(Quat::from_rotation_y(std::f32::consts::PI));
    assert_near(square.middle(), Vec3::splat(0.3));
    square.simulation.world.despawn(sun);
    assert_near(square.middle(), Vec3::splat(0.2));
}

/// Lights with a cone or an ambient colour need other shaders even while they are off: the picture is the same.
#[test]
fn a_light_that_is_off_changes_no_pixel_of_what_others_light() {
    let picture = |off: &[Light]| {
        let mut square = Square::new(Material { metallic: 0.3, roughness: 0.4, ..matte(Vec3::new(0.8, 0.5, 0.3)) })?;
        square.edit(|material| material.shading = Shading::MetallicRoughness);
        square.light(Light::directional(0.2), Transform::from_rotation(Quat::from_rotation_y(0.4)));
        for i in 0..4 {
            let color = Vec3::new(1.0, 0.5 + 0.1 * i as f32, 0.3);
            square.light(Light::point(0.7, 4.0).with_color(color), Transform::from_xyz(i as f32 - 1.5, 0.3, 0.8));
        }
        off.iter().for_each(|light| _ = square.light(Light { enabled: false, ..light.clone() }, head_on()));
        square.headless.draw(&mut square.simulation, square.camera, (96, 96)).expect("a picture");
        square.headless.renderer.read_linear()
    };
    let (cone, ambient) = (Light::spot(1.0, 9.0, 0.5), Light { ambient: Vec3::ONE, ..Light::point(1.0, 9.0) });
    let Some(plain) = picture(&[]) else { return };
    assert!(plain.iter().any(|pixel| pixel[0] > 0.3), "something is lit");
    for off in [vec![cone.clone()], vec![ambient.clone()], vec![cone, ambient]] {
        let other = picture(&off).expect("a picture");
        let apart = plain.iter().flatten().zip(other.iter().flatten()).map(|(a, b)| (a - b).abs());
        // Two shaders need not round alike.
        assert!(apart.fold(0.0, f32::max) < 2e-3, "{off:?}");
    }
}

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
    assert!(seen.x > 0.1 && (seen.z / seen.x - 4.0).abs() < 0.2, "{seen}");
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

#[test]
fn a_mirrored_object_still_shows_its_front_and_its_relief() {
    // A normal map that leans 30° toward +U, lit from +X: brighter than flat. Mirrored in X, it leans toward −X: darker.
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    let (lean, light) = (30f32.to_radians(), 45f32.to_radians());
    let byte = |v: f32| (v * 127.5 + 127.5).round() as u8;
    let texel = vec![byte(lean.sin()), 128, byte(lean.cos()), 255];
    let map = square.add_image(Image::rgba8("leaning", 1, 1, ImageKind::Normal, texel));
    square.edit(|m| m.normal_map = Some(map));
    square.light(Light::directional(1.0), Transform::from_rotation(Quat::from_rotation_y(light)));
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
    let byte = |v: f32| (v * 127.5 + 127.5).round() as u8;
    let texel = vec![byte(lean.sin()), 128, byte(lean.cos()), 255];
    let map = square.add_image(Image::rgba8("leaning", 1, 1, ImageKind::Normal, texel));
    square.light(Light::directional(1.0), Transform::from_rotation(Quat::from_rotation_y(light)));
    let near = |got: Vec4, wanted: f32, what: &str| assert!((got.x - wanted).abs() < 0.012, "{what}: {got} {wanted}");
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
fn bright_light_and_low_exposure_do_not_overflow() {
    let Some(mut square) = Square::new(matte(Vec3::new(0.25, 0.5, 1.0))) else { return };
    square.light(Light::directional(4e6), Transform::default());
    square.simulation.world.resource_mut::<Environment>().exposure = 1e-7;
    assert_near(square.middle(), Vec3::new(0.1, 0.2, 0.4));
}

#[test]
fn a_light_may_be_ambient_alone() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    let glow = Light { ambient: Vec3::new(0.1, 0.2, 0.3), attenuation: Vec3::X, ..Light::point(1.0, f32::INFINITY) };
    square.light(glow.with_color(Vec3::ZERO), head_on());
    assert_near(square.middle(), Vec3::new(0.1, 0.2, 0.3));
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
    assert!((got.x - cosine).abs() < 0.005, "{got} {cosine}");
    square.headless.settings.debug = DebugView::Normal;
    let normal = square.middle().truncate() * 2.0 - 1.0;
    // Rising toward +X, the surface leans toward −X.
    assert!((normal - Vec3::new(-0.25, 0.0, 1.0).normalize()).length() < 0.02, "{normal}");
}

#[test]
fn three_lights_and_all_lights_agree_while_no_more_than_three_reach() {
    let Some(mut square) = Square::new(matte(Vec3::new(0.3, 0.6, 0.9))) else { return };
    for i in 0..3 {
        square.light(Light::point(0.7, 20.0), Transform::from_xyz(i as f32 - 1.0, 0.5, 1.5));
    }
    let three = square.middle();
    square.simulation.world.insert_resource(LightPolicy::All);
    let all = square.middle();
    assert!(three.x > 0.1 && (three - all).abs().max_element() < 2e-3, "{three} {all}");
    // A fourth is seen by "all" in full; by "three" about as much, through weights and remainder; by "hard" not.
    square.light(Light::point(0.5, 20.0), Transform::from_xyz(0.0, -1.0, 2.0));
    let all_four = square.middle();
    square.simulation.world.insert_resource(LightPolicy::Hard);
    assert!((square.middle() - three).abs().max_element() < 2e-3);
    square.simulation.world.insert_resource(LightPolicy::Three);
    let smooth = square.middle();
    assert!((smooth - all_four).abs().max_element() < 0.35 * all_four.x, "{smooth} {all_four}");
}

const POLICIES: [LightPolicy; 3] = [LightPolicy::Three, LightPolicy::Hard, LightPolicy::All];

#[test]
fn the_light_count_is_that_of_the_object_whatever_the_policy() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    square.headless.settings.debug = DebugView::LightCount;
    assert_near(square.middle(), HeatScale::NONE);
    // Reaches a corner of the square, not the middle, which shows the object's count all the same.
    square.light(Light::point(1.0, 0.5), Transform::from_xyz(0.9, 0.9, 0.2));
    assert_near(square.middle(), HeatScale::color(0.0));
    for i in 0..4 {
        square.light(Light::point(0.3, 20.0), Transform::from_xyz(i as f32 - 1.0, 0.5, 1.5));
    }
    square.light(Light::point(9.0, 3.0), Transform::from_xyz(0.0, 0.0, 5.0));
    square.light(Light { enabled: false, ..Light::directional(1.0) }, Transform::default());
    for policy in POLICIES {
        square.simulation.world.insert_resource(policy);
        assert_near(square.middle(), HeatScale::color(5f32.log2() / 6.0));
    }
}

#[test]
fn the_error_bound_is_the_sum_of_what_is_dropped_as_bright_as_it_shows() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    square.headless.settings.debug = DebugView::ErrorBound;
    assert_near(square.middle(), HeatScale::NONE);
    for intensity in [0.5, 0.7, 0.9] {
        square.light(Light::directional(intensity), Transform::default());
    }
    assert_near(square.middle(), HeatScale::NONE);
    square.light(Light::directional(0.04), Transform::default());
    square.light(Light::directional(0.06), Transform::default());
    for policy in POLICIES {
        square.simulation.world.insert_resource(policy);
        // 0.1 is in the middle of 0.001 … 10; ten times as bright a picture is one decade more.
        assert_near(square.middle(), HeatScale::color(0.5));
        square.simulation.world.resource_mut::<Environment>().exposure = 10.0;
        assert_near(square.middle(), HeatScale::color(0.75));
        square.simulation.world.resource_mut::<Environment>().exposure = 1.0;
    }
}

#[test]
fn without_a_light_every_policy_and_view_draws() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    square.simulation.world.resource_mut::<Environment>().ambient = Vec3::splat(0.2);
    for policy in POLICIES {
        square.simulation.world.insert_resource(policy);
        square.headless.settings.debug = DebugView::Off;
        assert_near(square.middle(), Vec3::splat(0.2));
        square.headless.settings.debug = DebugView::ThreeLights;
        assert!(square.middle().truncate().max_element() < 0.05);
    }
}

#[test]
fn inverse_square_light_is_its_intensity_at_a_metre_and_a_quarter_at_two() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    let bulb = Light::point(0.8, f32::INFINITY).with_attenuation(Light::INVERSE_SQUARE);
    let lamp = square.light(bulb.clone(), Transform::from_xyz(0.0, 0.0, 1.0));
    assert_near(square.middle(), Vec3::splat(0.8));
    square.simulation.world.entity_mut(lamp).insert(Transform::from_xyz(0.0, 0.0, 2.0));
    assert_near(square.middle(), Vec3::splat(0.2));
    square.simulation.world.entity_mut(lamp).insert(Light { range: 4.0, ..bulb });
    let window = (1.0f32 - (2.0f32 / 4.0).powi(4)).powi(2);
    assert_near(square.middle(), Vec3::splat(0.2 * window));
}

#[test]
fn a_light_that_is_gone_gives_nothing_even_to_the_reference() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    square.simulation.world.insert_resource(LightPolicy::All);
    let lamp = square.light(Light::point(1.0, 20.0), Transform::from_xyz(0.0, 0.0, 1.0));
    assert!(square.middle().x > 0.4);
    square.simulation.world.despawn(lamp);
    assert_near(square.middle(), Vec3::ZERO);
}

#[test]
fn outputs_give_depth_normal_and_entity() {
    let Some(mut square) = Square::new(matte(Vec3::ONE)) else { return };
    square.middle();
    let view = relief::viewpoint::Viewpoint::Camera(square.camera).view(&square.simulation.world, (SIZE, SIZE));
    let gpu: Gpu = square.headless.renderer.gpu().clone();
    let outputs = square.headless.renderer.draw_outputs().expect("outputs");
    let (middle, corner) = ((SIZE * SIZE / 2) as usize, 0);
    let depths = outputs.depths(&gpu, &view);
    assert!((depths[middle] - 3.0).abs() < 1e-3, "{}", depths[middle]);
    assert_eq!(depths[corner], f32::INFINITY);
    assert_eq!(outputs.entities(&gpu)[middle], Some(square.square.index().index()));
    assert_eq!(outputs.entities(&gpu)[corner], None);
    assert!((Vec3::from(outputs.normals(&gpu)[middle]) - Vec3::Z).length() < 1e-3);
}

#[test]
fn a_sky_of_one_colour_is_the_gradient_between_three_equal_ones() {
    let Some(mut square) = Square::new(Material { base_factor: Vec4::ONE, ..Material::default() }) else { return };
    for (exposure, samples) in [(1.0, 1), (2.5, 4)] {
        square.headless.settings.samples = samples;
        let mut picture = |zenith: Vec3| {
            let dusk = Vec3::new(0.03, 0.4, 0.07);
            let environment =
                Environment { exposure, zenith: dusk + zenith, horizon: dusk, ground: dusk, ..Environment::default() };
            square.simulation.world.insert_resource(environment);
            square.headless.draw(&mut square.simulation, square.camera, (SIZE, SIZE)).expect("a picture");
            square.headless.renderer.read_linear().expect("linear colours")
        };
        // The difference is lost in the half floats of the target, but there is a gradient to draw.
        let (plain, gradient) = (picture(Vec3::ZERO), picture(Vec3::splat(1e-6)));
        assert_eq!(plain, gradient);
        let corner = Vec4::from_array(plain[0]);
        let expected = (Vec3::new(0.03, 0.4, 0.07) * exposure).extend(1.0);
        assert!((corner - expected).abs().max_element() < 1e-3, "{corner}");
    }
}
