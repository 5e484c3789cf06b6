//! Openness: how much of the sky a place sees, by direction.
//!
//! Corners of the world's grid of [`SPACING`] keep which of 256 directions of the upper half meet nothing that stands
//! (`corners`). Only those are asked that surfaces lie between (`cells`); others in between go by their neighbours
//! (`lattice`). Under a sky the bits become openness along five axes, weighted by the sky's luminance: a house that
//! hides the bright part of the sky hides more (`directions`). Renderers read it in bricks (`bricks`). Rooms have
//! corners of their own, within their walls (`rooms`).

pub(crate) mod bricks;
pub(crate) mod cells;
pub(crate) mod corners;
pub(crate) mod directions;
pub(crate) mod lattice;
pub(crate) mod rooms;

pub use bricks::{Openness, OpennessTexel};
pub use corners::{Occluder, Occluders};
pub use lattice::{Lattice, SPACING};
pub use rooms::Room;
