//! From what arrives at a camera to its picture, on the CPU, where the GPU's picture is not the camera's: exposure,
//! noise and the tone map. The same for any number of threads, of the same linear colours.

use super::pixels::Pixels;
use half::f16;
use systems::draw::ToneMap;
use systems::ecs::parallel::map_in_parallel;
use systems::sensors::philox::{Noise, normal};
use systems::sensors::{CameraOutput, CameraSensor, Exposure, LightMeter};

/// Tells if a camera's colours are made here of linear ones.
pub(crate) fn is_developed(sensor: &CameraSensor) -> bool {
    sensor.lens.has_distortion() || sensor.noise.is_some() || sensor.exposure != Exposure::Scene
}

/// Exposes linear colours, which the scene's `exposure` has exposed, adds noise to them, and makes colours of them
/// where these are asked for. Returns the exposure that they have then.
pub(super) fn develop(
    pixels: &mut Pixels,
    sensor: &CameraSensor,
    (exposure, tone_map): (f32, ToneMap),
    random: Noise,
) -> f32 {
    let row = sensor.size.0.max(1) as usize;
    let rows = || pixels.linear.chunks(row);
    let factor = match sensor.exposure {
        Exposure::Scene => 1.0,
        Exposure::Fixed(own) if exposure > 0.0 => f64::from(own) / f64::from(exposure),
        // Black, whatever it is multiplied by.
        Exposure::Fixed(_) => 1.0,
        Exposure::Metered { key, stops } => {
            let metered = |row: &[[f16; 3]]| {
                row.iter().fold(LightMeter::default(), |meter, rgb| meter.with(rgb.map(f16::to_f64)))
            };
            let meters = map_in_parallel(rows(), metered);
            meters.into_iter().fold(LightMeter::default(), LightMeter::and).factor(key, stops)
        }
    };
    if factor != 1.0 || sensor.noise.is_some() {
        let light = |light: f16, word: u32| {
            let light = light.to_f64() * factor;
            let read = sensor.noise.map_or(light, |noise| noise.light(noise.counts(light, normal(word).into())));
            f16::from_f64(read.min(f16::MAX.to_f64()))
        };
        let exposed = |(number, linear): (usize, &[[f16; 3]])| {
            let pixels = (number * row..).zip(linear).map(|(pixel, [r, g, b])| {
                let words = if sensor.noise.is_some() { random.words(pixel as u32, 0) } else { [0; 4] };
                [light(*r, words[0]), light(*g, words[1]), light(*b, words[2])]
            });
            pixels.collect::<Vec<_>>()
        };
        pixels.linear = map_in_parallel(rows().enumerate(), exposed).concat();
    }
    if sensor.outputs.has(CameraOutput::Color) {
        let encoded = |rgb: &[f16; 3]| tone_map.encoded(rgb.map(f16::to_f32));
        let rows = map_in_parallel(pixels.linear.chunks(row), |row| row.iter().map(encoded).collect::<Vec<_>>());
        pixels.color = rows.concat();
    }
    (f64::from(exposure) * factor) as f32
}
