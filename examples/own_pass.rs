//! A render pass of one's own between those of a view: lines along the axes of the world, hidden by what is before
//! them.
//!
//! `cargo run --release --example own_pass` writes `own_pass.png`.

use relief::prelude::*;
use relief::renderer::{
    Gpu, PICTURE_FORMAT, PassPlace, PassTargets, Renderer, Settings, ViewPlan, ViewState, ViewTarget, picture_texture,
    read_texture,
};
use wgpu::util::DeviceExt;

const SIZE: (u32, u32) = (640, 360);
const SHADER: &str = "
    @group(0) @binding(0) var<uniform> clip_from_world: mat4x4f;

    struct Vertex {
        @builtin(position) position: vec4f,
        @location(0) color: vec3f,
    }

    // Two vertices a line, one line an axis.
    @vertex fn vertex(@builtin(vertex_index) index: u32) -> Vertex {
        var axis = vec3f(0.0);
        axis[index / 2u] = 1.0;
        let place = axis * select(-3.0, 3.0, index % 2u == 1u);
        return Vertex(clip_from_world * vec4f(place, 1.0), axis * 4.0);
    }

    @fragment fn fragment(vertex: Vertex) -> @location(0) vec4f {
        return vec4f(vertex.color, 1.0);
    }
";

/// The pipeline and the bind group of the lines.
struct Lines {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
}

impl Lines {
    /// For colours before the tone map, with as many samples per pixel as the settings say.
    fn new(gpu: &Gpu, settings: &Settings, clip_from_world: glam::Mat4) -> Self {
        let device = &gpu.device;
        let source = wgpu::ShaderSource::Wgsl(SHADER.into());
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("lines"), source });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("lines"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: None,
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState { topology: wgpu::PrimitiveTopology::LineList, ..Default::default() },
            // Depth is reversed: what is nearer is greater.
            depth_stencil: Some(wgpu::DepthStencilState {
                format: PassTargets::DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: wgpu::MultisampleState { count: settings.samples, ..Default::default() },
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: None,
                compilation_options: Default::default(),
                targets: &[Some(PassTargets::LINEAR_FORMAT.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let uniform = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("lines"),
            contents: bytemuck::bytes_of(&clip_from_world),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("lines"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() }],
        });
        Self { pipeline, group }
    }

    fn encode(&self, encoder: &mut wgpu::CommandEncoder, targets: &PassTargets<'_>) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("lines"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: targets.color,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: targets.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.draw(0..6, 0..1);
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut simulation = Simulation::new();
    let mut library = simulation.world.resource_mut::<Library>();
    let ball = library.add_mesh(shapes::sphere(0.7, 48, 32));
    simulation.world.spawn((ball, Transform::IDENTITY));
    simulation.world.spawn((ball, Transform::from_xyz(1.4, 0.6, -1.2)));
    simulation.world.spawn((Light::point(8.0, 20.0), Transform::from_xyz(2.0, 3.0, 3.0)));
    let eye = Transform::from_xyz(3.0, 2.0, 4.0).looking_at(Vec3::ZERO, Vec3::Y);
    let camera = simulation.world.spawn((Camera::default(), eye)).id();
    simulation.frame();

    let gpu = Gpu::headless()?;
    let (mut renderer, mut state, settings) = (Renderer::new(&gpu), ViewState::new(&gpu), Settings::default());
    let view = Viewpoint::Camera(camera).view(&simulation.world, SIZE);
    let lines = Lines::new(&gpu, &settings, view.clip_from_world());
    let plan = ViewPlan { view, settings };
    simulation.with_frame(|frame| renderer.prepare(frame, &mut [(&mut state, plan)]))?;

    let picture = picture_texture(&gpu, SIZE);
    let target = picture.create_view(&Default::default());
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let view = ViewTarget::new(&mut state, &target, PICTURE_FORMAT)
        .with_pass(PassPlace::AfterOpaque, |encoder, targets| lines.encode(encoder, targets));
    renderer.encode(&mut encoder, &mut [view]);
    gpu.queue.submit([encoder.finish()]);

    let texels = read_texture(&gpu, &picture);
    let picture = image::RgbaImage::from_raw(SIZE.0, SIZE.1, texels).ok_or("a picture of another size")?;
    picture.save("own_pass.png")?;
    gpu.check()?;
    Ok(())
}
