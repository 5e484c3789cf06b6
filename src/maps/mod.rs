//! The map tools: `relief map`, each also a function here.
//!
//! ```text
//! file → Raster → tool → Raster → PNG (or EXR)
//! ```
//!
//! Values are floats 0..1 in linear light, so that 8-bit, 16-bit and float images go the same way. Every tool computes
//! rows independently of each other, on all cores, and gives the same bytes for any number of them.

pub mod bake;
mod raster;

pub use raster::{Edges, Raster};
