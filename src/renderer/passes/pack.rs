//! The pack pass: from the textures that a batch has drawn to arrays in a buffer, where other programs find them.
//!
//! It computes what the CPU computes of textures that are read back ([`crate::renderer::Outputs`]).

use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::error::RenderError;
use crate::renderer::gpu::formats::{DEPTH_FORMAT, ID_FORMAT};
use crate::renderer::gpu::shaders;
use crate::renderer::gpu::texture::texture;
use crate::renderer::plan::packed::{PackedArray, PackedLabels, PackedLayout};
use glam::Mat4;
use wgpu::util::DeviceExt;

/// Threads of a workgroup, and workgroups in a row of a dispatch; both of shaders/pack.wgsl.
pub(crate) const TOGETHER: u32 = 64;
pub(crate) const ROW: u32 = 32768;
const NOT_PACKED: u32 = u32::MAX;

/// Destination of what several views show.
#[derive(Clone, Copy, Debug)]
pub struct Packing<'a> {
    /// Places of arrays in the buffer.
    pub layout: &'a PackedLayout,
    /// A storage buffer.
    pub target: &'a wgpu::Buffer,
    /// Labels of each view's entities; needed for arrays of these.
    pub labels: &'a [Vec<PackedLabels>],
    /// Steps of [`PackedArray::DepthSteps`], which needs [`PackedArray::Depth`], too: at most 253 positive depths,
    /// ascending, metres.
    pub scale: &'a [f32],
}

impl Packing<'_> {
    /// Checks that the buffer has room, that the device can bind what of it is written, and that so many views are in
    /// the arrays.
    ///
    /// # Errors
    /// [`RenderError::TooLarge`].
    pub(crate) fn check(&self, gpu: &Gpu, views: usize) -> Result<(), RenderError> {
        let too_large = |what, unit, needed, limit| Err(RenderError::TooLarge { what, unit, needed, limit });
        self.layout.check(&gpu.device)?;
        if self.layout.bytes > self.target.size() {
            return too_large("the arrays of all views", "bytes", self.layout.bytes, self.target.size());
        }
        if views > self.layout.views {
            return too_large("the views of a capture", "views", views as u64, self.layout.views as u64);
        }
        Ok(())
    }
}

/// Textures of a batch that are packed.
#[derive(Debug)]
pub(crate) struct PackedTextures {
    /// Pictures as stored, without the conversion from sRGB; `None` where there are none. So are the others.
    pub pictures: Option<wgpu::TextureView>,
    pub depths: Option<wgpu::TextureView>,
    pub ids: Option<wgpu::TextureView>,
    /// Pictures lie one below the other in a single layer.
    pub is_tall: bool,
}

/// `PackedBatch` of shaders/pack.wgsl.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct PackedBatch {
    size: [u32; 2],
    quads: u32,
    is_tall: u32,
    color: u32,
    depth: u32,
    instance: u32,
    part: u32,
    class: u32,
    depth_steps: u32,
}

/// `PackedView` of shaders/pack.wgsl.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct PackedView {
    z: [f32; 2],
    w: [f32; 2],
    place: u32,
    labels: u32,
    label_count: u32,
    unused: u32,
}

/// Pipeline of the pack pass.
#[derive(Debug)]
pub(crate) struct Packer {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
    /// In the place of what a batch has not drawn.
    nothing: [wgpu::TextureView; 3],
}

impl Packer {
    pub fn new(device: &wgpu::Device) -> Self {
        let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
        let layers = |sample_type| wgpu::BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2Array,
            multisampled: false,
        };
        let read = buffer(wgpu::BufferBindingType::Storage { read_only: true });
        let types = [
            buffer(wgpu::BufferBindingType::Uniform),
            read,
            read,
            layers(wgpu::TextureSampleType::Float { filterable: false }),
            layers(wgpu::TextureSampleType::Depth),
            layers(wgpu::TextureSampleType::Uint),
            buffer(wgpu::BufferBindingType::Storage { read_only: false }),
            read,
        ];
        let entry = |(binding, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty,
            count: None,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("pack"),
            entries: &(0..).zip(types).map(entry).collect::<Vec<_>>(),
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("pack"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let source = wgpu::ShaderSource::Wgsl(shaders::PACK.into());
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("pack.wgsl"), source });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("pack"),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some("pack"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let nothing = [PICTURE_AS_STORED, DEPTH_FORMAT, ID_FORMAT]
            .map(|format| layers_view(&texture(device, "nothing", (1, 1), format, 1, BOUND), None));
        Self { layout, pipeline, nothing }
    }

    /// Encodes the pass for a batch. `views`: by layer, how to get from clip to view space, and the place in the
    /// arrays.
    pub fn encode(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        textures: &PackedTextures,
        views: impl Iterator<Item = (Mat4, usize)>,
        Packing { layout, target, labels, scale }: &Packing<'_>,
    ) {
        let mut rows = Vec::new();
        let view = |(view_from_clip, place): (Mat4, usize)| {
            let own = labels.get(place).map_or(&[][..], Vec::as_slice);
            let first = rows.len() as u32;
            if textures.ids.is_some() {
                rows.extend_from_slice(own);
            }
            // Of (0, 0, depth, 1), as for the CPU (`metres` of views/outputs.rs).
            let (depth, one) = (view_from_clip.z_axis, view_from_clip.w_axis);
            PackedView {
                z: [depth.z, one.z],
                w: [depth.w, one.w],
                place: place as u32,
                labels: first,
                label_count: rows.len() as u32 - first,
                unused: 0,
            }
        };
        let views: Vec<PackedView> = views.map(view).collect();
        if rows.is_empty() {
            rows.push(PackedLabels::default());
        }
        let start = |array, is_drawn: bool| {
            let start = layout.start(array).filter(|_| is_drawn);
            start.map_or(NOT_PACKED, |bytes| (bytes / 4) as u32)
        };
        let (has_pictures, has_ids) = (textures.pictures.is_some(), textures.ids.is_some());
        let batch = PackedBatch {
            size: layout.size.into(),
            quads: layout.quads() as u32,
            is_tall: textures.is_tall.into(),
            color: start(PackedArray::Color, has_pictures),
            depth: start(PackedArray::Depth, textures.depths.is_some()),
            instance: start(PackedArray::Instance, has_ids),
            part: start(PackedArray::Part, has_ids),
            class: start(PackedArray::Class, has_ids),
            depth_steps: start(PackedArray::DepthSteps, textures.depths.is_some()),
        };
        let buffer = |label, contents, usage| {
            gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
        };
        let batch = buffer("packed batch", bytemuck::bytes_of(&batch), wgpu::BufferUsages::UNIFORM);
        let records = buffer("packed views", bytemuck::cast_slice(&views), wgpu::BufferUsages::STORAGE);
        let rows = buffer("labels", bytemuck::cast_slice(&rows), wgpu::BufferUsages::STORAGE);
        // A buffer has to have a step; no depth passes this one.
        let scale = if scale.is_empty() { &[f32::INFINITY] } else { *scale };
        let scale = buffer("depth scale", bytemuck::cast_slice(scale), wgpu::BufferUsages::STORAGE);
        let [no_pictures, no_depths, no_ids] = &self.nothing;
        // Of a larger buffer no more than that may be bound.
        let size = std::num::NonZero::new(layout.bytes.next_multiple_of(4));
        let written = wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer: target, offset: 0, size });
        let resources = [
            batch.as_entire_binding(),
            records.as_entire_binding(),
            rows.as_entire_binding(),
            wgpu::BindingResource::TextureView(textures.pictures.as_ref().unwrap_or(no_pictures)),
            wgpu::BindingResource::TextureView(textures.depths.as_ref().unwrap_or(no_depths)),
            wgpu::BindingResource::TextureView(textures.ids.as_ref().unwrap_or(no_ids)),
            written,
            scale.as_entire_binding(),
        ];
        let entries: Vec<_> =
            (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("pack"),
            layout: &self.layout,
            entries: &entries,
        });
        let workgroups = layout.quads().div_ceil(TOGETHER.into()) as u32;
        let label = wgpu::ComputePassDescriptor { label: Some("pack"), timestamp_writes: None };
        let mut pass = encoder.begin_compute_pass(&label);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(workgroups.min(ROW), workgroups.div_ceil(ROW), views.len() as u32);
    }
}

/// Pictures whose bytes are read as they are.
pub(crate) const PICTURE_AS_STORED: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const BOUND: wgpu::TextureUsages = wgpu::TextureUsages::TEXTURE_BINDING;

/// A view of all layers; `format`: another one than the texture's own.
pub(crate) fn layers_view(texture: &wgpu::Texture, format: Option<wgpu::TextureFormat>) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        label: Some("layers"),
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        format,
        usage: Some(BOUND),
        ..wgpu::TextureViewDescriptor::default()
    })
}
