//! From what arrives at a camera to its picture, on the CPU, where the GPU's picture is not the camera's.

use super::pixels::Pixels;
use systems::draw::ToneMap;
use systems::ecs::parallel::map_in_parallel;
use systems::sensors::{CameraOutput, CameraSensor};

/// Whether a camera's colours are made here of linear ones.
pub(super) fn is_developed(sensor: &CameraSensor) -> bool {
    sensor.lens.bends()
}

/// Makes colours of linear ones, where they are asked for.
pub(super) fn develop(pixels: &mut Pixels, sensor: &CameraSensor, tone_map: ToneMap) {
    if sensor.outputs.has(CameraOutput::Color) {
        let row = sensor.size.0.max(1) as usize;
        let encoded = |rgb: &[half::f16; 3]| tone_map.encoded(rgb.map(half::f16::to_f32));
        let rows = map_in_parallel(pixels.linear.chunks(row), |row| row.iter().map(encoded).collect::<Vec<_>>());
        pixels.color = rows.concat();
    }
}
