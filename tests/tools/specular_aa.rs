//! Specular antialiasing: a picture drawn small is near the same drawn many times as large and averaged in linear light,
//! before the tone map; without it, it is far from that. One sample per pixel: more would share one highlight.
//!
//! Two errors, both of luminance and as parts of the mean luminance: the root of the mean square over the pixels, which
//! counts what stands out, as sparkles do; and the mean of the amounts. `--nocapture` shows them.

use crate::common::bumps::Stage;
use crate::common::prelude::*;
use std::f32::consts::{FRAC_PI_2, TAU};

/// Random numbers 0..1, the same in every run (Knuth's MMIX generator).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// Texels along a side of the map, and of a metre of the ground.
const MAP_SIDE: u32 = 256;
const TEXELS_PER_METRE: f32 = 128.0;

/// Bumps: waves in all directions, 4 to 40 texels long, whose slope has a root of the mean square of 0.4.
fn bumps() -> Image {
    let (mut random, mut slopes) = (Random(7), vec![Vec2::ZERO; (MAP_SIDE * MAP_SIDE) as usize]);
    for _ in 0..60 {
        let length = 4.0 * 10f32.powf(random.next());
        let waves = (Vec2::from_angle(random.next() * TAU) * MAP_SIDE as f32 / length).round();
        let phase = random.next() * TAU;
        for (i, slope) in (0..).zip(&mut slopes) {
            let at = Vec2::new((i % MAP_SIDE) as f32, (i / MAP_SIDE) as f32) / MAP_SIDE as f32;
            *slope += waves.normalize() * (TAU * waves.dot(at) + phase).cos();
        }
    }
    let mean_square = slopes.iter().map(|slope| slope.length_squared()).sum::<f32>() / slopes.len() as f32;
    let texel = |slope: &Vec2| {
        let normal = (*slope * (0.4 / mean_square.sqrt())).extend(1.0).normalize();
        (normal * 127.5 + 128.0).extend(255.0).to_array().map(|value| value as u8)
    };
    Image::rgba8("bumps", MAP_SIDE, MAP_SIDE, ImageKind::Normal, slopes.iter().flat_map(texel).collect())
}

/// A grey surface with highlights. `gloss`: the exponent, or the perceptual roughness.
fn glossy(shading: Shading, gloss: f32) -> Material {
    let is_ggx = shading == Shading::MetallicRoughness;
    Material {
        shading,
        base_factor: Vec3::splat(0.2).extend(1.0),
        specular_factor: Vec3::splat(if is_ggx { 4.0 } else { 1.0 }),
        shininess: gloss,
        roughness: gloss,
        metallic: 0.0,
        ..Material::default()
    }
}

/// Exponents, and roughnesses whose α² are about as wide.
const MODELS: [(&str, Shading, [f32; 3]); 3] = [
    ("phong", Shading::Phong, [10.0, 40.0, 160.0]),
    ("blinn", Shading::Blinn, [10.0, 40.0, 160.0]),
    ("ggx", Shading::MetallicRoughness, [0.6, 0.4, 0.25]),
];

/// A picture drawn small, without and with specular antialiasing, and what it should be; luminances of pixels that show
/// nothing but the object.
#[derive(Default)]
struct Drawn {
    off: Vec<f32>,
    on: Vec<f32>,
    reference: Vec<f32>,
}

/// Errors of some pictures without and with specular antialiasing, each relative to the picture's mean.
#[derive(Clone, Copy, Default)]
struct Errors {
    root_mean_square: [f32; 2],
    mean: [f32; 2],
    pictures: f32,
}

impl Errors {
    fn add(&mut self, drawn: &Drawn) {
        let count = drawn.reference.len() as f32;
        let mean = drawn.reference.iter().sum::<f32>() / count;
        for (number, pixels) in [&drawn.off, &drawn.on].into_iter().enumerate() {
            let apart = || pixels.iter().zip(&drawn.reference).map(|(a, b)| a - b);
            self.root_mean_square[number] += (apart().map(|d| d * d).sum::<f32>() / count).sqrt() / mean;
            self.mean[number] += apart().map(f32::abs).sum::<f32>() / count / mean;
        }
        self.pictures += 1.0;
    }

    fn join(&mut self, other: Self) {
        for number in 0..2 {
            self.root_mean_square[number] += other.root_mean_square[number];
            self.mean[number] += other.mean[number];
        }
        self.pictures += other.pictures;
    }

    fn ratio(&self) -> f32 {
        self.root_mean_square[1] / self.root_mean_square[0]
    }

    fn print(&self, what: &str) {
        let [off, on] = self.root_mean_square.map(|sum| sum / self.pictures);
        let [mean_off, mean_on] = self.mean.map(|sum| sum / self.pictures);
        println!(
            "{what:32} {off:6.3} {on:6.3} ×{:.2}   mean {mean_off:6.3} {mean_on:6.3} ×{:.2}",
            on / off,
            mean_on / mean_off
        );
    }
}

/// Means of blocks of so many pixels along a side.
fn shrunk(pixels: &[f32], side: u32, factor: u32) -> Vec<f32> {
    let mut means = vec![0.0; (side * side) as usize];
    for (i, &pixel) in (0..).zip(pixels) {
        let (x, y) = (i % (side * factor) / factor, i / (side * factor) / factor);
        means[(y * side + x) as usize] += pixel / (factor * factor) as f32;
    }
    means
}

/// One object under one lamp.
struct Scene {
    stage: Stage,
    object: Entity,
    lamp: Entity,
}

impl Scene {
    fn luminances(&mut self, side: u32, specular_aa: bool) -> Vec<f32> {
        self.stage.size = (side, side);
        self.stage.headless.settings.specular_aa = specular_aa;
        let pixels = self.stage.linear();
        pixels.into_iter().map(|pixel| pixel.truncate().dot(Vec3::new(0.2126, 0.7152, 0.0722))).collect()
    }

    fn draw(&mut self, side: u32, factor: u32) -> Drawn {
        let reference = shrunk(&self.luminances(side * factor, false), side, factor);
        let id = OutputSet { id: true, ..OutputSet::NONE };
        let seen = self.stage.headless.renderer.draw_outputs(id).expect("outputs").entities();
        let seen: Vec<f32> = seen.iter().map(|entity| f32::from(u8::from(entity.is_some()))).collect();
        let whole: Vec<bool> = shrunk(&seen, side, factor).into_iter().map(|part| part > 0.999).collect();
        let of_object = |pixels: Vec<f32>| pixels.into_iter().zip(&whole).filter_map(|(p, w)| w.then_some(p)).collect();
        Drawn {
            off: of_object(self.luminances(side, false)),
            on: of_object(self.luminances(side, true)),
            reference: of_object(reference),
        }
    }

    fn edit(&mut self, edit: impl FnOnce(&mut Material)) {
        let id = *self.stage.simulation.world.get::<MaterialId>(self.object).expect("a material");
        assert!(self.stage.simulation.world.resource_mut::<Library>().edit_material(id, edit));
    }

    fn place(&mut self, entity: Entity, place: Transform) {
        *self.stage.simulation.world.get_mut::<Transform>(entity).expect("a place") = place;
    }

    /// Bumpy ground in the plane z = 0.
    fn ground(image: Image, material: Material) -> Option<Self> {
        let mut stage = Stage::new((SIDE, SIDE))?;
        stage.headless.settings.levels = LevelOfDetail::OFF;
        let texels = image.width as f32;
        let map = Map::new(stage.simulation.world.resource_mut::<Library>().add_image(image));
        let mesh = shapes::plane(Vec2::splat(GROUND), UVec2::splat(GROUND as u32));
        let mesh = shapes::with_uv_scale(mesh, Vec2::splat(GROUND * TEXELS_PER_METRE / texels));
        let material = Material { normal_map: Some(map), ..material };
        let object = stage.spawn(mesh, material, Transform::from_rotation(Quat::from_rotation_x(FRAC_PI_2)));
        let lamp = stage.simulation.world.spawn((Light::point(4.0, 1e6), Transform::default())).id();
        let mut camera = stage.simulation.world.get_mut::<Camera>(stage.camera).expect("a camera");
        camera.projection = Projection::Perspective { fov_y: 30f32.to_radians(), aspect: None };
        Some(Self { stage, object, lamp })
    }

    /// From so many metres, so many degrees from the normal, toward the highlight of a lamp.
    fn look(&mut self, distance: f32, slant: f32) {
        let (sine, cosine) = slant.to_radians().sin_cos();
        let eye = Vec3::new(0.0, -sine, cosine) * distance;
        self.place(self.stage.camera, Transform::from_translation(eye).looking_at(Vec3::ZERO, Vec3::Y));
        self.place(self.lamp, Transform::from_translation(Vec3::new(0.3, sine, cosine) * 4.0));
    }
}

/// Pixels along a side of the small picture.
const SIDE: u32 = 24;
/// Metres.
const GROUND: f32 = 128.0;

/// Texels that a pixel in the middle of the picture covers, along its shorter side.
fn texels_per_pixel(distance: f32) -> f32 {
    2.0 * distance * 15f32.to_radians().tan() / SIDE as f32 * TEXELS_PER_METRE
}

/// Enlargement of the reference: 8, or more if its pixels would still cover several texels.
fn enlargement(distance: f32, slant: f32) -> u32 {
    if texels_per_pixel(distance) / slant.to_radians().cos() / 8.0 < 1.5 { 8 } else { 32 }
}

const DISTANCES: [f32; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];

/// Measures a ground under each lighting model, over all distances, slants and glosses. `most`: error allowed, as a
/// share of that without.
fn measure(what: &str, bumps: &Image, most: f32) {
    for (name, shading, glosses) in MODELS {
        let Some(mut scene) = Scene::ground(bumps.clone(), glossy(shading, 1.0)) else { return };
        let (mut all, mut by_distance) = (Errors::default(), [Errors::default(); DISTANCES.len()]);
        for gloss in glosses {
            scene.edit(|material| (material.shininess, material.roughness) = (gloss, gloss));
            let mut of_gloss = Errors::default();
            for slant in [0.0, 40.0, 70.0] {
                for (distance, errors) in DISTANCES.into_iter().zip(&mut by_distance) {
                    scene.look(distance, slant);
                    let drawn = scene.draw(SIDE, enlargement(distance, slant));
                    errors.add(&drawn);
                    of_gloss.add(&drawn);
                }
            }
            of_gloss.print(&format!("{what}, {name}, {gloss}"));
            all.join(of_gloss);
        }
        for (distance, errors) in DISTANCES.into_iter().zip(by_distance) {
            errors.print(&format!("{what}, {name}, {:.1} texels", texels_per_pixel(distance)));
            assert!(errors.mean[1] < errors.mean[0], "{what}, {name} at {distance} m");
        }
        all.print(&format!("{what}, {name}"));
        assert!(all.ratio() <= most, "{what}, {name}: {}", all.ratio());
    }
}

#[test]
fn highlights_of_bumps_far_away_are_the_mean_of_what_is_there() {
    measure("waves", &bumps(), 1.0 / 3.0);
}

/// Flat tops and steep joints, which no bell curve is near: about a third is left, and more where drivers filter
/// otherwise.
#[test]
fn highlights_of_cobbles_far_away_are_the_mean_of_what_is_there() {
    let path = format!("{}/assets/textures/cobble_normal.png", env!("CARGO_MANIFEST_DIR"));
    let texels = image::open(path).expect("an image").into_rgba8();
    let (width, height) = texels.dimensions();
    measure("cobbles", &Image::rgba8("cobbles", width, height, ImageKind::Normal, texels.into_raw()), 0.4);
}

#[test]
fn every_technique_that_reads_normals_keeps_their_spread() {
    let Some(mut scene) = Scene::ground(bumps(), glossy(Shading::Blinn, 40.0)) else { return };
    let reads = |technique: Technique| technique.needs().contains(&systems::assets::MapSlot::Normal);
    for (name, technique) in Technique::ALL.into_iter().filter(|(_, technique)| reads(*technique)) {
        for (model, shading, [_, gloss, _]) in MODELS {
            scene.edit(|material| {
                (material.technique, material.shading) = (technique, shading);
                (material.shininess, material.roughness) = (gloss, gloss);
            });
            let mut errors = Errors::default();
            for slant in [0.0, 40.0] {
                scene.look(4.0, slant);
                errors.add(&scene.draw(SIDE, enlargement(4.0, slant)));
            }
            errors.print(&format!("{name}, {model}"));
            // Less is left of the others; dot3 rounds to 8 bits, with and without.
            assert!(errors.ratio() < 0.6, "{name}, {model}: {}", errors.ratio());
        }
    }
}

#[test]
fn highlights_of_small_balls_do_not_glitter() {
    let lights = 24;
    for (name, shading, glosses) in [
        ("phong", Shading::Phong, [40.0, 160.0]),
        ("blinn", Shading::Blinn, [160.0, 640.0]),
        ("ggx", Shading::MetallicRoughness, [0.25, 0.15]),
    ] {
        let Some(mut stage) = Stage::new((SIDE, SIDE)) else { return };
        stage.headless.settings.levels = LevelOfDetail::OFF;
        let object = stage.spawn(shapes::sphere(1.0, 192, 96), glossy(shading, 1.0), Transform::default());
        let lamp = stage.simulation.world.spawn((Light::directional(1.0), Transform::default())).id();
        let mut scene = Scene { stage, object, lamp };
        let (mut all, mut random) = (Errors::default(), Random(1));
        for radius in [3.0, 6.0] {
            for gloss in glosses {
                scene.edit(|material| (material.shininess, material.roughness) = (gloss, gloss));
                // One error of all pictures: where a highlight falls between pixels, all of one is error.
                let mut together = Drawn::default();
                for _ in 0..lights {
                    let pixel = 1.0 / radius;
                    scene.stage.orthographic(0.5 * SIDE as f32 * pixel);
                    let shift = Vec2::new(random.next(), random.next()) * pixel;
                    scene.place(object, Transform::from_translation(shift.extend(0.0)));
                    let (around, from_eye) = (random.next() * TAU, 0.2 + 2.0 * random.next());
                    let toward = (Vec2::from_angle(around) * from_eye.sin()).extend(from_eye.cos());
                    scene.place(lamp, Transform::default().looking_to(-toward, Vec3::Y));
                    let drawn = scene.draw(SIDE, 8);
                    together.off.extend(drawn.off);
                    together.on.extend(drawn.on);
                    together.reference.extend(drawn.reference);
                }
                let mut errors = Errors::default();
                errors.add(&together);
                errors.print(&format!("{name}, {gloss}, {radius} pixels"));
                all.join(errors);
            }
        }
        all.print(name);
        assert!(all.ratio() <= 1.0 / 3.0, "{name}: {}", all.ratio());
    }
}

/// Half floats, and two compiled shaders that may round apart: 2⁻¹⁰ each.
#[track_caller]
fn assert_same(scene: &mut Scene) {
    let (on, off) = (scene.luminances(SIDE, true), scene.luminances(SIDE, false));
    assert!(off.iter().any(|&pixel| pixel > 0.1));
    let apart = on.iter().zip(&off).map(|(a, b)| (a - b).abs() / b.max(0.01)).fold(0.0, f32::max);
    assert!(apart <= 2.0 / 1024.0, "{apart}");
}

#[test]
fn nothing_changes_where_a_pixel_shows_one_normal() {
    let leaning = || Image::rgba8("leaning", 64, 64, ImageKind::Normal, [150, 118, 250, 0].repeat(64 * 64));
    for (_, shading, [_, gloss, _]) in MODELS {
        // All normals equal; what the file has in alpha does not count.
        let Some(mut scene) = Scene::ground(leaning(), glossy(shading, gloss)) else { return };
        for distance in [16.0, 0.2] {
            scene.look(distance, 30.0);
            assert_same(&mut scene);
        }
        // Bumps so near that a texel is larger than a pixel.
        let Some(mut scene) = Scene::ground(bumps(), glossy(shading, gloss)) else { return };
        scene.look(0.2, 30.0);
        assert_same(&mut scene);
    }
}
