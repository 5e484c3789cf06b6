//! Edges of what is much brighter than white: the picture shows how much of each pixel is covered.

use crate::common::bumps::Stage;
use crate::common::prelude::*;
use systems::assets::color::linear_from_srgb;

const SIZE: (u32, u32) = (64, 48);
/// Linear red, green and blue of the bar.
const EXPOSURE: f32 = 16.0;
/// Width of the bar, metres; the picture is 24 m high, and the bar is longer.
const WIDTH: f64 = 7.3;
/// Rotation of the bar from upright.
const DEGREES: f64 = 5.0;

/// A white bar on black.
fn stage() -> Option<Stage> {
    let mut stage = Stage::new(SIZE)?;
    stage.headless.settings.samples = 4;
    stage.orthographic(12.0);
    stage.simulation.world.resource_mut::<Environment>().exposure = EXPOSURE;
    let (mesh, facing) = Stage::facing(Vec2::new(WIDTH as f32, 40.0));
    let white = Material { shading: Shading::Unlit, base_factor: Vec3::ONE.extend(1.0), ..Material::default() };
    stage.spawn(mesh, white, Transform::from_rotation(Quat::from_rotation_z(DEGREES.to_radians() as f32)) * facing);
    Some(stage)
}

/// Share of a pixel that the bar covers.
fn coverage(x: u32, y: u32) -> f64 {
    let slope = DEGREES.to_radians().tan();
    // Pixels per metre.
    let scale = f64::from(SIZE.1) / 24.0;
    let half = 0.5 * WIDTH * scale / DEGREES.to_radians().cos();
    // ∫ clamp(x) dx: of what is left of an edge over the rows within a pixel, each of which it covers up to the edge.
    let integral = |x: f64| if x < 1.0 { 0.5 * x.max(0.0).powi(2) } else { x - 0.5 };
    let left_of = |edge: f64| {
        let middle = f64::from(SIZE.0) / 2.0 + edge + slope * (f64::from(y) + 0.5 - f64::from(SIZE.1) / 2.0);
        let from_left = middle - f64::from(x);
        (integral(from_left + slope / 2.0) - integral(from_left - slope / 2.0)) / slope
    };
    left_of(half) - left_of(-half)
}

/// Linear light of 8 bits of sRGB.
fn decoded(byte: u8) -> f64 {
    linear_from_srgb(f32::from(byte) / 255.0).into()
}

/// Largest error of what is read of a picture: a step of 8 bits, as `tone_curves.rs` allows. At white, where steps are
/// the largest, it is 2.4 / 1.055 / 255.
const STEP: f64 = 0.009;

#[test]
fn edges_of_a_bar_sixteen_times_as_bright_as_white_show_how_much_of_a_pixel_it_covers() {
    let Some(mut stage) = stage() else { return };
    let slope = DEGREES.to_radians().tan();
    // Samples lie at 1/8, 3/8, 5/8 and 7/8 across a pixel, so an upright edge has 1/8 too many or too few to its left.
    // Turned, a sample is passed earlier or later by at most 3/8 of the slope, and the corners that the edge cuts off
    // are 1/8 of it. Vertices are rounded.
    let off = 0.125 + 0.5 * slope + f64::from(stage.headless.renderer.gpu().vertex_rounding());
    for (name, curve) in ToneMap::ALL {
        stage.simulation.world.resource_mut::<Environment>().tone_map = curve;
        let picture = stage.picture();
        let linear = stage.headless.renderer.read_linear().expect("prepared");
        let white = decoded(picture.get_pixel(SIZE.0 / 2, SIZE.1 / 2).0[1]);
        assert!(white > 0.8, "{name}: {white}");
        let step = 2.0 * STEP / white;
        let mut with_samples = [0; 5];
        for ((x, y, pixel), light) in picture.enumerate_pixels().zip(linear) {
            for (byte, light) in pixel.0.into_iter().zip(light).take(3) {
                let (shown, covered) = (decoded(byte) / white, coverage(x, y));
                let bound = off + step;
                assert!((shown - covered).abs() <= bound, "{name}, {x} {y}: {shown} of {covered}, bound {bound}");
                // As many quarters as samples are covered, in the picture as in linear light.
                let quarters = (shown * 4.0).round();
                assert!((shown - quarters / 4.0).abs() <= step, "{name}, {x} {y}: {shown}");
                assert_eq!(f64::from(light), f64::from(EXPOSURE) * quarters / 4.0, "{name}, {x} {y}: linear light");
                with_samples[quarters as usize] += 1;
            }
        }
        // Two edges pass through 48 rows, and four columns each: each number of samples is there, in three channels.
        assert!(with_samples.iter().all(|&values| values >= 24), "{name}: {with_samples:?}");
    }
}

#[test]
fn a_picture_that_is_shown_again_has_the_same_edges() {
    let Some(mut stage) = stage() else { return };
    let drawn = stage.picture();
    let gpu = stage.headless.renderer.gpu().clone();
    let again = picture_texture(&gpu, SIZE);
    stage.headless.renderer.read_linear().expect("prepared");
    stage.headless.renderer.show_again(&again.create_view(&wgpu::TextureViewDescriptor::default()), PICTURE_FORMAT);
    assert!(read_texture(&gpu, &again) == drawn.into_raw());
}

/// With one sample a pixel is the bar or is not. Debug views, whose colours are within 0..1, show the mean of these.
#[test]
fn one_sample_and_debug_views_show_the_linear_colours() {
    let Some(mut stage) = stage() else { return };
    for (samples, debug) in [(1, DebugView::Off), (1, DebugView::Base), (4, DebugView::Base)] {
        (stage.headless.settings.samples, stage.headless.settings.debug) = (samples, debug);
        let picture = stage.picture();
        let linear = stage.headless.renderer.read_linear().expect("prepared");
        let mut edges = 0;
        for (pixel, [light, ..]) in picture.pixels().zip(linear) {
            let light = f64::from(light).min(1.0);
            assert!((decoded(pixel.0[0]) - light).abs() <= STEP, "{samples} samples, {debug:?}: {pixel:?} for {light}");
            edges += usize::from(light > 0.0 && light < 1.0);
        }
        assert_eq!(edges > 0, samples > 1, "{samples} samples, {debug:?}: {edges}");
    }
}
