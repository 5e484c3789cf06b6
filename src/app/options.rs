//! Options that a window is opened with.

use crate::renderer::Settings;
use crate::session::Session;

/// Contents of the window, and its settings at the start.
pub struct Options {
    /// A loaded world, and its run.
    pub session: Session,
    /// Pixels.
    pub size: (u32, u32),
    /// Render settings at first.
    pub settings: Settings,
    /// Starts with the clock stopped.
    pub paused: bool,
    /// Starts with the panel shown.
    pub panel: bool,
}
