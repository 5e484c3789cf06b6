//! Everything about a scene that its types cannot say: names that must be known, numbers that must make sense. Uses
//! `text`, `format` and `read`.
//!
//! One walk over the whole file collects every fault with its place, so that `relief check` shows all at once. The
//! limits are wide: they keep arithmetic finite and memory bounded, not scenes tasteful.

mod cells;
mod entities;
mod generators;
pub mod names;
pub mod rigs;
#[cfg(feature = "vehicles")]
mod roads;
#[cfg(not(feature = "vehicles"))]
#[path = "no_roads.rs"]
mod roads;
#[cfg(feature = "vehicles")]
mod route_lengths;
pub mod scene;
mod sensor_names;
mod sensors;
mod surfaces;
pub mod walk;
