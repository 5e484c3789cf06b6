//! The passes of the historic emboss technique: sums of heights in the target's alpha, and the light that they scale.
//! `shaders/emboss.wgsl` tells what each pass writes.

use crate::renderer::gpu::formats::HDR_FORMAT;
use wgpu::{BlendComponent, BlendFactor, BlendOperation, BlendState, ColorWrites};

/// One pass.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum EmbossPass {
    /// Half the height into alpha.
    Height { light: u32 },
    /// Half the inverted height a step toward the light, added.
    Shifted { light: u32 },
    /// Half the smooth surface's diffuse light less one half, added.
    Diffuse { light: u32 },
    /// Negative values in alpha become 0.
    Clamped,
    /// Base colour and light, twice, times alpha, added to the colour.
    Colored { light: u32 },
    /// Alpha becomes 1 again.
    Opaque,
}

impl EmbossPass {
    /// All passes in order.
    pub fn all() -> impl Iterator<Item = Self> {
        let of_light = |light| {
            [
                Self::Height { light },
                Self::Shifted { light },
                Self::Diffuse { light },
                Self::Clamped,
                Self::Colored { light },
            ]
        };
        (0..3).flat_map(of_light).chain([Self::Opaque])
    }

    /// The shader's EMBOSS_STEP and EMBOSS_LIGHT.
    pub fn constants(self) -> (u32, u32) {
        match self {
            Self::Height { light } => (0, light),
            Self::Shifted { light } => (1, light),
            Self::Diffuse { light } => (2, light),
            Self::Clamped => (3, 0),
            Self::Colored { light } => (4, light),
            Self::Opaque => (5, 0),
        }
    }

    /// Blend state and write mask of its output.
    pub fn target(self) -> wgpu::ColorTargetState {
        let blended = |src_factor, operation| {
            let both = BlendComponent { src_factor, dst_factor: BlendFactor::One, operation };
            Some(BlendState { color: both, alpha: BlendComponent { src_factor: BlendFactor::One, ..both } })
        };
        let (blend, write_mask) = match self {
            Self::Height { .. } | Self::Opaque => (None, ColorWrites::ALPHA),
            Self::Shifted { .. } | Self::Diffuse { .. } => {
                (blended(BlendFactor::One, BlendOperation::Add), ColorWrites::ALPHA)
            }
            Self::Clamped => (blended(BlendFactor::One, BlendOperation::Max), ColorWrites::ALPHA),
            Self::Colored { .. } => (blended(BlendFactor::DstAlpha, BlendOperation::Add), ColorWrites::COLOR),
        };
        wgpu::ColorTargetState { format: HDR_FORMAT, blend, write_mask }
    }
}
