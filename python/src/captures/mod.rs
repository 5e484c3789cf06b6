//! Captures of sensors, as objects of Python. Uses what calls are given.

pub mod camera;
pub mod capture;
mod common;
pub mod depth_steps;
pub mod lens;
pub mod points;
pub mod readings;
#[cfg(target_os = "linux")]
pub mod shared;
