//! The window: the only place that knows there is one.
//!
//! ```text
//! window    events in, frames out: step → systems → panel → prepare → draw → present
//! input     keys and pointer become commands and gestures; the table of keys
//! viewer    what is looked at and how: the world, settings, selection; commands change it
//! camera    the free camera: orbit, pan, zoom, look, fly
//! driving   keys become a vehicle's controls
//! picking   what is under the pointer
//! surface   the window's textures
//! graphics  the device and what draws with it, opened anew where it is lost
//! gui       egui on winit and wgpu
//! timing    how long frames take
//! panel, entities, details, overlay, legend, light_editor   what egui shows
//! sensors   what of the sensors is looked at; sensor_captures and others: how
//! ```
//!
//! The scene fills the whole window and the panel floats over it, so the window shows the pixels that rendering the
//! same scene, camera and size to a file gives. While the clock runs or the camera moves, frames follow one another;
//! otherwise nothing is drawn until an event comes.

mod camera;
mod details;
mod driving;
mod entities;
mod graphics;
mod gui;
mod input;
mod legend;
mod light_editor;
mod overlay;
mod panel;
mod picking;
mod sensor_captures;
mod sensor_overlay;
mod sensor_panel;
mod sensor_thumbnails;
mod sensor_values;
mod sensors;
mod surface;
mod timing;
mod viewer;
mod window;

pub use input::{KEYS, KeyBinding, POINTER};

use crate::frames::{FrameError, LoadOptions};
use crate::recording::Stepper;
use crate::renderer::{GpuError, RenderError, Settings};
use crate::viewpoint::Viewpoint;
use bevy_ecs::prelude::*;
use std::panic::{self, AssertUnwindSafe};
use std::path::PathBuf;
use systems::Simulation;
use systems::ecs::clock::Clock;
use winit::event_loop::EventLoop;

/// What the window shows, and how it starts.
pub struct Options {
    /// A loaded world.
    pub simulation: Simulation,
    /// Where it was loaded from, and how: texels that only a lost device had are read again.
    pub scene: PathBuf,
    /// How.
    pub load: LoadOptions,
    /// Takes its steps.
    pub stepper: Stepper,
    /// The scene's name, for the title bar.
    pub title: String,
    /// Names and entities of the scene's cameras, for switching between them.
    pub cameras: Vec<(String, Entity)>,
    /// What is looked through at first.
    pub viewpoint: Viewpoint,
    /// Pixels.
    pub size: (u32, u32),
    /// How to draw at first.
    pub settings: Settings,
    /// Starts with the clock stopped.
    pub paused: bool,
    /// Starts with the panel shown.
    pub panel: bool,
}

/// Why there is no window, or none any more.
#[derive(Debug, thiserror::Error)]
pub enum AppError {
    /// No display, or no window on it.
    #[error("{0}")]
    NoDisplay(String),
    /// No graphics adapter for the window.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The scene is too large for the adapter, or there is no device for long.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// What the scene was loaded from cannot be read again.
    #[error(transparent)]
    Texels(#[from] FrameError),
}

/// Shows a world in a window until it is closed.
///
/// # Errors
/// [`AppError`]. [`AppError::NoDisplay`] comes before anything is drawn, so that the caller can do something else.
pub fn run(mut options: Options) -> Result<(), AppError> {
    if options.paused {
        options.simulation.world.resource_mut::<Clock>().paused = true;
    }
    let event_loop = open_event_loop()?;
    let mut app = window::App::new(options);
    event_loop.run_app(&mut app).map_err(|error| no_display(&error))?;
    app.result()
}

/// winit returns an error where there is no display, but panics where a library is missing that it opens late, or the
/// X server lacks an extension. Both mean the same to a person: no window here.
fn open_event_loop() -> Result<EventLoop<()>, AppError> {
    let hook = panic::take_hook();
    panic::set_hook(Box::new(|_| {}));
    let opened = panic::catch_unwind(AssertUnwindSafe(EventLoop::new));
    panic::set_hook(hook);
    match opened {
        Ok(Ok(event_loop)) => Ok(event_loop),
        Ok(Err(error)) => Err(no_display(&error)),
        Err(payload) => {
            let text = payload.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| payload.downcast_ref::<&str>().copied());
            Err(AppError::NoDisplay(text.unwrap_or("the window system cannot be used").to_owned()))
        }
    }
}

/// winit's errors begin with the place in its source.
fn no_display(error: &dyn std::error::Error) -> AppError {
    let text = error.to_string();
    let reason = text.strip_prefix("os error at ").and_then(|rest| rest.split_once(": "));
    AppError::NoDisplay(reason.map_or(text.as_str(), |(_, reason)| reason).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reason_for_no_window_is_for_people() {
        let error = std::io::Error::other("os error at winit/mod.rs:788: neither DISPLAY nor: that");
        assert_eq!(no_display(&error).to_string(), "neither DISPLAY nor: that");
        assert_eq!(no_display(&std::io::Error::other("plain: text")).to_string(), "plain: text");
    }
}
