//! Exposure and noise of cameras against the model that they are made by.

use crate::common::{self, prelude::*};
use relief::sense::CameraCapture;
use systems::ecs::clock::Seed;
use systems::sensors::{Exposure, ImageNoise};

const SIZE: (u32, u32) = (400, 256);

/// 8 bits: half floats tell its counts apart.
const NOISE: ImageNoise = ImageNoise { full_well: 2000.0, read: 12.0, dark: 30.0, gain: 1.0, bits: 8, black: 20 };

fn camera(exposure: Exposure, noise: Option<ImageNoise>) -> CameraSensor {
    let camera = CameraSensor { size: SIZE, samples: 1, exposure, noise, ..CameraSensor::default() };
    camera.with(CameraOutput::Linear)
}

/// Cards side by side, each as wide as another and unlit, that fill the pictures of cameras at the origin.
fn cards(colors: &[Vec3], exposure: f32) -> Simulation {
    let mut simulation = Simulation::new();
    simulation.world.insert_resource(Environment { exposure, ..common::dark() });
    let width = 40.0 / colors.len() as f32;
    for (i, color) in colors.iter().enumerate() {
        let mut library = simulation.world.resource_mut::<Library>();
        let card = library.add_mesh(shapes::plane(Vec2::new(width, 40.0), UVec2::ONE));
        let base_factor = color.extend(1.0);
        let material = library.add_material(Material { base_factor, shading: Shading::Unlit, ..Material::default() });
        let upright = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
        let at = Transform::from_xyz((i as f32 + 0.5) * width - 20.0, 0.0, -5.0).with_rotation(upright);
        simulation.world.spawn((card, material, at));
    }
    simulation
}

fn spawn(simulation: &mut Simulation, name: &str, camera: CameraSensor) {
    simulation.world.spawn((Sensor::camera(camera), Name::new(name.to_owned())));
    register_all(&mut simulation.world);
}

fn of<'a>(capture: &'a Capture, name: &str) -> &'a CameraCapture {
    capture[name].camera().expect("a camera")
}

/// Mean and variance of the counts of a channel.
fn moments(capture: &CameraCapture, noise: &ImageNoise, channel: usize) -> (f64, f64) {
    let count = |rgb: &[half::f16; 3]| {
        let above = rgb[channel].to_f64() * noise.counts_per_electron() * f64::from(noise.full_well);
        let counts = above + f64::from(noise.black);
        // Half floats below 1 are off by 2⁻¹² at most, a sixteenth of a count.
        assert!((counts - counts.round()).abs() < 0.07, "{counts}");
        counts.round()
    };
    let counts: Vec<f64> = capture.linear.iter().map(count).collect();
    let n = counts.len() as f64;
    let mean = counts.iter().sum::<f64>() / n;
    (mean, counts.iter().map(|count| (count - mean).powi(2)).sum::<f64>() / n)
}

/// Grey cards at several exposures: the mean is that of the light, and the variance is affine in it.
#[test]
fn mean_and_variance_are_those_of_the_model() {
    let Some(gpu) = common::gpu() else { return };
    let mut simulation = cards(&[Vec3::splat(0.5)], 1.0);
    let exposures = [0.2, 0.5, 0.8, 1.1, 1.4];
    for exposure in exposures {
        spawn(&mut simulation, &exposure.to_string(), camera(Exposure::Fixed(exposure), Some(NOISE)));
    }
    let capture = SensorSuite::new(&gpu).capture(&mut simulation).expect("captured");
    let n = f64::from(SIZE.0 * SIZE.1);
    assert!(n > 1e5);
    let k = NOISE.counts_per_electron();
    let (black, read) = (f64::from(NOISE.black), f64::from(NOISE.read));
    for channel in 0..3 {
        let (mut points, mut slope_room) = (Vec::new(), Vec::new());
        for exposure in exposures {
            let (mean, variance) = moments(of(&capture, &exposure.to_string()), &NOISE, channel);
            let electrons = f64::from(exposure) * 0.5 * f64::from(NOISE.full_well) + f64::from(NOISE.dark);
            let expected = black + k * electrons;
            // Rounding to whole numbers adds 1/12 where a deviation is more than one of them.
            let spread = k * k * (electrons + read * read) + 1.0 / 12.0;
            assert!((mean - expected).abs() < 3.0 * (spread / n).sqrt(), "{exposure}: mean {mean} for {expected}");
            // The variance of an estimate of a variance is (m₄ − σ⁴)/n, with m₄ = 2.99 σ⁴ of the table of normals.
            let deviation = spread * (1.99 / n).sqrt();
            assert!((variance - spread).abs() < 3.0 * deviation, "{exposure}: variance {variance} for {spread}");
            points.push((mean, variance));
            slope_room.push(3.0 * deviation);
        }
        // The line of least squares: slope K, and at black what reading and rounding add.
        let count = points.len() as f64;
        let middle = points.iter().map(|(mean, _)| mean).sum::<f64>() / count;
        let squares: f64 = points.iter().map(|(mean, _)| (mean - middle).powi(2)).sum();
        let slope = points.iter().map(|(mean, variance)| (mean - middle) * variance).sum::<f64>() / squares;
        let level = points.iter().map(|(_, variance)| variance).sum::<f64>() / count;
        let weights = || points.iter().zip(&slope_room);
        let room: f64 = weights().map(|((mean, _), room)| (mean - middle).abs() / squares * room).sum();
        assert!((slope - k).abs() < room, "slope {slope} for {k}");
        let at_black = level + slope * (black - middle);
        let expected = k * k * read * read + 1.0 / 12.0;
        let room: f64 = weights()
            .map(|((mean, _), room)| (1.0 / count + (mean - middle) * (black - middle) / squares).abs() * room)
            .sum();
        assert!((at_black - expected).abs() < room, "at black {at_black} for {expected}");
    }
}

#[test]
fn twelve_bits_have_the_mean_of_the_light_too() {
    let Some(gpu) = common::gpu() else { return };
    let noise = ImageNoise::default();
    let mut simulation = cards(&[Vec3::new(0.25, 0.1, 0.02)], 1.0);
    spawn(&mut simulation, "eye", camera(Exposure::Scene, Some(noise)));
    let capture = SensorSuite::new(&gpu).capture(&mut simulation).expect("captured");
    let linear = &of(&capture, "eye").linear;
    for (channel, light) in [0.25_f32, 0.1, 0.02].into_iter().enumerate() {
        let light = half::f16::from_f32(light).to_f64();
        let mean = linear.iter().map(|rgb| rgb[channel].to_f64()).sum::<f64>() / linear.len() as f64;
        let read = f64::from(noise.read);
        let full = f64::from(noise.full_well);
        let deviation = ((light * full + read * read) / linear.len() as f64).sqrt() / full;
        // Each is rounded to a half float, by 2⁻¹¹ of itself at most.
        let room = 3.0 * deviation + light / 2048.0;
        assert!((mean - light).abs() < room, "{channel}: {mean} for {light}");
    }
}

#[test]
fn noise_depends_on_seed_sensor_step_pixel_and_channel_and_on_nothing_else() {
    let Some(gpu) = common::gpu() else { return };
    let mut simulation = cards(&[Vec3::splat(0.4), Vec3::splat(0.2)], 1.0);
    let plain = camera(Exposure::Scene, Some(NOISE));
    let intrinsics = plain.intrinsics().expect("perspective");
    let bent = Lens::BrownConrady { intrinsics, coefficients: [0.05; 8] };
    let names = ["a", "b", "c"];
    for (name, lens) in names.into_iter().zip([plain.lens, plain.lens, bent]) {
        spawn(&mut simulation, name, CameraSensor { lens, ..plain.clone() });
    }
    let mut suite = SensorSuite::new(&gpu);
    let first = suite.capture(&mut simulation).expect("captured");
    for name in names.into_iter().rev() {
        for suite in [&mut suite, &mut SensorSuite::new(&gpu)] {
            let alone = suite.capture_some(&mut simulation, |wanted| wanted == name).expect("captured");
            assert!(alone[name] == first[name], "{name}");
        }
    }
    let light = |capture: &Capture, name: &str| of(capture, name).linear.clone();
    assert!(light(&first, "a") != light(&first, "b"), "sensors");
    let [r, g, b] = [0, 1, 2].map(|channel| light(&first, "a").iter().map(|rgb| rgb[channel]).collect::<Vec<_>>());
    assert!(r != g && g != b && r != b, "channels");
    simulation.step();
    let second = suite.capture(&mut simulation).expect("captured");
    assert!(light(&second, "a") != light(&first, "a"), "steps");
    // Another run comes by the same.
    simulation.world.resource_mut::<systems::ecs::clock::Clock>().step = 0;
    assert!(suite.capture(&mut simulation).expect("captured") == first);
    simulation.world.insert_resource(Seed(7));
    assert!(light(&suite.capture(&mut simulation).expect("captured"), "a") != light(&first, "a"), "seeds");
}

#[test]
fn exposures_are_the_scenes_or_fixed_or_metered() {
    let Some(gpu) = common::gpu() else { return };
    // Two halves, of 0.02 and 0.32 with the scene's exposure: 0.08 in geometric mean.
    let mut simulation = cards(&[Vec3::splat(0.01), Vec3::splat(0.16)], 2.0);
    let metered = |key, stops| Exposure::Metered { key, stops };
    let cases = [
        ("scene", Exposure::Scene, 2.0),
        ("fixed", Exposure::Fixed(3.0), 3.0),
        ("metered", metered(0.18, 8.0), 2.0 * 0.18 / 0.08),
        ("half a stop at most", metered(0.18, 0.5), 2.0 * 2f64.sqrt()),
        ("darker", metered(0.02, 8.0), 0.5),
    ];
    for (name, exposure, _) in cases {
        spawn(&mut simulation, name, camera(exposure, None));
    }
    let capture = SensorSuite::new(&gpu).capture(&mut simulation).expect("captured");
    for (name, _, exposure) in cases {
        let found = of(&capture, name);
        // Three roundings to half floats, 2⁻¹¹ each, and logarithms in steps of 2⁻¹⁶.
        let room = 2f64.powi(-9);
        assert!((f64::from(found.exposure) / exposure - 1.0).abs() < room, "{name}: {} for {exposure}", found.exposure);
        let row = SIZE.1 as usize / 2 * SIZE.0 as usize;
        for (place, card) in [(row + 5, 0.01), (row + SIZE.0 as usize - 5, 0.16)] {
            let light = found.linear[place][0].to_f64();
            assert!((light / (card * exposure) - 1.0).abs() < room, "{name}: {light} for {card} · {exposure}");
        }
        let shown = found.linear.iter().map(|rgb| common::dark().tone_map.encoded(rgb.map(half::f16::to_f32)));
        assert!(
            found.color.iter().zip(shown).all(|(a, b)| a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 1)),
            "{name}: colours are those of linear ones"
        );
    }
}

#[test]
fn what_no_camera_has_is_an_error() {
    let Some(gpu) = common::gpu() else { return };
    let mut simulation = cards(&[Vec3::ONE], 1.0);
    spawn(&mut simulation, "eye", camera(Exposure::Scene, Some(ImageNoise { bits: 9, ..NOISE })));
    let error = SensorSuite::new(&gpu).capture(&mut simulation).unwrap_err();
    assert_eq!(error.to_string(), "sensor \"eye\": noise.bits: expected 8 or 12, found 9");
}
