//! The commands of a frame: culling and drawing in one phase or two, the sky, blended objects, the tone map.

use super::culling::{ARGUMENT_BYTES, Phase};
use super::draws::DrawArguments;
use super::pipelines::{OUTPUT_FORMATS, Pass};
use super::portions::{self, Portion};
use super::targets::{self, Attachments, DEPTH_FORMAT, whole_view};
use super::timestamps::Timestamps;
use super::tone_map::tone_mapped;
use super::{Outputs, PICTURE_FORMAT, Renderer};
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

impl Renderer {
    /// Culling and the forward pass, in one phase or two; into `picture` if colours do not stay linear.
    pub(super) fn record_scene(&mut self, encoder: &mut wgpu::CommandEncoder, picture: &wgpu::TextureView) -> Recorded {
        let mut recorded = Recorded::default();
        if self.portions.on_processor && self.expected_triangles() > MANY_TRIANGLES {
            // Not earlier: what loading left is given back.
            keep_freed_memory();
        }
        self.tables.record(encoder, self.timestamps.as_ref());
        let (Some(targets), Some(frame_group)) = (&self.targets, self.tables.group()) else { return recorded };
        let attachments = targets.attachments(picture);
        let timestamps = self.timestamps.as_ref();
        let views = [(&self.culled, frame_group)];
        // Unless the lists of visible objects are those of this view already.
        let due = self.cullings_due > 0;
        if due {
            self.culling.record(encoder, timestamps, Phase::Early, &views);
        }
        let clear = Some(self.sky_color());
        // The lists of a still view stay what they are: one pass draws both.
        let pyramid = self.culled.pyramid().filter(|_| due);
        if let Some(pyramid) = pyramid {
            let (into, early) = (("early", clear, Leaves::Samples), [Phase::Early].into_iter());
            drop(self.draw_phases(encoder, (attachments, frame_group), into, early, &mut recorded));
            self.pyramids.record(encoder, timestamps, pyramid);
            self.culling.record(encoder, timestamps, Phase::Late, &views);
        }
        {
            let first = clear.filter(|_| pyramid.is_none());
            let leaves = if self.behind.is_some() { Leaves::Both } else { Leaves::Picture };
            let phases = self.phases().filter(|phase| *phase == Phase::Late || pyramid.is_none());
            let mut pass = self.draw_phases(
                encoder,
                (attachments, frame_group),
                ("forward", first, leaves),
                phases,
                &mut recorded,
            );
            let sky = self.pipelines.sky(targets.samples, self.pass.tone_map());
            if let (None, Some(sky)) = (self.plain_sky, sky) {
                pass.set_pipeline(sky);
                pass.draw(0..3, 0..1);
            }
            if let (Some(behind), Some(hdr)) = (&self.behind, &targets.hdr) {
                drop(pass);
                encoder.copy_texture_to_texture(
                    hdr.texture.as_image_copy(),
                    behind.texture.as_image_copy(),
                    behind.texture.size(),
                );
                pass = begin_forward(encoder, timestamps, attachments, ("blended", None, Leaves::Picture));
                pass.set_bind_group(0, frame_group, &[]);
            }
            let blended = self.draw_blended(&mut pass, self.pass);
            recorded.count((blended, blended));
        }
        if due || self.counts.wanted {
            let lists: Vec<_> = self.phases().map(|phase| self.culled.arguments(phase)).collect();
            let blended = self.blended_drawn();
            self.counts.send(&self.gpu, encoder, lists.into_iter(), self.draws.arguments.len(), blended);
        }
        self.cullings_due = self.cullings_due.saturating_sub(1);
        self.lists_ready = true;
        recorded
    }

    /// How many triangles there were of late, or, as long as that is unknown, are expected.
    fn expected_triangles(&self) -> u64 {
        let expected =
            |draw: &DrawArguments| u64::from(draw.expected_instances) * u64::from(draw.indirect.index_count / 3);
        let told = self.counts.latest.map(|drawn| drawn.triangles);
        told.unwrap_or_else(|| self.draws.arguments.iter().map(expected).sum())
    }

    /// Draws the objects that culling kept in some phases, in as many passes as they are cut into; returns the last of
    /// these.
    fn draw_phases<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
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
                    recorded.count(self.draw_objects(pass, self.pass, *phase, arguments.clone()));
                }
            }
            recorded.passes += 1;
        };
        let mut passes = self.cut(phases);
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
    fn has_emboss_passes(&self) -> bool {
        self.draws.list.iter().any(|draw| self.is_embossed(draw.key))
    }

    fn is_embossed(&self, key: BatchKey) -> bool {
        self.pipeline_of(self.pass, key).technique == Technique::EmbossMultipass
    }

    /// Cuts a pass over the objects in some phases into passes of portions, by how many there were of late.
    fn cut(&self, phases: impl Iterator<Item = Phase>) -> Vec<Vec<Portion>> {
        let arguments = &self.draws.arguments;
        // Passes that add up do so over all that the others left.
        let most = self.portions.of_pass.zip(self.portions.of_portion()).filter(|_| !self.has_emboss_passes());
        let Some(most) = most else {
            return vec![vec![phases.map(|phase| (phase, 0..arguments.len())).collect()]];
        };
        let all = self.phases().count() * arguments.len();
        portions::cut(most, phases, arguments.len(), |phase, index| {
            let draw = &arguments[index];
            let told = |phase: Phase| self.counts.instances(phase as usize * arguments.len() + index, all);
            // What was new of late is drawn in the early phase from then on.
            let appeared = if phase == Phase::Early { told(Phase::Late).unwrap_or(0) } else { 0 };
            let instances = told(phase).map_or(draw.expected_instances, |instances| instances + appeared);
            u64::from(instances) * u64::from(draw.indirect.index_count / 3)
        })
    }

    /// A sky of one colour as passes over the scene write it.
    fn sky_color(&self) -> wgpu::Color {
        let Some(sky) = self.plain_sky else { return wgpu::Color::TRANSPARENT };
        let [r, g, b] = self.pass.tone_map().map_or(sky, |curve| tone_mapped(curve, sky)).to_array();
        wgpu::Color { r: r.into(), g: g.into(), b: b.into(), a: 1.0 }
    }

    /// From linear colours, if they were kept, to the screen.
    pub(super) fn record_tone_map(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        format: wgpu::TextureFormat,
    ) {
        let Some(hdr) = self.targets.as_ref().and_then(|targets| targets.hdr.as_ref()) else { return };
        let tone_map = self.pipelines.tone_map(&self.gpu.device, format, self.tone_map);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("tone map"),
            color_attachments: &[Some(color_attachment(target))],
            timestamp_writes: self.timestamps.as_ref().and_then(|timestamps| timestamps.render_pass("tone map")),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(tone_map);
        pass.set_bind_group(0, &hdr.source, &[]);
        pass.draw(0..3, 0..1);
    }

    /// Draws the prepared objects once more, one sample per pixel, for their normals, ids and depths.
    pub fn draw_outputs(&mut self) -> Option<Outputs> {
        let missing = self.start_pipelines(Pass::Outputs, self.draws.list.iter().map(|draw| draw.key));
        self.pipelines.finish_objects(missing);
        let size = self.targets.as_ref().map(|targets| (targets.width, targets.height))?;
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        let make = |label, format| targets::texture(&self.gpu.device, label, size, format, 1, usage);
        let (normal, id) = (make("normals", OUTPUT_FORMATS[0]), make("ids", OUTPUT_FORMATS[1]));
        let depth = make("output depth", DEPTH_FORMAT);
        let views = [whole_view(&normal, "normals"), whole_view(&id, "ids"), whole_view(&depth, "output depth")];
        let label = wgpu::CommandEncoderDescriptor { label: Some("outputs") };
        let mut encoder = self.gpu.device.create_command_encoder(&label);
        self.tables.record(&mut encoder, None);
        if !self.lists_ready {
            // The picture was not drawn, which finds out what is visible. It is not drawn into if colours are kept
            // linear.
            let picture = if self.keeps_linear() { &normal } else { &make("picture", PICTURE_FORMAT) };
            self.record_scene(&mut encoder, &whole_view(picture, "picture"));
            if let Some(timestamps) = &mut self.timestamps {
                timestamps.finish(&mut encoder);
            }
        }
        let frame_group = self.tables.group()?;
        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("outputs"),
                color_attachments: &[Some(color_attachment(&views[0])), Some(color_attachment(&views[1]))],
                depth_stencil_attachment: Some(depth_attachment(&views[2], wgpu::StoreOp::Store)),
                ..wgpu::RenderPassDescriptor::default()
            });
            pass.set_bind_group(0, frame_group, &[]);
            for phase in self.phases() {
                self.draw_objects(&mut pass, Pass::Outputs, phase, 0..self.draws.arguments.len());
            }
            self.draw_blended(&mut pass, Pass::Outputs);
        }
        self.gpu.queue.submit([encoder.finish()]);
        Some(Outputs { width: size.0, height: size.1, normal, id, depth })
    }

    fn bind_meshes(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(2, &self.behind.as_ref().unwrap_or(&self.nothing_behind).group, &[]);
        pass.set_vertex_buffer(0, self.meshes.vertices.buffer().slice(..));
        pass.set_index_buffer(self.meshes.indices.buffer().slice(..), wgpu::IndexFormat::Uint32);
    }

    /// Sets pipeline and class; `false` if there is nothing to draw with.
    fn bind_key(&self, pass: &mut wgpu::RenderPass<'_>, kind: Pass, key: BatchKey) -> bool {
        let pipeline = self.pipelines.object(kind, self.pipeline_of(kind, key));
        let (Some(pipeline), Some(class)) = (pipeline, self.textures.class(key.class)) else { return false };
        pass.set_pipeline(pipeline);
        pass.set_bind_group(1, class, &[]);
        true
    }

    /// The objects that culling kept, those of some arguments: neighbouring draws that differ in their mesh only are
    /// one call. Returns the number of draws and of calls.
    fn draw_objects(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        kind: Pass,
        phase: Phase,
        some: Range<usize>,
    ) -> (u32, u32) {
        self.bind_meshes(pass);
        let first_instance = self.gpu.device.features().contains(wgpu::Features::INDIRECT_FIRST_INSTANCE);
        let (visible, arguments) = (self.culled.visible(), self.culled.arguments(phase));
        if first_instance && !self.draws.list.is_empty() {
            pass.set_vertex_buffer(1, visible.slice(..));
        }
        let list = &self.draws.list;
        let first = list.partition_point(|draw| draw.arguments.end <= some.start);
        let drawn = &list[first..first.max(list.partition_point(|draw| draw.arguments.start < some.end))];
        let (mut draws, mut calls) = (0, 0);
        let mut draw_runs = |kind: Pass, wanted: &dyn Fn(BatchKey) -> bool| {
            for run in drawn.chunk_by(|a, b| (a.key.pipeline, a.key.class) == (b.key.pipeline, b.key.class)) {
                let (first, last) = (&run[0], &run[run.len() - 1]);
                let range = first.arguments.start.max(some.start)..last.arguments.end.min(some.end);
                if range.is_empty() || !wanted(first.key) || !self.bind_key(pass, kind, first.key) {
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
                    let first_visible = self.draws.arguments[place].first_visible + self.culled.list_offset(phase);
                    pass.set_vertex_buffer(1, visible.slice(u64::from(first_visible) * 4..));
                    pass.draw_indexed_indirect(arguments, place as u64 * ARGUMENT_BYTES);
                    calls += 1;
                }
            }
        };
        draw_runs(kind, &|_| true);
        // Passes over a part of the objects have none.
        if kind != Pass::Outputs && some.len() == self.draws.arguments.len() && self.has_emboss_passes() {
            self.emboss_passes().for_each(|step| draw_runs(step, &|key| self.is_embossed(key)));
        }
        (draws, calls)
    }

    /// Blended objects, farthest first. Returns the number of draws.
    fn draw_blended(&self, pass: &mut wgpu::RenderPass<'_>, kind: Pass) -> u32 {
        let mut draws = 0;
        if !self.blended_runs.is_empty() {
            self.bind_meshes(pass);
            pass.set_vertex_buffer(1, self.blended.buffer().slice(..));
        }
        for run in &self.blended_runs {
            let Some(mesh) = self.meshes.range(run.key.mesh) else { continue };
            let Some(whole) = mesh.levels.first() else { continue };
            if self.bind_key(pass, kind, run.key) {
                let indices = whole.first_index..whole.first_index + whole.index_count;
                pass.draw_indexed(indices, mesh.base_vertex, run.slots.clone());
                draws += 1;
            }
        }
        draws
    }
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
