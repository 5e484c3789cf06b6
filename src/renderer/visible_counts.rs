//! How much was drawn. Only the GPU knows; its counts are in the arguments of the indirect draws.

use super::culling::ARGUMENT_BYTES;
use super::{Gpu, Renderer, ViewState, read_buffer};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What the GPU drew, read back.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct VisibleCounts {
    /// Objects that culling kept, and blended ones in view.
    pub objects: u32,
    /// Triangles of those objects.
    pub triangles: u64,
}

impl VisibleCounts {
    /// As many objects more, with that many indices each.
    pub(super) fn add(&mut self, objects: u32, indices: u32) {
        self.objects += objects;
        self.triangles += u64::from(objects) * u64::from(indices / 3);
    }

    /// What the arguments of some draws say.
    pub(super) fn add_arguments(&mut self, bytes: &[u8]) {
        for arguments in bytes.chunks_exact(ARGUMENT_BYTES as usize) {
            let word = |i: usize| u32::from_le_bytes([0, 1, 2, 3].map(|byte| arguments[4 * i + byte]));
            let (indices, instances) = (word(0), word(1));
            self.add(instances, indices);
        }
    }
}

/// Counts on their way, one frame's at a time, and the last that arrived. Nothing waits for them.
#[derive(Debug, Default)]
pub(super) struct CountReadback {
    under_way: Option<UnderWay>,
    /// Newer ones are to be sent as soon as those have arrived.
    pub wanted: bool,
    pub latest: Option<VisibleCounts>,
}

#[derive(Debug)]
struct UnderWay {
    buffer: wgpu::Buffer,
    /// What is known already.
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

impl Renderer {
    /// How much the last frame drew of a view; nothing of one that was not prepared for it. Waits for the GPU.
    pub fn read_visible_counts(&self, view: &ViewState) -> VisibleCounts {
        if !self.is_prepared(view) {
            return VisibleCounts::default();
        }
        if view.culled.direct().is_some() {
            return self.direct_counts(view);
        }
        let mut drawn = self.visible_blended(view);
        let bytes = self.draws_of(view).list.len() as u64 * ARGUMENT_BYTES;
        for phase in view.phases().filter(|_| bytes > 0) {
            drawn.add_arguments(&read_buffer(&self.gpu, view.culled.arguments(phase), bytes));
        }
        drawn
    }

    /// Instance slots of the opaque objects that the last frame drew of a view: those of each phase in the order in
    /// which it drew them; none of one that was not prepared for it. Waits for the GPU.
    pub fn read_visible_slots(&self, view: &ViewState) -> Vec<u32> {
        if !self.is_prepared(view) {
            return Vec::new();
        }
        if let Some(direct) = view.culled.direct() {
            return direct.slots.clone();
        }
        let words = |buffer: &wgpu::Buffer| {
            let bytes = read_buffer(&self.gpu, buffer, buffer.size());
            bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect::<Vec<_>>()
        };
        let first_instance = self.gpu.device.features().contains(wgpu::Features::INDIRECT_FIRST_INSTANCE);
        let visible = words(view.culled.visible());
        let mut slots = Vec::new();
        for phase in view.phases() {
            let arguments = words(view.culled.arguments(phase));
            let drawn = arguments.chunks_exact(ARGUMENT_BYTES as usize / 4);
            for (draw, arguments) in self.draws_of(view).list.iter().zip(drawn) {
                // Where indirect draws all begin at the first instance, it is the lists that lie apart.
                let apart = draw.first_visible + view.culled.list_offset(phase);
                let first = if first_instance { arguments[4] } else { apart } as usize;
                let count = arguments[1] as usize;
                slots.extend(visible.iter().skip(first).take(count));
            }
        }
        slots
    }

    /// Of a view whose objects were culled on the CPU.
    pub(super) fn direct_counts(&self, view: &ViewState) -> VisibleCounts {
        let mut drawn = self.visible_blended(view);
        let listed = view.culled.direct().map_or(&[][..], |direct| &direct.ranges);
        for (draw, slots) in self.draws_of(view).list.iter().zip(listed) {
            drawn.add(slots.len() as u32, draw.indirect.index_count);
        }
        drawn
    }

    /// Blended objects are not culled by the GPU.
    pub(super) fn visible_blended(&self, view: &ViewState) -> VisibleCounts {
        let mut drawn = VisibleCounts::default();
        for run in &view.blended_runs {
            let whole = self.assets.meshes.range(run.key.mesh).and_then(|mesh| mesh.levels.first());
            drawn.add(run.slots.len() as u32, whole.map_or(0, |level| level.index_count));
        }
        drawn
    }
}
