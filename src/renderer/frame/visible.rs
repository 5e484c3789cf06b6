//! Counts of what the last frame drew of a view, read back.

use super::renderer::Renderer;
use crate::renderer::culling::cull::ARGUMENT_BYTES;
use crate::renderer::culling::visible_counts::VisibleCounts;
use crate::renderer::gpu::readback::read_buffer;
use crate::renderer::views::view_state::ViewState;

impl Renderer {
    /// Counts of what the last frame drew of a view; nothing of one that was not prepared for it. Waits for the GPU.
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

    /// Counts of a view whose objects were culled on the CPU.
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
        for run in &view.blended.runs {
            let whole = self.assets.meshes.range(run.key.mesh).and_then(|mesh| mesh.levels.first());
            drawn.add(run.slots.len() as u32, whole.map_or(0, |level| level.index_count));
        }
        drawn
    }
}
