//! The text of scene files: reading RON, places in it, and faults with their places. Knows nothing of scenes.

pub mod faults;
pub mod file;
pub mod parse;
pub mod places;
pub mod slips;
