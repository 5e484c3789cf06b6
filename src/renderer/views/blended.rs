//! The blended objects of a view, in the order in which they are drawn.

use crate::renderer::culling::slot_set::SlotSet;
use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::error::RenderError;
use crate::renderer::gpu::growing_buffer::GrowingBuffer;
use systems::draw::{BlendedRun, DrawList, Transparent, View, sort_transparent};
use systems::ecs::tables::DirtySlots;

/// The blended objects that a view draws, farthest first.
#[derive(Debug)]
pub(crate) struct BlendedList {
    /// Slots as they were last uploaded.
    slots: Vec<u32>,
    buffer: GrowingBuffer,
    /// Version of the blended objects, and view, that the order is for.
    made_for: Option<(u64, View)>,
    pub runs: Vec<BlendedRun>,
}

impl BlendedList {
    pub fn new(device: &wgpu::Device) -> Self {
        let buffer = GrowingBuffer::new(device, "list of blended objects", wgpu::BufferUsages::VERTEX);
        Self { slots: Vec::new(), buffer, made_for: None, runs: Vec::new() }
    }

    /// The slots.
    pub fn buffer(&self) -> &wgpu::Buffer {
        self.buffer.buffer()
    }

    /// Brings the order up to date with a draw list and a view; `only`: of all objects those in these slots. Returns
    /// the bytes written.
    pub fn upload(
        &mut self,
        gpu: &Gpu,
        list: &DrawList,
        view: &View,
        only: Option<&SlotSet>,
    ) -> Result<u64, RenderError> {
        let is_known = |(version, of): &(u64, View)| *version == list.transparent_version && of == view;
        if only.is_none() && self.made_for.as_ref().is_some_and(is_known) {
            return Ok(0);
        }
        let is_meant = |object: &&Transparent| only.is_none_or(|only| only.has(object.slot));
        let (slots, runs) = sort_transparent(list.transparent.iter().filter(is_meant), view);
        self.runs = runs;
        let mut written = 0;
        if slots != self.slots {
            written = self.buffer.write(gpu, &slots, &DirtySlots::default(), true)?;
            self.slots = slots;
        }
        self.made_for = Some((list.transparent_version, view.clone()));
        Ok(written)
    }
}
