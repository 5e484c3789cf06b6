//! Progress of loading: images decoded, of those known to be needed.
//!
//! Two counters for the whole process, which the decoders add to. What is needed becomes known while models are read,
//! so the total grows.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

static EXPECTED: AtomicUsize = AtomicUsize::new(0);
static DONE: AtomicUsize = AtomicUsize::new(0);

pub(super) fn expect(images: usize) {
    EXPECTED.fetch_add(images, Relaxed);
}

pub(super) fn done(images: usize) {
    DONE.fetch_add(images, Relaxed);
}

/// Images decoded by this process, and those that are or were to be.
pub fn counts() -> (usize, usize) {
    (DONE.load(Relaxed), EXPECTED.load(Relaxed))
}
