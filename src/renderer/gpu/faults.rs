//! Errors of a device that arrive while nothing waits for them: wgpu reports them to callbacks, from any thread.

use super::error::RenderError;
use std::panic;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};
use std::sync::{Arc, Mutex, Once, PoisonError};

/// The environment variable that has a process lose its first device, to test what comes of it: in which call of
/// [`Gpu::check`](super::device::Gpu::check).
pub const LOSE_VARIABLE: &str = "RELIEF_LOSE_DEVICE";

/// Errors recorded for a device.
#[derive(Clone, Debug, Default)]
pub struct Faults {
    known: Arc<Mutex<Option<RenderError>>>,
    /// Checks until the device is lost on purpose; 0: never.
    left: Arc<AtomicU32>,
}

impl Faults {
    /// Watches a device that was just opened. Otherwise wgpu panics on whatever no error scope catches.
    pub(super) fn watch(device: &wgpu::Device) -> Self {
        let faults = Self { left: Arc::new(AtomicU32::new(losing_after())), ..Self::default() };
        let noting = faults.clone();
        device.set_device_lost_callback(move |_, message| {
            let reason = if message.is_empty() { "it was destroyed".to_owned() } else { message };
            noting.note(RenderError::Lost { reason });
        });
        let noting = faults.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            noting.note(RenderError::Refused { reason: error.to_string() });
        }));
        faults
    }

    /// The first counts: others follow from it. But for a loss, which nothing goes on after.
    pub(super) fn note(&self, error: RenderError) {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let is_loss = matches!(error, RenderError::Lost { .. });
        if known.is_none() || is_loss && !matches!(&*known, Some(RenderError::Lost { .. })) {
            *known = Some(error);
        }
    }

    /// Returns the recorded error, once; a lost device, always.
    pub(super) fn take(&self) -> Result<(), RenderError> {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        match &*known {
            None => Ok(()),
            Some(lost @ RenderError::Lost { .. }) => Err(lost.clone()),
            Some(_) => known.take().map_or(Ok(()), Err),
        }
    }

    /// Counts a check, and tells if the device is to be lost now, on purpose.
    pub(super) fn is_due(&self) -> bool {
        self.left.fetch_update(Relaxed, Relaxed, |left| left.checked_sub(1)) == Ok(1)
    }
}

/// For the first device of a process.
fn losing_after() -> u32 {
    static FIRST: AtomicBool = AtomicBool::new(true);
    let wanted = std::env::var(LOSE_VARIABLE).ok().and_then(|text| text.parse().ok());
    wanted.filter(|_| FIRST.swap(false, Relaxed)).unwrap_or(0)
}

/// Polls a device. wgpu 30 panics here where a driver says that the device is lost, after it has told the callback;
/// that is neither a panic for the caller nor a message.
pub(crate) fn poll(device: &wgpu::Device, how: wgpu::PollType) -> bool {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let others = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            let text = panic.payload().downcast_ref::<String>();
            if !text.is_some_and(|text| text.starts_with("Error in Device::poll")) {
                others(panic);
            }
        }));
    });
    panic::catch_unwind(panic::AssertUnwindSafe(|| device.poll(how))).is_ok_and(|polled| polled.is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_fault_is_told_once_and_a_loss_always() {
        let faults = Faults::default();
        assert_eq!(faults.take().map_err(|error| error.to_string()), Ok(()));
        let refused = |reason: &str| RenderError::Refused { reason: reason.into() };
        faults.note(refused("first"));
        faults.note(refused("second"));
        assert!(faults.take().expect_err("it is known").to_string().contains("first"));
        assert!(faults.take().is_ok(), "told already");
        faults.note(refused("third"));
        faults.note(RenderError::Lost { reason: "gone".into() });
        faults.note(refused("fourth"));
        for _ in 0..2 {
            assert!(faults.take().expect_err("it stays lost").to_string().contains("gone"));
        }
    }
}
