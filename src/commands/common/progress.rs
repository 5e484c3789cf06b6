//! Bars on a terminal: how far a command is.

use crate::import::progress::counts;
use indicatif::{ProgressBar, ProgressStyle};
use std::any::Any;
use std::io::IsTerminal;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// Delay before a bar is shown: quick work shows none.
const PATIENCE: Duration = Duration::from_millis(300);

/// A bar on a terminal, nothing elsewhere.
pub fn bar(template: &str) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template(template);
    ProgressBar::new(0).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// Moves a bar to so many done of so many.
pub fn show(bar: &ProgressBar, done: u64, of: u64) {
    bar.set_length(of);
    bar.set_position(done);
}

/// A bar of the images decoded, for [`crate::session::LoadOptions::watch`].
pub fn of_loading() -> Box<dyn Any> {
    Box::new(LoadingBar::on_terminal())
}

/// A bar on standard error from when loading has taken a while until this is dropped.
struct LoadingBar {
    /// Dropping it ends the thread.
    end: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl LoadingBar {
    /// Without a terminal there is none.
    fn on_terminal() -> Option<Self> {
        std::io::stderr().is_terminal().then(|| {
            let ((before, _), (end, ended)) = (counts(), channel());
            let thread = std::thread::spawn(move || {
                let mut wait = PATIENCE;
                let mut shown = None;
                while ended.recv_timeout(wait) == Err(RecvTimeoutError::Timeout) {
                    let (done, expected) = counts();
                    let bar = shown.get_or_insert_with(|| bar("{bar:40} image {pos}/{len}"));
                    show(bar, (done - before) as u64, (expected - before) as u64);
                    wait = Duration::from_millis(50);
                }
                if let Some(bar) = shown {
                    bar.finish_and_clear();
                }
            });
            Self { end: Some(end), thread: Some(thread) }
        })
    }
}

impl Drop for LoadingBar {
    fn drop(&mut self) {
        self.end = None;
        self.thread.take().map(JoinHandle::join);
    }
}
