//! The pace of uploads.

use super::device::Gpu;

/// Uploads of all there is are submitted after this many bytes: until the GPU has them there is a copy, whose memory
/// the driver may keep.
pub(crate) const FEW_BYTES_UNDER_WAY: u64 = 4 << 20;

/// Submits uploads little by little. Nothing waits for them.
#[derive(Debug)]
pub(crate) struct Pace {
    under_way: u64,
    pub most: u64,
}

impl Pace {
    /// Submits after so many bytes.
    pub fn new(most: u64) -> Self {
        Self { under_way: 0, most }
    }

    /// After that many bytes were handed in.
    pub fn handed_in(&mut self, gpu: &Gpu, bytes: u64) {
        self.under_way += bytes;
        if self.under_way >= self.most {
            gpu.queue.submit([]);
            // Copies of what has arrived are freed.
            gpu.poll(wgpu::PollType::Poll);
            self.under_way = 0;
        }
    }
}
