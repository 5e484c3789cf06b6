//! Textures and buffers back to the CPU.

use super::device::Gpu;
use super::error::RenderError;
use super::formats::PICTURE_FORMAT;
use super::texture::texture;
use glam::UVec2;

/// A texture of [`PICTURE_FORMAT`] for a view to be drawn into and [`read_texture`] to read. `size`: pixels.
pub fn picture_texture(gpu: &Gpu, size: (u32, u32)) -> wgpu::Texture {
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
    texture(&gpu.device, "picture", size, PICTURE_FORMAT, 1, usage)
}

/// The texels of a texture's first level, rows tightly packed. Waits for the GPU. Zeros where that fails, which
/// [`Gpu::check`] tells.
pub fn read_texture(gpu: &Gpu, texture: &wgpu::Texture) -> Vec<u8> {
    let [texels] = Readback::default().read(gpu, new_encoder(gpu), &[Some(texture.clone())]);
    texels
}

/// Textures on their way to the CPU, through buffers that are kept.
#[derive(Debug, Default)]
pub(crate) struct Readback {
    free: Vec<wgpu::Buffer>,
}

/// Copies of textures that were submitted and not waited for.
#[derive(Debug)]
pub(crate) struct Pending {
    buffer: wgpu::Buffer,
    sources: Vec<Source>,
}

impl Pending {
    /// Bytes of its buffer.
    pub fn bytes(&self) -> u64 {
        self.buffer.size()
    }
}

/// Layers of a texture to be read, or as many pictures one below the other in a single layer.
#[derive(Clone, Debug)]
pub(crate) struct Source {
    pub texture: wgpu::Texture,
    /// Size of a layer, pixels.
    pub size: (u32, u32),
    pub layers: u32,
}

/// Texels of a source in a mapped buffer, whose rows are padded.
#[derive(Clone, Copy)]
pub(crate) struct Packed<'a> {
    bytes: &'a [u8],
    row: usize,
    padded_row: usize,
    rows: usize,
}

impl Packed<'_> {
    /// The texels of a layer, rows tightly packed.
    pub fn layer(&self, layer: u32) -> Vec<u8> {
        let first = layer as usize * self.rows * self.padded_row;
        let rows = self.bytes[first..].chunks_exact(self.padded_row).take(self.rows);
        let mut texels = Vec::with_capacity(self.row * self.rows);
        rows.for_each(|row| texels.extend_from_slice(&row[..self.row]));
        texels
    }
}

impl Source {
    fn row(&self) -> u32 {
        self.size.0 * texel_bytes(&self.texture, aspect_of(&self.texture))
    }

    fn padded_row(&self) -> u32 {
        self.row().next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
    }

    fn bytes(&self) -> u64 {
        u64::from(self.padded_row()) * u64::from(self.size.1) * u64::from(self.layers)
    }
}

impl Readback {
    /// Submits commands, and behind them copies of the first levels of some textures: their texels, rows tightly
    /// packed, none of those that are `None`. Waits for the GPU, once.
    pub fn read<const N: usize>(
        &mut self,
        gpu: &Gpu,
        encoder: wgpu::CommandEncoder,
        textures: &[Option<wgpu::Texture>; N],
    ) -> [Vec<u8>; N] {
        let source = |texture: &wgpu::Texture| Source {
            texture: texture.clone(),
            size: (texture.width(), texture.height()),
            layers: 1,
        };
        let sources: Vec<Source> = textures.iter().flatten().map(source).collect();
        let bytes: u64 = sources.iter().map(Source::bytes).sum();
        if N > 1 && bytes > gpu.device.limits().max_buffer_size {
            // One after another, with a wait for each.
            gpu.queue.submit([encoder.finish()]);
            return textures.each_ref().map(|texture| {
                let [texels] = Self::default().read(gpu, new_encoder(gpu), std::array::from_ref(texture));
                texels
            });
        }
        let pending = self.submit(gpu, encoder, sources);
        let read = self.finish(gpu, pending, |packed| packed.iter().map(|packed| packed.layer(0)).collect::<Vec<_>>());
        self.keep(0);
        let mut read = read.into_iter();
        textures.each_ref().map(|texture| texture.as_ref().and_then(|_| read.next()).unwrap_or_default())
    }

    /// Submits commands, and behind them copies of some textures, which [`Self::finish`] waits for.
    pub fn submit(&mut self, gpu: &Gpu, mut encoder: wgpu::CommandEncoder, sources: Vec<Source>) -> Pending {
        let end = sources.iter().map(Source::bytes).sum::<u64>().max(4);
        let large_enough = self.free.iter().position(|buffer| buffer.size() >= end);
        let buffer = match large_enough {
            Some(index) => self.free.swap_remove(index),
            None => mappable(gpu, end),
        };
        let mut offset = 0;
        for source in &sources {
            let layout =
                wgpu::TexelCopyBufferLayout { offset, bytes_per_row: Some(source.padded_row()), rows_per_image: None };
            // Layers, or all of a single one.
            let layers = source.layers.min(source.texture.depth_or_array_layers());
            let height = source.size.1 * (source.layers / layers);
            encoder.copy_texture_to_buffer(
                first_level(&source.texture, aspect_of(&source.texture), wgpu::Origin3d::ZERO),
                wgpu::TexelCopyBufferInfo {
                    buffer: &buffer,
                    layout: wgpu::TexelCopyBufferLayout { rows_per_image: Some(height), ..layout },
                },
                wgpu::Extent3d { width: source.size.0, height, depth_or_array_layers: layers },
            );
            offset += source.bytes();
        }
        gpu.queue.submit([encoder.finish()]);
        buffer.slice(..).map_async(wgpu::MapMode::Read, |_| {});
        Pending { buffer, sources }
    }

    /// Waits for the GPU, and makes something of the copies.
    pub fn finish<T>(&mut self, gpu: &Gpu, pending: Pending, make: impl FnOnce(&[Packed<'_>]) -> T) -> T {
        let Pending { buffer, sources } = pending;
        let made = read_mapped(gpu, &buffer, |bytes| {
            let mut offset = 0;
            let packed = |source: &Source| {
                let bytes = &bytes[offset as usize..(offset + source.bytes()) as usize];
                offset += source.bytes();
                let (row, padded_row) = (source.row() as usize, source.padded_row() as usize);
                Packed { bytes, row, padded_row, rows: source.size.1 as usize }
            };
            make(&sources.iter().map(packed).collect::<Vec<_>>())
        });
        self.free.push(buffer);
        made
    }

    /// Keeps the largest of its buffers, and of the others as many as have no more than so many bytes together.
    pub fn keep(&mut self, bytes: u64) {
        self.free.sort_by_key(|buffer| std::cmp::Reverse(buffer.size()));
        let mut sum = 0;
        let mut is_largest = true;
        self.free.retain(|buffer| {
            sum += buffer.size();
            std::mem::take(&mut is_largest) || sum <= bytes
        });
    }
}

fn new_encoder(gpu: &Gpu) -> wgpu::CommandEncoder {
    gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("read back") })
}

fn aspect_of(texture: &wgpu::Texture) -> wgpu::TextureAspect {
    let is_depth = texture.format().has_depth_aspect();
    if is_depth { wgpu::TextureAspect::DepthOnly } else { wgpu::TextureAspect::All }
}

fn texel_bytes(texture: &wgpu::Texture, aspect: wgpu::TextureAspect) -> u32 {
    texture.format().block_copy_size(Some(aspect)).unwrap_or(4)
}

fn first_level(
    texture: &wgpu::Texture,
    aspect: wgpu::TextureAspect,
    origin: wgpu::Origin3d,
) -> wgpu::TexelCopyTextureInfo<'_> {
    wgpu::TexelCopyTextureInfo { texture, mip_level: 0, origin, aspect }
}

/// Submits commands, and behind them a copy of one texel of ids and one of depths. Waits for the GPU.
pub(crate) fn read_id_and_depth(
    gpu: &Gpu,
    mut encoder: wgpu::CommandEncoder,
    id: &wgpu::Texture,
    depth: &wgpu::Texture,
    pixel: UVec2,
) -> [[u8; 4]; 2] {
    let buffer = mappable(gpu, 8);
    let one = wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 };
    let origin = wgpu::Origin3d { x: pixel.x, y: pixel.y, z: 0 };
    let layout = |bytes_per_row| wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
    encoder.copy_texture_to_buffer(
        first_level(id, wgpu::TextureAspect::All, origin),
        wgpu::TexelCopyBufferInfo { buffer: &buffer, layout: layout(None) },
        one,
    );
    // Of depths there are copies of whole textures only (WebGPU, "texture-to-buffer copies"): on the GPU.
    let row = (depth.width() * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let all = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("depths"),
        size: u64::from(row) * u64::from(depth.height()),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    encoder.copy_texture_to_buffer(
        first_level(depth, wgpu::TextureAspect::DepthOnly, wgpu::Origin3d::ZERO),
        wgpu::TexelCopyBufferInfo { buffer: &all, layout: layout(Some(row)) },
        depth.size(),
    );
    let texel = u64::from(pixel.y) * u64::from(row) + u64::from(pixel.x) * 4;
    encoder.copy_buffer_to_buffer(&all, texel, &buffer, 4, 4);
    gpu.queue.submit([encoder.finish()]);
    mapped(gpu, &buffer, |bytes| [[0, 1, 2, 3], [4, 5, 6, 7]].map(|places| places.map(|place| bytes[place])))
}

/// The first bytes of a buffer. Waits for the GPU. Zeros where that fails, as above.
pub(crate) fn read_buffer(gpu: &Gpu, source: &wgpu::Buffer, bytes: u64) -> Vec<u8> {
    let buffer = mappable(gpu, bytes);
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("read back") });
    encoder.copy_buffer_to_buffer(source, 0, &buffer, 0, bytes);
    gpu.queue.submit([encoder.finish()]);
    map(gpu, &buffer)
}

fn mappable(gpu: &Gpu, size: u64) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    })
}

fn map(gpu: &Gpu, buffer: &wgpu::Buffer) -> Vec<u8> {
    mapped(gpu, buffer, <[u8]>::to_vec)
}

/// Maps a buffer and converts its bytes, or zeros where it cannot be mapped. Waits for the GPU.
fn mapped<T>(gpu: &Gpu, buffer: &wgpu::Buffer, make: impl FnOnce(&[u8]) -> T) -> T {
    buffer.slice(..).map_async(wgpu::MapMode::Read, |_| {});
    read_mapped(gpu, buffer, make)
}

/// Waits for the GPU until a buffer is mapped, and unmaps it after its bytes are converted.
fn read_mapped<T>(gpu: &Gpu, buffer: &wgpu::Buffer, make: impl FnOnce(&[u8]) -> T) -> T {
    gpu.poll(wgpu::PollType::wait_indefinitely());
    let made = match buffer.slice(..).get_mapped_range() {
        Ok(bytes) => make(&bytes),
        Err(error) => {
            gpu.faults.note(RenderError::Refused { reason: error.to_string() });
            return make(&vec![0; buffer.size() as usize]);
        }
    };
    buffer.unmap();
    made
}
