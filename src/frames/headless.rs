//! Pictures of a world in hand, without a window.

use super::FrameError;
use crate::renderer::{Gpu, Settings, SingleView};
use crate::viewpoint::Viewpoint;
use systems::Simulation;

/// A renderer without a window, for a few pictures of a world in hand.
pub struct Headless {
    /// Draws.
    pub renderer: SingleView,
    /// Render settings.
    pub settings: Settings,
}

impl Headless {
    /// Opens the best adapter.
    ///
    /// # Errors
    /// [`FrameError::Gpu`].
    pub fn new() -> Result<Self, FrameError> {
        Ok(Self { renderer: SingleView::new(&Gpu::headless()?), settings: Settings::default() })
    }

    /// Brings the world's draw list up to date and draws it as seen from a camera's entity, or another viewpoint, in
    /// 8-bit sRGB.
    ///
    /// # Errors
    /// [`FrameError::Render`].
    pub fn draw(
        &mut self,
        simulation: &mut Simulation,
        from: impl Into<Viewpoint>,
        size: (u32, u32),
    ) -> Result<image::RgbaImage, FrameError> {
        simulation.frame();
        let view = from.into().view(&simulation.world, size);
        simulation.with_frame(|frame| self.renderer.prepare(frame, &view, &self.settings))?;
        let picture = self.renderer.draw_picture();
        self.renderer.gpu().check()?;
        Ok(picture)
    }
}
