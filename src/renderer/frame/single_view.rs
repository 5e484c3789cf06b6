//! A renderer with one view: most programs have one camera.

use super::renderer::Renderer;
use crate::renderer::culling::visible_counts::VisibleCounts;
use crate::renderer::gpu::device::Gpu;
use crate::renderer::gpu::error::RenderError;
use crate::renderer::gpu::timestamps::PassTime;
use crate::renderer::plan::output_set::OutputSet;
use crate::renderer::plan::settings::Settings;
use crate::renderer::plan::view_plan::ViewPlan;
use crate::renderer::resources::stats::{HeldBytes, RenderStats};
use crate::renderer::shadows::traced::TracedShadows;
use crate::renderer::views::outputs::{Outputs, Picked};
use crate::renderer::views::view_state::ViewState;
use crate::renderer::views::view_target::ViewTarget;
use glam::UVec2;
use systems::draw::{FrameData, View};

/// A [`Renderer`] and the state of its only view.
#[derive(Debug)]
pub struct SingleView {
    renderer: Renderer,
    state: ViewState,
}

impl SingleView {
    /// For a device.
    pub fn new(gpu: &Gpu) -> Self {
        Self { renderer: Renderer::new(gpu), state: ViewState::new(gpu) }
    }

    /// The device it draws with.
    pub fn gpu(&self) -> &Gpu {
        self.renderer.gpu()
    }

    /// The view.
    pub fn state(&self) -> &ViewState {
        &self.state
    }

    /// [`Renderer::prepare`]. Returns whether the picture can differ from the one last drawn; if not,
    /// [`Self::show_again`] gives it for less.
    ///
    /// # Errors
    /// [`RenderError`].
    pub fn prepare(
        &mut self,
        frame: &mut FrameData<'_>,
        view: &View,
        settings: &Settings,
    ) -> Result<bool, RenderError> {
        let plan = ViewPlan { view: view.clone(), settings: *settings };
        self.renderer.prepare(frame, &mut [(&mut self.state, plan)])?;
        Ok(self.state.needs_redraw())
    }

    /// [`Renderer::set_traced_shadows`].
    ///
    /// # Errors
    /// [`RenderError::TooLarge`].
    pub fn set_traced_shadows(&mut self, shadows: Option<&TracedShadows>) -> Result<(), RenderError> {
        self.renderer.set_traced_shadows(&mut self.state, shadows)
    }

    /// [`Renderer::encode`] into `target`, handed in.
    ///
    /// # Panics
    /// Same conditions as [`Renderer::encode`].
    pub fn draw(&mut self, target: &wgpu::TextureView, format: wgpu::TextureFormat) {
        let commands = self.encode(target, format);
        self.gpu().queue.submit([commands]);
    }

    /// [`Self::draw`] without handing the commands in, to measure the two apart.
    ///
    /// # Panics
    /// Same conditions as [`Renderer::encode`].
    pub fn encode(&mut self, target: &wgpu::TextureView, format: wgpu::TextureFormat) -> wgpu::CommandBuffer {
        let label = wgpu::CommandEncoderDescriptor { label: Some("frame") };
        let mut encoder = self.gpu().device.create_command_encoder(&label);
        self.renderer.encode(&mut encoder, &mut [ViewTarget::new(&mut self.state, target, format)]);
        encoder.finish()
    }

    /// [`Renderer::encode_again`], handed in.
    ///
    /// # Panics
    /// Same conditions as [`Renderer::encode_again`].
    pub fn show_again(&mut self, target: &wgpu::TextureView, format: wgpu::TextureFormat) {
        let label = wgpu::CommandEncoderDescriptor { label: Some("frame again") };
        let mut encoder = self.gpu().device.create_command_encoder(&label);
        self.renderer.encode_again(&mut encoder, &mut [ViewTarget::new(&mut self.state, target, format)]);
        self.gpu().queue.submit([encoder.finish()]);
    }

    /// Draws what was prepared and reads the picture back: 8-bit sRGB RGBA, rows from the top. Empty if nothing was
    /// prepared.
    pub fn draw_picture(&mut self) -> image::RgbaImage {
        self.draw_outputs(OutputSet::COLOR).and_then(|outputs| outputs.picture).unwrap_or_default()
    }

    /// [`Renderer::draw_outputs`].
    pub fn draw_outputs(&mut self, outputs: OutputSet) -> Option<Outputs> {
        self.renderer.draw_outputs(&mut self.state, outputs)
    }

    /// [`Renderer::pick`].
    pub fn pick(&mut self, pixel: UVec2) -> Option<Picked> {
        self.renderer.pick(&mut self.state, pixel)
    }

    /// [`ViewState::read_linear`].
    pub fn read_linear(&self) -> Option<Vec<[f32; 4]>> {
        self.state.read_linear(self.gpu())
    }

    /// [`ViewState::visible_counts`].
    pub fn visible_counts(&self) -> Option<VisibleCounts> {
        self.state.visible_counts()
    }

    /// [`Renderer::read_visible_counts`].
    pub fn read_visible_counts(&self) -> VisibleCounts {
        self.renderer.read_visible_counts(&self.state)
    }

    /// [`Renderer::read_visible_slots`].
    pub fn read_visible_slots(&self) -> Vec<u32> {
        self.renderer.read_visible_slots(&self.state)
    }

    /// [`Renderer::held_bytes`].
    pub fn held_bytes(&self) -> HeldBytes {
        self.renderer.held_bytes()
    }

    /// [`Renderer::stats`].
    pub fn stats(&self) -> RenderStats {
        self.renderer.stats()
    }

    /// [`Renderer::time_passes`].
    pub fn time_passes(&mut self) {
        self.renderer.time_passes();
    }

    /// [`Renderer::pass_times`].
    pub fn pass_times(&mut self) -> Option<Vec<PassTime>> {
        self.renderer.pass_times()
    }
}
