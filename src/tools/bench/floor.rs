//! Cost of the triangles in view by themselves on this adapter. They are one instanced draw with the plainest shader, a
//! matrix and a colour. The time of a frame beyond that is Relief's. Everything in view is drawn, meshes whole, one
//! sample per pixel. A frame can take less: it leaves out hidden objects and those between samples, and has levels of
//! detail.

use super::grid::Grid;
use crate::renderer::{Gpu, PICTURE_FORMAT, texture};
use glam::{Mat4, Vec3, Vec4};
use std::time::{Duration, Instant};
use systems::assets::{Library, MeshId, world_bounds};
use systems::draw::View;
use systems::space::{GlobalTransform, Sphere};

const SHADER: &str = "
@group(0) @binding(0) var<uniform> clip_from_world: mat4x4f;

struct Vertex {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat) color: vec3f,
}

@vertex
fn vs_main(
    @builtin(instance_index) index: u32,
    @location(0) position: vec3f,
    @location(1) x: vec4f,
    @location(2) y: vec4f,
    @location(3) z: vec4f,
) -> Vertex {
    let object = vec4f(position, 1.0);
    let world = vec3f(dot(x, object), dot(y, object), dot(z, object));
    let color = vec3f(f32(index & 7u), f32((index >> 3u) & 7u), f32((index >> 6u) & 7u)) / 7.0;
    return Vertex(clip_from_world * vec4f(world, 1.0), color);
}

@fragment
fn fs_main(in: Vertex) -> @location(0) vec4f {
    return vec4f(in.color, 1.0);
}
";

/// The draw, ready.
pub(super) struct Floor {
    pipeline: wgpu::RenderPipeline,
    view: wgpu::BindGroup,
    /// Positions, rows of matrices, indices.
    buffers: [wgpu::Buffer; 3],
    indices: u32,
    depth: wgpu::TextureView,
    /// Objects in view.
    pub objects: u32,
}

impl Floor {
    /// For the objects of the yard as they are now; `None` where it is empty, or larger than a buffer of the device.
    pub fn new(gpu: &Gpu, yard: &mut Grid, view: &View) -> Option<Self> {
        let clip_from_world = view.clip_from_world();
        let world = &mut yard.simulation.world;
        let mesh = *world.query::<&MeshId>().iter(world).next()?;
        let mesh = yard.simulation.library().mesh(mesh)?.mesh.clone();
        let world = &mut yard.simulation.world;
        let mut rows: Vec<[f32; 4]> = Vec::new();
        let mut objects = world.query::<(&MeshId, &GlobalTransform)>();
        let library = world.resource::<Library>();
        for (&mesh, place) in objects.iter(world) {
            if world_bounds(library, mesh, place).is_some_and(|bounds| may_be_in_view(&clip_from_world, bounds)) {
                let matrix = Mat4::from(place.affine());
                rows.extend([matrix.row(0), matrix.row(1), matrix.row(2)].map(|row| row.to_array()));
            }
        }
        if size_of_val(&rows[..]) as u64 > gpu.device.limits().max_buffer_size {
            return None;
        }
        let positions: Vec<[f32; 3]> = mesh.positions.iter().map(Vec3::to_array).collect();
        let buffers = [
            filled(gpu, wgpu::BufferUsages::VERTEX, bytemuck::cast_slice(&positions)),
            filled(gpu, wgpu::BufferUsages::VERTEX, bytemuck::cast_slice(&rows)),
            filled(gpu, wgpu::BufferUsages::INDEX, bytemuck::cast_slice(&mesh.indices)),
        ];
        let uniform = filled(gpu, wgpu::BufferUsages::UNIFORM, bytemuck::bytes_of(&clip_from_world));
        let pipeline = pipeline(&gpu.device);
        let view_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("floor"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() }],
        });
        let (size, usage) = ((view.width, view.height), wgpu::TextureUsages::RENDER_ATTACHMENT);
        let depth = texture(&gpu.device, "floor", size, wgpu::TextureFormat::Depth32Float, 1, usage);
        Some(Self {
            pipeline,
            view: view_group,
            buffers,
            indices: mesh.indices.len() as u32,
            depth: depth.create_view(&wgpu::TextureViewDescriptor::default()),
            objects: rows.len() as u32 / 3,
        })
    }

    /// Draws, waits for the GPU, and says how long that took.
    pub fn draw(&self, gpu: &Gpu, target: &wgpu::TextureView) -> Duration {
        let begun = Instant::now();
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("floor") });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("floor"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Discard }),
                stencil_ops: None,
            }),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.view, &[]);
        pass.set_vertex_buffer(0, self.buffers[0].slice(..));
        pass.set_vertex_buffer(1, self.buffers[1].slice(..));
        pass.set_index_buffer(self.buffers[2].slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.indices, 0, 0..self.objects);
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
        gpu.poll(wgpu::PollType::wait_indefinitely());
        begun.elapsed()
    }
}

/// Tells if a sphere may be in view: not wholly outside one of its four sides.
fn may_be_in_view(clip_from_world: &Mat4, sphere: Sphere) -> bool {
    let [x, y, w] = [0, 1, 3].map(|row| clip_from_world.row(row));
    [w + x, w - x, w + y, w - y]
        .into_iter()
        .all(|side: Vec4| side.dot(sphere.center.extend(1.0)) > -sphere.radius * side.truncate().length())
}

fn filled(gpu: &Gpu, usage: wgpu::BufferUsages, bytes: &[u8]) -> wgpu::Buffer {
    let size = (bytes.len() as u64).next_multiple_of(4).max(4);
    let usage = usage | wgpu::BufferUsages::COPY_DST;
    let descriptor = wgpu::BufferDescriptor { label: Some("floor"), size, usage, mapped_at_creation: false };
    let buffer = gpu.device.create_buffer(&descriptor);
    gpu.queue.write_buffer(&buffer, 0, bytes);
    buffer
}

fn pipeline(device: &wgpu::Device) -> wgpu::RenderPipeline {
    let source = wgpu::ShaderSource::Wgsl(SHADER.into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("floor"), source });
    let layout = |stride: usize, step_mode, attributes| {
        Some(wgpu::VertexBufferLayout { array_stride: stride as u64, step_mode, attributes })
    };
    let per_vertex = &wgpu::vertex_attr_array![0 => Float32x3];
    let per_instance = &wgpu::vertex_attr_array![1 => Float32x4, 2 => Float32x4, 3 => Float32x4];
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("floor"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vs_main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[
                layout(12, wgpu::VertexStepMode::Vertex, per_vertex),
                layout(48, wgpu::VertexStepMode::Instance, per_instance),
            ],
        },
        primitive: wgpu::PrimitiveState { cull_mode: Some(wgpu::Face::Back), ..wgpu::PrimitiveState::default() },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: wgpu::TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fs_main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::ColorTargetState::from(PICTURE_FORMAT))],
        }),
        multiview_mask: None,
        cache: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::camera::rh::proj::directx as proj;

    #[test]
    fn what_reaches_into_the_view_counts() {
        // A right angle about −Z.
        let clip_from_world = proj::perspective_infinite_reverse(90f32.to_radians(), 1.0, 0.1);
        let sphere = |x: f32, y: f32, z: f32| Sphere { center: Vec3::new(x, y, z), radius: 1.0 };
        for inside in [sphere(0.0, 0.0, -5.0), sphere(6.0, 0.0, -5.0), sphere(0.0, -6.0, -5.0), sphere(0.0, 0.0, 0.5)] {
            assert!(may_be_in_view(&clip_from_world, inside), "{inside:?}");
        }
        for outside in [sphere(0.0, 0.0, 5.0), sphere(6.5, 0.0, -5.0), sphere(-6.5, 0.0, -5.0), sphere(0.0, 6.5, -5.0)]
        {
            assert!(!may_be_in_view(&clip_from_world, outside), "{outside:?}");
        }
    }
}
