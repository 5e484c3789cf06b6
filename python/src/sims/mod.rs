//! Worlds as Python holds them, alone and several at once. Uses all other floors.

pub mod columns;
mod contents;
pub mod dataset;
pub mod many;
pub mod roads;
#[cfg(target_os = "linux")]
pub mod sharing;
pub mod sim;
mod spawning;
mod weather;
