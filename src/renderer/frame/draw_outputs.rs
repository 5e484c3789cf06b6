//! Outputs of a view: its picture, depths, normals and ids, drawn if need be, and read back together.

use super::objects::Encoded;
use super::renderer::Renderer;
use crate::renderer::gpu::formats::PICTURE_FORMAT;
use crate::renderer::gpu::readback::read_id_and_depth;
use crate::renderer::gpu::timestamps::Timestamps;
use crate::renderer::passes::attachments::{color_attachment, depth_attachment};
use crate::renderer::passes::output_textures::OutputTexture;
use crate::renderer::passes::pass::{Attached, Pass};
use crate::renderer::plan::output_set::OutputSet;
use crate::renderer::views::outputs::{Outputs, Picked, entity_of, metres};
use crate::renderer::views::view_state::ViewState;
use crate::renderer::views::view_target::ViewTarget;
use glam::UVec2;

impl Renderer {
    /// Draws outputs of a view and reads them back, with one wait for the GPU. What the settings ask for
    /// ([`Settings::outputs`](crate::renderer::Settings::outputs)) and [`Self::encode`] has drawn already is read only;
    /// the rest is drawn once more for it. The picture is without the caller's own passes, and so is what
    /// [`Self::encode_again`] shows next. `None` unless the view is one of those of the last [`Self::prepare`].
    pub fn draw_outputs(&mut self, view: &mut ViewState, outputs: OutputSet) -> Option<Outputs> {
        if !self.is_prepared(view) {
            return None;
        }
        let size = view.size()?;
        let label = wgpu::CommandEncoderDescriptor { label: Some("outputs") };
        let mut encoder = self.gpu.device.create_command_encoder(&label);
        if outputs.is_shaded() {
            self.encode_picture(&mut encoder, view, size);
        }
        let rest = outputs.beside_color().without(view.drawn_outputs);
        if rest != OutputSet::NONE {
            self.encode_rest(&mut encoder, view, size, rest, None);
        }
        let textures = &view.output_textures;
        let kept = |kept: &Option<OutputTexture>, wanted: bool| {
            kept.as_ref().filter(|_| wanted).map(|kept| kept.texture.clone())
        };
        let depth = view.drawn_depth(rest == OutputSet::NONE && view.draws_together()).filter(|_| outputs.depth);
        let linear = view.targets.as_ref().filter(|_| outputs.linear);
        let sources = [
            linear.map(|targets| targets.hdr.resolved(&self.gpu.device, &mut encoder)),
            kept(&textures.color, outputs.color),
            kept(&textures.normal, outputs.normal),
            kept(&textures.id, outputs.id),
            depth.cloned(),
        ];
        let [linear, color, normal, id, depth] = view.readback.read(&self.gpu, encoder, &sources);
        let (width, height) = size;
        let picture = outputs.color.then(|| image::RgbaImage::from_raw(width, height, color)).flatten();
        Some(Outputs { width, height, picture, linear, normal, id, depth, view_from_clip: view.view_from_clip })
    }

    /// The entity at a pixel, and its distance; `None` where there is nothing, or if the view is not one of those of
    /// the last [`Self::prepare`]. Shades that pixel only and waits for the GPU: for clicks, not for every frame.
    pub fn pick(&mut self, view: &mut ViewState, pixel: UVec2) -> Option<Picked> {
        let size = view.size().filter(|_| self.is_prepared(view))?;
        if pixel.cmpge(size.into()).any() {
            return None;
        }
        let label = wgpu::CommandEncoderDescriptor { label: Some("pick") };
        let mut encoder = self.gpu.device.create_command_encoder(&label);
        let wanted = OutputSet { depth: true, id: true, ..OutputSet::NONE };
        let rest = wanted.without(view.drawn_outputs);
        if rest != OutputSet::NONE {
            // Textures that the settings ask for stay whole.
            let alone = Some(pixel).filter(|_| !view.outputs.depth && !view.outputs.id);
            self.encode_rest(&mut encoder, view, size, wanted, alone);
        }
        let id = &view.output_textures.id.as_ref()?.texture;
        let depth = view.drawn_depth(rest == OutputSet::NONE && view.draws_together())?;
        let [id, depth] = read_id_and_depth(&self.gpu, encoder, id, depth, pixel);
        Some(Picked { entity: entity_of(id)?, depth: metres(f32::from_le_bytes(depth), view.view_from_clip) })
    }

    /// Draws the picture into the texture that the view keeps, with what the settings ask for.
    fn encode_picture(&mut self, encoder: &mut wgpu::CommandEncoder, view: &mut ViewState, size: (u32, u32)) {
        let planned = view.outputs;
        view.outputs.color = true;
        let missing = self.start_pipelines(std::iter::once(&*view), self.opaque_keys(view));
        self.pipelines.finish_objects(missing);
        view.output_textures.fit(&self.gpu.device, size, OutputSet::COLOR.with(planned), false);
        view.ensure_outputs(&self.gpu.device, size);
        if let Some(picture) = view.output_textures.color.as_ref().map(|kept| kept.view.clone()) {
            self.encode(encoder, &mut [ViewTarget::new(&mut *view, &picture, PICTURE_FORMAT)]);
        }
        view.outputs = planned;
    }

    /// Draws outputs that the settings do not ask for; `pixel`: at that only.
    fn encode_rest(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: &mut ViewState,
        size: (u32, u32),
        rest: OutputSet,
        pixel: Option<UVec2>,
    ) {
        let planned = std::mem::replace(&mut view.outputs, rest);
        let missing = self.start_pipelines(std::iter::once(&*view), self.opaque_keys(view));
        self.pipelines.finish_objects(missing);
        view.output_textures.fit(&self.gpu.device, size, rest, true);
        // Nothing is drawn into it: there is no tone map.
        let target = view.output_textures.depth.as_ref().map(|kept| kept.view.clone());
        if view.lists_ready {
            self.own.tables.encode(encoder, None);
            self.encode_outputs(encoder, view, None, pixel);
        } else if let Some(target) = target {
            // The picture was not drawn, which finds out what is visible.
            let mut view = ViewTarget::new(&mut *view, &target, PICTURE_FORMAT);
            self.begin_encoding(encoder, std::slice::from_ref(&view));
            self.encode_scene(encoder, &mut view, &mut Encoded::default());
            self.finish_timestamps(encoder);
        }
        view.outputs = planned;
        // Of one pixel only, or beside those that the settings ask for.
        view.drawn_outputs = OutputSet::NONE;
    }

    /// Encodes the outputs that the settings ask for beside the picture. Where opaque objects were drawn with the
    /// picture, only blended ones are encoded.
    pub(super) fn encode_outputs(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        view: &ViewState,
        timestamps: Option<&Timestamps>,
        pixel: Option<UVec2>,
    ) {
        let beside = view.outputs.beside_color();
        let together = view.draws_together();
        let (Some(group), Some(targets)) = (view.group(), &view.targets) else { return };
        if beside == OutputSet::NONE || (together && view.blended.runs.is_empty()) {
            return;
        }
        let attached = Attached::of(beside);
        let own_depth = view.output_textures.depth.as_ref().map(|kept| &kept.view);
        let Some(depth) = (if together { Some(&targets.depth) } else { own_depth }) else { return };
        let load = together.then_some(wgpu::LoadOp::Load);
        let attachment = |view| {
            let mut attachment = color_attachment(view);
            attachment.ops.load = load.unwrap_or(attachment.ops.load);
            attachment
        };
        let mut depth = depth_attachment(depth, wgpu::StoreOp::Store);
        if together {
            depth.depth_ops = depth.depth_ops.map(|ops| wgpu::Operations { load: wgpu::LoadOp::Load, ..ops });
        }
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("outputs"),
            color_attachments: &view.output_textures.attached(attached).map(|view| view.map(attachment)),
            depth_stencil_attachment: Some(depth),
            timestamp_writes: timestamps.and_then(|timestamps| timestamps.render_pass("outputs")),
            ..wgpu::RenderPassDescriptor::default()
        });
        if let Some(pixel) = pixel {
            pass.set_scissor_rect(pixel.x, pixel.y, 1, 1);
        }
        pass.set_bind_group(0, group, &[]);
        let kind = Pass::Outputs(attached);
        for phase in view.phases().filter(|_| !together) {
            self.draw_objects(&mut pass, view, kind, phase);
        }
        self.draw_blended(&mut pass, view, kind);
    }
}
