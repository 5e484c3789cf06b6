//! Passes that draw casters into the layers of the shadow maps, and the bindings of receivers: the texture, the
//! pipelines of `shaders/shadow_pass.wgsl` and the buffers that they read.

use super::shadow_layers::ShadowFaceRecord;
use crate::renderer::gpu::formats::DEPTH_FORMAT;
use crate::renderer::gpu::growing_buffer::GrowingBuffer;
use crate::renderer::gpu::shaders;
use crate::renderer::gpu::texture::{layer_view, layered_texture, texture};
use crate::renderer::gpu::timestamps::Timestamps;
use crate::renderer::resources::frame_tables::FrameTables;
use crate::renderer::resources::meshes::{SLOT_LAYOUT, VERTEX_LAYOUT};
use std::collections::BTreeMap;
use systems::draw::ViewRecord;

/// Inputs of the mask shader that a caster has: transformed UVs, and vertex colours.
pub(crate) type MaskKey = (bool, bool);

#[derive(Debug)]
pub(crate) struct OnDevice {
    shaders: wgpu::ShaderModule,
    pub opaque: wgpu::RenderPipeline,
    pub empty: wgpu::RenderPipeline,
    mask_layout: wgpu::PipelineLayout,
    pub masks: BTreeMap<MaskKey, wgpu::RenderPipeline>,
    face_layout: wgpu::BindGroupLayout,
    /// A face each, as far apart as the device asks for.
    pub faces: GrowingBuffer,
    pub face_group: Option<(u32, wgpu::BindGroup)>,
    pub slots: GrowingBuffer,
    /// Shaders of casters read tables and no view.
    view: wgpu::Buffer,
    pub tables: Option<(u32, wgpu::BindGroup)>,
}

/// The texture of layers of one side.
#[derive(Debug)]
pub(crate) struct Maps {
    texture: wgpu::Texture,
    pub layers: Vec<wgpu::TextureView>,
    /// Bind group of receivers.
    pub group: wgpu::BindGroup,
}

/// Bytes from one face's record to the next.
pub(crate) fn face_stride(device: &wgpu::Device) -> u32 {
    (size_of::<ShadowFaceRecord>() as u32).next_multiple_of(device.limits().min_uniform_buffer_offset_alignment)
}

impl Maps {
    pub fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, side: u32, layers: usize) -> Self {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_DST;
        let texture = layered_texture(device, "shadow maps", ((side, side), layers as u32), DEPTH_FORMAT, 1, usage);
        let layers = (0..layers as u32).map(|layer| layer_view(&texture, "shadow layer", layer)).collect();
        let all = texture.create_view(&wgpu::TextureViewDescriptor {
            label: Some("shadow maps"),
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..wgpu::TextureViewDescriptor::default()
        });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("shadow maps"),
            ..wgpu::SamplerDescriptor::default()
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("shadow maps"),
            layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&all) },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&sampler) },
            ],
        });
        Self { layers, group, texture }
    }

    /// Copies a base into a layer.
    pub fn copy_into(&self, encoder: &mut wgpu::CommandEncoder, base: &wgpu::Texture, layer: usize) {
        let mut to = self.texture.as_image_copy();
        to.origin.z = layer as u32;
        encoder.copy_texture_to_texture(base.as_image_copy(), to, base.size());
    }
}

/// A layer by itself, for what is still.
pub(crate) fn base_texture(device: &wgpu::Device, side: u32) -> wgpu::Texture {
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
    texture(device, "still casters", (side, side), DEPTH_FORMAT, 1, usage)
}

/// A pass that draws depths into a layer or a base.
pub(crate) fn begin_pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    view: &wgpu::TextureView,
    load: wgpu::LoadOp<f32>,
    timestamps: Option<&Timestamps>,
) -> wgpu::RenderPass<'a> {
    let depth_ops = Some(wgpu::Operations { load, store: wgpu::StoreOp::Store });
    let attachment = wgpu::RenderPassDepthStencilAttachment { view, depth_ops, stencil_ops: None };
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("shadows"),
        depth_stencil_attachment: Some(attachment),
        timestamp_writes: timestamps.and_then(|timestamps| timestamps.render_pass("shadows")),
        ..wgpu::RenderPassDescriptor::default()
    })
}

impl OnDevice {
    pub fn new(
        device: &wgpu::Device,
        frame_layout: &wgpu::BindGroupLayout,
        class_layout: &wgpu::BindGroupLayout,
    ) -> Self {
        let source = wgpu::ShaderSource::Wgsl(shaders::SHADOW_PASS.into());
        let module = wgpu::ShaderModuleDescriptor { label: Some("shadow_pass.wgsl"), source };
        let shaders = device.create_shader_module(module);
        let face_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("shadow face"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::VERTEX,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: true,
                    min_binding_size: wgpu::BufferSize::new(size_of::<ShadowFaceRecord>() as u64),
                },
                count: None,
            }],
        });
        let layout = |class| {
            device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some("shadows"),
                bind_group_layouts: &[Some(frame_layout), class, None, Some(&face_layout)],
                immediate_size: 0,
            })
        };
        let opaque_layout = layout(None);
        let pipeline = |entry, compare, buffers: &[_]| {
            pipeline(device, &shaders, &opaque_layout, Entries { vertex: entry, fragment: None }, &[], compare, buffers)
        };
        let opaque = pipeline("vs_opaque", wgpu::CompareFunction::Greater, &[Some(VERTEX_LAYOUT), Some(SLOT_LAYOUT)]);
        let empty = pipeline("vs_empty", wgpu::CompareFunction::Always, &[]);
        Self {
            mask_layout: layout(Some(class_layout)),
            opaque,
            empty,
            masks: BTreeMap::new(),
            faces: GrowingBuffer::new(device, "shadow faces", wgpu::BufferUsages::UNIFORM),
            face_group: None,
            slots: GrowingBuffer::new(device, "shadow casters", wgpu::BufferUsages::VERTEX),
            view: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("no view"),
                size: size_of::<ViewRecord>() as u64,
                usage: wgpu::BufferUsages::UNIFORM,
                mapped_at_creation: false,
            }),
            tables: None,
            face_layout,
            shaders,
        }
    }

    pub fn make_mask(&mut self, device: &wgpu::Device, mask: MaskKey) {
        let Self { shaders, mask_layout, masks, .. } = self;
        masks.entry(mask).or_insert_with(|| {
            let (transformed_uvs, vertex_colors) = mask;
            let constants = [
                ("TRANSFORMED_UVS", f64::from(u32::from(transformed_uvs))),
                ("VERTEX_COLORS", f64::from(u32::from(vertex_colors))),
            ];
            let entries = Entries { vertex: "vs_mask", fragment: Some("fs_mask") };
            let buffers = [Some(VERTEX_LAYOUT), Some(SLOT_LAYOUT)];
            let compare = wgpu::CompareFunction::Greater;
            pipeline(device, shaders, mask_layout, entries, &constants, compare, &buffers)
        });
    }

    /// Makes the bind groups whose buffers or textures are others.
    pub fn bind(&mut self, device: &wgpu::Device, tables: &FrameTables, frame_layout: &wgpu::BindGroupLayout) {
        let version = tables.version();
        if self.tables.as_ref().is_none_or(|(bound, _)| *bound != version) {
            self.tables = Some((version, tables.bind(device, frame_layout, &self.view)));
        }
        let version = self.faces.version;
        if self.face_group.as_ref().is_none_or(|(bound, _)| *bound != version) {
            let binding = wgpu::BufferBinding {
                buffer: self.faces.buffer(),
                offset: 0,
                size: wgpu::BufferSize::new(size_of::<ShadowFaceRecord>() as u64),
            };
            let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("shadow faces"),
                layout: &self.face_layout,
                entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::Buffer(binding) }],
            });
            self.face_group = Some((version, group));
        }
    }
}

/// Entry points of a shader.
struct Entries<'a> {
    vertex: &'a str,
    fragment: Option<&'a str>,
}

fn pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    Entries { vertex, fragment }: Entries<'_>,
    constants: &[(&str, f64)],
    compare: wgpu::CompareFunction,
    buffers: &[Option<wgpu::VertexBufferLayout<'_>>],
) -> wgpu::RenderPipeline {
    let compilation_options =
        wgpu::PipelineCompilationOptions { constants, ..wgpu::PipelineCompilationOptions::default() };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("shadows"),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(vertex),
            compilation_options: compilation_options.clone(),
            buffers,
        },
        // Sheets cast shadows to either side, and faces mirror.
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(compare),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: fragment.map(|entry| wgpu::FragmentState {
            module,
            entry_point: Some(entry),
            compilation_options,
            targets: &[],
        }),
        multiview_mask: None,
        cache: None,
    })
}
