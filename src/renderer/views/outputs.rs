//! Outputs of a view, read back.

use glam::Mat4;

/// Outputs of a view, read back.
#[derive(Clone, Debug)]
pub struct Outputs {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// The picture: 8-bit sRGB RGBA, rows from the top. `None` unless it was asked for.
    pub picture: Option<image::RgbaImage>,
    /// Half floats.
    pub(crate) linear: Vec<u8>,
    pub(crate) normal: Vec<u8>,
    pub(crate) id: Vec<u8>,
    pub(crate) depth: Vec<u8>,
    pub(crate) view_from_clip: Mat4,
}

impl Outputs {
    /// Linear colours, exposed, before the tone map: RGBA, rows from the top. Of several samples per pixel, their mean
    /// in linear light. Empty unless they were asked for.
    pub fn linear(&self) -> Vec<[half::f16; 4]> {
        let half = |b: &[u8]| half::f16::from_le_bytes([b[0], b[1]]);
        self.linear.chunks_exact(8).map(|t| [half(&t[0..]), half(&t[2..]), half(&t[4..]), half(&t[6..])]).collect()
    }

    /// World-space shading normals, one per pixel, rows from the top; zero where there is nothing. Empty unless they
    /// were asked for.
    pub fn normals(&self) -> Vec<[f32; 3]> {
        let half = |b: &[u8]| half::f16::from_le_bytes([b[0], b[1]]).to_f32();
        self.normal.chunks_exact(8).map(|t| [half(&t[0..]), half(&t[2..]), half(&t[4..])]).collect()
    }

    /// Entity index plus 1 of each pixel; 0 where there is nothing. Empty unless they were asked for.
    pub fn ids(&self) -> impl Iterator<Item = u32> + '_ {
        self.id.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    }

    /// Entity index of each pixel; `None` where there is nothing. Empty unless they were asked for.
    pub fn entities(&self) -> Vec<Option<u32>> {
        self.ids().map(|id| id.checked_sub(1)).collect()
    }

    /// Distance along the viewing direction in metres, one per pixel; infinite where there is nothing. Empty unless
    /// they were asked for.
    pub fn depths(&self) -> Vec<f32> {
        let depths = self.depth.chunks_exact(4);
        depths.map(|b| metres(f32::from_le_bytes([b[0], b[1], b[2], b[3]]), self.view_from_clip)).collect()
    }
}

pub(crate) fn entity_of(texel: [u8; 4]) -> Option<u32> {
    u32::from_le_bytes(texel).checked_sub(1)
}

/// The distance along the viewing direction of a reversed depth.
pub(crate) fn metres(depth: f32, view_from_clip: Mat4) -> f32 {
    // Of (0, 0, depth, 1), from the middle of the picture: where it is does not matter.
    let z = view_from_clip.z_axis.z * depth + view_from_clip.w_axis.z;
    let w = view_from_clip.z_axis.w * depth + view_from_clip.w_axis.w;
    if depth == 0.0 { f32::INFINITY } else { -z / w }
}

/// The entity that a pixel shows.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Picked {
    /// The entity's index.
    pub entity: u32,
    /// Distance along the viewing direction in metres.
    pub depth: f32,
}
