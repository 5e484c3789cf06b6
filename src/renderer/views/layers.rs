//! Textures that views share: each is drawn into a layer.

use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::error::RenderError;
use crate::renderer::gpu::formats::{DEPTH_FORMAT, HDR_FORMAT, ID_FORMAT, NORMAL_FORMAT, PICTURE_FORMAT};
use crate::renderer::gpu::texture::{layer_view, layered_texture};
use crate::renderer::passes::output_textures::{OutputTexture, OutputTextures};
use crate::renderer::passes::pack::{PICTURE_AS_STORED, PackedTextures, layers_view};
use crate::renderer::passes::pipelines::{Pipelines, ToneMapSource};
use crate::renderer::passes::targets::{Hdr, Targets};
use crate::renderer::plan::output_set::OutputSet;
use crate::renderer::plan::settings::{DebugView, Settings};
use crate::renderer::plan::view_plan::ViewPlan;

/// Layers of a texture that every adapter has (WebGPU, 3.6.2 "Limits": maxTextureArrayLayers).
const MOST_LAYERS: u32 = 256;

/// Bytes of the textures of a batch, beyond which there is another batch: a large view's passes take so long that
/// nothing is gained by more of them in one submission.
const MOST_BYTES: u64 = 256 << 20;

/// Traits that views of a batch have in common.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct ViewBatchKey {
    pub size: (u32, u32),
    pub samples: u32,
    pub outputs: OutputSet,
    /// They have the scene's tone map, which debug views have not.
    tone_mapped: bool,
}

impl ViewBatchKey {
    pub fn of(plan: &ViewPlan) -> Self {
        let Settings { samples, outputs, debug, .. } = plan.settings;
        Self { size: plan.size(), samples, outputs, tone_mapped: debug == DebugView::Off }
    }

    /// The most views that a batch of these may have.
    pub fn most_views(self, gpu: &Gpu) -> usize {
        let (width, height) = (u64::from(self.size.0), u64::from(self.size.1));
        let own = if self.samples == 1 { 0 } else { 12 * u64::from(self.samples) };
        // Of colours, depths, normals, ids and the picture.
        let bytes = width * height * (8 + 4 + 8 + 4 + 4 + own);
        let fit = (MOST_BYTES / bytes.max(1)).max(1);
        let limits = gpu.device.limits();
        let tall = u64::from(limits.max_texture_dimension_2d) / height.max(1);
        fit.min(tall.max(1)).min(u64::from(MOST_LAYERS.min(limits.max_texture_array_layers))) as usize
    }
}

/// Textures of pictures, whose bytes can be read as they are stored, too.
fn pictures(
    device: &wgpu::Device,
    ((width, height), layers): ((u32, u32), u32),
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("pictures"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: layers },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: PICTURE_FORMAT,
        usage,
        view_formats: &[PICTURE_AS_STORED],
    })
}

/// The textures of a batch.
#[derive(Debug)]
pub(crate) struct LayerTextures {
    /// With the group of all layers as the tone map reads it. Of one layer that is not drawn into, where views have
    /// several samples per pixel.
    pub hdr: Hdr,
    pub depth: wgpu::Texture,
    pub normal: Option<wgpu::Texture>,
    pub id: Option<wgpu::Texture>,
    /// All pictures, one below the other; layers, where views have several samples per pixel.
    pub picture: wgpu::Texture,
}

/// The part of a batch's textures that a view is drawn into.
#[derive(Clone, Debug)]
pub(crate) struct Layer {
    index: u32,
    size: (u32, u32),
    hdr: Hdr,
    depth: OutputTexture,
    normal: Option<OutputTexture>,
    id: Option<OutputTexture>,
}

impl Layer {
    /// The targets of its view, with one sample per pixel.
    pub fn targets(&self) -> Targets {
        Targets {
            width: self.size.0,
            height: self.size.1,
            samples: 1,
            hdr: self.hdr.clone(),
            depth: self.depth.view.clone(),
            depth_texture: self.depth.texture.clone(),
            layer: self.index,
        }
    }

    /// Textures that outputs are drawn into, beside the picture or after it.
    pub fn outputs(&self) -> OutputTextures {
        let depth = Some(self.depth.clone());
        OutputTextures { color: None, normal: self.normal.clone(), id: self.id.clone(), depth }
    }
}

impl LayerTextures {
    pub fn new(gpu: &Gpu, pipelines: &Pipelines, key: ViewBatchKey, layers: u32) -> Result<Self, RenderError> {
        let device = &gpu.device;
        let invalid = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let no_memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let (width, height) = key.size;
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        let bound = usage | wgpu::TextureUsages::TEXTURE_BINDING;
        let texture = |label, format, usage| layered_texture(device, label, (key.size, layers), format, 1, usage);
        let is_single = key.samples == 1;
        let hdr_size = if is_single { (key.size, layers) } else { ((1, 1), 1) };
        let hdr = layered_texture(device, "hdr layers", hdr_size, HDR_FORMAT, 1, bound);
        let picture_size = if is_single { ((width, height * layers), 1) } else { (key.size, layers) };
        let textures = Self {
            hdr: Hdr::of_layers(device, pipelines.tone_map_layout(ToneMapSource::Layers), hdr),
            depth: texture("depth layers", DEPTH_FORMAT, bound),
            normal: key.outputs.normal.then(|| texture("normal layers", NORMAL_FORMAT, usage)),
            id: key.outputs.id.then(|| texture("id layers", ID_FORMAT, bound)),
            picture: pictures(device, picture_size, bound),
        };
        let errors = [no_memory.pop(), invalid.pop()].map(pollster::block_on);
        match errors.into_iter().flatten().next() {
            Some(error) => {
                Err(RenderError::NoMemory { size: key.size.into(), samples: key.samples, reason: error.to_string() })
            }
            None => Ok(textures),
        }
    }

    /// The textures that a pack pass reads of what views have drawn.
    pub fn packed(&self, key: ViewBatchKey) -> PackedTextures {
        let OutputSet { color, depth, .. } = key.outputs;
        PackedTextures {
            pictures: color.then(|| layers_view(&self.picture, Some(PICTURE_AS_STORED))),
            depths: depth.then(|| layers_view(&self.depth, None)),
            ids: self.id.as_ref().map(|ids| layers_view(ids, None)),
            is_tall: key.samples == 1,
        }
    }

    pub fn layer(&self, key: ViewBatchKey, index: u32) -> Layer {
        let output = |texture: &wgpu::Texture, label| OutputTexture {
            view: layer_view(texture, label, index),
            texture: texture.clone(),
        };
        let hdr_layer = if key.samples == 1 { index } else { 0 };
        Layer {
            index,
            size: key.size,
            hdr: Hdr { view: layer_view(&self.hdr.texture, "hdr layer", hdr_layer), ..self.hdr.clone() },
            depth: output(&self.depth, "depth layer"),
            normal: self.normal.as_ref().map(|texture| output(texture, "normal layer")),
            id: self.id.as_ref().map(|texture| output(texture, "id layer")),
        }
    }
}
