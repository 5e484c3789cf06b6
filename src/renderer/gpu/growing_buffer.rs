//! Buffers that grow, and take only what changed.

use super::device::Gpu;
use super::error::RenderError;
use systems::ecs::tables::DirtySlots;

/// A storage or vertex buffer that grows.
#[derive(Debug)]
pub(crate) struct GrowingBuffer {
    label: &'static str,
    usage: wgpu::BufferUsages,
    buffer: wgpu::Buffer,
    /// Changes whenever `buffer` is another one: bind groups are made anew.
    pub version: u32,
}

/// The size that a buffer of `held` bytes grows to: what is needed, or half as much again as it held, so that little by
/// little it does not grow often; but no more than `limit` while `needed` fits.
fn grown(held: u64, needed: u64, limit: u64) -> u64 {
    needed.max(held + held / 2).next_multiple_of(256).min(limit.max(needed))
}

/// Clean records between two dirty ranges that are written along: a write call costs about as much as 4 KiB.
pub(crate) fn gap(record_size: usize) -> u32 {
    (4096 / record_size) as u32
}

impl GrowingBuffer {
    pub fn new(device: &wgpu::Device, label: &'static str, usage: wgpu::BufferUsages) -> Self {
        let usage = usage | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
        Self { label, usage, buffer: make(device, label, usage, 256), version: 0 }
    }

    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// Makes room for `bytes`; says whether the contents are lost.
    pub fn reserve(&mut self, device: &wgpu::Device, bytes: u64) -> Result<bool, RenderError> {
        if bytes <= self.buffer.size() {
            return Ok(false);
        }
        let limits = device.limits();
        let limit = if self.usage.contains(wgpu::BufferUsages::STORAGE) {
            limits.max_buffer_size.min(limits.max_storage_buffer_binding_size)
        } else {
            limits.max_buffer_size
        };
        if bytes > limit {
            return Err(RenderError::TooLarge { what: self.label, unit: "bytes", needed: bytes, limit });
        }
        self.buffer = make(device, self.label, self.usage, grown(self.buffer.size(), bytes, limit));
        self.version += 1;
        Ok(true)
    }

    /// Another buffer of at least so many bytes, whatever it had; its contents are lost.
    pub fn resize(&mut self, device: &wgpu::Device, bytes: u64) {
        self.buffer = make(device, self.label, self.usage, bytes.max(256).next_multiple_of(256));
        self.version += 1;
    }

    /// [`Self::reserve`], keeping the first `used` bytes.
    pub fn extend(&mut self, gpu: &Gpu, used: u64, bytes: u64) -> Result<(), RenderError> {
        let old = self.buffer.clone();
        if self.reserve(&gpu.device, bytes)? && used > 0 {
            let mut encoder =
                gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("grow") });
            encoder.copy_buffer_to_buffer(&old, 0, &self.buffer, 0, used);
            gpu.queue.submit([encoder.finish()]);
        }
        Ok(())
    }

    /// Brings the buffer up to date with `records`: all of them if it grew or `everything` is asked for, else the dirty
    /// ones. Returns the bytes written.
    pub fn write<T: bytemuck::Pod>(
        &mut self,
        gpu: &Gpu,
        records: &[T],
        dirty: &DirtySlots,
        everything: bool,
    ) -> Result<u64, RenderError> {
        let size = size_of::<T>();
        let lost = self.reserve(&gpu.device, size_of_val(records) as u64)?;
        let all = 0..records.len() as u32;
        let (all, some) = if lost || everything { (Some(all), Vec::new()) } else { (None, dirty.ranges(gap(size))) };
        let mut written = 0;
        for range in all.into_iter().chain(some) {
            let bytes: &[u8] = bytemuck::cast_slice(&records[range.start as usize..range.end as usize]);
            if !bytes.is_empty() {
                gpu.queue.write_buffer(&self.buffer, u64::from(range.start) * size as u64, bytes);
                written += bytes.len() as u64;
            }
        }
        Ok(written)
    }
}

fn make(device: &wgpu::Device, label: &'static str, usage: wgpu::BufferUsages, size: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buffers_hold_what_is_needed_and_grow_by_half_up_to_the_limit() {
        assert_eq!(grown(256, 100_000, 1 << 30), 100_096, "all at once");
        assert_eq!(grown(1024, 1025, 1 << 30), 1536, "little by little");
        assert_eq!(grown(512, 600, 700), 700);
        assert_eq!(grown(0, 1024, 1 << 30), 1024);
    }
}
