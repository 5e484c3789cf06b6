//! Boxes and optical flow of cameras against arithmetic of their own.

#[path = "../common/mod.rs"]
mod common;

mod boxes;
mod flow;
mod studio;
