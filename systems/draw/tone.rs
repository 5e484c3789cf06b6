//! The tone curves on the CPU: the twin of shaders/tone.wgsl.

use super::environment::ToneMap;
use crate::assets::color::srgb_from_linear;
use glam::{DMat3, DVec3};

impl ToneMap {
    /// Displayed colour, linear, 0..1, of a linear colour after exposure.
    pub fn mapped(self, linear: DVec3) -> DVec3 {
        let x = linear.max(DVec3::ZERO);
        let mapped = match self {
            Self::Clamp => x,
            Self::Aces => aces(x),
            Self::Agx => agx(x),
        };
        mapped.clamp(DVec3::ZERO, DVec3::ONE)
    }

    /// [`Self::mapped`] as 8-bit sRGB.
    pub fn encoded(self, [r, g, b]: [f32; 3]) -> [u8; 3] {
        let mapped = self.mapped(DVec3::new(r.into(), g.into(), b.into()));
        mapped.to_array().map(|linear| (255.0 * srgb_from_linear(linear as f32)).round() as u8)
    }
}

/// Narkowicz 2016, "ACES Filmic Tone Mapping Curve".
fn aces(x: DVec3) -> DVec3 {
    (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)
}

/// Troy Sobotka's AgX in the compact form of Benjamin Wrensch ("Minimal AgX Implementation", 2023): into the AgX
/// primaries, log2 between −12.47 and 4.03 EV, a sixth-order fit of the sigmoid, and back.
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
