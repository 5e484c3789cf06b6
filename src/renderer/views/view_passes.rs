//! Passes of a view: which it draws by its settings, with which pipelines, and into which textures of outputs.
//!
//! A view with one sample per pixel draws all outputs in one pass ([`ViewState::draws_together`]). Others draw depths,
//! normals and ids in a second pass of one sample per pixel: they have no mean.

use super::view_state::ViewState;
use crate::renderer::passes::pass::{Attached, Pass, Shadows};
use crate::renderer::passes::targets::SceneColorCopy;
use crate::renderer::plan::output_set::OutputSet;
use crate::renderer::plan::settings::{DebugView, Settings};
use systems::assets::Technique;
use systems::draw::{Batch, BatchKey, DrawList, PipelineKey};

impl ViewState {
    /// Chooses the pass that it draws, before its objects and shadows are prepared.
    pub(crate) fn choose_pass(&mut self, list: &DrawList, settings: &Settings) {
        self.levels = settings.levels.enabled;
        self.technique = settings.technique;
        self.tone_map = settings.debug.tone_map(&list.environment);
        self.outputs = settings.outputs;
        self.may_hide = settings.occlusion.is_on(list.objects);
        let has_maps = (list.light_features.lamp_shadows || list.light_features.sun_shadows)
            && settings.shadow_maps > 0
            && settings.outputs.is_shaded()
            && matches!(settings.debug, DebugView::Off | DebugView::Visibility);
        let shadows = self.traced.as_ref().map(|_| Shadows::Traced).or(has_maps.then_some(Shadows::Maps));
        let pass = |beside| Pass::Color {
            lights: list.light_features,
            debug: settings.debug,
            samples: settings.samples,
            specular_aa: settings.specular_aa,
            shadows,
            beside,
            emboss: None,
        };
        self.pass = pass(Attached::default());
        let adds_up = self.adds_up(list);
        self.together = settings.outputs.is_shaded()
            && settings.outputs.beside_color() != OutputSet::NONE
            && settings.samples == 1
            && !adds_up;
        let beside = if self.together { Attached::of(settings.outputs) } else { Attached::default() };
        self.pass = pass(beside);
    }

    /// Tells whether the light of an object is the sum of several passes over it.
    fn adds_up(&self, list: &DrawList) -> bool {
        let adds_up = |batch: &Batch| self.pipeline_of(self.pass, batch.key).technique == Technique::EmbossMultipass;
        list.batches.iter().any(adds_up)
    }

    /// The pipeline that objects with that key are drawn with in a pass.
    pub(crate) fn pipeline_of(&self, pass: Pass, key: BatchKey) -> PipelineKey {
        let technique = self.technique.unwrap_or(key.pipeline.technique);
        let PipelineKey { alpha, shading, double_sided, mirrored, .. } = key.pipeline;
        let technique = pass.technique(technique, alpha, shading);
        if pass.draws_places_alone(alpha, technique) {
            // One pipeline for all of them.
            return PipelineKey { double_sided, mirrored, ..PipelineKey::default() };
        }
        PipelineKey { technique, ..key.pipeline }
    }

    /// Tells if [`Settings::outputs`] are drawn in the picture's own pass, which has one sample per pixel then.
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
    pub(crate) fn drawn_depth(&self, together: bool) -> Option<&wgpu::Texture> {
        if together {
            self.targets.as_ref().map(|targets| &targets.depth_texture)
        } else {
            self.output_textures.depth.as_ref().map(|kept| &kept.texture)
        }
    }

    /// Makes the textures of outputs that the settings ask for.
    pub(crate) fn ensure_outputs(&mut self, device: &wgpu::Device, size: (u32, u32)) {
        if let Some(layer) = &self.layer {
            self.output_textures = layer.outputs();
            return;
        }
        let (beside, together) = (self.outputs.beside_color(), self.draws_together());
        self.output_textures.fit(device, size, beside, beside != OutputSet::NONE && !together);
    }

    /// The passes that the settings need pipelines for, and whether opaque objects are drawn in each.
    pub(crate) fn passes(&self) -> impl Iterator<Item = (Pass, bool)> + use<> {
        let beside = self.outputs.beside_color();
        let outputs = (Pass::Outputs(Attached::of(beside)), !self.draws_together());
        let scene = (self.outputs.is_shaded() || self.may_hide).then_some((self.pass, true));
        scene.into_iter().chain((beside != OutputSet::NONE).then_some(outputs))
    }

    /// Makes a copy of the picture for blended objects to refract, while any does.
    pub(crate) fn ensure_scene_color(
        &mut self,
        device: &wgpu::Device,
        layout: &wgpu::BindGroupLayout,
        size: (u32, u32),
        blended: &[BatchKey],
    ) {
        if !self.refracts(blended) {
            self.scene_color = None;
        } else if self.scene_color.as_ref().is_none_or(|copy| copy.size() != size) {
            self.scene_color = Some(SceneColorCopy::new(device, layout, size));
        }
    }

    /// Tells if a blended object, in view or not, refracts what lies behind it.
    fn refracts(&self, blended: &[BatchKey]) -> bool {
        let shown = matches!(self.pass, Pass::Color { debug: DebugView::Off, .. });
        let technique = |key: &BatchKey| self.pipeline_of(self.pass, *key).technique;
        shown && blended.iter().any(|key| technique(key) == Technique::PerturbedUv)
    }
}
