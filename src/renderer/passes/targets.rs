//! Render targets of a frame before the caller's target, or beside it. Depth and linear HDR colours have all samples.
//! The tone map reads the samples of each pixel, so nothing resolves them before it: a mean of linear colours has an
//! edge as bright as a lamp where the lamp covers a fraction of a pixel. That mean is taken only for what is to be
//! linear: what blended objects refract, and [`crate::renderer::ViewState::read_linear`].

use super::attachments::Attachments;
use super::pipelines::ToneMapSource;
use crate::renderer::gpu::formats::{DEPTH_FORMAT, HDR_FORMAT};
use crate::renderer::gpu::texture::{texture, whole_view};

/// The targets of one size.
#[derive(Debug)]
pub(crate) struct Targets {
    pub width: u32,
    pub height: u32,
    pub samples: u32,
    pub hdr: Hdr,
    pub depth: wgpu::TextureView,
    pub depth_texture: wgpu::Texture,
    /// Layer of the textures that these targets are.
    pub layer: u32,
}

/// Linear colours of each sample.
#[derive(Clone, Debug)]
pub(crate) struct Hdr {
    pub texture: wgpu::Texture,
    /// View of the whole texture, or of a layer.
    pub view: wgpu::TextureView,
    /// For the tone-map pass.
    pub source: wgpu::BindGroup,
}

impl Targets {
    /// `tone_map_layout`: for so many samples.
    pub fn new(device: &wgpu::Device, tone_map_layout: &wgpu::BindGroupLayout, size: (u32, u32), samples: u32) -> Self {
        let mut usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
        if samples == 1 {
            // They may be read back.
            usage |= wgpu::TextureUsages::COPY_SRC;
        }
        let depth_texture = texture(device, "depth", size, DEPTH_FORMAT, samples, usage);
        let depth = whole_view(&depth_texture, "depth");
        let hdr = Hdr::new(device, tone_map_layout, texture(device, "hdr", size, HDR_FORMAT, samples, usage));
        Self { width: size.0, height: size.1, samples, hdr, depth, depth_texture, layer: 0 }
    }

    /// Copy source of the colours, of one sample per pixel.
    pub fn hdr_layer(&self) -> wgpu::TexelCopyTextureInfo<'_> {
        let origin = wgpu::Origin3d { z: self.layer, ..wgpu::Origin3d::ZERO };
        wgpu::TexelCopyTextureInfo { origin, ..self.hdr.texture.as_image_copy() }
    }

    /// Attachments of the scene's passes, with the copy that blended objects refract, if any does.
    pub fn attachments<'a>(
        &'a self,
        scene_color: Option<&'a SceneColorCopy>,
        beside: [Option<&'a wgpu::TextureView>; 2],
    ) -> Attachments<'a> {
        let resolved = scene_color.filter(|_| self.samples > 1).map(|copy| &copy.view);
        Attachments { color: &self.hdr.view, resolved, depth: &self.depth, beside }
    }
}

impl Hdr {
    fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, texture: wgpu::Texture) -> Self {
        let view = whole_view(&texture, "hdr");
        let source = tone_map_source(device, layout, &view, ToneMapSource::of(texture.sample_count()));
        Self { texture, view, source }
    }

    /// One sample per pixel of several views, each a layer.
    pub fn of_layers(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, texture: wgpu::Texture) -> Self {
        let view = texture.create_view(&wgpu::TextureViewDescriptor {
            label: Some("hdr layers"),
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..wgpu::TextureViewDescriptor::default()
        });
        let source = tone_map_source(device, layout, &view, ToneMapSource::Layers);
        Self { texture, view, source }
    }

    /// The colours with one sample per pixel, in a texture that can be copied: these, or their mean in linear light.
    pub fn resolved(&self, device: &wgpu::Device, encoder: &mut wgpu::CommandEncoder) -> wgpu::Texture {
        if self.texture.sample_count() == 1 {
            return self.texture.clone();
        }
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        let size = (self.texture.width(), self.texture.height());
        let resolved = texture(device, "hdr resolved", size, HDR_FORMAT, 1, usage);
        drop(encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("resolve"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.view,
                depth_slice: None,
                resolve_target: Some(&whole_view(&resolved, "hdr resolved")),
                ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
            })],
            ..wgpu::RenderPassDescriptor::default()
        }));
        resolved
    }
}

fn tone_map_source(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    view: &wgpu::TextureView,
    source: ToneMapSource,
) -> wgpu::BindGroup {
    let resource = wgpu::BindingResource::TextureView(view);
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("tone map source"),
        layout,
        entries: &[wgpu::BindGroupEntry { binding: source as u32, resource }],
    })
}

/// A picture of what lies behind blended objects, for those that refract it.
#[derive(Debug)]
pub(crate) struct SceneColorCopy {
    pub texture: wgpu::Texture,
    view: wgpu::TextureView,
    /// Bind group of the objects that refract it.
    pub group: wgpu::BindGroup,
}

impl SceneColorCopy {
    pub fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, size: (u32, u32)) -> Self {
        let usage = wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_DST
            | wgpu::TextureUsages::RENDER_ATTACHMENT;
        let texture = texture(device, "scene color copy", size, HDR_FORMAT, 1, usage);
        let view = whole_view(&texture, "scene color copy");
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("scene color copy"),
            layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) }],
        });
        Self { texture, view, group }
    }

    pub fn size(&self) -> (u32, u32) {
        (self.texture.width(), self.texture.height())
    }
}
