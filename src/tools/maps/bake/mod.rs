//! Detail of a fine mesh into maps of a coarse one, by casting rays.
//!
//! ```text
//! files → Surface (surface.rs) → Unwrap: which triangle each texel shows (unwrap.rs) ┐
//!         Surface of the fine mesh → Target: its BVH (target.rs) ────────────────────┴→ bake() (texels.rs)
//!                                                        → maps, dilated past the charts (dilate.rs), and a report
//! ```
//!
//! [`bake`] casts from a coarse mesh, along its normals; [`bake_tile`] straight down onto a patch that repeats
//! (`tile.rs`). Both take the fine mesh's normal, its distance, and the share of the sky that it leaves open
//! (`occlusion.rs`).
//!
//! Every texel is worked out by itself, so that any number of threads gives the same bytes. What the frame of a texel
//! is must be what the renderer makes of the same mesh, or the map would tilt the light: [`Surface`] and [`bake`]
//! follow `vs_main` and `tangent_frame` of the shaders step by step.

mod bands;
mod dilate;
mod occlusion;
mod options;
mod preview;
mod report;
mod surface;
mod target;
mod texels;
mod tile;
mod unwrap;

pub use options::{AUTO_CAGE, BakeOptions, MAX_SIDE, Reach, Wanted};
pub use preview::preview;
pub use report::{Baked, Coverage, Report};
pub use surface::{Role, Surface};
pub use target::{Hit, Sides, Target};
pub use texels::{bake, check_size};
pub use tile::{TileOptions, bake_tile};
pub use unwrap::{Texel, Unwrap};
