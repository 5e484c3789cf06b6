//! Vertex rounding by the adapter's rasteriser is no more than culling allows for. Objects between samples are left out
//! by that.

use crate::common::{self, prelude::*};

/// Pixels along a row, two for each edge.
const WIDTH: u32 = 2048;
const EDGES: u32 = WIDTH / 2;
/// Rows of pixels, one for each kind of edge.
const KINDS: u32 = 4;

/// The distance of an edge from the middle of its pixel, which is on its inner side where it is negative: from −1/16 to
/// 1/16 of a pixel.
fn offset(edge: u32) -> f64 {
    (f64::from(edge) / f64::from(EDGES - 1) * 2.0 - 1.0) / 16.0
}

/// Squares of about half a pixel, each with one edge beside the middle of its pixel: its left, right, upper or lower
/// one, by the row.
const SHADER: &str = "
@vertex fn vs(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> @builtin(position) vec4f {
    let edge = instance % 1024u;
    let kind = instance / 1024u;
    let offset = (f32(edge) / 1023.0 * 2.0 - 1.0) / 16.0;
    let corner = vec2f(f32(vertex & 1u), f32((vertex >> 1u) & 1u));
    var low = vec2f(0.1);
    var high = vec2f(0.9);
    switch kind {
        case 0u: { low.x = 0.5 + offset; }
        case 1u: { high.x = 0.5 - offset; }
        case 2u: { low.y = 0.5 + offset; }
        default: { high.y = 0.5 - offset; }
    }
    let pixel = vec2f(f32(edge) * 2.0, f32(kind)) + mix(low, high, corner);
    let ndc = pixel / vec2f(2048.0, 4.0) * 2.0 - 1.0;
    return vec4f(ndc.x, -ndc.y, 0.5, 1.0);
}
@fragment fn fs() -> @location(0) vec4f { return vec4f(1.0); }
";

/// Tells if each edge's pixel is drawn, kind by kind.
fn drawn(gpu: &Gpu) -> Vec<bool> {
    let device = &gpu.device;
    let format = wgpu::TextureFormat::Rgba8Unorm;
    let source = wgpu::ShaderSource::Wgsl(SHADER.into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vs"),
            buffers: &[],
            compilation_options: wgpu::PipelineCompilationOptions::default(),
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..wgpu::PrimitiveState::default()
        },
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fs"),
            targets: &[Some(format.into())],
            compilation_options: wgpu::PipelineCompilationOptions::default(),
        }),
        multiview_mask: None,
        cache: None,
    });
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: WIDTH, height: KINDS, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    {
        let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store };
        let attachment = wgpu::RenderPassColorAttachment { view: &view, depth_slice: None, resolve_target: None, ops };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(attachment)],
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&pipeline);
        pass.draw(0..4, 0..EDGES * KINDS);
    }
    gpu.queue.submit([encoder.finish()]);
    let bytes = read_texture(gpu, &texture);
    (0..EDGES * KINDS).map(|edge| bytes[edge as usize * 8] > 0).collect()
}

#[test]
fn the_rasteriser_moves_no_vertex_farther_than_culling_reckons_with() {
    let Some(gpu) = common::gpu() else { return };
    let rounding = f64::from(gpu.vertex_rounding());
    assert!([1.0 / 16.0, 1.0 / 256.0].contains(&rounding), "{rounding}");
    let drawn = drawn(&gpu);
    for (kind, edges) in drawn.chunks(EDGES as usize).enumerate() {
        for (edge, &drawn) in edges.iter().enumerate() {
            let offset = offset(edge as u32);
            if offset.abs() > rounding {
                assert_eq!(drawn, offset < 0.0, "kind {kind}: {offset} of a pixel, {}", gpu.name());
            }
        }
    }
}
