//! Nodes, what they draw, and what they are called. Uses `report`, `document`, `geometry` and `materials`.

pub mod far;
pub mod hierarchy;
pub mod labels;
pub mod parts;
