//! Colours from the ways that people give them: all become linear RGB of the sRGB primaries.

use glam::Vec3;
use std::sync::LazyLock;

/// The sRGB transfer function, IEC 61966-2-1: encoded value to linear light, both 0..1.
pub fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// [`linear_from_srgb`] of each byte over 255.
pub static LINEAR_FROM_SRGB8: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| linear_from_srgb(i as f32 / 255.0)));

/// The other way: linear light to encoded value, both 0..1.
pub fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The colour of a black body, linear RGB, the largest component 1; `None` outside 1667..25000 K.
///
/// Chromaticity: the cubic splines of Kim et al., "Design of Advanced Color Temperature Control System for HDTV
/// Applications", J. Korean Phys. Soc. 41 (2002); then XYZ to linear sRGB by the matrix of IEC 61966-2-1. Warm colours
/// lie outside of sRGB; their negative blue is cut.
pub fn linear_from_kelvin(kelvin: f32) -> Option<Vec3> {
    if !(1667.0..=25000.0).contains(&kelvin) {
        return None;
    }
    let t = 1000.0 / kelvin;
    let x = if kelvin <= 4000.0 {
        ((-0.266_123_9 * t - 0.234_358_9) * t + 0.877_695_6) * t + 0.179_910
    } else {
        ((-3.025_847 * t + 2.107_037_9) * t + 0.222_634_7) * t + 0.240_390
    };
    let y = if kelvin <= 2222.0 {
        ((-1.106_381_4 * x - 1.348_110_2) * x + 2.185_558_3) * x - 0.202_196_83
    } else if kelvin <= 4000.0 {
        ((-0.954_947_6 * x - 1.374_185_9) * x + 2.091_37) * x - 0.167_488_67
    } else {
        ((3.081_758 * x - 5.873_387) * x + 3.751_13) * x - 0.370_014_83
    };
    let xyz = Vec3::new(x / y, 1.0, (1.0 - x - y) / y);
    let rgb = Vec3::new(
        xyz.dot(Vec3::new(3.240_97, -1.537_383_2, -0.498_610_76)),
        xyz.dot(Vec3::new(-0.969_243_65, 1.875_967_5, 0.041_555_06)),
        xyz.dot(Vec3::new(0.055_630_08, -0.203_976_96, 1.056_971_5)),
    );
    Some(rgb.max(Vec3::ZERO) / rgb.max_element())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chromaticities of the Planckian locus, CIE 15 (to the approximation's accuracy).
    #[test]
    fn temperatures_lie_on_the_planckian_locus() {
        for (kelvin, x, y) in [(2000.0, 0.5267, 0.4133), (2856.0, 0.4476, 0.4074), (6500.0, 0.3135, 0.3237)] {
            let rgb = linear_from_kelvin(kelvin).expect("in range");
            let xyz = Vec3::new(0.412_391, 0.212_639, 0.019_331) * rgb.x
                + Vec3::new(0.357_584, 0.715_169, 0.119_195) * rgb.y
                + Vec3::new(0.180_481, 0.072_192, 0.950_532) * rgb.z;
            let found = (xyz.x / xyz.element_sum(), xyz.y / xyz.element_sum());
            assert!((found.0 - x).abs() < 0.002 && (found.1 - y).abs() < 0.002, "{kelvin}: {found:?}");
            assert_eq!(rgb.max_element(), 1.0);
        }
        assert_eq!((linear_from_kelvin(1000.0), linear_from_kelvin(f32::NAN)), (None, None));
    }
}
