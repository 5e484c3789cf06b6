//! The target of a view, with the caller's own passes.

use super::view_state::ViewState;
use crate::renderer::passes::custom_passes::{EncodePass, PassPlace, PassTargets};

/// A view of a frame, and where it is drawn.
pub struct ViewTarget<'a> {
    /// The view, prepared.
    pub state: &'a mut ViewState,
    /// All of a texture of the prepared view's size, or a part of one.
    pub target: &'a wgpu::TextureView,
    /// Format of the target. An sRGB one encodes; others receive linear values.
    pub format: wgpu::TextureFormat,
    passes: Vec<(PassPlace, EncodePass<'a>)>,
}

impl<'a> ViewTarget<'a> {
    /// A view and its target.
    pub fn new(state: &'a mut ViewState, target: &'a wgpu::TextureView, format: wgpu::TextureFormat) -> Self {
        Self { state, target, format, passes: Vec::new() }
    }

    /// With a pass of the caller's own, which `encode` encodes; several at one place in the order in which they were
    /// added; none if the settings ask for no picture. Between passes depths are kept, which costs bandwidth on GPUs
    /// that draw in tiles.
    #[must_use]
    pub fn with_pass(
        mut self,
        place: PassPlace,
        encode: impl FnMut(&mut wgpu::CommandEncoder, &PassTargets<'_>) + 'a,
    ) -> Self {
        self.passes.push((place, Box::new(encode)));
        self
    }

    pub(crate) fn has_pass(&self, place: PassPlace) -> bool {
        self.state.outputs.color && self.passes.iter().any(|(at, _)| *at == place)
    }

    /// Encodes the caller's passes of a place.
    pub(crate) fn encode_passes(&mut self, encoder: &mut wgpu::CommandEncoder, place: PassPlace) {
        if !self.state.outputs.color {
            return;
        }
        let Some(targets) = &self.state.targets else { return };
        let scene = targets.attachments(None, [None; 2]);
        let (color, color_format, color_samples) = match place {
            PassPlace::AfterToneMap => (self.target, self.format, 1),
            PassPlace::AfterOpaque | PassPlace::AfterBlended => {
                (scene.color, PassTargets::LINEAR_FORMAT, targets.samples)
            }
        };
        let size = (targets.width, targets.height);
        let own =
            PassTargets { size, color, color_format, color_samples, depth: scene.depth, samples: targets.samples };
        for (_, encode) in self.passes.iter_mut().filter(|(at, _)| *at == place) {
            encode(encoder, &own);
        }
    }
}
