//! How far loading is: images decoded, of those known to be needed.
//!
//! Two counters for the whole process, which the decoders add to and [`Bar`] looks at. What is needed becomes known
//! while models are read, so the total grows.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

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

/// What is done quickly shows nothing.
const PATIENCE: Duration = Duration::from_millis(300);

/// A bar on standard error from when loading has taken a while until this is dropped.
pub struct Bar {
    /// Dropping it ends the thread.
    end: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Bar {
    /// Without a terminal there is none.
    pub fn on_terminal() -> Option<Self> {
        std::io::stderr().is_terminal().then(|| {
            let ((before, _), (end, ended)) = (counts(), channel());
            let thread = std::thread::spawn(move || {
                let mut wait = PATIENCE;
                let mut bar = None;
                while ended.recv_timeout(wait) == Err(RecvTimeoutError::Timeout) {
                    let bar = bar.get_or_insert_with(new_bar);
                    let (done, expected) = counts();
                    bar.set_length((expected - before) as u64);
                    bar.set_position((done - before) as u64);
                    wait = Duration::from_millis(50);
                }
                if let Some(bar) = bar {
                    bar.finish_and_clear();
                }
            });
            Self { end: Some(end), thread: Some(thread) }
        })
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.end = None;
        self.thread.take().map(JoinHandle::join);
    }
}

fn new_bar() -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:40} image {pos}/{len}");
    ProgressBar::new(0).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
