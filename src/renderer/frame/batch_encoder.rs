//! The views of a batch, encoded world by world.

use super::objects::Encoded;
use super::renderer::Renderer;
use crate::renderer::culling::slot_set::SlotSet;
use crate::renderer::gpu::error::RenderError;
use crate::renderer::gpu::formats::PICTURE_FORMAT;
use crate::renderer::plan::view_plan::ViewPlan;
use crate::renderer::views::layers::ViewBatchKey;
use crate::renderer::views::view_state::ViewState;
use crate::renderer::views::view_target::ViewTarget;
use std::sync::Arc;
use systems::draw::FrameData;

/// The views of a batch, as they are encoded world by world.
pub(crate) struct BatchEncoder<'a> {
    pub renderer: &'a mut Renderer,
    pub key: ViewBatchKey,
    pub states: &'a mut [ViewState],
    /// All in one, or one for each view.
    pub pictures: &'a [wgpu::TextureView],
    pub encoder: wgpu::CommandEncoder,
    pub encoded: Encoded,
    /// The first state that has no view yet.
    pub next: usize,
}

impl BatchEncoder<'_> {
    /// Prepares and encodes the next views, which are of one world.
    pub fn encode(
        &mut self,
        frame: &mut FrameData<'_>,
        views: Vec<(ViewPlan, Option<Arc<SlotSet>>)>,
    ) -> Result<(), RenderError> {
        let Self { renderer, key, states, pictures, encoder, encoded, next } = self;
        let first = std::mem::replace(next, *next + views.len());
        let states = &mut states[first..*next];
        let mut prepared = Vec::with_capacity(views.len());
        for (state, (plan, only)) in states.iter_mut().zip(views) {
            state.only = only;
            prepared.push((state, plan));
        }
        renderer.prepare(frame, &mut prepared)?;
        let targets: Vec<_> = (first..)
            .zip(states)
            .map(|(index, state)| ViewTarget::new(state, &pictures[index.min(pictures.len() - 1)], PICTURE_FORMAT))
            .collect();
        renderer.begin_encoding(encoder, &targets);
        for mut target in targets {
            renderer.encode_scene(encoder, &mut target, encoded);
            if key.samples > 1 {
                renderer.encode_tone_map(encoder, &target);
            }
            target.state.drawn_now();
        }
        Ok(())
    }
}
