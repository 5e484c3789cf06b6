//! Tracking: boxes and optical flow, by where everything is that is drawn, and where it was. Uses captures, lenses that
//! bend, and the places of motion sensors.

pub(crate) mod boxes;
mod drawn_parts;
mod flow;
mod outer_vertices;
mod outline;
mod things;
pub(crate) mod tracker;
