//! Which objects a view draws, found on the GPU: shaders/cull.wgsl tests every slot against the view and writes the
//! lists of visible slots and the arguments of the indirect draws. The CPU does the same few calls however many objects
//! there are, and learns the counts only if it asks for them.

use super::draws::Draws;
use super::tables::GrowingBuffer;
use super::timestamps::Timestamps;
use super::{Gpu, RenderError, shaders};
use bytemuck::{Pod, Zeroable};
use systems::draw_list::{DirtySlots, PAGE_SLOTS};
use systems::view::View;
use wgpu::util::DrawIndexedIndirectArgs;

/// Mirrors `Cull` of shaders/cull.wgsl.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug, Default, Pod, Zeroable)]
pub struct CullRecord {
    /// Of the view's frustum, world space: inward unit normal and offset.
    pub planes: [[f32; 4]; 6],
    /// Pages of instances.
    pub page_count: u32,
    /// Pages as the draws see them.
    pub entry_count: u32,
    /// Indirect draws.
    pub draw_count: u32,
    /// Room for 16-byte alignment.
    pub pad0: u32,
}

/// The pipelines of the culling pass.
#[derive(Debug)]
pub(super) struct Culling {
    layout: wgpu::BindGroupLayout,
    cull: wgpu::ComputePipeline,
    count: wgpu::ComputePipeline,
    scan: wgpu::ComputePipeline,
    scatter: wgpu::ComputePipeline,
    finish: wgpu::ComputePipeline,
}

/// What culling keeps for one view.
#[derive(Debug)]
pub(super) struct CulledView {
    record: wgpu::Buffer,
    visibility: GrowingBuffer,
    kept: GrowingBuffer,
    /// Slots, a list per draw.
    pub visible: GrowingBuffer,
    /// One [`DrawIndexedIndirectArgs`] per draw.
    pub arguments: GrowingBuffer,
    group: Option<(u32, wgpu::BindGroup)>,
    counts: CullRecord,
}

/// Bytes of one draw's arguments.
pub(super) const ARGUMENT_BYTES: u64 = size_of::<DrawIndexedIndirectArgs>() as u64;

/// Workgroups in a row of a dispatch; `ROW` of shaders/cull.wgsl.
const ROW: u32 = 32768;

impl Culling {
    pub fn new(device: &wgpu::Device, frame_layout: &wgpu::BindGroupLayout) -> Self {
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
            count: None,
        };
        let storage = |read_only| wgpu::BufferBindingType::Storage { read_only };
        let entries: Vec<_> = std::iter::once(entry(0, wgpu::BufferBindingType::Uniform))
            .chain((1..=4).map(|binding| entry(binding, storage(true))))
            .chain((5..=8).map(|binding| entry(binding, storage(false))))
            .collect();
        let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some("culling"), entries: &entries };
        let layout = device.create_bind_group_layout(&descriptor);
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("culling"),
            bind_group_layouts: &[Some(frame_layout), Some(&layout)],
            immediate_size: 0,
        });
        let source = wgpu::ShaderSource::Wgsl(shaders::CULL.into());
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("cull.wgsl"), source });
        let pipeline = |entry_point| {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry_point),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(entry_point),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            })
        };
        Self {
            cull: pipeline("cull"),
            count: pipeline("count"),
            scan: pipeline("scan"),
            scatter: pipeline("scatter"),
            finish: pipeline("finish"),
            layout,
        }
    }

    /// Records the culling of views, each with the frame group of its tables and eye.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        timestamps: Option<&Timestamps>,
        views: &[(&CulledView, &wgpu::BindGroup)],
    ) {
        for (view, frame_group) in views {
            let Some((_, group)) = &view.group else { continue };
            let (pages, entries) = (view.counts.page_count, view.counts.entry_count);
            if entries == 0 {
                continue;
            }
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("culling"),
                timestamp_writes: timestamps.and_then(|timestamps| timestamps.compute_pass("culling")),
            });
            pass.set_bind_group(0, *frame_group, &[]);
            pass.set_bind_group(1, group, &[]);
            let draws = view.counts.draw_count.div_ceil(64);
            let work = [
                (&self.cull, pages),
                (&self.count, entries),
                (&self.scan, 1),
                (&self.scatter, entries),
                (&self.finish, draws),
            ];
            for (pipeline, workgroups) in work {
                pass.set_pipeline(pipeline);
                pass.dispatch_workgroups(workgroups.min(ROW), workgroups.div_ceil(ROW), 1);
            }
        }
    }
}

impl CulledView {
    pub fn new(device: &wgpu::Device) -> Self {
        use wgpu::BufferUsages;
        let buffer = |label, usage| GrowingBuffer::new(device, label, BufferUsages::STORAGE | usage);
        Self {
            record: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("culled view"),
                size: size_of::<CullRecord>() as u64,
                usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            visibility: buffer("visibility", BufferUsages::empty()),
            kept: buffer("kept slots", BufferUsages::empty()),
            visible: buffer("visible slots", BufferUsages::VERTEX),
            arguments: buffer("draw arguments", BufferUsages::INDIRECT),
            group: None,
            counts: CullRecord::default(),
        }
    }

    /// Gets ready for the draws as they are now, and for a view. `redrawn`: the draws changed.
    pub fn prepare(
        &mut self,
        gpu: &Gpu,
        culling: &Culling,
        draws: &Draws,
        view: &View,
        redrawn: bool,
    ) -> Result<(), RenderError> {
        let entries = u64::from(draws.entry_count);
        self.visibility.reserve(&gpu.device, u64::from(draws.slot_count) * 4)?;
        self.kept.reserve(&gpu.device, (entries + 1) * 16)?;
        self.visible.reserve(&gpu.device, entries * u64::from(PAGE_SLOTS) * 4)?;
        if redrawn {
            let bytes: Vec<u32> = draws.arguments.iter().flat_map(argument_words).collect();
            self.arguments.write(gpu, &bytes, &DirtySlots::default(), true)?;
        }
        let record = CullRecord {
            planes: view.frustum_planes().map(|plane| plane.to_array()),
            page_count: draws.page_count,
            entry_count: draws.entry_count,
            draw_count: draws.list.len() as u32,
            pad0: 0,
        };
        if self.counts != record {
            gpu.queue.write_buffer(&self.record, 0, bytemuck::bytes_of(&record));
            self.counts = record;
        }
        self.bind(&gpu.device, culling, draws);
        Ok(())
    }

    fn bind(&mut self, device: &wgpu::Device, culling: &Culling, draws: &Draws) {
        let own = [&self.visibility, &self.kept, &self.visible, &self.arguments];
        let buffers: Vec<&GrowingBuffer> = draws.buffers().into_iter().chain(own).collect();
        let version = buffers.iter().map(|buffer| buffer.version).sum();
        if self.group.as_ref().is_some_and(|(bound, _)| *bound == version) {
            return;
        }
        let entries: Vec<_> = std::iter::once(&self.record)
            .chain(buffers.iter().map(|buffer| buffer.buffer()))
            .enumerate()
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding: binding as u32,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let descriptor =
            wgpu::BindGroupDescriptor { label: Some("culled view"), layout: &culling.layout, entries: &entries };
        self.group = Some((version, device.create_bind_group(&descriptor)));
    }
}

fn argument_words(arguments: &DrawIndexedIndirectArgs) -> [u32; 5] {
    let DrawIndexedIndirectArgs { index_count, instance_count, first_index, base_vertex, first_instance } = *arguments;
    [index_count, instance_count, first_index, base_vertex as u32, first_instance]
}
