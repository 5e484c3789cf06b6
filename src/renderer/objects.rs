//! The objects of a view in a pass: which draws, with which pipelines, and how a pass is cut.

use super::culling::{ARGUMENT_BYTES, Phase};
use super::draws::DrawArguments;
use super::pass::Pass;
use super::portions::{self, Portion};
use super::record::{Leaves, begin_forward};
use super::targets::Attachments;
use super::{Renderer, ViewState};
use std::ops::Range;
use systems::assets::Technique;
use systems::draw::BatchKey;

/// What was recorded for a frame's objects.
#[derive(Clone, Copy, Default)]
pub(super) struct Recorded {
    pub draws: u32,
    pub calls: u32,
    pub passes: u32,
}

impl Recorded {
    pub fn count(&mut self, (draws, calls): (u32, u32)) {
        self.draws += draws;
        self.calls += calls;
    }
}

impl Renderer {
    /// How many triangles of a view there were of late, or, as long as that is not known, are expected.
    pub(super) fn expected_triangles(&self, view: &ViewState) -> u64 {
        let expected =
            |draw: &DrawArguments| u64::from(draw.expected_instances) * u64::from(draw.indirect.index_count / 3);
        let told = view.counts.latest.map(|drawn| drawn.triangles);
        told.unwrap_or_else(|| self.draws_of(view).arguments.iter().map(expected).sum())
    }

    /// Draws the objects that culling kept in some phases, in as many passes as they are cut into; returns the last of
    /// these.
    pub(super) fn draw_phases<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
        view: &ViewState,
        (attachments, frame_group): (Attachments<'_>, &wgpu::BindGroup),
        (label, mut clear, leaves): (&'static str, Option<wgpu::Color>, Leaves),
        phases: impl Iterator<Item = Phase>,
        recorded: &mut Recorded,
    ) -> wgpu::RenderPass<'a> {
        let timestamps = self.timestamps.as_ref();
        let mut draw = |pass: &mut wgpu::RenderPass<'_>, portions: &[Portion]| {
            pass.set_bind_group(0, frame_group, &[]);
            for (number, portion) in (0..).zip(portions) {
                if number > 0 {
                    self.portions.hand_over(pass, number);
                }
                for (phase, arguments) in portion {
                    recorded.count(self.draw_objects(pass, view, view.pass, *phase, arguments.clone()));
                }
            }
            recorded.passes += 1;
        };
        let mut passes = self.cut(view, phases);
        let last = passes.pop().unwrap_or_default();
        for portions in &passes {
            draw(
                &mut begin_forward(encoder, timestamps, attachments, (label, clear.take(), Leaves::SAMPLES)),
                portions,
            );
        }
        let mut pass = begin_forward(encoder, timestamps, attachments, (label, clear, leaves));
        draw(&mut pass, &last);
        pass
    }

    /// Whether the passes of [`Technique::EmbossMultipass`] follow those over all objects.
    fn has_emboss_passes(&self, view: &ViewState) -> bool {
        self.draws_of(view).list.iter().any(|draw| is_embossed(view, draw.key))
    }

    /// Cuts a pass over the objects in some phases into passes of portions, by how many there were of late.
    fn cut(&self, view: &ViewState, phases: impl Iterator<Item = Phase>) -> Vec<Vec<Portion>> {
        let arguments = &self.draws_of(view).arguments;
        // Passes that add up do so over all that the others left.
        let most = self.portions.of_pass.zip(self.portions.of_portion()).filter(|_| !self.has_emboss_passes(view));
        let Some(most) = most else {
            return vec![vec![phases.map(|phase| (phase, 0..arguments.len())).collect()]];
        };
        let all = view.phases().count() * arguments.len();
        portions::cut(most, phases, arguments.len(), |phase, index| {
            let draw = &arguments[index];
            let told = |phase: Phase| view.counts.instances(phase as usize * arguments.len() + index, all);
            // What was new of late is drawn in the early phase from then on.
            let appeared = if phase == Phase::Early { told(Phase::Late).unwrap_or(0) } else { 0 };
            let instances = told(phase).map_or(draw.expected_instances, |instances| instances + appeared);
            u64::from(instances) * u64::from(draw.indirect.index_count / 3)
        })
    }

    fn bind_meshes(&self, pass: &mut wgpu::RenderPass<'_>, view: &ViewState) {
        pass.set_bind_group(2, &view.scene_color.as_ref().unwrap_or(&self.no_scene_color).group, &[]);
        pass.set_vertex_buffer(0, self.meshes.vertices.buffer().slice(..));
        pass.set_index_buffer(self.meshes.indices.buffer().slice(..), wgpu::IndexFormat::Uint32);
    }

    /// Sets pipeline and class; `false` if there is nothing to draw with.
    fn bind_key(&self, pass: &mut wgpu::RenderPass<'_>, view: &ViewState, kind: Pass, key: BatchKey) -> bool {
        let drawn_with = view.pipeline_of(kind, key);
        let pipeline = self.pipelines.object(kind, drawn_with);
        let class = self.textures.class(key.class, drawn_with.technique);
        let (Some(pipeline), Some(class)) = (pipeline, class) else { return false };
        pass.set_pipeline(pipeline);
        pass.set_bind_group(1, class, &[]);
        true
    }

    /// The objects that culling kept, those of some arguments: neighbouring draws that differ in their mesh only are
    /// one call. Returns the number of draws and of calls.
    pub(super) fn draw_objects(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        view: &ViewState,
        kind: Pass,
        phase: Phase,
        some: Range<usize>,
    ) -> (u32, u32) {
        self.bind_meshes(pass, view);
        let first_instance = self.gpu.device.features().contains(wgpu::Features::INDIRECT_FIRST_INSTANCE);
        let (visible, arguments) = (view.culled.visible(), view.culled.arguments(phase));
        let all = self.draws_of(view);
        if first_instance && !all.list.is_empty() {
            pass.set_vertex_buffer(1, visible.slice(..));
        }
        let first = all.list.partition_point(|draw| draw.arguments.end <= some.start);
        let end = all.list.partition_point(|draw| draw.arguments.start < some.end);
        let drawn = &all.list[first..first.max(end)];
        let (mut draws, mut calls) = (0, 0);
        let mut draw_runs = |kind: Pass, wanted: &dyn Fn(BatchKey) -> bool| {
            for run in drawn.chunk_by(|a, b| (a.key.pipeline, a.key.class) == (b.key.pipeline, b.key.class)) {
                let (first, last) = (&run[0], &run[run.len() - 1]);
                let range = first.arguments.start.max(some.start)..last.arguments.end.min(some.end);
                if range.is_empty() || !wanted(first.key) || !self.bind_key(pass, view, kind, first.key) {
                    continue;
                }
                // Of a draw in several portions, the first counts.
                draws += run.iter().filter(|draw| range.contains(&draw.arguments.start)).count() as u32;
                if first_instance {
                    pass.multi_draw_indexed_indirect(
                        arguments,
                        range.start as u64 * ARGUMENT_BYTES,
                        range.len() as u32,
                    );
                    calls += 1;
                    continue;
                }
                for place in range {
                    let first_visible = all.arguments[place].first_visible + view.culled.list_offset(phase);
                    pass.set_vertex_buffer(1, visible.slice(u64::from(first_visible) * 4..));
                    pass.draw_indexed_indirect(arguments, place as u64 * ARGUMENT_BYTES);
                    calls += 1;
                }
            }
        };
        draw_runs(kind, &|_| true);
        // Passes over a part of the objects have none.
        if !matches!(kind, Pass::Outputs(_)) && some.len() == all.arguments.len() && self.has_emboss_passes(view) {
            view.emboss_passes().for_each(|step| draw_runs(step, &|key| is_embossed(view, key)));
        }
        (draws, calls)
    }

    /// Blended objects, farthest first. Returns the number of draws.
    pub(super) fn draw_blended(&self, pass: &mut wgpu::RenderPass<'_>, view: &ViewState, kind: Pass) -> u32 {
        let mut draws = 0;
        if !view.blended_runs.is_empty() {
            self.bind_meshes(pass, view);
            pass.set_vertex_buffer(1, view.blended.buffer().slice(..));
        }
        for run in &view.blended_runs {
            let Some(mesh) = self.meshes.range(run.key.mesh) else { continue };
            let Some(whole) = mesh.levels.first() else { continue };
            if self.bind_key(pass, view, kind, run.key) {
                let indices = whole.first_index..whole.first_index + whole.index_count;
                pass.draw_indexed(indices, mesh.base_vertex, run.slots.clone());
                draws += 1;
            }
        }
        draws
    }
}

fn is_embossed(view: &ViewState, key: BatchKey) -> bool {
    view.pipeline_of(view.pass, key).technique == Technique::EmbossMultipass
}
