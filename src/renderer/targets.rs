//! What a frame is drawn into before it reaches the caller's target, or beside it: depth, and linear HDR colours,
//! multisampled and resolved.

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
    pub hdr: Hdr,
    pub depth: wgpu::TextureView,
    pub depth_texture: wgpu::Texture,
}

/// Linear colours.
#[derive(Debug)]
pub(super) struct Hdr {
    pub texture: wgpu::Texture,
    /// Of all of it.
    view: wgpu::TextureView,
    /// Resolved into it.
    multisampled: Option<wgpu::TextureView>,
    /// For the tone-map pass.
    pub source: wgpu::BindGroup,
}

/// What the passes over a scene draw into.
#[derive(Clone, Copy)]
pub(super) struct Attachments<'a> {
    pub color: &'a wgpu::TextureView,
    /// What `color` is resolved into in the end.
    pub resolved: Option<&'a wgpu::TextureView>,
    pub depth: &'a wgpu::TextureView,
    /// Normals and ids that are drawn with the colour.
    pub beside: [Option<&'a wgpu::TextureView>; 2],
}

impl Targets {
    pub fn new(device: &wgpu::Device, tone_map_layout: &wgpu::BindGroupLayout, size: (u32, u32), samples: u32) -> Self {
        let mut usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
        if samples == 1 {
            // It may be read back.
            usage |= wgpu::TextureUsages::COPY_SRC;
        }
        let depth_texture = texture(device, "depth", size, DEPTH_FORMAT, samples, usage);
        let depth = whole_view(&depth_texture, "depth");
        let hdr = Hdr::new(device, tone_map_layout, size, samples);
        Self { width: size.0, height: size.1, samples, hdr, depth, depth_texture }
    }

    /// Where the scene is drawn.
    pub fn attachments<'a>(&'a self, beside: [Option<&'a wgpu::TextureView>; 2]) -> Attachments<'a> {
        let (color, resolved) = match &self.hdr {
            Hdr { view, multisampled: Some(multisampled), .. } => (multisampled, Some(view)),
            Hdr { view, .. } => (view, None),
        };
        Attachments { color, resolved, depth: &self.depth, beside }
    }
}

impl Hdr {
    fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, size: (u32, u32), samples: u32) -> Self {
        let attachment = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let readable = attachment | wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
        let texture_of = |label, samples, usage| texture(device, label, size, HDR_FORMAT, samples, usage);
        let texture = texture_of("hdr", 1, readable);
        let view = whole_view(&texture, "hdr");
        let multisampled = (samples > 1).then(|| {
            let label = "hdr multisampled";
            whole_view(&texture_of(label, samples, attachment), label)
        });
        let source = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("tone map source"),
            layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) }],
        });
        Self { texture, view, multisampled, source }
    }
}

/// A picture of what lies behind blended objects, for those that refract it.
#[derive(Debug)]
pub(super) struct SceneColorCopy {
    pub texture: wgpu::Texture,
    /// As objects read it.
    pub group: wgpu::BindGroup,
}

impl SceneColorCopy {
    pub fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, size: (u32, u32)) -> Self {
        let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
        let texture = texture(device, "scene color copy", size, HDR_FORMAT, 1, usage);
        let view = whole_view(&texture, "scene color copy");
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("scene color copy"),
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
