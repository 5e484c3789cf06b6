//! The graphics device of this process, which all worlds share, and whether this still is the process that began.

use crate::errors::{Failure, Outcome};
use relief::renderer::RenderError;
use relief::sense::Drawing;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

/// The process that first made a world: its threads are in no process that is forked from it.
static PROCESS: OnceLock<u32> = OnceLock::new();

/// Device and renderers, with the resources of all worlds: they share the device, and worlds of one scene meshes and
/// textures.
static DRAWING: Mutex<Option<Drawing>> = Mutex::new(None);

/// Before anything that takes a lock, or uses threads or the device.
pub fn check_process() -> Outcome<()> {
    let now = std::process::id();
    if *PROCESS.get_or_init(|| now) == now { Ok(()) } else { Err(Failure::Forked) }
}

fn drawing() -> MutexGuard<'static, Option<Drawing>> {
    DRAWING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Does something with what draws. The device is opened when a view is first drawn, and again after it was lost: what
/// needs no picture needs none. Locks of worlds are taken before.
pub fn with_drawing<T>(work: impl FnOnce(&mut Drawing) -> Result<T, RenderError>) -> Outcome<T> {
    check_process()?;
    let mut drawing = drawing();
    work(drawing.get_or_insert_with(|| Drawing::of_many(None))).map_err(|error| {
        if error.is_of_device() {
            *drawing = None;
        }
        error.into()
    })
}

/// Gives up what is uploaded of a world.
pub fn forget(world: u64) {
    // What a forked process has of the device is not its own.
    if check_process().is_ok()
        && let Some(drawing) = drawing().as_mut()
    {
        drawing.forget(world);
    }
}
