//! Checks that encoders share.

use std::io::{Error, ErrorKind};

/// Error of what a form has no place for.
pub(crate) fn unfit(message: impl Into<String>) -> Error {
    Error::new(ErrorKind::InvalidInput, message.into())
}

/// Checks that there are as many values as were expected.
pub(crate) fn check_count(what: &str, expected: usize, found: usize) -> std::io::Result<()> {
    if expected == found { Ok(()) } else { Err(unfit(format!("{what}: expected {expected} values, found {found}"))) }
}

/// Number of pixels of a picture; width and height in pixels.
pub(crate) fn pixels_of((width, height): (u32, u32)) -> usize {
    width as usize * height as usize
}
