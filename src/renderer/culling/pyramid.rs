//! The depth pyramid of a view, for finding what is hidden: shaders/pyramid.wgsl halves the depths of what is drawn so
//! far, level by level, keeping the farthest.

use crate::renderer::gpu::shaders;
use crate::renderer::gpu::texture::whole_view;
use crate::renderer::gpu::timestamps::Timestamps;
use crate::renderer::passes::targets::Targets;

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;

/// Texels along each side of the square that a workgroup makes.
pub(crate) const SIDE: u32 = 8;

/// The pipelines that make pyramids.
#[derive(Clone, Debug)]
pub(crate) struct PyramidMaker {
    single: Reduction,
    multisampled: Reduction,
    finer: Reduction,
}

/// One way to make a level, with the binding that it reads.
#[derive(Clone, Debug)]
struct Reduction {
    source: u32,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

/// The pyramid of one view.
#[derive(Debug)]
pub(crate) struct Pyramid {
    /// All levels, for reading.
    pub view: wgpu::TextureView,
    /// Bind group of the pass that makes each level, and the level's size.
    levels: Vec<(wgpu::BindGroup, [u32; 2])>,
    multisampled: bool,
}

impl PyramidMaker {
    pub fn new(device: &wgpu::Device) -> Self {
        let source = wgpu::ShaderSource::Wgsl(shaders::PYRAMID.into());
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("pyramid.wgsl"), source });
        let depth = wgpu::TextureSampleType::Depth;
        let float = wgpu::TextureSampleType::Float { filterable: false };
        Self {
            single: Reduction::new(device, &module, "from_single", 0, depth, false),
            multisampled: Reduction::new(device, &module, "from_multisampled", 1, depth, true),
            finer: Reduction::new(device, &module, "from_finer", 2, float, false),
        }
    }

    /// Encodes the making of a pyramid from the depths that it was made for.
    pub fn encode(&self, encoder: &mut wgpu::CommandEncoder, timestamps: Option<&Timestamps>, pyramid: &Pyramid) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("depth pyramid"),
            timestamp_writes: timestamps.and_then(|timestamps| timestamps.compute_pass("depth pyramid")),
        });
        for (level, (group, [width, height])) in pyramid.levels.iter().enumerate() {
            let reduction = match (level, pyramid.multisampled) {
                (0, false) => &self.single,
                (0, true) => &self.multisampled,
                _ => &self.finer,
            };
            pass.set_pipeline(&reduction.pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(width.div_ceil(SIDE), height.div_ceil(SIDE), 1);
        }
    }
}

impl Reduction {
    fn new(
        device: &wgpu::Device,
        module: &wgpu::ShaderModule,
        entry_point: &str,
        source: u32,
        sample_type: wgpu::TextureSampleType,
        multisampled: bool,
    ) -> Self {
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty,
            count: None,
        };
        let view_dimension = wgpu::TextureViewDimension::D2;
        let access = wgpu::StorageTextureAccess::WriteOnly;
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(entry_point),
            entries: &[
                entry(source, wgpu::BindingType::Texture { sample_type, view_dimension, multisampled }),
                entry(3, wgpu::BindingType::StorageTexture { access, format: FORMAT, view_dimension }),
            ],
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(entry_point),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(entry_point),
            layout: Some(&pipeline_layout),
            module,
            entry_point: Some(entry_point),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        Self { source, layout, pipeline }
    }

    fn bind(&self, device: &wgpu::Device, from: &wgpu::TextureView, to: &wgpu::TextureView) -> wgpu::BindGroup {
        let entry =
            |binding, view| wgpu::BindGroupEntry { binding, resource: wgpu::BindingResource::TextureView(view) };
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("depth pyramid"),
            layout: &self.layout,
            entries: &[entry(self.source, from), entry(3, to)],
        })
    }
}

impl Pyramid {
    pub fn level_count(&self) -> u32 {
        self.levels.len() as u32
    }

    /// A pyramid over the depths of those targets.
    pub fn new(device: &wgpu::Device, maker: &PyramidMaker, targets: &Targets) -> Self {
        let [width, height] = [targets.width, targets.height].map(|side| side.div_ceil(2).next_power_of_two());
        let level_count = width.max(height).ilog2() + 1;
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("depth pyramid"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: level_count,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::STORAGE_BINDING,
            view_formats: &[],
        });
        let level_view = |base_mip_level| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                label: Some("depth pyramid level"),
                base_mip_level,
                mip_level_count: Some(1),
                ..wgpu::TextureViewDescriptor::default()
            })
        };
        let multisampled = targets.samples > 1;
        let first = if multisampled { &maker.multisampled } else { &maker.single };
        let group = |level: u32| match level {
            0 => first.bind(device, &targets.depth, &level_view(0)),
            _ => maker.finer.bind(device, &level_view(level - 1), &level_view(level)),
        };
        let size = |level: u32| [(width >> level).max(1), (height >> level).max(1)];
        let levels = (0..level_count).map(|level| (group(level), size(level))).collect();
        Self { view: whole_view(&texture, "depth pyramid"), levels, multisampled }
    }
}
