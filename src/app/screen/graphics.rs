//! Graphics resources of a window. Where the device is lost it is opened anew; nothing of the world is in it.

use crate::app::screen::gui::Gui;
use crate::app::screen::surface::Screen;
use crate::renderer::{Gpu, GpuError, SingleView};
use std::sync::Arc;
use std::time::Duration;
use winit::window::Window;

/// A driver that was reset is back after some seconds.
const MOST_TRIES: u32 = 20;
const BETWEEN_TRIES: Duration = Duration::from_millis(500);

/// Device, surface, and what draws. Fields are dropped in order: what draws before what is drawn to.
pub struct Graphics {
    pub gui: Gui,
    pub renderer: SingleView,
    pub screen: Screen,
    pub gpu: Gpu,
}

impl Graphics {
    /// Opens the adapter that can show on the window.
    ///
    /// # Errors
    /// [`GpuError`].
    pub fn open(window: &Arc<Window>, instance: wgpu::Instance) -> Result<Self, GpuError> {
        let (gpu, screen) = Screen::open(window, instance)?;
        let gui = Gui::new(&gpu, screen.panel_format, window);
        Ok(Self { gui, renderer: SingleView::new(&gpu), screen, gpu })
    }

    /// Another device in the place of one that is lost, with nothing uploaded; the panel is as it was.
    ///
    /// # Errors
    /// [`GpuError`] where there is none for some seconds.
    pub fn reopen(self, window: &Arc<Window>) -> Result<Self, GpuError> {
        let Self { gui, renderer, screen, gpu } = self;
        let (instance, panel) = (gpu.instance.clone(), gui.context.clone());
        // The old ones first: a window has one surface, and memory may be short.
        drop((gui, renderer, screen, gpu));
        let mut tries = 1;
        loop {
            match Self::open(window, instance.clone()) {
                Ok(graphics) => {
                    graphics.gui.context.memory_mut(|memory| *memory = panel.memory(Clone::clone));
                    return Ok(graphics);
                }
                Err(error) if tries == MOST_TRIES => return Err(error),
                Err(_) => std::thread::sleep(BETWEEN_TRIES),
            }
            tries += 1;
        }
    }
}
