//! Records that lie apart in a table, uploaded together: where objects here and there have moved, a call for each would
//! cost more than all else. The records go into a buffer in one call, and shaders/scatter.wgsl puts them in their
//! places at the beginning of the frame's commands.

use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::error::RenderError;
use crate::renderer::gpu::growing_buffer::GrowingBuffer;
use crate::renderer::gpu::shaders;
use std::collections::BTreeMap;
use std::ops::Range;
use systems::ecs::tables::{DirtySlots, Records};

/// Fewer ranges than this are written by a call each.
pub(crate) const MANY_RANGES: usize = 32;

/// Workgroups in a row of a dispatch; `ROW` of shaders/scatter.wgsl.
pub(crate) const ROW: u32 = 32768;
/// Texels that a workgroup writes.
pub(crate) const TEXELS_TOGETHER: u32 = 64;

/// Scatter pipelines that all tables share, by the texels of a record.
#[derive(Debug)]
pub(crate) struct Scatter {
    layout: wgpu::BindGroupLayout,
    pipeline_layout: wgpu::PipelineLayout,
    module: wgpu::ShaderModule,
    pipelines: BTreeMap<u32, wgpu::ComputePipeline>,
}

/// The buffers of one table.
#[derive(Debug)]
pub(crate) struct ScatterBuffers {
    places: GrowingBuffer,
    texels: GrowingBuffer,
    pending: Option<Pending>,
}

/// Dispatch that is yet to be encoded.
#[derive(Debug)]
struct Pending {
    group: wgpu::BindGroup,
    record_texels: u32,
    workgroups: u32,
}

impl Scatter {
    pub fn new(device: &wgpu::Device) -> Self {
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty,
            count: None,
        };
        let storage = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: true },
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let table = wgpu::BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::WriteOnly,
            format: wgpu::TextureFormat::Rgba32Uint,
            view_dimension: wgpu::TextureViewDimension::D2,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("scatter"),
            entries: &[entry(0, storage), entry(1, storage), entry(2, table)],
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("scatter"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let source = wgpu::ShaderSource::Wgsl(shaders::SCATTER.into());
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("scatter.wgsl"), source });
        Self { layout, pipeline_layout, module, pipelines: BTreeMap::new() }
    }

    /// Makes the pipeline for records of that many texels unless it exists.
    fn make(&mut self, device: &wgpu::Device, record_texels: u32) {
        self.pipelines.entry(record_texels).or_insert_with(|| {
            let constants = [("TEXELS", f64::from(record_texels))];
            let options = wgpu::PipelineCompilationOptions {
                constants: &constants,
                ..wgpu::PipelineCompilationOptions::default()
            };
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some("scatter"),
                layout: Some(&self.pipeline_layout),
                module: &self.module,
                entry_point: Some("scatter"),
                compilation_options: options,
                cache: None,
            })
        });
    }
}

/// Beginning of a table: a texel of a texture.
pub(crate) struct Place<'a> {
    pub texture: &'a wgpu::TextureView,
    pub start: u32,
}

impl ScatterBuffers {
    pub fn new(device: &wgpu::Device) -> Self {
        let buffer = |label| GrowingBuffer::new(device, label, wgpu::BufferUsages::STORAGE);
        Self { places: buffer("places of records"), texels: buffer("scattered records"), pending: None }
    }

    /// Uploads the records in `ranges` of a table that begins at a place; [`Self::encode`] puts them in
    /// their places. Returns the bytes written.
    pub fn write<R: Records + ?Sized>(
        &mut self,
        gpu: &Gpu,
        scatter: &mut Scatter,
        Place { texture, start }: Place<'_>,
        records: &R,
        ranges: &[Range<u32>],
        room: &mut Vec<R::Record>,
    ) -> Result<u64, RenderError> {
        let record_texels = (size_of::<R::Record>() / 16) as u32;
        let places: Vec<u32> = ranges.iter().cloned().flatten().map(|slot| start + slot * record_texels).collect();
        let together = records.read(ranges, room);
        let all = DirtySlots::default();
        let bytes = self.places.write(gpu, &places, &all, true)? + self.texels.write(gpu, together, &all, true)?;
        let texels = (size_of_val(together) / 16) as u32;
        scatter.make(&gpu.device, record_texels);
        // No more than what was written: the shader takes the number of texels from it.
        let places = part(&self.places, size_of_val(&places[..]));
        let together = part(&self.texels, size_of_val(together));
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("scatter"),
            layout: &scatter.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: places },
                wgpu::BindGroupEntry { binding: 1, resource: together },
                wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::TextureView(texture) },
            ],
        });
        self.pending = Some(Pending { group, record_texels, workgroups: texels.div_ceil(TEXELS_TOGETHER) });
        Ok(bytes)
    }

    /// Tells if a dispatch is yet to be encoded.
    pub fn is_pending(&self) -> bool {
        self.pending.is_some()
    }

    /// Puts what is pending in its place now, before anything newer: a frame was prepared and not drawn.
    pub fn flush(&mut self, gpu: &Gpu, scatter: &Scatter) {
        if self.is_pending() {
            let label = wgpu::CommandEncoderDescriptor { label: Some("scatter") };
            let mut encoder = gpu.device.create_command_encoder(&label);
            self.encode(scatter, &mut encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default()));
            gpu.queue.submit([encoder.finish()]);
        }
    }

    /// Encodes what is pending.
    pub fn encode(&mut self, scatter: &Scatter, pass: &mut wgpu::ComputePass<'_>) {
        let Some(pending) = self.pending.take() else { return };
        let Some(pipeline) = scatter.pipelines.get(&pending.record_texels) else { return };
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &pending.group, &[]);
        pass.dispatch_workgroups(pending.workgroups.min(ROW), pending.workgroups.div_ceil(ROW), 1);
    }
}

fn part(buffer: &GrowingBuffer, bytes: usize) -> wgpu::BindingResource<'_> {
    let size = wgpu::BufferSize::new(bytes as u64);
    wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer: buffer.buffer(), offset: 0, size })
}
