//! Pictures of objects: which are drawn, where and in which colours, and what else views and cameras of sensors have of
//! them. What is here passes on every driver.

mod boxes_and_flow;
mod bright_edges;
mod changing_library;
#[path = "../common/mod.rs"]
mod common;
mod culling;
mod custom_passes;
mod every_frame;
mod far_from_origin;
mod frames;
mod known;
mod limits;
mod outputs;
mod pieces;
mod sensors;
mod sky;
mod tone_curves;
mod vertex_rounding;
mod views;
