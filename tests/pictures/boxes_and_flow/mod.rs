//! Boxes and optical flow of cameras against arithmetic of their own.

mod boxes;
mod flow;
mod studio;
