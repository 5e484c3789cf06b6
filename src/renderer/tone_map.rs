//! The tone curves of shaders/tone.wgsl once more, for a sky of one colour, which is a clear.

use glam::{Mat3, Vec3};
use systems::draw::ToneMap;

/// What a curve makes of a linear colour, which is exposed already: 0..1, linear.
pub(super) fn tone_mapped(curve: ToneMap, linear: Vec3) -> Vec3 {
    let color = linear.max(Vec3::ZERO);
    let color = match curve {
        ToneMap::Clamp => color,
        ToneMap::Aces => aces(color),
        ToneMap::Agx => agx(color),
    };
    color.clamp(Vec3::ZERO, Vec3::ONE)
}

fn aces(x: Vec3) -> Vec3 {
    (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)
}

fn agx(color: Vec3) -> Vec3 {
    const AGX_FROM_LINEAR: Mat3 = Mat3::from_cols_array(&[
        0.842_479_05,
        0.042_328_242,
        0.042_375_655,
        0.078_433_6,
        0.878_468_6,
        0.078_433_6,
        0.079_223_745,
        0.079_166_13,
        0.879_143,
    ]);
    const LINEAR_FROM_AGX: Mat3 = Mat3::from_cols_array(&[
        1.196_879,
        -0.052_896_85,
        -0.052_971_635,
        -0.098_020_88,
        1.151_903_1,
        -0.098_043_45,
        -0.099_029_74,
        -0.098_961_18,
        1.151_073_7,
    ]);
    let (low, high) = (-12.47393, 4.026_069);
    let light = (AGX_FROM_LINEAR * color).max(Vec3::splat(1e-10));
    let x = ((light.map(f32::log2) - low) / (high - low)).clamp(Vec3::ZERO, Vec3::ONE);
    let (x2, x4) = (x * x, x * x * x * x);
    let curve = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
    (LINEAR_FROM_AGX * curve).clamp(Vec3::ZERO, Vec3::ONE).powf(2.2)
}
