//! Keys and pointer, and what they lead to: commands, the free camera, a vehicle's controls, the thing pointed at.

pub mod camera;
pub mod driving;
pub mod input;
pub mod picking;
