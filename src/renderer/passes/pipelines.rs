//! Pipelines: one forward shader, specialised by override constants, made when a batch first needs it.

use super::emboss::EmbossPass;
use super::pass::{Pass, Shadows, SkyKey};
use crate::renderer::gpu::formats::{DEPTH_FORMAT, HDR_FORMAT};
use crate::renderer::gpu::shaders;
use crate::renderer::plan::settings::DebugView;
use crate::renderer::resources::meshes::{SLOT_LAYOUT, VERTEX_LAYOUT};
use std::collections::{BTreeMap, BTreeSet};
use std::thread::JoinHandle;
use systems::assets::AlphaMode;
use systems::draw::{LightFeatures, PipelineKey, ToneMap};
use systems::ecs::parallel::map_in_parallel;

/// Pipelines that are being made.
pub(crate) type MissingPipelines = JoinHandle<Vec<((Pass, PipelineKey), wgpu::RenderPipeline)>>;

/// The shader that draws objects.
#[derive(Clone, Debug)]
struct Forward {
    module: wgpu::ShaderModule,
    layout: wgpu::PipelineLayout,
}

/// Source texture of a tone map, by its binding in shaders/tonemap.wgsl.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum ToneMapSource {
    /// One sample per pixel.
    Single,
    /// Several.
    Multisampled,
    /// One sample per pixel of several views, as layers; the target has them one below the other.
    Layers,
}

impl ToneMapSource {
    const ALL: [Self; 3] = [Self::Single, Self::Multisampled, Self::Layers];

    /// Source of a view with so many samples per pixel.
    pub fn of(samples: u32) -> Self {
        if samples > 1 { Self::Multisampled } else { Self::Single }
    }
}

/// Every pipeline of a renderer.
#[derive(Clone, Debug)]
pub(crate) struct Pipelines {
    /// Group 0 of all passes: view and tables.
    pub frame_layout: wgpu::BindGroupLayout,
    /// Group 2 of objects: the picture without blended ones.
    pub scene_color_layout: wgpu::BindGroupLayout,
    /// Group 0 of the tone map, by [`ToneMapSource`].
    tone_map_layouts: [wgpu::BindGroupLayout; 3],
    forward: Forward,
    /// The same with shadows, and group 3 of it; made when a view first asks for it.
    with_shadows: BTreeMap<Shadows, (Forward, wgpu::BindGroupLayout)>,
    sky: wgpu::ShaderModule,
    tone_map: wgpu::ShaderModule,
    sky_layout: wgpu::PipelineLayout,
    tone_map_pipeline_layouts: [wgpu::PipelineLayout; 3],
    objects: BTreeMap<(Pass, PipelineKey), wgpu::RenderPipeline>,
    skies: BTreeMap<SkyKey, wgpu::RenderPipeline>,
    /// Few: by target format and curve, and what is read.
    tone_maps: Vec<((wgpu::TextureFormat, ToneMap, ToneMapSource), wgpu::RenderPipeline)>,
}

impl Pipelines {
    pub fn new(device: &wgpu::Device, class_layout: &wgpu::BindGroupLayout) -> Self {
        let module = |label, source| shader_module(device, label, source);
        let frame_layout = frame_layout(device);
        let picture_layout = |label, source| {
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some(label),
                entries: &[wgpu::BindGroupLayoutEntry {
                    binding: source as u32,
                    visibility: wgpu::ShaderStages::FRAGMENT,
                    ty: wgpu::BindingType::Texture {
                        sample_type: wgpu::TextureSampleType::Float { filterable: false },
                        view_dimension: match source {
                            ToneMapSource::Single | ToneMapSource::Multisampled => wgpu::TextureViewDimension::D2,
                            ToneMapSource::Layers => wgpu::TextureViewDimension::D2Array,
                        },
                        multisampled: source == ToneMapSource::Multisampled,
                    },
                    count: None,
                }],
            })
        };
        let scene_color_layout = picture_layout("scene color copy", ToneMapSource::Single);
        let tone_map_layouts = ToneMapSource::ALL.map(|source| picture_layout("tone map source", source));
        let layout = |label, groups: &[_]| pipeline_layout(device, label, groups);
        Self {
            forward: Forward {
                module: module("forward.wgsl", shaders::FORWARD),
                layout: layout("forward", &[Some(&frame_layout), Some(class_layout), Some(&scene_color_layout)]),
            },
            with_shadows: BTreeMap::new(),
            sky: module("sky.wgsl", shaders::SKY),
            tone_map: module("tonemap.wgsl", shaders::TONE_MAP),
            sky_layout: layout("sky", &[Some(&frame_layout)]),
            tone_map_pipeline_layouts: tone_map_layouts.each_ref().map(|group| layout("tone map", &[Some(group)])),
            frame_layout,
            scene_color_layout,
            tone_map_layouts,
            objects: BTreeMap::new(),
            skies: BTreeMap::new(),
            tone_maps: Vec::new(),
        }
    }

    /// Group 3 of objects that receive shadows.
    pub fn shadows_layout(
        &mut self,
        device: &wgpu::Device,
        class_layout: &wgpu::BindGroupLayout,
        shadows: Shadows,
    ) -> &wgpu::BindGroupLayout {
        let make = || {
            let (label, source, group) = match shadows {
                Shadows::Maps => ("forward with shadow maps", shaders::FORWARD_SHADOWED, maps_layout(device)),
                Shadows::Traced => ("forward with traced shadows", shaders::FORWARD_TRACED, traced_layout(device)),
            };
            let groups = [&self.frame_layout, class_layout, &self.scene_color_layout, &group].map(Some);
            let layout = pipeline_layout(device, label, &groups);
            (Forward { module: shader_module(device, label, source), layout }, group)
        };
        &self.with_shadows.entry(shadows).or_insert_with(make).1
    }

    /// The pipeline that [`Self::start_objects`] began to make.
    pub fn object(&self, pass: Pass, key: PipelineKey) -> Option<&wgpu::RenderPipeline> {
        self.objects.get(&(pass, key))
    }

    /// The sky, if made.
    pub fn sky(&self, key: SkyKey) -> Option<&wgpu::RenderPipeline> {
        self.skies.get(&key)
    }

    /// Begins to make the pipelines for objects of those kinds that do not exist, on threads of their own: compiling
    /// one takes long.
    pub fn start_objects(
        &self,
        device: &wgpu::Device,
        kinds: impl Iterator<Item = (Pass, PipelineKey)>,
    ) -> Option<MissingPipelines> {
        let missing: BTreeSet<_> = kinds.filter(|kind| !self.objects.contains_key(kind)).collect();
        (!missing.is_empty()).then(|| {
            let (pipelines, device) = (self.clone(), device.clone());
            std::thread::spawn(move || {
                let make = |&(pass, key): &_| pipelines.make_object(&device, pass, key);
                let made = map_in_parallel(missing.iter(), make);
                missing.into_iter().zip(made).collect()
            })
        })
    }

    /// Waits for what [`Self::start_objects`] began.
    pub fn finish_objects(&mut self, missing: Option<MissingPipelines>) {
        if let Some(missing) = missing {
            self.objects.extend(missing.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        }
    }

    fn make_object(&self, device: &wgpu::Device, pass: Pass, key: PipelineKey) -> wgpu::RenderPipeline {
        let with_shadows = pass.shadows().and_then(|shadows| self.with_shadows.get(&shadows));
        let Forward { module, layout } = with_shadows.map_or(&self.forward, |(forward, _)| forward);
        let constants = object_constants(pass, key);
        let blend = key.alpha == AlphaMode::Blend && !matches!(pass, Pass::Outputs(_));
        let targets = pass.targets(key);
        let (vertex_entry, fragment_entry) = pass.entry_points(key);
        let depth = match pass {
            Pass::Color { emboss: Some(_), .. } => depth_state(false, wgpu::CompareFunction::Equal),
            Pass::Color { .. } | Pass::Outputs(_) => depth_state(!blend, wgpu::CompareFunction::Greater),
        };
        let compilation_options =
            wgpu::PipelineCompilationOptions { constants: &constants, ..wgpu::PipelineCompilationOptions::default() };
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(&format!("{pass:?} {key:?}")),
            layout: Some(layout),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some(vertex_entry),
                compilation_options: compilation_options.clone(),
                buffers: &[Some(VERTEX_LAYOUT), Some(SLOT_LAYOUT)],
            },
            primitive: wgpu::PrimitiveState {
                front_face: if key.mirrored { wgpu::FrontFace::Cw } else { wgpu::FrontFace::Ccw },
                cull_mode: (!key.double_sided).then_some(wgpu::Face::Back),
                ..wgpu::PrimitiveState::default()
            },
            depth_stencil: Some(depth),
            multisample: wgpu::MultisampleState { count: pass.samples(), ..wgpu::MultisampleState::default() },
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some(fragment_entry),
                compilation_options,
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    /// Makes the sky's pipeline unless it exists.
    pub fn make_sky(&mut self, device: &wgpu::Device, key: SkyKey) {
        if self.skies.contains_key(&key) {
            return;
        }
        let SkyKey { samples, beside, atmosphere } = key;
        let constants = [("ATMOSPHERE", f64::from(u32::from(atmosphere)))];
        let color = wgpu::ColorTargetState::from(HDR_FORMAT);
        let targets = beside.targets_beside(color, wgpu::ColorWrites::empty());
        let depth = Some(depth_state(false, wgpu::CompareFunction::Equal));
        let shader = Shader { module: &self.sky, vertex: "vs_sky", fragment: "fs_sky" };
        let pipeline = fullscreen(device, "sky", &self.sky_layout, shader, &constants, &targets, depth, samples);
        self.skies.insert(key, pipeline);
    }

    /// Group 0 of the tone map.
    pub fn tone_map_layout(&self, source: ToneMapSource) -> &wgpu::BindGroupLayout {
        &self.tone_map_layouts[source as usize]
    }

    /// The tone-map pipeline for a target format and curve, and for what it reads.
    pub fn tone_map(
        &mut self,
        device: &wgpu::Device,
        format: wgpu::TextureFormat,
        curve: ToneMap,
        source: ToneMapSource,
    ) -> &wgpu::RenderPipeline {
        let key = (format, curve, source);
        let index = self.tone_maps.iter().position(|(k, _)| *k == key).unwrap_or_else(|| {
            let constants = [("TONE_MAP", f64::from(curve as u32))];
            let fragment = match source {
                ToneMapSource::Single => "fs_tonemap",
                ToneMapSource::Multisampled => "fs_tonemap_multisampled",
                ToneMapSource::Layers => "fs_tonemap_layers",
            };
            let shader = Shader { module: &self.tone_map, vertex: "vs_tonemap", fragment };
            let target = Some(wgpu::ColorTargetState::from(format));
            let layout = &self.tone_map_pipeline_layouts[source as usize];
            let pipeline = fullscreen(device, "tone map", layout, shader, &constants, &[target], None, 1);
            self.tone_maps.push((key, pipeline));
            self.tone_maps.len() - 1
        });
        &self.tone_maps[index].1
    }
}

/// Override constants of the forward shader in a pass, for objects of one pipeline.
pub(crate) fn object_constants(pass: Pass, key: PipelineKey) -> [(&'static str, f64); 21] {
    let (lights, debug, specular_aa, emboss) = match pass {
        Pass::Color { lights, debug, specular_aa, emboss, .. } => (lights, debug, specular_aa, emboss),
        Pass::Outputs(_) => (LightFeatures::default(), DebugView::Off, false, None),
    };
    let (emboss_step, emboss_light) = emboss.map_or((0, 0), EmbossPass::constants);
    [
        ("TECHNIQUE", f64::from(key.technique as u32)),
        ("SHADING", f64::from(key.shading as u32)),
        ("ALPHA", f64::from(key.alpha as u32)),
        ("TRANSFORMED_UVS", f64::from(u32::from(key.transformed_uvs))),
        ("EMISSIVE", f64::from(u32::from(key.emissive))),
        ("ENVIRONMENT_MAP", f64::from(u32::from(key.environment_map))),
        ("VERTEX_COLORS", f64::from(u32::from(key.vertex_colors))),
        ("LIGHT_LISTS", f64::from(u32::from(lights.lists))),
        ("LIGHTS_WITH_ATTENUATION", f64::from(u32::from(lights.attenuation))),
        ("LIGHTS_WITH_CONES", f64::from(u32::from(lights.cones))),
        ("LIGHTS_WITH_EXPONENTS", f64::from(u32::from(lights.exponents))),
        ("LIGHTS_WITH_AMBIENT", f64::from(u32::from(lights.ambient))),
        ("LAMPS_WITH_SHADOWS", f64::from(u32::from(lights.lamp_shadows))),
        ("SUNS_WITH_SHADOWS", f64::from(u32::from(lights.sun_shadows))),
        ("LIGHTS_WITH_SIZES", f64::from(u32::from(lights.sizes))),
        ("ATMOSPHERE", f64::from(u32::from(lights.atmosphere))),
        ("OPENNESS", f64::from(u32::from(lights.openness))),
        ("SPECULAR_AA", f64::from(u32::from(specular_aa))),
        ("DEBUG", f64::from(debug as u32)),
        ("EMBOSS_STEP", f64::from(emboss_step)),
        ("EMBOSS_LIGHT", f64::from(emboss_light)),
    ]
}

pub(crate) fn shader_module(device: &wgpu::Device, label: &str, source: &'static str) -> wgpu::ShaderModule {
    let source = wgpu::ShaderSource::Wgsl(source.into());
    device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(label), source })
}

pub(crate) fn pipeline_layout(
    device: &wgpu::Device,
    label: &str,
    groups: &[Option<&wgpu::BindGroupLayout>],
) -> wgpu::PipelineLayout {
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: groups,
        immediate_size: 0,
    })
}

fn frame_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let all = wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE;
    let entry = |binding, visibility, ty| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let table = wgpu::BindingType::StorageTexture {
        access: wgpu::StorageTextureAccess::ReadOnly,
        format: wgpu::TextureFormat::Rgba32Uint,
        view_dimension: wgpu::TextureViewDimension::D2,
    };
    let filtered = wgpu::TextureSampleType::Float { filterable: true };
    let sampled =
        |view_dimension, sample_type| wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("frame"),
        entries: &[
            entry(0, all, buffer(wgpu::BufferBindingType::Uniform)),
            entry(1, all, table),
            entry(2, all, buffer(wgpu::BufferBindingType::Uniform)),
            entry(3, wgpu::ShaderStages::FRAGMENT, buffer(wgpu::BufferBindingType::Uniform)),
            entry(4, wgpu::ShaderStages::FRAGMENT, sampled(wgpu::TextureViewDimension::D2Array, filtered)),
            entry(5, wgpu::ShaderStages::FRAGMENT, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
            entry(
                6,
                wgpu::ShaderStages::FRAGMENT,
                sampled(wgpu::TextureViewDimension::D3, wgpu::TextureSampleType::Uint),
            ),
            entry(7, wgpu::ShaderStages::FRAGMENT, sampled(wgpu::TextureViewDimension::D3, filtered)),
            entry(8, wgpu::ShaderStages::FRAGMENT, sampled(wgpu::TextureViewDimension::D3, filtered)),
            entry(
                9,
                wgpu::ShaderStages::FRAGMENT,
                sampled(wgpu::TextureViewDimension::D2, wgpu::TextureSampleType::Uint),
            ),
        ],
    })
}

/// Group 3 of objects that receive shadows: the layers of all lights.
fn maps_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry =
        |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::FRAGMENT, ty, count: None };
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Depth,
        view_dimension: wgpu::TextureViewDimension::D2Array,
        multisampled: false,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("shadow maps"),
        entries: &[entry(0, texture), entry(1, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::NonFiltering))],
    })
}

/// Group 3 of objects with shadows that rays found: one storage buffer.
fn traced_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let ty = wgpu::BufferBindingType::Storage { read_only: true };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("traced shadows"),
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
            count: None,
        }],
    })
}

pub(crate) fn depth_state(write: bool, compare: wgpu::CompareFunction) -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(write),
        depth_compare: Some(compare),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    }
}

/// A shader module, and its entry points.
pub(crate) struct Shader<'a> {
    pub module: &'a wgpu::ShaderModule,
    pub vertex: &'a str,
    pub fragment: &'a str,
}

#[allow(clippy::too_many_arguments)]
pub(crate) fn fullscreen(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::PipelineLayout,
    Shader { module, vertex, fragment }: Shader<'_>,
    constants: &[(&str, f64)],
    targets: &[Option<wgpu::ColorTargetState>],
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
        fragment: Some(wgpu::FragmentState { module, entry_point: Some(fragment), compilation_options, targets }),
        multiview_mask: None,
        cache: None,
    })
}
