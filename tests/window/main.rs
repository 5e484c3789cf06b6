//! The window under a display of its own: keys that are pressed, and what sensors see.

#[path = "../common/mod.rs"]
mod common;
mod keys;
mod sensor_window;
