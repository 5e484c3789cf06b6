//! Texture arrays, samplers, and the bind group of each material class.

use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::error::RenderError;
use crate::renderer::gpu::pace::{FEW_BYTES_UNDER_WAY, Pace};
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
    /// Encoding of the array that it was made for.
    srgb: bool,
    texels: Texels,
    /// Image in each layer, and its revision in the library.
    layers: Vec<Option<(ImageId, u64)>>,
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

/// Textures and bind groups of materials.
#[derive(Debug)]
pub(crate) struct Textures {
    pub layout: wgpu::BindGroupLayout,
    /// `None` where no image is.
    arrays: Vec<Option<ArrayTexture>>,
    samplers: BTreeMap<Sampler, wgpu::Sampler>,
    /// By number; without groups where one of the arrays has no images.
    classes: Vec<(MaterialClass, Option<ClassGroups>)>,
    /// The version of the list's textures and the revision of the library's images that were looked at last.
    seen: Option<(u64, u64)>,
    version: u64,
    /// Warning given that heights are drawn in steps: once is enough, however many arrays have them.
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
        Self {
            layout,
            arrays: Vec::new(),
            samplers: BTreeMap::new(),
            classes: Vec::new(),
            seen: None,
            version: 0,
            said_steps: false,
        }
    }

    /// Bind group of a material class for a technique.
    pub fn class(&self, class: ClassId, technique: Technique) -> Option<&wgpu::BindGroup> {
        let (_, groups) = self.classes.get(class.0 as usize)?;
        let groups = groups.as_ref()?;
        Some(if technique == Technique::PerturbedUv { &groups.perturbed_uv } else { &groups.others })
    }

    /// Changes whenever what a layer shows did.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Bytes of all texture arrays.
    pub fn bytes(&self) -> u64 {
        self.arrays.iter().flatten().map(|array| texture_bytes(&array.texture)).sum()
    }

    /// Uploads layers that are new or replaced, which is when the library may drop their texels; gives up those without
    /// an image; binds classes that are new or whose arrays are other textures. Returns the bytes written.
    pub fn upload(&mut self, gpu: &Gpu, list: &DrawList, library: &mut Library) -> Result<u64, RenderError> {
        let now = Some((list.textures_version, library.revisions().images));
        if self.seen == now {
            return Ok(0);
        }
        self.fit(gpu, list, library)?;
        let (mut written, mut pace) = (0, Pace::new(FEW_BYTES_UNDER_WAY));
        for (wanted, array) in list.texture_arrays.iter().zip(&mut self.arrays) {
            let Some(array) = array else { continue };
            for (layer, content) in contents(wanted, library).into_iter().enumerate() {
                let held = array.layers[layer];
                if content == held {
                    continue;
                }
                self.version += 1;
                array.layers[layer] = None;
                let Some((id, image)) = content.and_then(|(id, _)| Some((id, library.image(id)?))) else { continue };
                if image.levels.is_empty() {
                    return Err(RenderError::NoTexels { image: image.name.clone() });
                }
                let bytes = write_layer(gpu, &array.texture, layer as u32, image);
                pace.handed_in(gpu, bytes);
                written += bytes;
                library.release_texels(id);
                array.layers[layer] = content;
            }
        }
        self.bind(&gpu.device, list);
        self.seen = now;
        Ok(written)
    }

    /// Makes arrays that are missing, too small, or much too large; what they have in common with the old ones is
    /// copied.
    fn fit(&mut self, gpu: &Gpu, list: &DrawList, library: &Library) -> Result<(), RenderError> {
        self.arrays.resize_with(list.texture_arrays.len(), || None);
        for (wanted, array) in list.texture_arrays.iter().zip(&mut self.arrays) {
            let old = array.take_if(|old| wanted.layers.is_empty() || !old.is_for(wanted));
            let mut changed = old.is_some();
            drop(old);
            let held = array.as_ref().map(|array| array.texture.depth_or_array_layers() as usize);
            let needed = wanted.layers.len();
            let layers = match held {
                _ if needed == 0 => None,
                None => Some(needed),
                // Half as many again, so that images that come one by one are not copied often.
                Some(held) if needed > held => Some((held + held / 2).min(most_layers(wanted)).max(needed)),
                Some(held) if 2 * needed <= held => Some(needed),
                Some(held) => array.as_ref().is_some_and(|array| array.is_mixed_up(wanted, library)).then_some(held),
            };
            if let Some(layers) = layers {
                check_size(&gpu.device, wanted, library)?;
                let mut new = make_array(&gpu.device, wanted, layers);
                if let Some(old) = array.as_ref() {
                    new.take_over(gpu, old, wanted, library);
                }
                if new.texture.format() == wgpu::TextureFormat::R16Float && !self.said_steps {
                    tracing::warn!(
                        "this adapter cannot filter 16-bit heights: they are drawn in steps of up to 1/2048"
                    );
                    self.said_steps = true;
                }
                *array = Some(new);
                changed = true;
            }
            if changed {
                self.version += 1;
                // Any class may hold a view of the old texture.
                self.classes.clear();
            }
        }
        Ok(())
    }

    fn bind(&mut self, device: &wgpu::Device, list: &DrawList) {
        self.classes.truncate(list.classes.len());
        for (number, class) in list.classes.iter().enumerate() {
            if self.classes.get(number).is_some_and(|(bound, _)| bound == class) {
                continue;
            }
            for sampler in class.samplers {
                self.samplers.entry(sampler).or_insert_with(|| make_sampler(device, sampler));
            }
            let group = |technique| self.group(device, class, bound_maps(technique));
            let groups = group(Technique::PerturbedUv).zip(group(Technique::Normal));
            let groups = groups.map(|(perturbed_uv, others)| ClassGroups { perturbed_uv, others });
            match self.classes.get_mut(number) {
                Some(bound) => *bound = (*class, groups),
                None => self.classes.push((*class, groups)),
            }
        }
    }

    /// `None` where one of the arrays has no images.
    fn group(
        &self,
        device: &wgpu::Device,
        class: &MaterialClass,
        maps: [MapSlot; BOUND_MAPS],
    ) -> Option<wgpu::BindGroup> {
        let array = |map: MapSlot| self.arrays.get(class.arrays[map as usize] as usize)?.as_ref();
        let sampler = |map: MapSlot| &self.samplers[&class.samplers[map as usize]];
        let views = maps.iter().map(|&map| Some(wgpu::BindingResource::TextureView(&array(map)?.view)));
        let views: Vec<_> = views.collect::<Option<_>>()?;
        let samplers = maps.iter().map(|&map| wgpu::BindingResource::Sampler(sampler(map)));
        let entries: Vec<_> = views
            .into_iter()
            .chain(samplers)
            .enumerate()
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding: binding as u32, resource })
            .collect();
        Some(device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("material class"),
            layout: &self.layout,
            entries: &entries,
        }))
    }
}

/// Refuses images that are larger than the device's textures.
fn check_size(device: &wgpu::Device, wanted: &TextureArray, library: &Library) -> Result<(), RenderError> {
    let limit = device.limits().max_texture_dimension_2d;
    if wanted.width.max(wanted.height) <= limit {
        return Ok(());
    }
    let image = wanted.layers.iter().flatten().next().and_then(|&image| library.image(image));
    let image = image.map_or_else(String::new, |image| image.name.clone());
    Err(RenderError::MapTooLarge { image, size: [wanted.width, wanted.height], limit })
}

/// Tells if the device reads block-compressed textures; if not, their blocks are uploaded as texels.
fn reads_blocks(device: &wgpu::Device) -> bool {
    device.features().contains(wgpu::Features::TEXTURE_COMPRESSION_BC)
}

/// Filterable format for heights of more than 8 bits. Graphics cards have one of the first two, most have both.
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

/// Wanted content of each layer of an array: images of the library that fit it, at their current revision.
fn contents(wanted: &TextureArray, library: &Library) -> Vec<Option<(ImageId, u64)>> {
    let content = |id: ImageId| {
        let fits = library.image(id).is_some_and(|image| TextureArray::of(image).same_format(wanted));
        library.image_revision(id).filter(|_| fits).map(|revision| (id, revision))
    };
    wanted.layers.iter().map(|layer| layer.and_then(content)).collect()
}

impl ArrayTexture {
    /// Tells if its layers can hold the images of that array.
    fn is_for(&self, wanted: &TextureArray) -> bool {
        let size = (self.texture.width(), self.texture.height());
        (size, self.srgb, self.texels) == ((wanted.width, wanted.height), wanted.srgb, wanted.texels)
    }

    /// The layer that shows that.
    fn find(&self, content: (ImageId, u64)) -> Option<usize> {
        self.layers.iter().position(|layer| *layer == Some(content))
    }

    /// Tells if an image is in another layer than it is to be.
    fn is_mixed_up(&self, wanted: &TextureArray, library: &Library) -> bool {
        let contents = contents(wanted, library);
        (0..)
            .zip(contents)
            .any(|(layer, content)| content.is_some_and(|content| self.find(content).is_some_and(|held| held != layer)))
    }

    /// Copies the layers that an old one has.
    fn take_over(&mut self, gpu: &Gpu, old: &Self, wanted: &TextureArray, library: &Library) {
        let mut encoder =
            gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("move maps") });
        let (side, _) = old.texture.format().block_dimensions();
        for (layer, content) in contents(wanted, library).into_iter().enumerate() {
            let Some(from) = content.and_then(|content| old.find(content)) else { continue };
            for level in 0..old.texture.mip_level_count() {
                let (width, height) = level_size(wanted.width, wanted.height, level);
                let part = |texture, layer: usize| wgpu::TexelCopyTextureInfo {
                    texture,
                    mip_level: level,
                    origin: wgpu::Origin3d { x: 0, y: 0, z: layer as u32 },
                    aspect: wgpu::TextureAspect::All,
                };
                // Whole blocks, also where the level is smaller than one.
                let size = wgpu::Extent3d {
                    width: width.next_multiple_of(side),
                    height: height.next_multiple_of(side),
                    depth_or_array_layers: 1,
                };
                encoder.copy_texture_to_texture(part(&old.texture, from), part(&self.texture, layer), size);
            }
            self.layers[layer] = content;
        }
        gpu.queue.submit([encoder.finish()]);
    }
}

/// Bytes of all levels of all layers.
fn texture_bytes(texture: &wgpu::Texture) -> u64 {
    let (side, format) = (texture.format().block_dimensions().0, texture.format());
    let blocks = (0..texture.mip_level_count()).map(|level| {
        let (width, height) = level_size(texture.width(), texture.height(), level);
        u64::from(width.div_ceil(side)) * u64::from(height.div_ceil(side))
    });
    let block = u64::from(format.block_copy_size(None).unwrap_or_default());
    u64::from(texture.depth_or_array_layers()) * blocks.sum::<u64>() * block
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
    ArrayTexture { texture, view, srgb: wanted.srgb, texels: wanted.texels, layers: vec![None; layers] }
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
