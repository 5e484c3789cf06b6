//! Measuring tools, and tools that make maps: what compares pictures, and what compares scenes by these.
//!
//! ```text
//! compare          how far two pictures are apart
//! maps             images into normal, height, horizon, offset and specular maps; maps baked from meshes
//! bench            what many objects cost
//! gallery          a scene once for each of its mesh variants
//! frame_error      the job of the next three, and the comparison with their reference
//! light_error      a scene by light policies against all lights
//! shadow_error     a scene against shadows that rays find (traced)
//! sky_error        light of the sky against rays
//! technique_error  every bump technique against real geometry
//! ```
//!
//! Nothing but the command line uses them.

pub mod bench;
pub mod compare;
mod error;
pub mod frame_error;
pub mod gallery;
pub mod light_error;
pub mod maps;
pub mod shadow_error;
pub mod sky_error;
pub mod technique_error;
mod traced;

pub use error::ToolError;

/// Figures as a line of JSON.
pub fn json_line(figures: &impl serde::Serialize) -> String {
    serde_json::to_string(figures).unwrap_or_default()
}
