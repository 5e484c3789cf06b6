//! Textures and buffers back to the CPU.

use super::{Gpu, PICTURE_FORMAT, RenderError, targets};

/// A texture of [`PICTURE_FORMAT`] for a view to be drawn into and [`read_texture`] to read. `size`: pixels.
pub fn picture_texture(gpu: &Gpu, size: (u32, u32)) -> wgpu::Texture {
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
    targets::texture(&gpu.device, "picture", size, PICTURE_FORMAT, 1, usage)
}

/// The texels of a texture's first level, rows tightly packed. Waits for the GPU. Zeros where that fails, which
/// [`Gpu::check`] tells.
pub fn read_texture(gpu: &Gpu, texture: &wgpu::Texture, aspect: wgpu::TextureAspect) -> Vec<u8> {
    let size = texture.size();
    let texel = texture.format().block_copy_size(Some(aspect)).unwrap_or(4);
    let row = size.width * texel;
    let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = mappable(gpu, u64::from(padded) * u64::from(size.height));
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("read back") });
    encoder.copy_texture_to_buffer(
        wgpu::TexelCopyTextureInfo { texture, mip_level: 0, origin: wgpu::Origin3d::ZERO, aspect },
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded), rows_per_image: None },
        },
        size,
    );
    gpu.queue.submit([encoder.finish()]);
    let bytes = map(gpu, &buffer);
    bytes.chunks_exact(padded as usize).flat_map(|padded_row| &padded_row[..row as usize]).copied().collect()
}

/// The first bytes of a buffer. Waits for the GPU. Zeros where that fails, as above.
pub(super) fn read_buffer(gpu: &Gpu, source: &wgpu::Buffer, bytes: u64) -> Vec<u8> {
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
    let slice = buffer.slice(..);
    slice.map_async(wgpu::MapMode::Read, |_| {});
    gpu.poll(wgpu::PollType::wait_indefinitely());
    slice.get_mapped_range().map_or_else(
        |error| {
            gpu.faults.note(RenderError::Refused { reason: error.to_string() });
            vec![0; buffer.size() as usize]
        },
        |mapped| mapped.to_vec(),
    )
}
