//! The window's device, textures and egui.

pub mod graphics;
pub mod gui;
pub mod surface;
