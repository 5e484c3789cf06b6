//! What a frame is drawn into before it reaches the caller's target: HDR colour with depth, multisampled and resolved.

/// Linear HDR.
pub(super) const HDR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
/// Reversed depth needs a float format.
pub(super) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The targets of one size.
#[derive(Debug)]
pub(super) struct Targets {
    pub width: u32,
    pub height: u32,
    pub samples: u32,
    /// Drawn into: multisampled, or `hdr` itself at one sample.
    pub color: wgpu::TextureView,
    /// Resolved.
    pub hdr: wgpu::TextureView,
    pub hdr_texture: wgpu::Texture,
    pub depth: wgpu::TextureView,
    /// `hdr` for the tone-map pass.
    pub tone_map_source: wgpu::BindGroup,
}

impl Targets {
    pub fn new(
        device: &wgpu::Device,
        tone_map_layout: &wgpu::BindGroupLayout,
        (width, height): (u32, u32),
        samples: u32,
    ) -> Self {
        let attachment = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let readable = attachment | wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
        let size = (width, height);
        let hdr_texture = texture(device, "hdr", size, HDR_FORMAT, 1, readable);
        let hdr = whole_view(&hdr_texture, "hdr");
        let color = if samples > 1 {
            let multisampled = texture(device, "hdr multisampled", size, HDR_FORMAT, samples, attachment);
            whole_view(&multisampled, "hdr multisampled")
        } else {
            hdr.clone()
        };
        let depth =
            texture(device, "depth", size, DEPTH_FORMAT, samples, attachment | wgpu::TextureUsages::TEXTURE_BINDING);
        let tone_map_source = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("tone map source"),
            layout: tone_map_layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&hdr) }],
        });
        let depth = whole_view(&depth, "depth");
        Self { width, height, samples, color, hdr, hdr_texture, depth, tone_map_source }
    }
}

/// A picture of what lies behind blended objects, for those that refract it.
#[derive(Debug)]
pub(super) struct Behind {
    pub texture: wgpu::Texture,
    /// As objects read it.
    pub group: wgpu::BindGroup,
}

impl Behind {
    pub fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, size: (u32, u32)) -> Self {
        let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
        let texture = texture(device, "behind", size, HDR_FORMAT, 1, usage);
        let view = whole_view(&texture, "behind");
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("behind"),
            layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) }],
        });
        Self { texture, group }
    }

    pub fn size(&self) -> (u32, u32) {
        (self.texture.width(), self.texture.height())
    }
}

/// A plain 2D texture.
pub(super) fn texture(
    device: &wgpu::Device,
    label: &str,
    (width, height): (u32, u32),
    format: wgpu::TextureFormat,
    sample_count: u32,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

/// A view of all of a texture.
pub(super) fn whole_view(texture: &wgpu::Texture, label: &str) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor { label: Some(label), ..wgpu::TextureViewDescriptor::default() })
}
