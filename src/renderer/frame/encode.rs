//! The commands of a frame of several views: culling and drawing in one phase or two, the sky, blended objects, the
//! tone map.

use super::objects::Encoded;
use super::renderer::Renderer;
use super::worlds::WorldUploads;
use crate::renderer::culling::cull::Phase;
use crate::renderer::passes::attachments::{Leaves, ScenePass, begin_forward, color_attachment};
use crate::renderer::passes::custom_passes::PassPlace;
use crate::renderer::passes::pipelines::ToneMapSource;
use crate::renderer::shadows::shadow_maps::CasterSources;
use crate::renderer::views::view_state::ViewState;
use crate::renderer::views::view_target::ViewTarget;

impl Renderer {
    /// Encodes a frame: some of the views of the last [`Self::prepare`], one after the other. The caller submits. A
    /// view's own passes may read the pictures of the views before it.
    ///
    /// # Panics
    /// If a view is not one of those.
    pub fn encode(&mut self, encoder: &mut wgpu::CommandEncoder, views: &mut [ViewTarget<'_>]) {
        self.check(views);
        self.begin_encoding(encoder, views);
        let mut encoded = Encoded::default();
        for view in &mut *views {
            self.encode_scene(encoder, view, &mut encoded);
            self.encode_tone_map(encoder, view);
            view.encode_passes(encoder, PassPlace::AfterToneMap);
            view.state.drawn_now();
        }
        (self.stats.draws, self.stats.draw_calls) = (encoded.draws, encoded.calls);
        self.finish_timestamps(encoder);
    }

    /// Encodes what was drawn last, once more: only the tone map. For a window whose panel changes above a still scene,
    /// after a [`Self::prepare`] that found nothing new. Of the caller's own passes those after the tone map; what the
    /// others drew is still there. But where such a pass needs depths that were not kept, all is encoded anew, with the
    /// passes that are given now.
    ///
    /// # Panics
    /// Same conditions as [`Self::encode`].
    pub fn encode_again(&mut self, encoder: &mut wgpu::CommandEncoder, views: &mut [ViewTarget<'_>]) {
        self.check(views);
        self.begin_encoding(encoder, views);
        for view in views {
            let lacks_depth = view.has_pass(PassPlace::AfterToneMap) && !view.state.kept_depth;
            if lacks_depth {
                self.encode_scene(encoder, view, &mut Encoded::default());
            }
            self.encode_tone_map(encoder, view);
            view.encode_passes(encoder, PassPlace::AfterToneMap);
        }
        self.finish_timestamps(encoder);
    }

    fn check(&self, views: &[ViewTarget<'_>]) {
        for view in views {
            assert!(self.is_prepared(view.state), "expected a view of the last Renderer::prepare");
        }
    }

    pub(super) fn finish_timestamps(&mut self, encoder: &mut wgpu::CommandEncoder) {
        if let Some(timestamps) = &mut self.timestamps {
            timestamps.finish(encoder);
        }
    }

    /// Encodes table uploads and shadow maps, once before the first view.
    pub(super) fn begin_encoding(&mut self, encoder: &mut wgpu::CommandEncoder, views: &[ViewTarget<'_>]) {
        let of_late = views.iter().filter_map(|view| view.state.counts.latest);
        self.cpu_rasterizer.begin_frame(of_late.map(|drawn| drawn.triangles).sum());
        self.own.tables.encode(encoder, self.timestamps.as_ref());
        let Self { gpu, own, assets, pipelines, timestamps, .. } = self;
        let WorldUploads { tables, shadow_maps, .. } = own;
        let sources = CasterSources {
            tables,
            frame_layout: &pipelines.frame_layout,
            meshes: &assets.meshes,
            textures: &assets.textures,
        };
        shadow_maps.encode(gpu, encoder, sources, timestamps.as_ref());
        self.stats.shadows = self.own.shadow_maps.stats;
    }

    /// All of a view but the tone map. View by view, as its samples and depths are still in caches between its passes.
    pub(super) fn encode_scene(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: &mut ViewTarget<'_>,
        encoded: &mut Encoded,
    ) {
        self.cull(encoder, Phase::Early, view.state);
        self.draw_early(encoder, view, encoded);
        self.cull(encoder, Phase::Late, view.state);
        if view.state.draws_scene() {
            self.draw_scene(encoder, view, encoded);
        }
        self.encode_outputs(encoder, view.state, self.timestamps.as_ref(), None);
        view.state.drawn_outputs = view.state.outputs.beside_color();
        self.send_counts(encoder, view.state);
        view.state.cullings_due = view.state.cullings_due.saturating_sub(1);
        view.state.lists_ready = true;
    }

    /// Finds what is visible, unless the lists of visible objects are those of the view already.
    fn cull(&self, encoder: &mut wgpu::CommandEncoder, phase: Phase, state: &ViewState) {
        let has_phase = phase == Phase::Early || state.culled.pyramid().is_some();
        let due = state.targets.is_some() && state.cullings_due > 0 && has_phase;
        if let Some(group) = state.group().filter(|_| due) {
            self.culling.encode(encoder, self.timestamps.as_ref(), phase, &state.culled, group);
        }
    }

    /// Encodes the early phase of a view in two phases, and the depth pyramid of its depths. The lists of a still view
    /// stay what they are: one pass draws both.
    fn draw_early(&self, encoder: &mut wgpu::CommandEncoder, view: &ViewTarget<'_>, encoded: &mut Encoded) {
        let state = &*view.state;
        let pyramid = state.culled.pyramid().filter(|_| state.cullings_due > 0);
        let (Some(pyramid), Some(targets), Some(_)) = (pyramid, &state.targets, state.group()) else { return };
        let into = ScenePass { label: "early", clear: Some(sky_color(state)), leaves: Leaves::DEPTH };
        let early = [Phase::Early].into_iter();
        let attachments = state.attachments(targets);
        drop(self.draw_phases(encoder, state, attachments, into, early, encoded));
        self.pyramids.encode(encoder, self.timestamps.as_ref(), pyramid);
    }

    /// The rest of a view's opaque objects, the sky and blended objects, and the caller's passes between these.
    fn draw_scene(&self, encoder: &mut wgpu::CommandEncoder, view: &mut ViewTarget<'_>, encoded: &mut Encoded) {
        let after = [PassPlace::AfterOpaque, PassPlace::AfterBlended].map(|place| view.has_pass(place));
        let [after_opaque, after_blended] = after;
        let keeps_depth = view.has_pass(PassPlace::AfterToneMap) || view.state.draws_together();
        let draws_cells = view.state.cell_view.is_some();
        view.state.kept_depth = keeps_depth;
        // What the pass over blended objects leaves, and that over the sky before it.
        let last = Leaves { resolved: false, depth: keeps_depth || after_blended || draws_cells };
        let copies = view.state.scene_color.is_some();
        let opaque = if copies { Leaves { resolved: true, ..Leaves::DEPTH } } else { last };

        let state = &*view.state;
        let (Some(targets), Some(_)) = (&state.targets, state.group()) else { return };
        let has_early = state.culled.pyramid().is_some() && state.cullings_due > 0;
        let clear = (!has_early).then(|| sky_color(state));
        let phases = state.phases().filter(|phase| *phase == Phase::Late || !has_early);
        let attachments = state.attachments(targets);
        let leaves = if after_opaque { Leaves::DEPTH } else { opaque };
        let into = ScenePass { label: "forward", clear, leaves };
        // Passes end where they are dropped, on either way: the compiler cannot tell.
        let pass = self.draw_phases(encoder, state, attachments, into, phases, encoded);
        let mut pass = pass.forget_lifetime();
        if after_opaque {
            drop(pass);
            view.encode_passes(encoder, PassPlace::AfterOpaque);
            let Some(sky) = self.go_on(encoder, view, "sky", opaque) else { return };
            pass = sky;
        }

        let state = &*view.state;
        if let (None, Some(sky)) = (state.plain_sky, self.pipelines.sky(state.pass.sky())) {
            pass.set_pipeline(sky);
            pass.draw(0..3, 0..1);
        }
        if let (Some(copy), Some(targets)) = (&state.scene_color, &state.targets) {
            drop(pass);
            if targets.samples == 1 {
                encoder.copy_texture_to_texture(targets.hdr_layer(), copy.texture.as_image_copy(), copy.texture.size());
            }
            let Some(blended) = self.go_on(encoder, view, "blended", last) else { return };
            pass = blended;
        }
        let blended = self.draw_blended(&mut pass, state, state.pass);
        encoded.count(Encoded { draws: blended, calls: blended });
        drop(pass);

        if let (Some(cells), Some(targets), Some(group)) = (&state.cell_view, &state.targets, state.group()) {
            cells.encode(encoder, self.timestamps.as_ref(), state.attachments(targets).color, group);
        }
        if after_blended {
            view.encode_passes(encoder, PassPlace::AfterBlended);
        }
    }

    /// Another pass over the scene of a view that is prepared, after what is drawn already.
    fn go_on(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        view: &ViewTarget<'_>,
        label: &'static str,
        leaves: Leaves,
    ) -> Option<wgpu::RenderPass<'static>> {
        let targets = view.state.targets.as_ref()?;
        let attachments = view.state.attachments(targets);
        let into = ScenePass { label, clear: None, leaves };
        let mut pass = begin_forward(encoder, self.timestamps.as_ref(), attachments, into).forget_lifetime();
        pass.set_bind_group(0, view.state.group()?, &[]);
        Some(pass)
    }

    /// Sends the counts of what is drawn on their way, where they are others.
    fn send_counts(&self, encoder: &mut wgpu::CommandEncoder, state: &mut ViewState) {
        if state.culled.direct().is_some() {
            state.counts.latest = Some(self.direct_counts(state));
        } else if state.targets.is_some() && (state.cullings_due > 0 || state.counts.wanted) {
            let lists: Vec<_> = state.phases().map(|phase| state.culled.arguments(phase)).collect();
            let blended = self.visible_blended(state);
            let arguments = self.draws_of(state).list.len();
            state.counts.send(&self.gpu, encoder, lists.into_iter(), arguments, blended);
        }
    }

    /// From linear colours to the screen; resolves samples.
    pub(super) fn encode_tone_map(&mut self, encoder: &mut wgpu::CommandEncoder, view: &ViewTarget<'_>) {
        let Some(targets) = view.state.targets.as_ref().filter(|_| view.state.outputs.color) else { return };
        let source = ToneMapSource::of(targets.samples);
        let tone_map = self.pipelines.tone_map(&self.gpu.device, view.format, view.state.tone_map, source);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("tone map"),
            color_attachments: &[Some(color_attachment(view.target))],
            timestamp_writes: self.timestamps.as_ref().and_then(|timestamps| timestamps.render_pass("tone map")),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(tone_map);
        pass.set_bind_group(0, &targets.hdr.source, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// A sky of one colour as passes over the scene write it.
fn sky_color(view: &ViewState) -> wgpu::Color {
    let Some(sky) = view.plain_sky else { return wgpu::Color::TRANSPARENT };
    let [r, g, b] = sky.to_array();
    wgpu::Color { r: r.into(), g: g.into(), b: b.into(), a: 1.0 }
}
