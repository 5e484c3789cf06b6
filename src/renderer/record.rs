//! The commands of a frame of several views: culling and drawing in one phase or two, the sky, blended objects, the
//! tone map.

use super::culling::{ARGUMENT_BYTES, Phase};
use super::draws::DrawArguments;
use super::pipelines::{OUTPUT_FORMATS, Pass};
use super::portions::{self, Portion};
use super::targets::{self, Attachments, DEPTH_FORMAT, whole_view};
use super::timestamps::Timestamps;
use super::tone_map::tone_mapped;
use super::{Drawn, Outputs, PICTURE_FORMAT, Renderer, ViewState, read_buffer};
use crate::freed_memory::keep_freed_memory;
use std::ops::Range;
use systems::draw_list::BatchKey;
use systems::library::Technique;

/// What a driver on the processor holds of more triangles than these is worth keeping from frame to frame.
const MANY_TRIANGLES: u64 = 10_000;

/// What was recorded for a frame's objects.
#[derive(Clone, Copy, Default)]
pub(super) struct Recorded {
    pub draws: u32,
    pub calls: u32,
    pub passes: u32,
}

impl Recorded {
    fn count(&mut self, (draws, calls): (u32, u32)) {
        self.draws += draws;
        self.calls += calls;
    }
}

/// Where a view of a frame is drawn.
#[derive(Debug)]
pub struct ViewTarget<'a> {
    /// The view, prepared.
    pub state: &'a mut ViewState,
    /// All of a texture of the prepared view's size, or a part of one.
    pub target: &'a wgpu::TextureView,
    /// Of the target. An sRGB format encodes; others receive linear values. Unless colours are
    /// [kept linear](ViewState::keeps_linear), it must be [`PICTURE_FORMAT`].
    pub format: wgpu::TextureFormat,
}

impl Renderer {
    /// Records a frame: some of the views of the last [`Self::prepare`], in the order in which the GPU draws them. The
    /// caller submits.
    ///
    /// # Panics
    /// If a view is not one of those, or a target has the wrong format ([`ViewTarget::format`]).
    pub fn record(&mut self, encoder: &mut wgpu::CommandEncoder, views: &mut [ViewTarget<'_>]) {
        self.check(views);
        let recorded = self.record_scene(encoder, views);
        views.iter_mut().for_each(|view| self.record_tone_map(encoder, view));
        (self.stats.draws, self.stats.draw_calls, self.stats.passes) =
            (recorded.draws, recorded.calls, recorded.passes);
        views.iter_mut().for_each(|view| view.state.drawn_now());
        self.finish_timestamps(encoder);
    }

    /// Records what was drawn last, once more: only the tone map, where colours were kept linear. For a window whose
    /// panel changes above a still scene, after a [`Self::prepare`] that found nothing new.
    ///
    /// # Panics
    /// As [`Self::record`].
    pub fn record_again(&mut self, encoder: &mut wgpu::CommandEncoder, views: &mut [ViewTarget<'_>]) {
        self.check(views);
        for view in views {
            if !view.state.keeps_linear() {
                self.record_scene(encoder, std::slice::from_mut(view));
            }
            self.record_tone_map(encoder, view);
        }
        self.finish_timestamps(encoder);
    }

    fn check(&self, views: &[ViewTarget<'_>]) {
        for view in views {
            assert!(self.is_prepared(view.state), "expected a view of the last Renderer::prepare");
            view.state.check_format(view.format);
        }
    }

    fn finish_timestamps(&mut self, encoder: &mut wgpu::CommandEncoder) {
        if let Some(timestamps) = &mut self.timestamps {
            timestamps.finish(encoder);
        }
    }

    /// All but the tone map.
    fn record_scene(&mut self, encoder: &mut wgpu::CommandEncoder, views: &mut [ViewTarget<'_>]) -> Recorded {
        let mut recorded = Recorded::default();
        let triangles: u64 = views.iter().map(|view| self.expected_triangles(view.state)).sum();
        if self.portions.on_processor && triangles > MANY_TRIANGLES {
            // Not earlier: what loading left is given back.
            keep_freed_memory();
        }
        self.tables.record(encoder, self.timestamps.as_ref());
        self.cull(encoder, Phase::Early, views);
        for view in &*views {
            self.draw_early(encoder, view, &mut recorded);
        }
        self.cull(encoder, Phase::Late, views);
        for view in &mut *views {
            self.draw_scene(encoder, view, &mut recorded);
            self.send_counts(encoder, view.state);
            view.state.cullings_due = view.state.cullings_due.saturating_sub(1);
            view.state.lists_ready = true;
        }
        recorded
    }

    /// Finds what is visible, unless the lists of visible objects are those of a view already.
    fn cull(&self, encoder: &mut wgpu::CommandEncoder, phase: Phase, views: &[ViewTarget<'_>]) {
        let due = |view: &&ViewTarget<'_>| {
            let state = &view.state;
            state.targets.is_some()
                && state.cullings_due > 0
                && (phase == Phase::Early || state.culled.pyramid().is_some())
        };
        let views: Vec<_> = views
            .iter()
            .filter(due)
            .filter_map(|view| view.state.group().map(|group| (&view.state.culled, group)))
            .collect();
        self.culling.record(encoder, self.timestamps.as_ref(), phase, &views);
    }

    /// Of a view in two phases, what was seen before, and the depths that it leaves. The lists of a still view stay
    /// what they are: one pass draws both.
    fn draw_early(&self, encoder: &mut wgpu::CommandEncoder, view: &ViewTarget<'_>, recorded: &mut Recorded) {
        let state = &*view.state;
        let pyramid = state.culled.pyramid().filter(|_| state.cullings_due > 0);
        let (Some(pyramid), Some(targets), Some(group)) = (pyramid, &state.targets, state.group()) else { return };
        let into = ("early", Some(sky_color(state)), Leaves::Samples);
        let early = [Phase::Early].into_iter();
        drop(self.draw_phases(encoder, state, (targets.attachments(view.target), group), into, early, recorded));
        self.pyramids.record(encoder, self.timestamps.as_ref(), pyramid);
    }

    /// The rest of a view's opaque objects, the sky and blended objects.
    fn draw_scene(&self, encoder: &mut wgpu::CommandEncoder, view: &ViewTarget<'_>, recorded: &mut Recorded) {
        let state = &*view.state;
        let (Some(targets), Some(group)) = (&state.targets, state.group()) else { return };
        let attachments = targets.attachments(view.target);
        let has_early = state.culled.pyramid().is_some() && state.cullings_due > 0;
        let clear = (!has_early).then(|| sky_color(state));
        let leaves = if state.behind.is_some() { Leaves::Both } else { Leaves::Picture };
        let phases = state.phases().filter(|phase| *phase == Phase::Late || !has_early);
        let into = ("forward", clear, leaves);
        let mut pass = self.draw_phases(encoder, state, (attachments, group), into, phases, recorded);
        let sky = self.pipelines.sky(targets.samples, state.pass.tone_map());
        if let (None, Some(sky)) = (state.plain_sky, sky) {
            pass.set_pipeline(sky);
            pass.draw(0..3, 0..1);
        }
        if let (Some(behind), Some(hdr)) = (&state.behind, &targets.hdr) {
            drop(pass);
            encoder.copy_texture_to_texture(
                hdr.texture.as_image_copy(),
                behind.texture.as_image_copy(),
                behind.texture.size(),
            );
            let into = ("blended", None, Leaves::Picture);
            pass = begin_forward(encoder, self.timestamps.as_ref(), attachments, into);
            pass.set_bind_group(0, group, &[]);
        }
        let blended = self.draw_blended(&mut pass, state, state.pass);
        recorded.count((blended, blended));
    }

    /// Sends the counts of what is drawn on their way, where they are others.
    fn send_counts(&self, encoder: &mut wgpu::CommandEncoder, state: &mut ViewState) {
        if state.targets.is_some() && (state.cullings_due > 0 || state.counts.wanted) {
            let lists: Vec<_> = state.phases().map(|phase| state.culled.arguments(phase)).collect();
            let blended = self.blended_drawn(state);
            let arguments = self.draws_of(state).arguments.len();
            state.counts.send(&self.gpu, encoder, lists.into_iter(), arguments, blended);
        }
    }

    /// How many triangles of a view there were of late, or, as long as nobody knows, are expected.
    fn expected_triangles(&self, view: &ViewState) -> u64 {
        let expected =
            |draw: &DrawArguments| u64::from(draw.expected_instances) * u64::from(draw.indirect.index_count / 3);
        let told = view.counts.latest.map(|drawn| drawn.triangles);
        told.unwrap_or_else(|| self.draws_of(view).arguments.iter().map(expected).sum())
    }

    /// Draws the objects that culling kept in some phases, in as many passes as they are cut into; returns the last of
    /// these.
    fn draw_phases<'a>(
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
                &mut begin_forward(encoder, timestamps, attachments, (label, clear.take(), Leaves::Samples)),
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

    /// From linear colours, if they were kept, to the screen.
    fn record_tone_map(&mut self, encoder: &mut wgpu::CommandEncoder, view: &ViewTarget<'_>) {
        let Some(hdr) = view.state.targets.as_ref().and_then(|targets| targets.hdr.as_ref()) else { return };
        let tone_map = self.pipelines.tone_map(&self.gpu.device, view.format, view.state.tone_map);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("tone map"),
            color_attachments: &[Some(color_attachment(view.target))],
            timestamp_writes: self.timestamps.as_ref().and_then(|timestamps| timestamps.render_pass("tone map")),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(tone_map);
        pass.set_bind_group(0, &hdr.source, &[]);
        pass.draw(0..3, 0..1);
    }

    /// Draws the objects of a view once more, one sample per pixel, for their normals, ids and depths; `None` unless it
    /// is one of those of the last [`Self::prepare`]. Submits.
    pub fn draw_outputs(&mut self, view: &mut ViewState) -> Option<Outputs> {
        if !self.is_prepared(view) {
            return None;
        }
        let opaque = self.draws_of(view).list.iter().map(|draw| draw.key);
        let missing = self.start_pipelines(std::iter::once((&*view, Pass::Outputs)), opaque);
        self.pipelines.finish_objects(missing);
        let size = view.size()?;
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        let make = |label, format| targets::texture(&self.gpu.device, label, size, format, 1, usage);
        let (normal, id) = (make("normals", OUTPUT_FORMATS[0]), make("ids", OUTPUT_FORMATS[1]));
        let depth = make("output depth", DEPTH_FORMAT);
        let views = [whole_view(&normal, "normals"), whole_view(&id, "ids"), whole_view(&depth, "output depth")];
        let label = wgpu::CommandEncoderDescriptor { label: Some("outputs") };
        let mut encoder = self.gpu.device.create_command_encoder(&label);
        if view.lists_ready {
            self.tables.record(&mut encoder, None);
        } else {
            // Nobody drew the picture, which finds out what is visible. It is not drawn into if colours are kept
            // linear.
            let picture = if view.keeps_linear() { &normal } else { &make("picture", PICTURE_FORMAT) };
            let (target, format) = (&whole_view(picture, "picture"), picture.format());
            self.record_scene(&mut encoder, &mut [ViewTarget { state: &mut *view, target, format }]);
            self.finish_timestamps(&mut encoder);
        }
        let frame_group = view.group()?;
        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("outputs"),
                color_attachments: &[Some(color_attachment(&views[0])), Some(color_attachment(&views[1]))],
                depth_stencil_attachment: Some(depth_attachment(&views[2], wgpu::StoreOp::Store)),
                ..wgpu::RenderPassDescriptor::default()
            });
            pass.set_bind_group(0, frame_group, &[]);
            for phase in view.phases() {
                self.draw_objects(&mut pass, view, Pass::Outputs, phase, 0..self.draws_of(view).arguments.len());
            }
            self.draw_blended(&mut pass, view, Pass::Outputs);
        }
        self.gpu.queue.submit([encoder.finish()]);
        Some(Outputs { width: size.0, height: size.1, normal, id, depth })
    }

    /// How much the last frame drew of a view; nothing of one that was not prepared for it. Waits for the GPU.
    pub fn read_drawn(&self, view: &ViewState) -> Drawn {
        if !self.is_prepared(view) {
            return Drawn::default();
        }
        let mut drawn = self.blended_drawn(view);
        let bytes = self.draws_of(view).arguments.len() as u64 * ARGUMENT_BYTES;
        for phase in view.phases().filter(|_| bytes > 0) {
            drawn.add_arguments(&read_buffer(&self.gpu, view.culled.arguments(phase), bytes));
        }
        drawn
    }

    /// Instance slots of the opaque objects that the last frame drew of a view: those of each phase in the order in
    /// which it drew them; none of one that was not prepared for it. Waits for the GPU.
    pub fn read_drawn_slots(&self, view: &ViewState) -> Vec<u32> {
        if !self.is_prepared(view) {
            return Vec::new();
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
            for (draw, arguments) in self.draws_of(view).arguments.iter().zip(drawn) {
                // Where indirect draws all begin at the first instance, it is the lists that lie apart.
                let apart = draw.first_visible + view.culled.list_offset(phase);
                let first = if first_instance { arguments[4] } else { apart } as usize;
                let count = arguments[1] as usize;
                slots.extend(visible.iter().skip(first).take(count));
            }
        }
        slots
    }

    fn blended_drawn(&self, view: &ViewState) -> Drawn {
        let mut drawn = Drawn::default();
        for run in &view.blended_runs {
            let whole = self.meshes.range(run.key.mesh).and_then(|mesh| mesh.levels.first());
            drawn.add(run.slots.len() as u32, whole.map_or(0, |level| level.index_count));
        }
        drawn
    }

    fn bind_meshes(&self, pass: &mut wgpu::RenderPass<'_>, view: &ViewState) {
        pass.set_bind_group(2, &view.behind.as_ref().unwrap_or(&self.nothing_behind).group, &[]);
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
    fn draw_objects(
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
        if kind != Pass::Outputs && some.len() == all.arguments.len() && self.has_emboss_passes(view) {
            view.emboss_passes().for_each(|step| draw_runs(step, &|key| is_embossed(view, key)));
        }
        (draws, calls)
    }

    /// Blended objects, farthest first. Returns the number of draws.
    fn draw_blended(&self, pass: &mut wgpu::RenderPass<'_>, view: &ViewState, kind: Pass) -> u32 {
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

/// A sky of one colour as passes over the scene write it.
fn sky_color(view: &ViewState) -> wgpu::Color {
    let Some(sky) = view.plain_sky else { return wgpu::Color::TRANSPARENT };
    let [r, g, b] = view.pass.tone_map().map_or(sky, |curve| tone_mapped(curve, sky)).to_array();
    wgpu::Color { r: r.into(), g: g.into(), b: b.into(), a: 1.0 }
}

/// What a pass over the scene leaves for those that follow.
#[derive(Clone, Copy, PartialEq)]
enum Leaves {
    /// Samples and depths.
    Samples,
    /// Samples and depths, and the picture resolved from them.
    Both,
    /// The resolved picture.
    Picture,
}

/// A pass over the scene. `clear`: it begins with that colour and nothing else.
fn begin_forward<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    timestamps: Option<&Timestamps>,
    Attachments { color, resolved, depth }: Attachments<'_>,
    (label, clear, leaves): (&'static str, Option<wgpu::Color>, Leaves),
) -> wgpu::RenderPass<'a> {
    let resolve_target = resolved.filter(|_| leaves != Leaves::Samples);
    let last = leaves == Leaves::Picture;
    let store = if last && resolve_target.is_some() { wgpu::StoreOp::Discard } else { wgpu::StoreOp::Store };
    let load = clear.map_or(wgpu::LoadOp::Load, wgpu::LoadOp::Clear);
    let mut depth = depth_attachment(depth, if last { wgpu::StoreOp::Discard } else { wgpu::StoreOp::Store });
    if clear.is_none() {
        depth.depth_ops = depth.depth_ops.map(|ops| wgpu::Operations { load: wgpu::LoadOp::Load, ..ops });
    }
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: color,
            depth_slice: None,
            resolve_target,
            ops: wgpu::Operations { load, store },
        })],
        depth_stencil_attachment: Some(depth),
        timestamp_writes: timestamps.and_then(|timestamps| timestamps.render_pass(label)),
        ..wgpu::RenderPassDescriptor::default()
    })
}

fn color_attachment(view: &wgpu::TextureView) -> wgpu::RenderPassColorAttachment<'_> {
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
    wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops }
}

fn depth_attachment(view: &wgpu::TextureView, store: wgpu::StoreOp) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    // Reversed depth: 0 is infinitely far.
    let depth_ops = Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store });
    wgpu::RenderPassDepthStencilAttachment { view, depth_ops, stencil_ops: None }
}
