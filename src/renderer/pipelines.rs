//! Pipelines: one forward shader, specialised by override constants, made when a batch first needs it.

use super::meshes::{SLOT_LAYOUT, VERTEX_LAYOUT};
use super::targets::{DEPTH_FORMAT, HDR_FORMAT};
use super::{DebugView, shaders};
use std::collections::BTreeMap;
use systems::components::ToneMap;
use systems::draw_list::PipelineKey;
use systems::library::AlphaMode;

/// What the forward pass writes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) enum Pass {
    /// HDR colour.
    Color {
        /// Every light shades every pixel.
        all_lights: bool,
        debug: DebugView,
        samples: u32,
    },
    /// Normal and id.
    Outputs,
}

/// Normal and id, in the order of the shader's `Outputs`.
pub(super) const OUTPUT_FORMATS: [wgpu::TextureFormat; 2] =
    [wgpu::TextureFormat::Rgba16Float, wgpu::TextureFormat::R32Uint];

/// Every pipeline of a renderer.
#[derive(Debug)]
pub(super) struct Pipelines {
    /// Group 0 of all passes: view and tables.
    pub frame_layout: wgpu::BindGroupLayout,
    /// Group 1 of the tone map.
    pub tone_map_layout: wgpu::BindGroupLayout,
    forward: wgpu::ShaderModule,
    sky: wgpu::ShaderModule,
    tone_map: wgpu::ShaderModule,
    forward_layout: wgpu::PipelineLayout,
    sky_layout: wgpu::PipelineLayout,
    tone_map_pipeline_layout: wgpu::PipelineLayout,
    objects: BTreeMap<(Pass, PipelineKey), wgpu::RenderPipeline>,
    skies: BTreeMap<u32, wgpu::RenderPipeline>,
    /// Few: by target format and curve.
    tone_maps: Vec<((wgpu::TextureFormat, ToneMap), wgpu::RenderPipeline)>,
}

impl Pipelines {
    pub fn new(device: &wgpu::Device, class_layout: &wgpu::BindGroupLayout) -> Self {
        let module = |label, source: &'static str| {
            let source = wgpu::ShaderSource::Wgsl(source.into());
            device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(label), source })
        };
        let frame_layout = frame_layout(device);
        let tone_map_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("tone map source"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::FRAGMENT,
                ty: wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Float { filterable: false },
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled: false,
                },
                count: None,
            }],
        });
        let layout = |label, groups: &[Option<&wgpu::BindGroupLayout>]| {
            device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(label),
                bind_group_layouts: groups,
                immediate_size: 0,
            })
        };
        Self {
            forward: module("forward.wgsl", shaders::FORWARD),
            sky: module("sky.wgsl", shaders::SKY),
            tone_map: module("tonemap.wgsl", shaders::TONE_MAP),
            forward_layout: layout("forward", &[Some(&frame_layout), Some(class_layout)]),
            sky_layout: layout("sky", &[Some(&frame_layout)]),
            tone_map_pipeline_layout: layout("tone map", &[Some(&frame_layout), Some(&tone_map_layout)]),
            frame_layout,
            tone_map_layout,
            objects: BTreeMap::new(),
            skies: BTreeMap::new(),
            tone_maps: Vec::new(),
        }
    }

    /// The pipeline that [`Self::make_object`] made.
    pub fn object(&self, pass: Pass, key: PipelineKey) -> Option<&wgpu::RenderPipeline> {
        self.objects.get(&(pass, key))
    }

    /// The sky for that many samples, if made.
    pub fn sky(&self, samples: u32) -> Option<&wgpu::RenderPipeline> {
        self.skies.get(&samples)
    }

    /// Makes the pipeline for objects of that kind unless it exists.
    pub fn make_object(&mut self, device: &wgpu::Device, pass: Pass, key: PipelineKey) {
        if self.objects.contains_key(&(pass, key)) {
            return;
        }
        let (all_lights, debug, samples) = match pass {
            Pass::Color { all_lights, debug, samples } => (all_lights, debug, samples),
            Pass::Outputs => (false, DebugView::Off, 1),
        };
        let constants = [
            ("TECHNIQUE", f64::from(key.technique as u32)),
            ("SHADING", f64::from(key.shading as u32)),
            ("ALPHA", f64::from(key.alpha as u32)),
            ("TRANSFORMED_UVS", f64::from(u32::from(key.transformed_uvs))),
            ("EMISSIVE", f64::from(u32::from(key.emissive))),
            ("VERTEX_COLORS", f64::from(u32::from(key.vertex_colors))),
            ("LIGHTS", f64::from(u32::from(all_lights))),
            ("DEBUG", f64::from(debug as u32)),
        ];
        let blend = key.alpha == AlphaMode::Blend && pass != Pass::Outputs;
        let write = wgpu::ColorWrites::ALL;
        let color = Some(wgpu::ColorTargetState {
            format: HDR_FORMAT,
            blend: blend.then_some(wgpu::BlendState::ALPHA_BLENDING),
            write_mask: write,
        });
        let outputs =
            OUTPUT_FORMATS.map(|format| Some(wgpu::ColorTargetState { format, blend: None, write_mask: write }));
        let color = [color];
        let (entry_point, targets): (_, &[_]) =
            if pass == Pass::Outputs { ("fs_outputs", &outputs) } else { ("fs_main", &color) };
        let compilation_options =
            wgpu::PipelineCompilationOptions { constants: &constants, ..wgpu::PipelineCompilationOptions::default() };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(&format!("{pass:?} {key:?}")),
            layout: Some(&self.forward_layout),
            vertex: wgpu::VertexState {
                module: &self.forward,
                entry_point: Some("vs_main"),
                compilation_options: compilation_options.clone(),
                buffers: &[Some(VERTEX_LAYOUT), Some(SLOT_LAYOUT)],
            },
            primitive: wgpu::PrimitiveState {
                front_face: if key.mirrored { wgpu::FrontFace::Cw } else { wgpu::FrontFace::Ccw },
                cull_mode: (!key.double_sided).then_some(wgpu::Face::Back),
                ..wgpu::PrimitiveState::default()
            },
            depth_stencil: Some(depth_state(!blend, wgpu::CompareFunction::Greater)),
            multisample: wgpu::MultisampleState { count: samples, ..wgpu::MultisampleState::default() },
            fragment: Some(wgpu::FragmentState {
                module: &self.forward,
                entry_point: Some(entry_point),
                compilation_options,
                targets,
            }),
            multiview_mask: None,
            cache: None,
        });
        self.objects.insert((pass, key), pipeline);
    }

    /// Makes the sky's pipeline unless it exists.
    pub fn make_sky(&mut self, device: &wgpu::Device, samples: u32) {
        if self.skies.contains_key(&samples) {
            return;
        }
        let target = Some(wgpu::ColorTargetState::from(HDR_FORMAT));
        let depth = Some(depth_state(false, wgpu::CompareFunction::Equal));
        let shader = (&self.sky, "vs_sky", "fs_sky");
        let pipeline = fullscreen(device, "sky", &self.sky_layout, shader, &[], target, depth, samples);
        self.skies.insert(samples, pipeline);
    }

    /// The tone-map pipeline for a target format and curve.
    pub fn tone_map(
        &mut self,
        device: &wgpu::Device,
        format: wgpu::TextureFormat,
        curve: ToneMap,
    ) -> &wgpu::RenderPipeline {
        let key = (format, curve);
        let index = self.tone_maps.iter().position(|(k, _)| *k == key).unwrap_or_else(|| {
            let constants = [("TONE_MAP", f64::from(curve as u32))];
            let shader = (&self.tone_map, "vs_tonemap", "fs_tonemap");
            let target = Some(wgpu::ColorTargetState::from(format));
            let layout = &self.tone_map_pipeline_layout;
            let pipeline = fullscreen(device, "tone map", layout, shader, &constants, target, None, 1);
            self.tone_maps.push((key, pipeline));
            self.tone_maps.len() - 1
        });
        &self.tone_maps[index].1
    }
}

fn frame_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let all = wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE;
    let entry = |binding, visibility, ty| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let table = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Uint,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let reaching = buffer(wgpu::BufferBindingType::Storage { read_only: true });
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("frame"),
        entries: &[
            entry(0, all, buffer(wgpu::BufferBindingType::Uniform)),
            entry(1, all, table),
            entry(2, all, table),
            entry(3, all, table),
            entry(4, wgpu::ShaderStages::FRAGMENT, reaching),
        ],
    })
}

fn depth_state(write: bool, compare: wgpu::CompareFunction) -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(write),
        depth_compare: Some(compare),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    }
}

#[allow(clippy::too_many_arguments)]
fn fullscreen(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::PipelineLayout,
    (module, vertex, fragment): (&wgpu::ShaderModule, &str, &str),
    constants: &[(&str, f64)],
    target: Option<wgpu::ColorTargetState>,
    depth_stencil: Option<wgpu::DepthStencilState>,
    samples: u32,
) -> wgpu::RenderPipeline {
    let compilation_options =
        wgpu::PipelineCompilationOptions { constants, ..wgpu::PipelineCompilationOptions::default() };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(label),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(vertex),
            compilation_options: compilation_options.clone(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil,
        multisample: wgpu::MultisampleState { count: samples, ..wgpu::MultisampleState::default() },
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment),
            compilation_options,
            targets: &[target],
        }),
        multiview_mask: None,
        cache: None,
    })
}
