//! The tone map, against the curves in double precision.

mod common;

use glam::{DMat3, DVec3, Vec3};
use relief::frames::Headless;
use relief::prelude::{Camera, Simulation, Transform};
use relief::renderer::{Settings, SingleView};
use systems::draw::{Environment, ToneMap};

/// In steps of 8 bits, how far from exact arithmetic a device may be: 0.6 for encoding sRGB (Direct3D 11.3 functional
/// specification, 3.2.3.7; Vulkan names no bound), and the rest for `log2` and `pow` in the curves. Of 16.5 stops that
/// AgX covers, with a slope below 4 and the powers 2.2 and 1/2.4 after it, 0.4 of a step is 2⁻⁸ of a stop: software
/// drivers, which take polynomials for both functions, are much finer.
const SLACK: f64 = 1.0;

#[test]
fn pixels_are_what_the_curve_makes_of_the_linear_colours() {
    let Some(gpu) = common::gpu() else { return };
    let mut simulation = Simulation::new();
    let camera = simulation.world.spawn((Camera::default(), Transform::default())).id();
    let mut headless =
        Headless { renderer: SingleView::new(&gpu), settings: Settings { samples: 1, ..Settings::default() } };
    let gradient = [Vec3::new(0.2, 0.4, 0.9), Vec3::new(0.7, 0.8, 0.0), Vec3::new(0.1, 0.09, 0.08)];
    let plain = [Vec3::new(0.3, 0.05, 0.6); 3];
    for (name, curve) in ToneMap::ALL {
        for (sky, exposure) in [(gradient, 0.02), (gradient, 1.0), (gradient, 20.0), (plain, 1.5)] {
            let [zenith, horizon, ground] = sky;
            let ambient = Vec3::ZERO;
            let environment = Environment { ambient, zenith, horizon, ground, exposure, tone_map: curve };
            simulation.world.insert_resource(environment);
            let picture = headless.draw(&mut simulation, camera, (128, 72)).expect("a picture");
            let linear = headless.renderer.read_linear().expect("prepared");
            for (pixel, [r, g, b, _]) in picture.pixels().zip(linear) {
                let expected = mapped(curve, DVec3::new(r.into(), g.into(), b.into())).to_array().map(encoded);
                let off = pixel.0.iter().zip(expected).map(|(&found, expected)| (f64::from(found) - expected).abs());
                let off = off.fold(0.0, f64::max);
                assert!(off <= SLACK, "{name}, exposure {exposure}: {pixel:?} for {r} {g} {b}, not {expected:?}");
            }
        }
    }
}

/// 0..1, linear.
fn mapped(curve: ToneMap, linear: DVec3) -> DVec3 {
    let x = linear.max(DVec3::ZERO);
    match curve {
        ToneMap::Clamp => x,
        ToneMap::Aces => (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14),
        ToneMap::Agx => agx(x),
    }
    .clamp(DVec3::ZERO, DVec3::ONE)
}

fn agx(color: DVec3) -> DVec3 {
    let agx_from_linear = DMat3::from_cols_array(&[
        0.842479062253094,
        0.0423282422610123,
        0.0423756549057051,
        0.0784335999999992,
        0.878468636469772,
        0.0784336,
        0.0792237451477643,
        0.0791661274605434,
        0.879142973793104,
    ]);
    let linear_from_agx = DMat3::from_cols_array(&[
        1.19687900512017,
        -0.0528968517574562,
        -0.0529716355144438,
        -0.0980208811401368,
        1.15190312990417,
        -0.0980434501171241,
        -0.0990297440797205,
        -0.0989611768448433,
        1.15107367264116,
    ]);
    let (low, high) = (-12.47393, 4.026069);
    let light = (agx_from_linear * color).max(DVec3::splat(1e-10));
    let x = ((light.map(f64::log2) - low) / (high - low)).clamp(DVec3::ZERO, DVec3::ONE);
    let (x2, x4) = (x * x, x * x * x * x);
    let curve = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
    (linear_from_agx * curve).clamp(DVec3::ZERO, DVec3::ONE).map(|x| x.powf(2.2))
}

/// IEC 61966-2-1, in steps of 8 bits.
fn encoded(linear: f64) -> f64 {
    255.0 * if linear <= 0.0031308 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}
