//! The map tools: `relief map`, each also a function here.
//!
//! ```text
//! file → Raster → tool → Raster → PNG (or EXR)          files, raster
//!                   └→ a material, drawn lit            preview
//! ```
//!
//! Values are floats 0..1 in linear light, so that 8-bit, 16-bit and float images go the same way. Every tool computes
//! rows independently of each other, on all cores, and gives the same bytes for any number of them.
//!
//! Heights become slopes by one rule. Texels are square, lengths are in widths of the image, and a height scale says
//! how many of those lie between black and white: it is [`systems::assets::Material::height_scale_uv`]. From one texel
//! to the next, 1/width away, the surface rises by scale · Δh, so its slope is scale · width · Δh, in either direction.

pub mod bake;
mod blur;
mod error;
pub mod files;
mod height;
mod horizon;
mod normal;
mod offset;
pub mod preview;
mod raster;
mod slope;
mod specular;

pub use error::MapError;
pub use height::{HeightOptions, height_from_color};
pub use horizon::{HorizonOptions, horizon_from_height};
pub use normal::{NormalOptions, normal_from_height};
pub use offset::offset_from_height;
pub use raster::{Advance, Edges, Raster};
pub use slope::{Filter, Relief};
pub use specular::{Polish, SpecularModel, SpecularOptions, specular_from};
