//! Counts of drawn objects. Only the GPU knows them: they are in the arguments of the indirect draws.

use super::cull::ARGUMENT_BYTES;
use crate::renderer::gpu::device::Gpu;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Counts of what the GPU drew, read back.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct VisibleCounts {
    /// Objects that culling kept, and blended ones in view.
    pub objects: u32,
    /// Triangles of those objects.
    pub triangles: u64,
}

impl VisibleCounts {
    /// Adds so many objects, with that many indices each.
    pub(crate) fn add(&mut self, objects: u32, indices: u32) {
        self.objects += objects;
        self.triangles += u64::from(objects) * u64::from(indices / 3);
    }

    /// Adds the counts in the arguments of some draws.
    pub(crate) fn add_arguments(&mut self, bytes: &[u8]) {
        for arguments in bytes.chunks_exact(ARGUMENT_BYTES as usize) {
            let word = |i: usize| u32::from_le_bytes([0, 1, 2, 3].map(|byte| arguments[4 * i + byte]));
            let (indices, instances) = (word(0), word(1));
            self.add(instances, indices);
        }
    }
}

/// Counts on their way, one frame's at a time, and the last that arrived. Nothing waits for them.
#[derive(Debug, Default)]
pub(crate) struct CountReadback {
    under_way: Option<UnderWay>,
    /// Newer ones are to be sent as soon as those have arrived.
    pub wanted: bool,
    pub latest: Option<VisibleCounts>,
}

#[derive(Debug)]
struct UnderWay {
    buffer: wgpu::Buffer,
    /// Counts of blended objects, which the CPU knows already.
    blended: VisibleCounts,
    arrived: Arc<AtomicBool>,
}

impl CountReadback {
    /// Sends so many arguments of draws in each buffer on their way, unless others are.
    pub fn send<'a>(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        arguments: impl ExactSizeIterator<Item = &'a wgpu::Buffer>,
        count: usize,
        blended: VisibleCounts,
    ) {
        let bytes = count as u64 * ARGUMENT_BYTES;
        if bytes == 0 {
            self.latest = Some(blended);
        }
        self.wanted = bytes > 0 && self.under_way.is_some();
        if bytes == 0 || self.wanted {
            return;
        }
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("drawn counts"),
            size: bytes * arguments.len() as u64,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        for (place, source) in (0..).zip(arguments) {
            encoder.copy_buffer_to_buffer(source, 0, &buffer, place * bytes, bytes);
        }
        let arrived = Arc::new(AtomicBool::new(false));
        let tell = arrived.clone();
        // A buffer that cannot be mapped never arrives: the device is lost then.
        encoder.map_buffer_on_submit(&buffer, wgpu::MapMode::Read, .., move |mapped| {
            tell.store(mapped.is_ok(), Ordering::Release);
        });
        self.under_way = Some(UnderWay { buffer, blended, arrived });
    }

    /// Takes what has arrived.
    pub fn receive(&mut self) {
        let Some(counts) = self.under_way.take_if(|counts| counts.arrived.load(Ordering::Acquire)) else { return };
        if let Ok(mapped) = counts.buffer.slice(..).get_mapped_range() {
            let mut drawn = counts.blended;
            drawn.add_arguments(&mapped);
            self.latest = Some(drawn);
        }
    }
}
