//! Textures of the outputs of a view.

use super::pass::Attached;
use crate::renderer::gpu::formats::{DEPTH_FORMAT, ID_FORMAT, NORMAL_FORMAT, PICTURE_FORMAT};
use crate::renderer::gpu::texture::{texture, whole_view};
use crate::renderer::plan::output_set::OutputSet;

/// A texture of a view's outputs.
#[derive(Clone, Debug)]
pub(crate) struct OutputTexture {
    pub texture: wgpu::Texture,
    /// View of all of it, or of a layer.
    pub view: wgpu::TextureView,
}

/// Outputs of a view, as the GPU has them. Textures are made when they are first asked for.
#[derive(Debug, Default)]
pub(crate) struct OutputTextures {
    pub color: Option<OutputTexture>,
    pub normal: Option<OutputTexture>,
    pub id: Option<OutputTexture>,
    /// Depths of the pass of one sample per pixel, unless the picture's own pass has that.
    pub depth: Option<OutputTexture>,
}

impl OutputTextures {
    /// Makes those that are missing for a size. `depth`: whatever `outputs` say.
    pub fn fit(&mut self, device: &wgpu::Device, size: (u32, u32), outputs: OutputSet, depth: bool) {
        let fit = |kept: &mut Option<OutputTexture>, label, format, wanted: bool| {
            if kept.as_ref().is_some_and(|kept| (kept.texture.width(), kept.texture.height()) != size) {
                *kept = None;
            }
            if wanted && kept.is_none() {
                let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
                    | wgpu::TextureUsages::COPY_SRC
                    | wgpu::TextureUsages::TEXTURE_BINDING;
                let texture = texture(device, label, size, format, 1, usage);
                *kept = Some(OutputTexture { view: whole_view(&texture, label), texture });
            }
        };
        fit(&mut self.color, "picture", PICTURE_FORMAT, outputs.color);
        fit(&mut self.normal, "normals", NORMAL_FORMAT, outputs.normal);
        fit(&mut self.id, "ids", ID_FORMAT, outputs.id);
        fit(&mut self.depth, "output depth", DEPTH_FORMAT, depth);
    }

    /// Normals and ids, as attachments of a pass that writes some of them.
    pub fn attached(&self, attached: Attached) -> [Option<&wgpu::TextureView>; 2] {
        [
            self.normal.as_ref().filter(|_| attached.normal).map(|kept| &kept.view),
            self.id.as_ref().filter(|_| attached.id).map(|kept| &kept.view),
        ]
    }
}
