//! The objects of a view in a pass: which draws, and with which pipelines.

use super::renderer::Renderer;
use crate::renderer::culling::cull::{ARGUMENT_BYTES, Phase};
use crate::renderer::passes::attachments::{Attachments, ScenePass, begin_forward};
use crate::renderer::passes::pass::{Pass, Shadows};
use crate::renderer::passes::targets::SceneColorCopy;
use crate::renderer::views::view_state::ViewState;
use std::ops::Range;
use systems::assets::Technique;
use systems::draw::BatchKey;
use wgpu::util::DrawIndexedIndirectArgs;

/// Draws and draw calls encoded for a frame's objects.
#[derive(Clone, Copy, Default)]
pub(crate) struct Encoded {
    pub draws: u32,
    pub calls: u32,
}

impl Encoded {
    pub fn count(&mut self, more: Self) {
        self.draws += more.draws;
        self.calls += more.calls;
    }
}

impl Renderer {
    /// Draws the objects that culling kept in some phases, in a pass that it begins and returns.
    pub(super) fn draw_phases<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
        view: &ViewState,
        attachments: Attachments<'_>,
        into: ScenePass,
        phases: impl Iterator<Item = Phase>,
        encoded: &mut Encoded,
    ) -> wgpu::RenderPass<'a> {
        let mut pass = begin_forward(encoder, self.timestamps.as_ref(), attachments, into);
        pass.set_bind_group(0, view.group(), &[]);
        for phase in phases {
            encoded.count(self.draw_objects(&mut pass, view, view.pass, phase));
        }
        pass
    }

    /// `behind`: what blended objects refract.
    fn bind_meshes(&self, pass: &mut wgpu::RenderPass<'_>, view: &ViewState, behind: Option<&SceneColorCopy>) {
        pass.set_bind_group(2, &behind.unwrap_or(&self.no_scene_color).group, &[]);
        let shadows = view.pass.shadows().and_then(|shadows| match shadows {
            Shadows::Maps => self.own.shadow_maps.group(view.shadow_side),
            Shadows::Traced => view.traced.as_ref(),
        });
        if let Some(shadows) = shadows {
            pass.set_bind_group(3, shadows, &[]);
        }
        pass.set_vertex_buffer(0, self.assets.meshes.vertices.buffer().slice(..));
        pass.set_index_buffer(self.assets.meshes.indices.buffer().slice(..), wgpu::IndexFormat::Uint32);
    }

    /// Sets pipeline and class; `false` if there is nothing to draw with.
    fn bind_key(&self, pass: &mut wgpu::RenderPass<'_>, view: &ViewState, kind: Pass, key: BatchKey) -> bool {
        let drawn_with = view.pipeline_of(kind, key);
        let pipeline = self.pipelines.object(kind, drawn_with);
        let class = self.assets.textures.class(key.class, drawn_with.technique);
        let (Some(pipeline), Some(class)) = (pipeline, class) else { return false };
        pass.set_pipeline(pipeline);
        pass.set_bind_group(1, class, &[]);
        true
    }

    /// The objects that culling kept: neighbouring draws that differ in their mesh only are one call. Returns the
    /// number of draws and of calls.
    pub(super) fn draw_objects(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        view: &ViewState,
        kind: Pass,
        phase: Phase,
    ) -> Encoded {
        // What lies behind blended objects is resolved by this very pass.
        self.bind_meshes(pass, view, None);
        let first_instance = self.gpu.device.features().contains(wgpu::Features::INDIRECT_FIRST_INSTANCE);
        let (visible, arguments) = (view.culled.visible(), view.culled.arguments(phase));
        let list = &self.draws_of(view).list;
        let direct = view.culled.direct();
        if (first_instance || direct.is_some()) && !list.is_empty() {
            pass.set_vertex_buffer(1, visible.slice(..));
        }
        let mut encoded = Encoded::default();
        let mut draw_runs = |kind: Pass, wanted: &dyn Fn(BatchKey) -> bool| {
            let mut end = 0;
            for run in list.chunk_by(|a, b| (a.key.pipeline, a.key.class) == (b.key.pipeline, b.key.class)) {
                let place = end;
                end += run.len();
                let listed = direct.map(|direct| &direct.ranges[place..end]);
                let is_empty = listed.is_some_and(|listed| listed.iter().all(Range::is_empty));
                if is_empty || !wanted(run[0].key) || !self.bind_key(pass, view, kind, run[0].key) {
                    continue;
                }
                if let Some(listed) = listed {
                    for (draw, slots) in run.iter().zip(listed).filter(|(_, slots)| !slots.is_empty()) {
                        let DrawIndexedIndirectArgs { first_index, index_count, base_vertex, .. } = draw.indirect;
                        pass.draw_indexed(first_index..first_index + index_count, base_vertex, slots.clone());
                        encoded.count(Encoded { draws: 1, calls: 1 });
                    }
                    continue;
                }
                encoded.draws += run.len() as u32;
                if first_instance {
                    pass.multi_draw_indexed_indirect(arguments, place as u64 * ARGUMENT_BYTES, run.len() as u32);
                    encoded.calls += 1;
                    continue;
                }
                for (place, draw) in (place..).zip(run) {
                    let first_visible = draw.first_visible + view.culled.list_offset(phase);
                    pass.set_vertex_buffer(1, visible.slice(u64::from(first_visible) * 4..));
                    pass.draw_indexed_indirect(arguments, place as u64 * ARGUMENT_BYTES);
                    encoded.calls += 1;
                }
            }
        };
        draw_runs(kind, &|_| true);
        if !matches!(kind, Pass::Outputs(_)) && list.iter().any(|draw| is_embossed(view, draw.key)) {
            view.pass.emboss_passes().for_each(|step| draw_runs(step, &|key| is_embossed(view, key)));
        }
        encoded
    }

    /// Blended objects, farthest first. Returns the number of draws.
    pub(super) fn draw_blended(&self, pass: &mut wgpu::RenderPass<'_>, view: &ViewState, kind: Pass) -> u32 {
        let mut draws = 0;
        if !view.blended.runs.is_empty() {
            self.bind_meshes(pass, view, view.scene_color.as_ref());
            pass.set_vertex_buffer(1, view.blended.buffer().slice(..));
        }
        for run in &view.blended.runs {
            let Some(mesh) = self.assets.meshes.range(run.key.mesh) else { continue };
            let Some(whole) = mesh.levels.first() else { continue };
            if self.bind_key(pass, view, kind, run.key) {
                let first = mesh.first_index() + whole.first_index;
                pass.draw_indexed(first..first + whole.index_count, mesh.base_vertex(), run.slots.clone());
                draws += 1;
            }
        }
        draws
    }
}

fn is_embossed(view: &ViewState, key: BatchKey) -> bool {
    view.pipeline_of(view.pass, key).technique == Technique::EmbossMultipass
}
