//! The window's textures, and getting the next one to draw into.

use crate::renderer::{Gpu, GpuError};
use std::sync::Arc;
use winit::window::Window;

/// A window's surface.
pub struct Screen {
    surface: wgpu::Surface<'static>,
    window: Arc<Window>,
    config: wgpu::SurfaceConfiguration,
    /// sRGB: the scene's linear values are encoded as they are in pictures.
    pub scene_format: wgpu::TextureFormat,
    /// The same texture for egui, which blends encoded colours; sRGB too where the surface has but one view.
    pub panel_format: wgpu::TextureFormat,
    failures: u32,
}

/// A texture to draw into and show.
pub struct Frame {
    texture: wgpu::SurfaceTexture,
    /// In the scene's format.
    pub scene: wgpu::TextureView,
    /// In the panel's format.
    pub panel: wgpu::TextureView,
}

/// So many frames that cannot be had in a row mean that there will be none.
const MOST_FAILURES: u32 = 100;

impl Screen {
    /// Opens the adapter that can show on the window, and the window's surface.
    ///
    /// # Errors
    /// [`GpuError`].
    pub fn open(window: &Arc<Window>, instance: wgpu::Instance) -> Result<(Gpu, Self), GpuError> {
        let surface = make_surface(&instance, window)?;
        let gpu = Gpu::for_surface(instance, &surface)?;
        let refused = |reason: &str| GpuError::NoSurface(reason.to_owned());
        let mut config =
            surface.get_default_config(&gpu.adapter, 1, 1).ok_or_else(|| refused("no supported format"))?;
        let flags = gpu.adapter.get_downlevel_capabilities().flags;
        let views = flags.contains(wgpu::DownlevelFlags::SURFACE_VIEW_FORMATS);
        let offered = surface.get_capabilities(&gpu.adapter).formats;
        let format = choose_format(&offered, views).ok_or_else(|| refused("no sRGB format"))?;
        config.format = format;
        config.present_mode = wgpu::PresentMode::AutoVsync;
        let scene_format = format.add_srgb_suffix();
        let panel_format = if views { format.remove_srgb_suffix() } else { format };
        config.view_formats = [scene_format, panel_format].into_iter().filter(|view| *view != format).collect();
        let screen = Self { surface, window: window.clone(), config, scene_format, panel_format, failures: 0 };
        Ok((gpu, screen))
    }

    /// The window's size in pixels; `None` while it has none (minimised).
    pub fn size(&self) -> Option<(u32, u32)> {
        let size = self.window.inner_size();
        (size.width > 0 && size.height > 0).then_some((size.width, size.height))
    }

    /// The next texture to draw into, of the window's size; `None`: not now.
    ///
    /// # Errors
    /// [`GpuError::NoSurface`] where it cannot be had for long.
    pub fn acquire(&mut self, gpu: &Gpu, (width, height): (u32, u32)) -> Result<Option<Frame>, GpuError> {
        if (self.config.width, self.config.height) != (width, height) {
            (self.config.width, self.config.height) = (width, height);
            self.surface.configure(&gpu.device, &self.config);
        }
        match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(texture) => return Ok(Some(self.frame(texture))),
            wgpu::CurrentSurfaceTexture::Suboptimal(texture) => {
                // Shown as it is; configured anew for the next one.
                (self.config.width, self.config.height) = (0, 0);
                return Ok(Some(self.frame(texture)));
            }
            wgpu::CurrentSurfaceTexture::Occluded => return Ok(None),
            wgpu::CurrentSurfaceTexture::Timeout => {}
            wgpu::CurrentSurfaceTexture::Outdated | wgpu::CurrentSurfaceTexture::Validation => {
                self.surface.configure(&gpu.device, &self.config);
            }
            wgpu::CurrentSurfaceTexture::Lost => {
                self.surface = make_surface(&gpu.instance, &self.window)?;
                self.surface.configure(&gpu.device, &self.config);
            }
        }
        self.failures += 1;
        if self.failures > MOST_FAILURES {
            return Err(GpuError::NoSurface("the surface yields no more textures".to_owned()));
        }
        self.window.request_redraw();
        Ok(None)
    }

    fn frame(&mut self, texture: wgpu::SurfaceTexture) -> Frame {
        self.failures = 0;
        let view = |label, format| {
            let (label, format) = (Some(label), Some(format));
            texture.texture.create_view(&wgpu::TextureViewDescriptor { label, format, ..Default::default() })
        };
        let (scene, panel) = (view("window, scene", self.scene_format), view("window, panel", self.panel_format));
        Frame { texture, scene, panel }
    }

    /// Shows a frame that has been drawn.
    pub fn present(&self, gpu: &Gpu, frame: Frame) {
        self.window.pre_present_notify();
        gpu.queue.present(frame.texture);
    }
}

fn make_surface(instance: &wgpu::Instance, window: &Arc<Window>) -> Result<wgpu::Surface<'static>, GpuError> {
    instance.create_surface(window.clone()).map_err(|error| GpuError::NoSurface(error.to_string()))
}

/// An 8-bit sRGB format if there is one, any sRGB format else; a plain one that can be viewed as sRGB last.
fn choose_format(offered: &[wgpu::TextureFormat], views: bool) -> Option<wgpu::TextureFormat> {
    use wgpu::TextureFormat::{Bgra8Unorm, Bgra8UnormSrgb, Rgba8Unorm, Rgba8UnormSrgb};
    let wanted = [Bgra8UnormSrgb, Rgba8UnormSrgb];
    let plain = if views { [Bgra8Unorm, Rgba8Unorm].as_slice() } else { &[] };
    let first_of = |wanted: &[_]| wanted.iter().copied().find(|format| offered.contains(format));
    first_of(&wanted).or_else(|| offered.iter().copied().find(|format| format.is_srgb())).or_else(|| first_of(plain))
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgpu::TextureFormat::{Bgra8Unorm, Bgra8UnormSrgb, Rgba8Unorm, Rgba16Float};

    #[test]
    fn the_scene_is_always_encoded_as_srgb() {
        assert_eq!(choose_format(&[Bgra8Unorm, Bgra8UnormSrgb], true), Some(Bgra8UnormSrgb));
        assert_eq!(choose_format(&[Rgba16Float, Rgba8Unorm], true), Some(Rgba8Unorm), "viewed as sRGB");
        assert_eq!(choose_format(&[Rgba16Float, Rgba8Unorm], false), None);
    }
}
