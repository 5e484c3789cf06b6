//! Sky of a world on the device: constants, and a map that worlds under the same sky share.

use crate::renderer::gpu::device::Gpu;
use std::sync::{Arc, Weak};
use systems::draw::{DrawnSky, SkyRecord};
use systems::weather::{Sky, SkyMap};

/// Maps that are on the device, as long as their skies live.
#[derive(Debug, Default)]
pub(crate) struct SkyTextures(Vec<(Weak<Sky>, wgpu::TextureView)>);

impl SkyTextures {
    /// The map of a sky, and the bytes that were uploaded for it.
    fn map(&mut self, gpu: &Gpu, sky: &Arc<Sky>) -> (wgpu::TextureView, u64) {
        self.0.retain(|(known, _)| known.strong_count() > 0);
        let known = self.0.iter().find(|(known, _)| known.as_ptr() == Arc::as_ptr(sky));
        if let Some((_, view)) = known {
            return (view.clone(), 0);
        }
        let map = &sky.map;
        let texture = texture(&gpu.device, SkyMap::SIDE as u32, map.sphere.len() as u32);
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
        let view = view(&texture);
        self.0.push((Arc::downgrade(sky), view.clone()));
        (view, bytes)
    }
}

/// Two layers: the upper half, and the sphere with its levels.
fn texture(device: &wgpu::Device, side: u32, levels: u32) -> wgpu::Texture {
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

fn view(texture: &wgpu::Texture) -> wgpu::TextureView {
    let dimension = Some(wgpu::TextureViewDimension::D2Array);
    texture.create_view(&wgpu::TextureViewDescriptor { dimension, ..wgpu::TextureViewDescriptor::default() })
}

/// A world's sky as passes read it.
#[derive(Debug)]
pub(crate) struct SkyBinding {
    record: wgpu::Buffer,
    map: wgpu::TextureView,
    sampler: wgpu::Sampler,
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
        let map = view(&texture(device, 1, 1));
        Self { record, map, sampler, uploaded: SkyRecord::default(), version: 0 }
    }

    /// Uploads a sky; returns the bytes. Without one, nothing reads it.
    pub fn upload(&mut self, gpu: &Gpu, sky: Option<&DrawnSky>, textures: &mut SkyTextures) -> u64 {
        let Some(sky) = sky else { return 0 };
        let (map, mut bytes) = textures.map(gpu, &sky.sky);
        if self.map != map {
            (self.map, self.version) = (map, self.version + 1);
        }
        if self.uploaded != sky.record {
            let record = bytemuck::bytes_of(&sky.record);
            gpu.queue.write_buffer(&self.record, 0, record);
            self.uploaded = sky.record;
            bytes += record.len() as u64;
        }
        bytes
    }

    /// Constants, map and sampler, in the order of their bindings.
    pub fn resources(&self) -> [wgpu::BindingResource<'_>; 3] {
        let Self { record, map, sampler, .. } = self;
        let (map, sampler) = (wgpu::BindingResource::TextureView(map), wgpu::BindingResource::Sampler(sampler));
        [record.as_entire_binding(), map, sampler]
    }
}
