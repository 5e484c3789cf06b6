//! Sky of a world on the device: constants, a map of its radiance, and openness in bricks. Worlds under the same sky
//! share the map, those with the same openness its textures.

use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::texture::{texture, whole_view};
use std::sync::{Arc, Weak};
use systems::draw::{DrawnSky, MoverTexel, SkyRecord};
use systems::weather::openness::Openness;
use systems::weather::{Sky, SkyMap};

/// Maps and openness that are on the device, as long as what they are made of lives.
#[derive(Debug, Default)]
pub(crate) struct SkyTextures {
    maps: Vec<(Weak<Sky>, wgpu::TextureView)>,
    openness: Vec<(Weak<Openness>, OpennessViews)>,
}

/// Table of bricks, and their openness to the sides and upward.
type OpennessViews = [wgpu::TextureView; 3];

/// The device's copy of a value, and the bytes that were uploaded for it.
fn of<T, V: Clone>(known: &mut Vec<(Weak<T>, V)>, value: &Arc<T>, upload: impl FnOnce(&T) -> (V, u64)) -> (V, u64) {
    known.retain(|(own, _)| own.strong_count() > 0);
    if let Some((_, view)) = known.iter().find(|(own, _)| own.as_ptr() == Arc::as_ptr(value)) {
        return (view.clone(), 0);
    }
    let (view, bytes) = upload(value);
    known.push((Arc::downgrade(value), view.clone()));
    (view, bytes)
}

fn upload_map(gpu: &Gpu, map: &SkyMap) -> (wgpu::TextureView, u64) {
    let texture = map_texture(&gpu.device, SkyMap::SIDE as u32, map.sphere.len() as u32);
    let levels = map.sphere.iter().map(|level| (1, &level[..]));
    let mut bytes = 0;
    for ((layer, texels), level) in levels.zip(0..).chain([((0, &map.hemisphere[..]), 0)]) {
        let (side, texels) = (SkyMap::SIDE as u32 >> level, bytemuck::cast_slice(texels));
        let origin = wgpu::Origin3d { z: layer, ..wgpu::Origin3d::ZERO };
        let target = wgpu::TexelCopyTextureInfo { mip_level: level, origin, ..texture.as_image_copy() };
        let layout = wgpu::TexelCopyBufferLayout { bytes_per_row: Some(side * 8), ..Default::default() };
        let size = wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 };
        gpu.queue.write_texture(target, texels, layout, size);
        bytes += texels.len() as u64;
    }
    (map_view(&texture), bytes)
}

fn upload_openness(gpu: &Gpu, openness: &Openness) -> (OpennessViews, u64) {
    let texels = (openness.texture_bricks * Openness::CORNERS).to_array();
    let all: [(_, _, &[u8]); 3] = [
        (openness.table_size.to_array(), TABLE, bytemuck::cast_slice(&openness.table)),
        (texels, SIDES, bytemuck::cast_slice(&openness.sides)),
        (texels, UP, &openness.up),
    ];
    let bytes = all.iter().map(|(_, _, texels)| texels.len() as u64).sum();
    let views = all.map(|(size, format, texels)| {
        let texture = volume(&gpu.device, size, format);
        let [width, height, depth_or_array_layers] = size;
        let bytes_per_row = texels.len() as u32 / (height * depth_or_array_layers);
        let layout = wgpu::TexelCopyBufferLayout {
            bytes_per_row: Some(bytes_per_row),
            rows_per_image: Some(height),
            ..Default::default()
        };
        let size = wgpu::Extent3d { width, height, depth_or_array_layers };
        gpu.queue.write_texture(texture.as_image_copy(), texels, layout, size);
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    });
    (views, bytes)
}

const TABLE: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;
const SIDES: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const UP: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// A texture of three dimensions.
fn volume(device: &wgpu::Device, [width, height, depth]: [u32; 3], format: wgpu::TextureFormat) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("openness"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: depth },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

/// Texels in a row of the movers' table.
pub(crate) const MOVERS_WIDTH: u32 = 1024;

fn movers_texture(device: &wgpu::Device, rows: u32) -> wgpu::Texture {
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    texture(device, "movers", (MOVERS_WIDTH, rows), wgpu::TextureFormat::Rgba32Uint, 1, usage)
}

/// Two layers: the upper half, and the sphere with its levels.
fn map_texture(device: &wgpu::Device, side: u32, levels: u32) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("sky"),
        size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 2 },
        mip_level_count: levels,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

fn map_view(texture: &wgpu::Texture) -> wgpu::TextureView {
    let dimension = Some(wgpu::TextureViewDimension::D2Array);
    texture.create_view(&wgpu::TextureViewDescriptor { dimension, ..wgpu::TextureViewDescriptor::default() })
}

/// A world's sky as passes read it.
#[derive(Debug)]
pub(crate) struct SkyBinding {
    record: wgpu::Buffer,
    map: wgpu::TextureView,
    sampler: wgpu::Sampler,
    openness: OpennessViews,
    /// With the texels that are uploaded.
    movers: (wgpu::Texture, wgpu::TextureView, Vec<MoverTexel>),
    uploaded: SkyRecord,
    /// Changes whenever bind groups are to be made anew.
    pub version: u32,
}

impl SkyBinding {
    /// No sky.
    pub fn new(device: &wgpu::Device) -> Self {
        let record = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("sky"),
            size: size_of::<SkyRecord>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("sky"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            mipmap_filter: wgpu::MipmapFilterMode::Linear,
            ..wgpu::SamplerDescriptor::default()
        });
        let map = map_view(&map_texture(device, 1, 1));
        let nothing = |format| volume(device, [1; 3], format).create_view(&wgpu::TextureViewDescriptor::default());
        let openness = [TABLE, SIDES, UP].map(nothing);
        let movers = movers_texture(device, 1);
        let movers = (movers.clone(), whole_view(&movers, "movers"), Vec::new());
        Self { record, map, sampler, openness, movers, uploaded: SkyRecord::default(), version: 0 }
    }

    /// Uploads a sky; returns the bytes. Without one, nothing reads it.
    pub fn upload(&mut self, gpu: &Gpu, sky: Option<&DrawnSky>, textures: &mut SkyTextures) -> u64 {
        let Some(sky) = sky else { return 0 };
        let (map, mut bytes) = of(&mut textures.maps, &sky.sky, |sky| upload_map(gpu, &sky.map));
        if self.map != map {
            (self.map, self.version) = (map, self.version + 1);
        }
        if let Some(openness) = &sky.openness {
            let (views, more) = of(&mut textures.openness, openness, |openness| upload_openness(gpu, openness));
            bytes += more;
            if self.openness != views {
                (self.openness, self.version) = (views, self.version + 1);
            }
        }
        bytes += self.upload_movers(gpu, &sky.movers.texels);
        if self.uploaded != sky.record {
            let record = bytemuck::bytes_of(&sky.record);
            gpu.queue.write_buffer(&self.record, 0, record);
            self.uploaded = sky.record;
            bytes += record.len() as u64;
        }
        bytes
    }

    /// Uploads the grid and its movers, if they are others.
    fn upload_movers(&mut self, gpu: &Gpu, texels: &[MoverTexel]) -> u64 {
        let (texture, view, uploaded) = &mut self.movers;
        if uploaded == texels || texels.is_empty() {
            return 0;
        }
        let rows = (texels.len() as u32).div_ceil(MOVERS_WIDTH);
        if texture.height() < rows {
            *texture = movers_texture(&gpu.device, rows.next_power_of_two());
            *view = whole_view(texture, "movers");
            self.version += 1;
        }
        uploaded.clear();
        uploaded.extend_from_slice(texels);
        let mut padded = texels.to_vec();
        padded.resize((rows * MOVERS_WIDTH) as usize, [0; 4]);
        let bytes: &[u8] = bytemuck::cast_slice(&padded);
        let layout = wgpu::TexelCopyBufferLayout { bytes_per_row: Some(MOVERS_WIDTH * 16), ..Default::default() };
        let size = wgpu::Extent3d { width: MOVERS_WIDTH, height: rows, depth_or_array_layers: 1 };
        gpu.queue.write_texture(texture.as_image_copy(), bytes, layout, size);
        bytes.len() as u64
    }

    /// Constants, map, sampler, openness and movers, in the order of their bindings.
    pub fn resources(&self) -> [wgpu::BindingResource<'_>; 7] {
        let texture = wgpu::BindingResource::TextureView;
        let [table, sides, up] = self.openness.each_ref().map(texture);
        let sampler = wgpu::BindingResource::Sampler(&self.sampler);
        [self.record.as_entire_binding(), texture(&self.map), sampler, table, sides, up, texture(&self.movers.1)]
    }
}
