//! Scene files as text describes them: plain structs for serde, and what each of them is as a component. Names are not
//! resolved yet, and files not read. Uses `text` alone.
//!
//! `docs/scenes.md` says what every field means; a test looks for each of them there. Defaults are those of the
//! components and library items that the fields become.

pub mod cells;
pub mod custom;
pub mod earth;
pub mod entities;
pub mod generators;
pub mod lights;
pub mod rigs;
#[cfg_attr(not(feature = "vehicles"), allow(dead_code))]
pub mod roads;
pub mod scene;
pub mod sensors;
pub mod surfaces;
pub mod values;
#[cfg(feature = "vehicles")]
pub mod vehicle_types;
pub mod weather;
