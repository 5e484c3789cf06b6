//! Sensors of a world, together: their names, which are due, how their views are drawn, and what they measured. Uses
//! all other floors.

pub(crate) mod drawing;
pub(crate) mod due;
pub(crate) mod names;
pub(crate) mod packed;
pub(crate) mod sensors;
pub(crate) mod suite;
