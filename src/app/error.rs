//! Reasons for no window.

use crate::frames::FrameError;

/// Errors that keep a window from opening, or end it.
#[derive(Debug, thiserror::Error)]
pub enum AppError {
    /// No display, or no window on it.
    #[error("{0}")]
    NoDisplay(String),
    /// No graphics adapter, a scene too large for it, no device for long, or files that cannot be read again.
    #[error(transparent)]
    Frame(FrameError),
}

impl<E: Into<FrameError>> From<E> for AppError {
    fn from(error: E) -> Self {
        Self::Frame(error.into())
    }
}

/// winit's errors begin with the place in its source.
pub fn no_display(error: &dyn std::error::Error) -> AppError {
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
