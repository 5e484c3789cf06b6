//! The graphics device of this process, which all worlds share, and whether this still is the process that began.

use crate::errors::{Failure, Outcome};
use relief::renderer::Gpu;
use std::sync::{Mutex, OnceLock, PoisonError};

/// The process that first made a world: its threads are in no process that is forked from it.
static PROCESS: OnceLock<u32> = OnceLock::new();

static DEVICE: Mutex<Option<Gpu>> = Mutex::new(None);

/// Before anything that takes a lock, or uses threads or the device.
pub fn check_process() -> Outcome<()> {
    let now = std::process::id();
    if *PROCESS.get_or_init(|| now) == now { Ok(()) } else { Err(Failure::Forked) }
}

/// The device, which is opened when it is first asked for, and again after it was lost.
pub fn gpu() -> Outcome<Gpu> {
    check_process()?;
    let mut device = DEVICE.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(gpu) = device.as_ref() {
        return Ok(gpu.clone());
    }
    let gpu = Gpu::headless()?;
    *device = Some(gpu.clone());
    Ok(gpu)
}

/// After it was lost: the next world that draws opens another.
pub fn forget() {
    *DEVICE.lock().unwrap_or_else(PoisonError::into_inner) = None;
}
