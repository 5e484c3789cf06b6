//! The tone map of shaders, against the curves in double precision.

use crate::common::{self, prelude::*};

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
            let environment =
                Environment { ambient, zenith, horizon, ground, exposure, tone_map: curve, ..Environment::default() };
            simulation.world.insert_resource(environment);
            let picture = headless.draw(&mut simulation, camera, (128, 72)).expect("a picture");
            let linear = headless.renderer.read_linear().expect("prepared");
            for (pixel, [r, g, b, _]) in picture.pixels().zip(linear) {
                let expected = curve.mapped(DVec3::new(r.into(), g.into(), b.into())).to_array().map(encoded);
                let off = pixel.0.iter().zip(expected).map(|(&found, expected)| (f64::from(found) - expected).abs());
                let off = off.fold(0.0, f64::max);
                assert!(off <= SLACK, "{name}, exposure {exposure}: {pixel:?} for {r} {g} {b}, not {expected:?}");
            }
        }
    }
}

/// IEC 61966-2-1, in steps of 8 bits.
fn encoded(linear: f64) -> f64 {
    255.0 * if linear <= 0.0031308 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}
