//! Cells and portals: rooms whose walls keep light out.
//!
//! A cell is a convex room, a portal a convex polygon between two cells, or between a cell and *outside*, which is all
//! that lies in no cell. [`Cells`] has both. What an eye or a light may reach is its [`Flood`]: a list of windows, each
//! a cell and the planes of what can be seen of it through the portals on the way (`flood`). An object is in the cells
//! that its box touches ([`Occupied`], `occupied`). [`Flood::share`] is how much of a light such an object gets:
//! 1 where any of its box may see the light, 0 half a metre from there on, continuous between.
//!
//! A [`Portal`] that opens and shuts is a component; a [`Door`] moves it, and the leaf in it (`doors`).

#[expect(clippy::module_inception, reason = "the resource's own file")]
pub(crate) mod cells;
pub(crate) mod doors;
pub(crate) mod flood;
pub(crate) mod geometry;
pub(crate) mod occupied;
pub(crate) mod problems;
pub(crate) mod sight;

pub use cells::{Cell, CellError, Cells, OUTSIDE, Opening};
pub use doors::{Door, Portal, move_doors};
pub use flood::{Flood, Source, Window};
pub use geometry::Plane;
pub use occupied::Occupied;
pub use problems::{problems, shared_sheets};
pub use sight::Sight;
