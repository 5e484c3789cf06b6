//! Normal, id and depth of a view, read back.

use super::{Gpu, read_texture};
use systems::draw::View;

/// Normal, id and depth of a view, for pictures other than colour and for picking.
#[derive(Debug)]
pub struct Outputs {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    pub(super) normal: wgpu::Texture,
    pub(super) id: wgpu::Texture,
    pub(super) depth: wgpu::Texture,
}

impl Outputs {
    /// World-space shading normals, one per pixel; zero where there is nothing.
    pub fn normals(&self, gpu: &Gpu) -> Vec<[f32; 3]> {
        let bytes = read_texture(gpu, &self.normal, wgpu::TextureAspect::All);
        let half = |b: &[u8]| half::f16::from_le_bytes([b[0], b[1]]).to_f32();
        bytes.chunks_exact(8).map(|t| [half(&t[0..]), half(&t[2..]), half(&t[4..])]).collect()
    }

    /// Entity index of each pixel; `None` where there is nothing.
    pub fn entities(&self, gpu: &Gpu) -> Vec<Option<u32>> {
        let bytes = read_texture(gpu, &self.id, wgpu::TextureAspect::All);
        bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]).checked_sub(1)).collect()
    }

    /// Distance along the viewing direction in metres, one per pixel; infinite where there is nothing.
    pub fn depths(&self, gpu: &Gpu, view: &View) -> Vec<f32> {
        let bytes = read_texture(gpu, &self.depth, wgpu::TextureAspect::DepthOnly);
        let view_from_clip = view.clip_from_view().inverse();
        let metres = |depth: f32| {
            let p = view_from_clip * glam::Vec4::new(0.0, 0.0, depth, 1.0);
            if depth == 0.0 { f32::INFINITY } else { -p.z / p.w }
        };
        bytes.chunks_exact(4).map(|b| metres(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))).collect()
    }
}
