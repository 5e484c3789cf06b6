//! Texture arrays, samplers, and the bind group of each material class.

use super::tables::{FEW_BYTES_UNDER_WAY, Pace};
use super::{Gpu, RenderError};
use std::borrow::Cow;
use std::collections::BTreeMap;
use systems::assets::{
    Filter, Image, ImageId, Library, MapSlot, MipFilter, Sampler, Technique, Texels, Wrap, blocks, level_count,
    level_size,
};
use systems::draw::{ClassId, DrawList, MaterialClass, TextureArray, most_layers};
use wgpu::TextureUsages;

#[derive(Debug)]
struct ArrayTexture {
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    uploaded: usize,
}

/// Maps that a pixel may read; a texture and a sampler each.
const BOUND_MAPS: usize = 9;

/// The maps that pixels of a technique may read, in the order of their bindings, which shaders/forward.wgsl has too.
/// [`Technique::PerturbedUv`] reads neither normal nor height map; its own two are bound in their places.
fn bound_maps(technique: Technique) -> [MapSlot; BOUND_MAPS] {
    use MapSlot::*;
    let (normal, height) = if technique == Technique::PerturbedUv { (Offset, Environment) } else { (Normal, Height) };
    [Base, normal, Specular, MetallicRoughness, Occlusion, Emissive, height, Horizon0, Horizon1]
}

/// The maps of a class, as techniques bind them.
#[derive(Debug)]
struct ClassGroups {
    perturbed_uv: wgpu::BindGroup,
    others: wgpu::BindGroup,
}

/// What materials bind.
#[derive(Debug)]
pub(super) struct Textures {
    pub layout: wgpu::BindGroupLayout,
    arrays: Vec<ArrayTexture>,
    samplers: BTreeMap<Sampler, wgpu::Sampler>,
    classes: Vec<ClassGroups>,
    /// Whether it has been said that heights are drawn in steps: once is enough, however many arrays have them.
    said_steps: bool,
}

impl Textures {
    pub fn new(device: &wgpu::Device) -> Self {
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        let texture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: true },
            view_dimension: wgpu::TextureViewDimension::D2Array,
            multisampled: false,
        };
        let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let maps = BOUND_MAPS as u32;
        let entries: Vec<_> =
            (0..maps).map(|i| entry(i, texture)).chain((maps..2 * maps).map(|i| entry(i, sampler))).collect();
        let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some("material class"), entries: &entries };
        Self::with_layout(device.create_bind_group_layout(&descriptor))
    }

    /// None yet, for pipelines that were made with that layout.
    pub fn with_layout(layout: wgpu::BindGroupLayout) -> Self {
        Self { layout, arrays: Vec::new(), samplers: BTreeMap::new(), classes: Vec::new(), said_steps: false }
    }

    /// What a class binds for a technique.
    pub fn class(&self, class: ClassId, technique: Technique) -> Option<&wgpu::BindGroup> {
        let groups = self.classes.get(class.0 as usize)?;
        Some(if technique == Technique::PerturbedUv { &groups.perturbed_uv } else { &groups.others })
    }

    /// Uploads layers that are new, which is when the library may drop their texels; binds classes that are new or
    /// whose arrays grew. Returns the bytes written.
    pub fn upload(&mut self, gpu: &Gpu, list: &DrawList, library: &mut Library) -> Result<u64, RenderError> {
        let missing = self.make_room(gpu, list, library)?;
        let (mut written, mut pace) = (0, Pace::new(FEW_BYTES_UNDER_WAY));
        for (index, layer, id) in missing {
            let array = &mut self.arrays[index];
            if let Some(image) = library.image(id) {
                if image.levels.is_empty() {
                    return Err(RenderError::NoTexels { image: image.name.clone() });
                }
                let bytes = write_layer(gpu, &array.texture, layer as u32, image);
                pace.handed_in(gpu, bytes);
                written += bytes;
                library.release_texels(id);
            }
            array.uploaded = layer + 1;
        }
        self.bind(&gpu.device, list);
        Ok(written)
    }

    /// Makes arrays that are missing or too small. Returns the layers to be written, in order: array, layer and image.
    fn make_room(
        &mut self,
        gpu: &Gpu,
        list: &DrawList,
        library: &Library,
    ) -> Result<Vec<(usize, usize, ImageId)>, RenderError> {
        let mut missing = Vec::new();
        for (index, wanted) in list.texture_arrays.iter().enumerate() {
            let room = self.arrays.get(index).map(|a| a.texture.depth_or_array_layers() as usize);
            if room.is_none_or(|room| room < wanted.layers.len()) {
                check_size(&gpu.device, wanted, library)?;
                if let Some(old) = self.arrays.get_mut(index) {
                    *old = grown(gpu, wanted, old);
                    // Any class may hold a view of the old texture.
                    self.classes.clear();
                } else {
                    self.arrays.push(make_array(&gpu.device, wanted, wanted.layers.len()));
                }
                if self.arrays[index].texture.format() == wgpu::TextureFormat::R16Float && !self.said_steps {
                    tracing::warn!(
                        "this adapter cannot filter 16-bit heights: they are drawn in steps of up to 1/2048"
                    );
                    self.said_steps = true;
                }
            }
            let uploaded = self.arrays[index].uploaded;
            let new = wanted.layers.iter().enumerate().skip(uploaded);
            missing.extend(new.map(|(layer, &image)| (index, layer, image)));
        }
        Ok(missing)
    }

    fn bind(&mut self, device: &wgpu::Device, list: &DrawList) {
        for class in list.classes.iter().skip(self.classes.len()) {
            for sampler in class.samplers {
                self.samplers.entry(sampler).or_insert_with(|| make_sampler(device, sampler));
            }
            let group = |technique| self.group(device, class, bound_maps(technique));
            let groups = ClassGroups { perturbed_uv: group(Technique::PerturbedUv), others: group(Technique::Normal) };
            self.classes.push(groups);
        }
    }

    fn group(&self, device: &wgpu::Device, class: &MaterialClass, maps: [MapSlot; BOUND_MAPS]) -> wgpu::BindGroup {
        let array = |map: MapSlot| &self.arrays[class.arrays[map as usize] as usize];
        let sampler = |map: MapSlot| &self.samplers[&class.samplers[map as usize]];
        let views = maps.iter().map(|&map| wgpu::BindingResource::TextureView(&array(map).view));
        let samplers = maps.iter().map(|&map| wgpu::BindingResource::Sampler(sampler(map)));
        let entries: Vec<_> = views
            .chain(samplers)
            .enumerate()
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding: binding as u32, resource })
            .collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("material class"),
            layout: &self.layout,
            entries: &entries,
        })
    }
}

/// Refuses images that are larger than the device's textures.
fn check_size(device: &wgpu::Device, wanted: &TextureArray, library: &Library) -> Result<(), RenderError> {
    let limit = device.limits().max_texture_dimension_2d;
    if wanted.width.max(wanted.height) <= limit {
        return Ok(());
    }
    let image = wanted.layers.first().and_then(|&image| library.image(image));
    let image = image.map_or_else(String::new, |image| image.name.clone());
    Err(RenderError::MapTooLarge { image, size: [wanted.width, wanted.height], limit })
}

/// Whether the device reads blocks itself; where not, they are uploaded as the texels that they stand for.
fn reads_blocks(device: &wgpu::Device) -> bool {
    device.features().contains(wgpu::Features::TEXTURE_COMPRESSION_BC)
}

/// What holds heights of more than 8 bits and is filtered: graphics cards have one of the first two, most have both.
fn height_format(device: &wgpu::Device) -> wgpu::TextureFormat {
    let features = device.features();
    if features.contains(wgpu::Features::FLOAT32_FILTERABLE) {
        wgpu::TextureFormat::R32Float
    } else if features.contains(wgpu::Features::TEXTURE_FORMAT_16BIT_NORM) {
        wgpu::TextureFormat::R16Unorm
    } else {
        wgpu::TextureFormat::R16Float
    }
}

/// A level's heights as a format of [`height_format`] has them.
fn heights_as(format: wgpu::TextureFormat, level: &[u8]) -> Cow<'_, [u8]> {
    let heights = level.as_chunks::<4>().0.iter().map(|&height| f32::from_le_bytes(height));
    match format {
        wgpu::TextureFormat::R16Unorm => {
            heights.flat_map(|h| ((h.clamp(0.0, 1.0) * 65535.0).round() as u16).to_le_bytes()).collect()
        }
        wgpu::TextureFormat::R16Float => heights.flat_map(|h| half::f16::from_f32(h).to_le_bytes()).collect(),
        _ => Cow::Borrowed(level),
    }
}

/// An array with room for more layers, and those of the old one: half as many again, so that images that come one by
/// one are not copied often.
fn grown(gpu: &Gpu, wanted: &TextureArray, old: &ArrayTexture) -> ArrayTexture {
    let held = old.texture.depth_or_array_layers() as usize;
    let layers = (held + held / 2).min(most_layers(wanted)).max(wanted.layers.len());
    let mut array = make_array(&gpu.device, wanted, layers);
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("grow maps") });
    let (side, _) = old.texture.format().block_dimensions();
    for level in 0..old.texture.mip_level_count() {
        let (width, height) = level_size(wanted.width, wanted.height, level);
        let part = |texture| wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: level,
            origin: wgpu::Origin3d::ZERO,
            aspect: wgpu::TextureAspect::All,
        };
        // Whole blocks, also where the level is smaller than one.
        let size = wgpu::Extent3d {
            width: width.next_multiple_of(side),
            height: height.next_multiple_of(side),
            depth_or_array_layers: old.uploaded as u32,
        };
        encoder.copy_texture_to_texture(part(&old.texture), part(&array.texture), size);
    }
    gpu.queue.submit([encoder.finish()]);
    array.uploaded = old.uploaded;
    array
}

fn make_array(device: &wgpu::Device, wanted: &TextureArray, layers: usize) -> ArrayTexture {
    let texels = if reads_blocks(device) || wanted.texels != Texels::Bc7 { wanted.texels } else { Texels::Rgba8 };
    let format = match (texels, wanted.srgb) {
        (Texels::Bc7, true) => wgpu::TextureFormat::Bc7RgbaUnormSrgb,
        (Texels::Bc7, false) => wgpu::TextureFormat::Bc7RgbaUnorm,
        (Texels::Rgba8, true) => wgpu::TextureFormat::Rgba8UnormSrgb,
        (Texels::Rgba8, false) => wgpu::TextureFormat::Rgba8Unorm,
        (Texels::Rgba16Float, _) => wgpu::TextureFormat::Rgba16Float,
        (Texels::R32Float, _) => height_format(device),
    };
    let label = format!("maps {}x{} {format:?}", wanted.width, wanted.height);
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some(&label),
        size: wgpu::Extent3d { width: wanted.width, height: wanted.height, depth_or_array_layers: layers as u32 },
        mip_level_count: level_count(wanted.width, wanted.height),
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST | TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = texture.create_view(&wgpu::TextureViewDescriptor {
        label: Some(&label),
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..wgpu::TextureViewDescriptor::default()
    });
    ArrayTexture { texture, view, uploaded: 0 }
}

fn write_layer(gpu: &Gpu, texture: &wgpu::Texture, layer: u32, image: &Image) -> u64 {
    let format = texture.format();
    let (side, _) = format.block_dimensions();
    let mut written = 0;
    for (level, bytes) in image.levels.iter().enumerate() {
        let (width, height) = level_size(image.width, image.height, level as u32);
        let bytes = match image.texels {
            Texels::Bc7 if side == 1 => Cow::Owned(blocks::decode(bytes, width, height)),
            Texels::R32Float => heights_as(format, bytes),
            _ => Cow::Borrowed(bytes.as_slice()),
        };
        let rows = height.div_ceil(side);
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture,
                mip_level: level as u32,
                origin: wgpu::Origin3d { x: 0, y: 0, z: layer },
                aspect: wgpu::TextureAspect::All,
            },
            &bytes,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(bytes.len() as u32 / rows),
                rows_per_image: None,
            },
            // Whole blocks, also where the level is smaller than one.
            wgpu::Extent3d {
                width: width.next_multiple_of(side),
                height: height.next_multiple_of(side),
                depth_or_array_layers: 1,
            },
        );
        written += bytes.len() as u64;
    }
    written
}

fn make_sampler(device: &wgpu::Device, sampler: Sampler) -> wgpu::Sampler {
    let wrap = |wrap| match wrap {
        Wrap::Repeat => wgpu::AddressMode::Repeat,
        Wrap::Mirror => wgpu::AddressMode::MirrorRepeat,
        Wrap::Clamp => wgpu::AddressMode::ClampToEdge,
    };
    let filter = |filter| match filter {
        Filter::Nearest => wgpu::FilterMode::Nearest,
        Filter::Linear => wgpu::FilterMode::Linear,
    };
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("material map"),
        address_mode_u: wrap(sampler.wrap_u),
        address_mode_v: wrap(sampler.wrap_v),
        mag_filter: filter(sampler.mag),
        min_filter: filter(sampler.min),
        mipmap_filter: match sampler.mip {
            MipFilter::Linear => wgpu::MipmapFilterMode::Linear,
            MipFilter::Nearest | MipFilter::None => wgpu::MipmapFilterMode::Nearest,
        },
        lod_max_clamp: if sampler.mip == MipFilter::None { 0.0 } else { 32.0 },
        ..wgpu::SamplerDescriptor::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_technique_finds_the_maps_that_it_goes_by() {
        for (name, technique) in Technique::ALL {
            let bound = bound_maps(technique);
            for map in technique.needs() {
                assert!(bound.contains(map), "{name} finds no {map:?}");
            }
        }
        assert!(bound_maps(Technique::PerturbedUv).contains(&MapSlot::Environment));
    }
}
