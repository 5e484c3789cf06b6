//! The window: the only place that knows there is one.
//!
//! ```text
//! options, error   what a window is opened with; reasons for none
//! timing    how long frames take
//! screen/   the window's textures (surface), egui on winit and wgpu (gui); graphics: the device and what draws with
//!           it, opened anew where it is lost
//! control/  input: keys and pointer become commands and gestures; the table of keys
//!           camera: the free camera: orbit, pan, zoom, look, fly
//!           driving: keys become a vehicle's controls; picking: what is under the pointer
//! sensors/  sensors that are looked at, their last captures
//! viewer    what is looked at and how: the world, settings, selection; commands change it
//! shown/    what egui shows: panel, lists, details, overlays
//! window    events in, frames out: step → systems → panel → prepare → draw → present
//! ```
//!
//! Each line uses those above it.
//!
//! The scene fills the whole window and the panel floats over it, so the window shows the pixels that rendering the
//! same scene, camera and size to a file gives. While the clock runs or the camera moves, frames follow one another;
//! otherwise nothing is drawn until an event comes.

mod control;
mod error;
mod options;
mod screen;
mod sensors;
mod shown;
mod timing;
mod viewer;
mod window;

pub use control::input::{KEYS, KeyBinding, POINTER};
pub use error::AppError;
pub use options::Options;

use error::no_display;
use std::panic::{self, AssertUnwindSafe};
use systems::ecs::clock::Clock;
use winit::event_loop::EventLoop;

/// Shows a world in a window until it is closed.
///
/// # Errors
/// [`AppError`]. [`AppError::NoDisplay`] comes before anything is drawn, so that the caller can do something else.
pub fn run(mut options: Options) -> Result<(), AppError> {
    if options.paused {
        options.session.simulation.world.resource_mut::<Clock>().paused = true;
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
