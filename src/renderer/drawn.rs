//! How much was drawn. Only the GPU knows; its counts are in the arguments of the indirect draws.

use super::Gpu;
use super::culling::ARGUMENT_BYTES;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What the GPU drew, read back.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Drawn {
    /// Objects that culling kept, and blended ones in view.
    pub objects: u32,
    /// Triangles of those objects.
    pub triangles: u64,
}

impl Drawn {
    /// As many objects more, with that many indices each.
    pub(super) fn add(&mut self, objects: u32, indices: u32) {
        self.objects += objects;
        self.triangles += u64::from(objects) * u64::from(indices / 3);
    }

    /// What the arguments of some draws say.
    pub(super) fn add_arguments(&mut self, bytes: &[u8]) {
        instances_and_indices(bytes).for_each(|(instances, indices)| self.add(instances, indices));
    }
}

/// Of each of the arguments of some draws.
fn instances_and_indices(bytes: &[u8]) -> impl Iterator<Item = (u32, u32)> {
    bytes.chunks_exact(ARGUMENT_BYTES as usize).map(|arguments| {
        let word = |i: usize| u32::from_le_bytes([0, 1, 2, 3].map(|byte| arguments[4 * i + byte]));
        (word(1), word(0))
    })
}

/// Counts on their way, one frame's at a time, and the last that arrived. Nothing waits for them.
#[derive(Debug, Default)]
pub(super) struct DrawnCounts {
    under_way: Option<UnderWay>,
    /// Newer ones are to be sent as soon as those have arrived.
    pub wanted: bool,
    pub latest: Option<Drawn>,
    /// The instances of each of the arguments, phase after phase.
    instances: Vec<u32>,
}

#[derive(Debug)]
struct UnderWay {
    buffer: wgpu::Buffer,
    /// What is known already.
    blended: Drawn,
    arrived: Arc<AtomicBool>,
}

impl DrawnCounts {
    /// Sends so many arguments of draws in each buffer on their way, unless others are.
    pub fn send<'a>(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        arguments: impl ExactSizeIterator<Item = &'a wgpu::Buffer>,
        count: usize,
        blended: Drawn,
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
            self.instances.clear();
            self.instances.extend(instances_and_indices(&mapped).map(|(instances, _)| instances));
        }
    }

    /// How many instances an argument had in a recent draw, by its place among so many, phase after phase; `None` if
    /// the last that arrived were of another number of arguments.
    pub fn instances(&self, place: usize, arguments: usize) -> Option<u32> {
        self.instances.get(place).copied().filter(|_| self.instances.len() == arguments)
    }
}
