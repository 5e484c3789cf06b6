//! Outputs of a view: its picture, depths, normals and ids, in textures that the view keeps, and read back together.
//!
//! Where the view has one sample per pixel, all are drawn in one pass ([`ViewState::draws_together`]). Else depths,
//! normals and ids are drawn in a second pass of one sample per pixel: they have no mean.

use super::encode::{color_attachment, depth_attachment};
use super::objects::Encoded;
use super::pass::{Attached, ID_FORMAT, NORMAL_FORMAT, Pass};
use super::readback::read_id_and_depth;
use super::targets::{self, DEPTH_FORMAT, whole_view};
use super::timestamps::Timestamps;
use super::{PICTURE_FORMAT, Renderer, ViewState, ViewTarget};
use glam::{Mat4, UVec2};

/// Which outputs of a view.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
pub struct OutputSet {
    /// The shaded picture.
    pub color: bool,
    /// Its linear colours, exposed, before the tone map.
    pub linear: bool,
    /// Distances along the viewing direction.
    pub depth: bool,
    /// Shading normals.
    pub normal: bool,
    /// Entities.
    pub id: bool,
}

impl OutputSet {
    /// None.
    pub const NONE: Self = Self { color: false, linear: false, depth: false, normal: false, id: false };
    /// The picture alone.
    pub const COLOR: Self = Self { color: true, ..Self::NONE };
    /// All.
    pub const ALL: Self = Self { color: true, linear: true, depth: true, normal: true, id: true };

    /// These, but for those of another set.
    pub fn without(self, other: Self) -> Self {
        Self {
            color: self.color && !other.color,
            linear: self.linear && !other.linear,
            depth: self.depth && !other.depth,
            normal: self.normal && !other.normal,
            id: self.id && !other.id,
        }
    }

    /// These, and those of another set.
    pub fn with(self, other: Self) -> Self {
        Self {
            color: self.color || other.color,
            linear: self.linear || other.linear,
            depth: self.depth || other.depth,
            normal: self.normal || other.normal,
            id: self.id || other.id,
        }
    }

    /// These, but for the picture and its linear colours.
    pub fn beside_color(self) -> Self {
        self.without(Self { linear: true, ..Self::COLOR })
    }

    /// Whether objects are shaded for them.
    pub fn is_shaded(self) -> bool {
        self.color || self.linear
    }

    /// Those that are attachments of a pass beside colour and depth.
    pub(super) fn attached(self) -> Attached {
        Attached { normal: self.normal, id: self.id }
    }
}

/// Outputs of a view, read back.
#[derive(Clone, Debug)]
pub struct Outputs {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// The picture: 8-bit sRGB RGBA, rows from the top. `None` unless it was asked for.
    pub picture: Option<image::RgbaImage>,
    /// Half floats.
    pub(super) linear: Vec<u8>,
    pub(super) normal: Vec<u8>,
    pub(super) id: Vec<u8>,
    pub(super) depth: Vec<u8>,
    pub(super) view_from_clip: Mat4,
}

impl Outputs {
    /// Linear colours, exposed, before the tone map: RGBA, rows from the top. Of several samples per pixel, their mean
    /// in linear light. Empty unless they were asked for.
    pub fn linear(&self) -> Vec<[half::f16; 4]> {
        let half = |b: &[u8]| half::f16::from_le_bytes([b[0], b[1]]);
        self.linear.chunks_exact(8).map(|t| [half(&t[0..]), half(&t[2..]), half(&t[4..]), half(&t[6..])]).collect()
    }

    /// World-space shading normals, one per pixel, rows from the top; zero where there is nothing. Empty unless they
    /// were asked for.
    pub fn normals(&self) -> Vec<[f32; 3]> {
        let half = |b: &[u8]| half::f16::from_le_bytes([b[0], b[1]]).to_f32();
        self.normal.chunks_exact(8).map(|t| [half(&t[0..]), half(&t[2..]), half(&t[4..])]).collect()
    }

    /// Entity index plus 1 of each pixel; 0 where there is nothing. Empty unless they were asked for.
    pub fn ids(&self) -> impl Iterator<Item = u32> + '_ {
        self.id.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    }

    /// Entity index of each pixel; `None` where there is nothing. Empty unless they were asked for.
    pub fn entities(&self) -> Vec<Option<u32>> {
        self.ids().map(|id| id.checked_sub(1)).collect()
    }

    /// Distance along the viewing direction in metres, one per pixel; infinite where there is nothing. Empty unless
    /// they were asked for.
    pub fn depths(&self) -> Vec<f32> {
        let depths = self.depth.chunks_exact(4);
        depths.map(|b| metres(f32::from_le_bytes([b[0], b[1], b[2], b[3]]), self.view_from_clip)).collect()
    }
}

fn entity_of(texel: [u8; 4]) -> Option<u32> {
    u32::from_le_bytes(texel).checked_sub(1)
}

/// The distance along the viewing direction of a reversed depth.
fn metres(depth: f32, view_from_clip: Mat4) -> f32 {
    // Of (0, 0, depth, 1), from the middle of the picture: where it is does not matter.
    let z = view_from_clip.z_axis.z * depth + view_from_clip.w_axis.z;
    let w = view_from_clip.z_axis.w * depth + view_from_clip.w_axis.w;
    if depth == 0.0 { f32::INFINITY } else { -z / w }
}

/// What a pixel shows.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Picked {
    /// The entity's index.
    pub entity: u32,
    /// Distance along the viewing direction in metres.
    pub depth: f32,
}

/// A texture of a view's outputs.
#[derive(Clone, Debug)]
pub(super) struct OutputTexture {
    pub texture: wgpu::Texture,
    /// Of all of it, or of a layer.
    pub view: wgpu::TextureView,
}

/// Outputs of a view, as the GPU has them. Textures are made when they are first asked for.
#[derive(Debug, Default)]
pub(super) struct OutputTextures {
    pub color: Option<OutputTexture>,
    pub normal: Option<OutputTexture>,
    pub id: Option<OutputTexture>,
    /// Of the pass of one sample per pixel, unless the picture's own pass has that.
    pub depth: Option<OutputTexture>,
}

impl OutputTextures {
    /// Makes those that are missing for a size. `depth`: whatever `outputs` say.
    fn fit(&mut self, device: &wgpu::Device, size: (u32, u32), outputs: OutputSet, depth: bool) {
        let fit = |kept: &mut Option<OutputTexture>, label, format, wanted: bool| {
            if kept.as_ref().is_some_and(|kept| (kept.texture.width(), kept.texture.height()) != size) {
                *kept = None;
            }
            if wanted && kept.is_none() {
                let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
                    | wgpu::TextureUsages::COPY_SRC
                    | wgpu::TextureUsages::TEXTURE_BINDING;
                let texture = targets::texture(device, label, size, format, 1, usage);
                *kept = Some(OutputTexture { view: whole_view(&texture, label), texture });
            }
        };
        fit(&mut self.color, "picture", PICTURE_FORMAT, outputs.color);
        fit(&mut self.normal, "normals", NORMAL_FORMAT, outputs.normal);
        fit(&mut self.id, "ids", ID_FORMAT, outputs.id);
        fit(&mut self.depth, "output depth", DEPTH_FORMAT, depth);
    }

    /// Normals and ids, as attachments of a pass that writes some of them.
    pub fn attached(&self, attached: Attached) -> [Option<&wgpu::TextureView>; 2] {
        [
            self.normal.as_ref().filter(|_| attached.normal).map(|kept| &kept.view),
            self.id.as_ref().filter(|_| attached.id).map(|kept| &kept.view),
        ]
    }
}

impl ViewState {
    /// Whether what [`Settings::outputs`](super::Settings::outputs) asks for is drawn in the picture's own pass, which
    /// has one sample per pixel then.
    pub fn draws_together(&self) -> bool {
        self.together && self.outputs.is_shaded()
    }

    /// Shading normals as the last frame drew them, `Rgba16Float`, world space; `None` unless the settings ask for
    /// them.
    pub fn normal_texture(&self) -> Option<&wgpu::Texture> {
        self.output_textures.normal.as_ref().filter(|_| self.outputs.normal).map(|kept| &kept.texture)
    }

    /// Entity indices plus 1 as the last frame drew them, `R32Uint`; `None` unless the settings ask for them.
    pub fn id_texture(&self) -> Option<&wgpu::Texture> {
        self.output_textures.id.as_ref().filter(|_| self.outputs.id).map(|kept| &kept.texture)
    }

    /// Reversed depths as the last frame drew them, `Depth32Float`; `None` unless the settings ask for them.
    pub fn depth_texture(&self) -> Option<&wgpu::Texture> {
        self.drawn_depth(self.draws_together()).filter(|_| self.outputs.depth)
    }

    /// Depths of one sample per pixel, of the picture's own pass or another.
    fn drawn_depth(&self, together: bool) -> Option<&wgpu::Texture> {
        if together {
            self.targets.as_ref().map(|targets| &targets.depth_texture)
        } else {
            self.output_textures.depth.as_ref().map(|kept| &kept.texture)
        }
    }

    /// Makes the textures of outputs that the settings ask for.
    pub(super) fn fit_outputs(&mut self, device: &wgpu::Device, size: (u32, u32)) {
        if let Some(layer) = &self.layer {
            self.output_textures = layer.outputs();
            return;
        }
        let (beside, together) = (self.outputs.beside_color(), self.draws_together());
        self.output_textures.fit(device, size, beside, beside != OutputSet::NONE && !together);
    }

    /// The passes that the settings need pipelines for, and whether opaque objects are drawn in each.
    pub(super) fn passes(&self) -> impl Iterator<Item = (Pass, bool)> + use<> {
        let beside = self.outputs.beside_color();
        let outputs = (Pass::Outputs(beside.attached()), !self.draws_together());
        let scene = (self.outputs.is_shaded() || self.may_hide).then_some((self.pass, true));
        scene.into_iter().chain((beside != OutputSet::NONE).then_some(outputs))
    }
}

impl Renderer {
    /// Draws outputs of a view and reads them back, with one wait for the GPU. What the settings ask for
    /// ([`Settings::outputs`](super::Settings::outputs)) and [`Self::encode`] has drawn already is read only; the rest
    /// is drawn once more for it. The picture is without the caller's own passes, and so is what [`Self::encode_again`]
    /// shows next. `None` unless the view is one of those of the last [`Self::prepare`].
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
        view.fit_outputs(&self.gpu.device, size);
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

    /// What the settings ask for beside the picture: all of it, or blended objects alone, where opaque ones were drawn
    /// with the picture.
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
        if beside == OutputSet::NONE || (together && view.blended_runs.is_empty()) {
            return;
        }
        let attached = beside.attached();
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
