//! The debug view of cells: a pass over what is drawn, which tints it by cells and draws the outlines of portals. Made
//! when it is first asked for.

use super::pipelines::{Shader, depth_state, fullscreen, pipeline_layout, shader_module};
use super::targets::Targets;
use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::formats::HDR_FORMAT;
use crate::renderer::gpu::shaders;
use crate::renderer::gpu::timestamps::Timestamps;
use crate::renderer::plan::settings::DebugView;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use systems::cells::{Cells, OUTSIDE};
use wgpu::util::DeviceExt;

/// An edge of a portal; mirrors `Edge` of shaders/cells.wgsl.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug, Pod, Zeroable)]
struct Edge {
    start: [f32; 3],
    end: [f32; 3],
    color: [f32; 3],
}

/// The opacity of outlines that something hides.
const HIDDEN_OPACITY: f64 = 0.25;

/// The pass, for some number of samples.
#[derive(Debug)]
struct CellPipelines {
    samples: u32,
    layout: wgpu::BindGroupLayout,
    tint: wgpu::RenderPipeline,
    /// Hidden ones, and those in sight.
    outlines: [wgpu::RenderPipeline; 2],
}

/// Resources of the cell pass of one view.
#[derive(Debug)]
pub(crate) struct CellView {
    pipelines: CellPipelines,
    cells: Vec<[f32; 4]>,
    edges: Vec<Edge>,
    edge_buffer: wgpu::Buffer,
    depth: wgpu::TextureView,
    group: wgpu::BindGroup,
}

impl CellView {
    /// Makes what the debug view needs of a world's cells, with portals that are so far open; what is there already is
    /// kept. Returns whether the picture is another than before.
    pub fn fit(
        view: &mut Option<Self>,
        gpu: &Gpu,
        frame_layout: &wgpu::BindGroupLayout,
        targets: Option<&Targets>,
        cells: Option<(&Cells, &[f32])>,
    ) -> bool {
        let (Some(targets), Some((cells, open))) = (targets, cells) else { return view.take().is_some() };
        let (records, edges) = (cell_records(cells, targets), edges(cells, open));
        let is_same = |view: &Self| view.depth == targets.depth && view.cells == records && view.edges == edges;
        if view.as_ref().is_some_and(is_same) {
            return false;
        }
        let device = &gpu.device;
        let pipelines = view.take().map(|view| view.pipelines).filter(|kept| kept.samples == targets.samples);
        let pipelines = pipelines.unwrap_or_else(|| CellPipelines::new(device, frame_layout, targets.samples));
        let buffer = |label, contents, usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
        };
        let cell_buffer = buffer("cells", bytemuck::cast_slice(&records), wgpu::BufferUsages::STORAGE);
        let edge_buffer = buffer("edges of portals", bytemuck::cast_slice(&edges), wgpu::BufferUsages::VERTEX);
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("cells"),
            layout: &pipelines.layout,
            entries: &[
                entry(depth_binding(targets.samples), wgpu::BindingResource::TextureView(&targets.depth)),
                entry(2, cell_buffer.as_entire_binding()),
            ],
        });
        let depth = targets.depth.clone();
        *view = Some(Self { pipelines, cells: records, edges, edge_buffer, depth, group });
        true
    }

    /// Encodes the pass, with the frame group of its view, over what is drawn into the view's targets.
    pub fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        timestamps: Option<&Timestamps>,
        color: &wgpu::TextureView,
        frame_group: &wgpu::BindGroup,
    ) {
        let ops = wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store };
        // Depths are read, too, and so not written.
        let depth = wgpu::RenderPassDepthStencilAttachment { view: &self.depth, depth_ops: None, stencil_ops: None };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("cells"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: color,
                depth_slice: None,
                resolve_target: None,
                ops,
            })],
            depth_stencil_attachment: Some(depth),
            timestamp_writes: timestamps.and_then(|timestamps| timestamps.render_pass("cells")),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_bind_group(0, frame_group, &[]);
        pass.set_bind_group(1, &self.group, &[]);
        pass.set_pipeline(&self.pipelines.tint);
        pass.draw(0..3, 0..1);
        if !self.edges.is_empty() {
            pass.set_vertex_buffer(0, self.edge_buffer.slice(..));
            for outlines in &self.pipelines.outlines {
                pass.set_pipeline(outlines);
                pass.draw(0..6, 0..self.edges.len() as u32);
            }
        }
    }
}

/// The picture's size, and the colours and planes of all cells, as shaders/cells.wgsl reads them.
fn cell_records(cells: &Cells, targets: &Targets) -> Vec<[f32; 4]> {
    let mut records = vec![[targets.width as f32, targets.height as f32, 0.0, 0.0]];
    for (cell, number) in cells.cells().iter().zip(OUTSIDE + 1..) {
        let planes = cell.planes();
        records.push(DebugView::cell_color(number).extend(planes.len() as f32).to_array());
        records.extend(planes.iter().map(|plane| plane.normal.extend(-plane.offset).to_array()));
    }
    records
}

/// Those of all portals.
fn edges(cells: &Cells, open: &[f32]) -> Vec<Edge> {
    let mut edges = Vec::new();
    for (i, opening) in cells.openings().iter().enumerate() {
        let is_open = open.get(i).is_none_or(|&open| open > 0.0);
        let color: Vec3 = if is_open { DebugView::OPEN_PORTAL } else { DebugView::SHUT_PORTAL };
        let ends = opening.polygon.iter().zip(opening.polygon.iter().cycle().skip(1));
        let edge = |(a, b): (&Vec3, &Vec3)| Edge { start: a.to_array(), end: b.to_array(), color: color.to_array() };
        edges.extend(ends.map(edge));
    }
    edges
}

/// Binding of the depths in shaders/cells.wgsl.
fn depth_binding(samples: u32) -> u32 {
    u32::from(samples > 1)
}

impl CellPipelines {
    fn new(device: &wgpu::Device, frame_layout: &wgpu::BindGroupLayout, samples: u32) -> Self {
        let multisampled = samples > 1;
        let entry = |binding, visibility, ty| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
        let depth = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Depth,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled,
        };
        let cells = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: true },
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("cells"),
            entries: &[
                entry(depth_binding(samples), wgpu::ShaderStages::FRAGMENT, depth),
                entry(2, wgpu::ShaderStages::VERTEX_FRAGMENT, cells),
            ],
        });
        let groups = pipeline_layout(device, "cells", &[Some(frame_layout), Some(&layout)]);
        let module = shader_module(device, "cells.wgsl", shaders::CELLS);
        let target = |blend| {
            let write_mask = wgpu::ColorWrites::COLOR;
            [Some(wgpu::ColorTargetState { format: HDR_FORMAT, blend: Some(blend), write_mask })]
        };
        let product = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::Dst,
            dst_factor: wgpu::BlendFactor::Zero,
            operation: wgpu::BlendOperation::Add,
        };
        let tint = fullscreen(
            device,
            "cells",
            &groups,
            Shader {
                module: &module,
                vertex: "vs_tint",
                fragment: if multisampled { "fs_tint_multisampled" } else { "fs_tint_single" },
            },
            &[],
            &target(wgpu::BlendState { color: product, alpha: wgpu::BlendComponent::REPLACE }),
            Some(depth_state(false, wgpu::CompareFunction::Always)),
            samples,
        );
        let outlines = [(wgpu::CompareFunction::Less, HIDDEN_OPACITY), (wgpu::CompareFunction::GreaterEqual, 1.0)];
        let outlines = outlines.map(|(compare, opacity)| {
            let constants = [("OPACITY", opacity)];
            let compilation_options =
                wgpu::PipelineCompilationOptions { constants: &constants, zero_initialize_workgroup_memory: false };
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("outlines of portals"),
                layout: Some(&groups),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("vs_outline"),
                    compilation_options: compilation_options.clone(),
                    buffers: &[Some(wgpu::VertexBufferLayout {
                        array_stride: size_of::<Edge>() as u64,
                        step_mode: wgpu::VertexStepMode::Instance,
                        attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x3],
                    })],
                },
                primitive: wgpu::PrimitiveState::default(),
                depth_stencil: Some(depth_state(false, compare)),
                multisample: wgpu::MultisampleState { count: samples, ..wgpu::MultisampleState::default() },
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some("fs_outline"),
                    compilation_options,
                    targets: &target(wgpu::BlendState::ALPHA_BLENDING),
                }),
                multiview_mask: None,
                cache: None,
            })
        });
        Self { samples, layout, tint, outlines }
    }
}
