//! Culling of a view's objects on the GPU. shaders/cull.wgsl tests every slot against the view. It writes the lists of
//! visible slots, near ones first, and the arguments of the indirect draws. The CPU does the same few calls however
//! many objects there are, and learns the counts only if it asks for them.
//!
//! With occlusion there are two sets of lists: of the objects that were seen when the view was last drawn, and of those
//! that the depths of the first show to be in sight as well.

use super::indirect_draws::{IndirectDraws, IndirectDrawsVersion};
use super::pyramid::Pyramid;
use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::error::RenderError;
use crate::renderer::gpu::growing_buffer::GrowingBuffer;
use crate::renderer::gpu::shaders;
use crate::renderer::gpu::texture::{texture, whole_view};
use crate::renderer::gpu::timestamps::Timestamps;
use crate::renderer::plan::view_plan::ViewPlan;
use bytemuck::{Pod, Zeroable};
use std::ops::Range;
use systems::cells::{Cells, Sight};
use systems::draw::{PAGE_SLOTS, Projection};
use systems::ecs::tables::DirtySlots;
use wgpu::util::DrawIndexedIndirectArgs;

/// Mirrors `Cull` of shaders/cull.wgsl.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug, Default, Pod, Zeroable)]
pub struct CullRecord {
    /// Planes of the view's frustum, world space: inward unit normal and offset.
    pub planes: [[f32; 4]; 6],
    /// Pages of instances.
    pub page_count: u32,
    /// Pages as the draws see them.
    pub entry_count: u32,
    /// Indirect draws.
    pub draw_count: u32,
    /// 1: objects are drawn in two phases.
    pub occlusion: u32,
    /// Size of the picture, pixels.
    pub size: [f32; 2],
    /// Levels of the depth pyramid.
    pub pyramid_levels: u32,
    /// Metres that a level of detail may be off: where the projection is parallel; else, at a distance of one metre.
    pub allowed_error: f32,
    /// Per pixel: 1 or 4.
    pub samples: u32,
    /// Largest distance that the rasteriser may move a vertex, pixels ([`Gpu::vertex_rounding`]).
    pub vertex_rounding: f32,
    /// Offset of a draw's list of visible slots in the late phase from that in the early one. It is used where indirect
    /// draws must begin at the first instance. Else 0: the one follows the other at once.
    pub late_offset: u32,
    /// Room for 16-byte alignment.
    pub pad0: u32,
}

/// One half of a frame's draws.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Phase {
    /// Objects seen when the view was last drawn; without occlusion, everything in view.
    Early,
    /// Other objects in sight.
    Late,
}

/// The pipelines of the culling pass.
#[derive(Clone, Debug)]
pub(crate) struct Culling {
    layout: wgpu::BindGroupLayout,
    module: wgpu::ShaderModule,
    pipeline_layout: wgpu::PipelineLayout,
    cull: wgpu::ComputePipeline,
    /// In worlds with cells, once there was one.
    cull_by_cells: Option<wgpu::ComputePipeline>,
    occlude: wgpu::ComputePipeline,
    /// By [`Phase`].
    count: [wgpu::ComputePipeline; 2],
    /// By [`Phase`].
    scatter: [wgpu::ComputePipeline; 2],
    scan_blocks: wgpu::ComputePipeline,
    scan_totals: wgpu::ComputePipeline,
    /// By [`Phase`].
    finish: [wgpu::ComputePipeline; 2],
    /// Stands for the depth pyramid where there is none.
    no_pyramid: wgpu::TextureView,
    /// [`Gpu::vertex_rounding`].
    vertex_rounding: f32,
    /// Indirect draws can begin at another instance than the first.
    first_instance: bool,
}

/// Indirect draws of one phase.
#[derive(Debug)]
pub(crate) struct PhaseDraws {
    /// One [`DrawIndexedIndirectArgs`] per element of [`IndirectDraws::list`].
    pub arguments: GrowingBuffer,
    /// With what it was made for: draws with levels of detail or without, and the versions of its buffers.
    group: Option<((bool, u32), wgpu::BindGroup)>,
}

/// Draws of a view that the CPU has found.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct DirectDraws {
    /// Slots, draw by draw, as the vertex shader reads them.
    pub slots: Vec<u32>,
    /// By draw: its part of `slots`.
    pub ranges: Vec<Range<u32>>,
}

/// Culling state of one view.
#[derive(Debug)]
pub(crate) struct CulledView {
    record: wgpu::Buffer,
    visibility: GrowingBuffer,
    slice_counts: GrowingBuffer,
    /// Visible slots, a list per draw and phase.
    visible: GrowingBuffer,
    /// By [`Phase`].
    phases: [PhaseDraws; 2],
    pyramid: Option<Pyramid>,
    counts: CullRecord,
    /// Sight of the eye through a world's cells; `None` without any.
    sight: Option<Sight>,
    sight_planes: wgpu::Buffer,
    /// The draws that the lists were made for.
    draws: IndirectDrawsVersion,
    /// Draws found by the CPU in place of the GPU.
    direct: Option<DirectDraws>,
}

/// Bytes of one draw's arguments.
pub(crate) const ARGUMENT_BYTES: u64 = size_of::<DrawIndexedIndirectArgs>() as u64;

/// Workgroups in a row of a dispatch; `ROW` of shaders/cull.wgsl.
pub(crate) const ROW: u32 = 32768;
/// Pages or entries that a workgroup takes; `TOGETHER` of shaders/cull.wgsl.
pub(crate) const TOGETHER: u32 = 8;
/// Slices of distance; `SLICES` of shaders/cull.wgsl.
pub(crate) const SLICES: u32 = 32;
/// Counts that are added up together; `BLOCK` of shaders/cull.wgsl.
pub(crate) const BLOCK: u32 = 1024;
/// Draws that a workgroup of `finish` takes.
pub(crate) const DRAWS_TOGETHER: u32 = 64;

/// Blocks that the counts of so many entries fill, the sum of all among them.
fn blocks(entries: u32) -> u32 {
    entries * SLICES / BLOCK + 1
}

impl Culling {
    pub fn new(gpu: &Gpu, frame_layout: &wgpu::BindGroupLayout) -> Self {
        let device = &gpu.device;
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
            count: None,
        };
        let storage = |read_only| wgpu::BufferBindingType::Storage { read_only };
        let pyramid = wgpu::BindGroupLayoutEntry {
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: false },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            ..entry(9, wgpu::BufferBindingType::Uniform)
        };
        let entries: Vec<_> = std::iter::once(entry(0, wgpu::BufferBindingType::Uniform))
            .chain((1..=4).map(|binding| entry(binding, storage(true))))
            .chain((5..=8).map(|binding| entry(binding, storage(false))))
            .chain([pyramid, entry(10, wgpu::BufferBindingType::Uniform)])
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
        let pipeline = |entry_point, phase: Phase| {
            make_pipeline(device, &pipeline_layout, &module, entry_point, &[("PHASE", phase.bit())])
        };
        let usage = wgpu::TextureUsages::TEXTURE_BINDING;
        let no_pyramid = texture(device, "no pyramid", (1, 1), wgpu::TextureFormat::R32Float, 1, usage);
        Self {
            cull: pipeline("cull", Phase::Early),
            cull_by_cells: None,
            occlude: pipeline("occlude", Phase::Late),
            count: [Phase::Early, Phase::Late].map(|phase| pipeline("count", phase)),
            scan_blocks: pipeline("scan_blocks", Phase::Early),
            scan_totals: pipeline("scan_totals", Phase::Early),
            scatter: [Phase::Early, Phase::Late].map(|phase| pipeline("scatter", phase)),
            finish: [Phase::Early, Phase::Late].map(|phase| pipeline("finish", phase)),
            no_pyramid: whole_view(&no_pyramid, "no pyramid"),
            vertex_rounding: gpu.vertex_rounding(),
            first_instance: device.features().contains(wgpu::Features::INDIRECT_FIRST_INSTANCE),
            layout,
            module,
            pipeline_layout,
        }
    }

    /// Gets ready for a world with cells.
    pub fn make_for_cells(&mut self, device: &wgpu::Device) {
        let constants = [("PHASE", Phase::Early.bit()), ("CELLS", 1.0)];
        let Self { pipeline_layout, module, cull_by_cells, .. } = self;
        cull_by_cells.get_or_insert_with(|| make_pipeline(device, pipeline_layout, module, "cull", &constants));
    }

    /// Encodes a phase of the culling of a view, with the frame group of its tables and eye. The late phase reads the
    /// depths that the early one left.
    pub fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        timestamps: Option<&Timestamps>,
        phase: Phase,
        view: &CulledView,
        frame_group: &wgpu::BindGroup,
    ) {
        let (name, test) = match phase {
            Phase::Early if view.sight.is_some() => ("culling", self.cull_by_cells.as_ref().unwrap_or(&self.cull)),
            Phase::Early => ("culling", &self.cull),
            Phase::Late => ("occlusion", &self.occlude),
        };
        let Some((_, group)) = &view.phases[phase as usize].group else { return };
        let (pages, entries) = (view.counts.page_count, view.counts.entry_count);
        if entries == 0 {
            return;
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(name),
            timestamp_writes: timestamps.and_then(|timestamps| timestamps.compute_pass(name)),
        });
        pass.set_bind_group(0, frame_group, &[]);
        pass.set_bind_group(1, group, &[]);
        let draws = view.counts.draw_count.div_ceil(DRAWS_TOGETHER);
        let tests = if phase == Phase::Early { pages } else { pages.div_ceil(TOGETHER) };
        let taken = entries.div_ceil(TOGETHER);
        let work = [
            (test, tests),
            (&self.count[phase as usize], taken),
            (&self.scan_blocks, blocks(entries)),
            (&self.scan_totals, 1),
            (&self.scatter[phase as usize], taken),
            (&self.finish[phase as usize], draws),
        ];
        for (pipeline, workgroups) in work {
            pass.set_pipeline(pipeline);
            pass.dispatch_workgroups(workgroups.min(ROW), workgroups.div_ceil(ROW), 1);
        }
    }
}

fn make_pipeline(
    device: &wgpu::Device,
    layout: &wgpu::PipelineLayout,
    module: &wgpu::ShaderModule,
    entry_point: &str,
    constants: &[(&str, f64)],
) -> wgpu::ComputePipeline {
    let options = wgpu::PipelineCompilationOptions { constants, zero_initialize_workgroup_memory: false };
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry_point),
        layout: Some(layout),
        module,
        entry_point: Some(entry_point),
        compilation_options: options,
        cache: None,
    })
}

impl Phase {
    /// Its bit in the shader's `visibility`.
    pub(crate) fn bit(self) -> f64 {
        match self {
            Self::Early => f64::from(0x200),
            Self::Late => f64::from(0x400),
        }
    }
}

impl CulledView {
    pub fn new(device: &wgpu::Device) -> Self {
        use wgpu::BufferUsages;
        let buffer = |label, usage| GrowingBuffer::new(device, label, BufferUsages::STORAGE | usage);
        let uniform = |label, size: usize| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: size as u64,
                usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        Self {
            record: uniform("culled view", size_of::<CullRecord>()),
            sight: None,
            sight_planes: uniform("sight", Sight::MOST * size_of::<[f32; 4]>()),
            visibility: buffer("visibility of objects", BufferUsages::empty()),
            slice_counts: buffer("counts of visible objects", BufferUsages::empty()),
            visible: buffer("lists of visible objects", BufferUsages::VERTEX),
            phases: ["early draws", "late draws"]
                .map(|label| PhaseDraws { arguments: buffer(label, BufferUsages::INDIRECT), group: None }),
            pyramid: None,
            counts: CullRecord::default(),
            draws: IndirectDrawsVersion::default(),
            direct: None,
        }
    }

    /// Draws that the CPU has found to be visible; `None` where the GPU is asked.
    pub fn direct(&self) -> Option<&DirectDraws> {
        self.direct.as_ref()
    }

    /// The arguments of a phase's draws.
    pub fn arguments(&self, phase: Phase) -> &wgpu::Buffer {
        self.phases[phase as usize].arguments.buffer()
    }

    /// The lists of visible slots, of both phases.
    pub fn visible(&self) -> &wgpu::Buffer {
        self.visible.buffer()
    }

    /// Offset of a phase's lists from those of the early phase, where draws must begin at the first instance; else 0.
    pub fn list_offset(&self, phase: Phase) -> u32 {
        if phase == Phase::Late { self.counts.late_offset } else { 0 }
    }

    /// The depth pyramid, while objects are drawn in two phases.
    pub fn pyramid(&self) -> Option<&Pyramid> {
        self.pyramid.as_ref()
    }

    /// The targets are others: `pyramid` belongs to them, `None` to draw in one phase.
    pub fn set_pyramid(&mut self, pyramid: Option<Pyramid>) {
        self.pyramid = pyramid;
        self.phases.iter_mut().for_each(|phase| phase.group = None);
    }

    /// Takes what the CPU has found. Returns whether it is something else than before.
    pub fn list(&mut self, gpu: &Gpu, found: DirectDraws) -> Result<bool, RenderError> {
        let is_new = self.direct.as_ref() != Some(&found);
        if is_new {
            self.visible.write(gpu, &found.slots, &DirtySlots::default(), true)?;
            self.direct = Some(found);
            // The GPU's lists are gone.
            self.draws = IndirectDrawsVersion::default();
            self.phases.iter_mut().for_each(|phase| phase.group = None);
        }
        Ok(is_new)
    }

    /// Gets ready for the draws as they are now, and for a view. Returns whether the lists that were made before are no
    /// longer right.
    pub fn prepare(
        &mut self,
        gpu: &Gpu,
        culling: &Culling,
        draws: &IndirectDraws,
        ViewPlan { view, settings }: &ViewPlan,
        cells: Option<&Cells>,
    ) -> Result<bool, RenderError> {
        self.direct = None;
        let redrawn = self.draws != draws.version();
        let mut recull = redrawn;
        let entries = u64::from(draws.entry_count);
        self.visibility.reserve(&gpu.device, u64::from(draws.slot_count) * 4)?;
        // A sum behind all blocks for each of them, and a number for each draw.
        let counts = u64::from(blocks(draws.entry_count)) * u64::from(BLOCK + 1) + draws.list.len() as u64;
        self.slice_counts.reserve(&gpu.device, counts * 4)?;
        let phases = if self.pyramid.is_some() { 2 } else { 1 };
        // What is drawn early is not drawn late: both have room where there is room for one, if they may follow each
        // other.
        let lists = if culling.first_instance { 1 } else { phases as u64 };
        self.visible.reserve(&gpu.device, lists * entries * u64::from(PAGE_SLOTS) * 4)?;
        for lists in &mut self.phases[..phases] {
            let lost = lists.arguments.reserve(&gpu.device, draws.list.len() as u64 * ARGUMENT_BYTES)?;
            if redrawn || lost || lists.group.is_none() {
                let words: Vec<u32> = draws.list.iter().flat_map(|draw| argument_words(&draw.indirect)).collect();
                lists.arguments.write(gpu, &words, &DirtySlots::default(), true)?;
                recull = true;
            }
        }
        let record = CullRecord {
            planes: view.frustum_planes().map(|plane| plane.to_array()),
            page_count: draws.page_count,
            entry_count: draws.entry_count,
            draw_count: draws.list.len() as u32,
            occlusion: self.pyramid.is_some().into(),
            size: [view.width as f32, view.height as f32],
            pyramid_levels: self.pyramid.as_ref().map_or(1, Pyramid::level_count),
            allowed_error: settings.levels.allowed_error(view.pixels_at_1m()),
            samples: settings.samples,
            vertex_rounding: culling.vertex_rounding,
            late_offset: if culling.first_instance { 0 } else { draws.entry_count * PAGE_SLOTS },
            ..CullRecord::default()
        };
        if self.counts != record {
            gpu.queue.write_buffer(&self.record, 0, bytemuck::bytes_of(&record));
            self.counts = record;
            recull = true;
        }
        // Where the projection is parallel, no eye is anywhere.
        let is_parallel = matches!(view.camera.projection, Projection::Orthographic { .. });
        let sight = cells.map(|cells| if is_parallel { Sight::everything() } else { Sight::new(cells, view.eye()) });
        if self.sight != sight {
            let planes = sight.as_ref().map_or(&[][..], |sight| &sight.0);
            gpu.queue.write_buffer(&self.sight_planes, 0, bytemuck::cast_slice(planes));
            self.sight = sight;
            recull = true;
        }
        for phase in 0..phases {
            self.bind(&gpu.device, culling, draws, phase);
        }
        self.draws = draws.version();
        Ok(recull)
    }

    fn bind(&mut self, device: &wgpu::Device, culling: &Culling, draws: &IndirectDraws, phase: usize) {
        let lists = &self.phases[phase];
        let own = [&self.visibility, &self.slice_counts, &self.visible, &lists.arguments];
        let buffers: Vec<&GrowingBuffer> = draws.buffers().into_iter().chain(own).collect();
        let version = (draws.with_levels(), buffers.iter().map(|buffer| buffer.version).sum());
        if lists.group.as_ref().is_some_and(|(bound, _)| *bound == version) {
            return;
        }
        let pyramid = self.pyramid.as_ref().map_or(&culling.no_pyramid, |pyramid| &pyramid.view);
        let entries: Vec<_> = std::iter::once(&self.record)
            .chain(buffers.iter().map(|buffer| buffer.buffer()))
            .map(wgpu::Buffer::as_entire_binding)
            .chain([wgpu::BindingResource::TextureView(pyramid), self.sight_planes.as_entire_binding()])
            .enumerate()
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding: binding as u32, resource })
            .collect();
        let descriptor =
            wgpu::BindGroupDescriptor { label: Some("culled view"), layout: &culling.layout, entries: &entries };
        self.phases[phase].group = Some((version, device.create_bind_group(&descriptor)));
    }
}

fn argument_words(arguments: &DrawIndexedIndirectArgs) -> [u32; 5] {
    let DrawIndexedIndirectArgs { index_count, instance_count, first_index, base_vertex, first_instance } = *arguments;
    [index_count, instance_count, first_index, base_vertex as u32, first_instance]
}
